//! A cheap test that nothing can be met in this step. Most steps have no contact.
//!
//! With `m = z - eta . x - g_A - (highest tooth)`, `d = phi_B g_B + phi_C g_C` and `q = R_t eta - g_T` along the first
//! two teeth, the four gaps are at least
//!
//! ```text
//! m - s |d| - max(d + |q_0|, -d + |q_1|)         s: largest deviation of an amplitude
//! ```
//!
//! The cubic through both ends of a step lies in the hull of its control points, and the motion within a margin of the
//! cubic. The distance of the hole's centre from the pin is convex in flight, so there the end of the step suffices.

use nalgebra::{Vector2, Vector3};

use super::rigid_body::cross;
use super::stator_tilt::StatorTiltState;
use super::{ShiftState, TiltState, TiltingSetup, TiltingState, Tooth};
use crate::math::Real;
use crate::modes::ModalState;
use crate::motor::clearance::cubic_margin;
use crate::params::{MotorParams, Parameter, TiltingParameter, TiltingParams};
use crate::rotor::RotorState;

/// What the test needs of a motor.
#[derive(Clone, Debug)]
pub(super) struct ClearTest<T> {
    /// `phi_B`, `phi_C` of the first tooth at nominal amplitude.
    shape: Vector2<T>,
    outward: Vector2<T>,
    radius_m: T,
    highest_m: T,
    spread: T,
    curve_margin_s: T,
    /// `(w h)^2` of the fastest mode.
    swing: T,
    /// Bound of the fall from rest, and of the motion by the drive from rest, in a step.
    drop_m: T,
    clearance_m: T,
    half_length_m: T,
    half_hole_m: T,
    pin_slope: Vector2<T>,
    rim: T,
    rim_radius_m: T,
    ceiling: T,
    ceiling_radius_m: T,
}

/// Where stator and rotor are.
#[derive(Clone, Copy)]
pub(super) struct Place<'a, T> {
    pub(super) modes: &'a ModalState<T>,
    pub(super) stator_tilt: &'a StatorTiltState<T>,
    pub(super) rotor: &'a RotorState<T>,
    pub(super) tilt: &'a TiltState<T>,
    pub(super) shift: &'a ShiftState<T>,
}

impl<'a, T: Real> Place<'a, T> {
    #[inline]
    pub(super) fn of_state(state: &'a TiltingState<T>) -> Self {
        let TiltingState { modes, stator_tilt, rotor, tilt, shift, .. } = state;
        Self { modes, stator_tilt, rotor, tilt, shift }
    }
}

/// The four numbers of which all gaps are made.
#[derive(Clone, Copy)]
struct Over<T> {
    m: T,
    d: T,
    q_0: T,
    q_1: T,
}

impl<T: Real> Over<T> {
    #[inline]
    fn plus(&self, other: &Self, times: T) -> Self {
        Self {
            m: self.m + other.m * times,
            d: self.d + other.d * times,
            q_0: self.q_0 + other.q_0 * times,
            q_1: self.q_1 + other.q_1 * times,
        }
    }

    #[inline]
    fn lowest(&self, spread: T) -> T {
        let (first, second) = (self.d + self.q_0.abs(), self.q_1.abs() - self.d);
        self.m - spread * self.d.abs() - if first > second { first } else { second }
    }

    #[inline]
    fn size(&self) -> T {
        self.m.abs() + self.d.abs() + self.q_0.abs() + self.q_1.abs()
    }
}

impl<T: Real> ClearTest<T> {
    pub(super) fn new(
        params: &MotorParams,
        tilting: &TiltingParams,
        setup: &TiltingSetup,
        teeth: &[Tooth<T>; 4],
        fastest_rad: f64,
    ) -> Self {
        use TiltingParameter::{
            CeilingHeight, CeilingRadius, HubClearance, HubLength, HubPinRadius, RimDepth, RotorOuterRadius,
        };
        let variation = &setup.variation;
        let [a_0, _, _, _] = variation.amplitudes;
        let [tooth, _, _, _] = teeth;
        let one = T::from_f64(1.0 / (1.0 + a_0));
        let spread = variation.amplitudes.iter().fold(0.0, |most: f64, a| most.max(a.abs()));
        let highest = variation.heights_m.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let get = |parameter| T::from_f64(tilting.get(parameter));
        let hub = super::Hub::<T>::new(tilting, variation.pin_direction_deg);
        // At full drive a mode gains less than (w h)^2 zeta times its amplitude in a step.
        let driven_m =
            params.get(Parameter::ModeBToothAmplitude) + params.get(Parameter::ModeCToothAmplitude);
        let drop_m = params.get(Parameter::Gravity).abs() * setup.step_s * setup.step_s
            + fastest_rad * fastest_rad * driven_m * 0.1;
        let hole = tilting.get(HubPinRadius) + tilting.get(HubClearance);
        Self {
            shape: Vector2::new(tooth.shape.y * one, tooth.shape.z * one),
            outward: tooth.outward,
            radius_m: T::from_f64(params.get(Parameter::ToothRadius)),
            highest_m: T::from_f64(highest),
            // A margin for rounding.
            spread: T::from_f64(spread + 1e-6),
            curve_margin_s: T::from_f64(cubic_margin(fastest_rad) * setup.step_s),
            swing: T::from_f64(fastest_rad * fastest_rad),
            drop_m: T::from_f64(drop_m),
            clearance_m: get(HubClearance),
            half_length_m: T::from_f64(0.5 * tilting.get(HubLength)),
            half_hole_m: T::from_f64(0.5 * hole),
            pin_slope: hub.pin_slope,
            rim: get(RimDepth),
            rim_radius_m: get(RotorOuterRadius),
            ceiling: get(CeilingHeight),
            ceiling_radius_m: get(CeilingRadius),
        }
    }

    /// Whether, after a step of free motion, everything is farther away than it can have moved in the step.
    #[expect(clippy::inline_always, reason = "a call would move the state through memory")]
    #[inline(always)]
    pub(super) fn is_far<const SHIFTS: bool>(&self, end: &Place<'_, T>, step_s: T) -> bool {
        self.teeth_are_far::<SHIFTS>(end, step_s)
            && self.hub_is_clear::<SHIFTS>(end)
            && self.stops_are_clear(end)
    }

    /// [`Self::is_far`] for the teeth.
    #[inline]
    pub(super) fn teeth_are_far<const SHIFTS: bool>(&self, end: &Place<'_, T>, step_s: T) -> bool {
        let (here, speed) = (self.over::<SHIFTS>(end), self.speed::<SHIFTS>(end));
        here.lowest(self.spread) > self.reach(end, &speed, step_s)
    }

    /// Whether no gap can vanish between two states a step of free motion apart.
    #[inline]
    pub(super) fn is_sure<const SHIFTS: bool>(
        &self,
        start: &Place<'_, T>,
        end: &Place<'_, T>,
        step_s: T,
    ) -> bool {
        self.teeth_are_clear::<SHIFTS>(start, end, step_s)
            && self.hub_is_clear::<SHIFTS>(end)
            && self.stops_are_clear(end)
    }

    #[inline]
    pub(super) fn teeth_are_clear<const SHIFTS: bool>(
        &self,
        start: &Place<'_, T>,
        end: &Place<'_, T>,
        step_s: T,
    ) -> bool {
        let (here, speed) = (self.over::<SHIFTS>(end), self.speed::<SHIFTS>(end));
        let lowest = here.lowest(self.spread);
        if lowest <= T::zero() {
            return false;
        }
        // Far above: nothing moves that far in a step.
        if lowest > self.reach(end, &speed, step_s) {
            return true;
        }
        let before = self.speed::<SHIFTS>(start);
        let margin = self.curve_margin_s * speed.plus(&before, -T::one()).size();
        let third_s = step_s * T::from_f64(1.0 / 3.0);
        // The first control point, the start, is not tested: the step before ended clear of it.
        lowest > margin
            && here.plus(&speed, -third_s).lowest(self.spread) > margin
            && self.over::<SHIFTS>(start).plus(&before, third_s).lowest(self.spread) > margin
    }

    /// A bound of how far the gaps move in the step that ends here, twice as large as needed.
    ///
    /// A mode of displacement x moves by less than `h |x'| + (w h)^2 |x|` in a step, its drive included, as long as `w
    /// h` is below 1; the rotor by less than `h |v| + h^2 (g + b v)`.
    #[inline]
    fn reach(&self, end: &Place<'_, T>, speed: &Over<T>, step_s: T) -> T {
        let (modes, pair) = (&end.modes.displacement_m, &end.stator_tilt.displacement_m);
        let swing_m = modes.x.abs() + modes.y.abs() + modes.z.abs() + pair.x.abs() + pair.y.abs();
        let moved_m = step_s * speed.size() + self.swing * swing_m + self.drop_m;
        moved_m + moved_m
    }

    #[inline]
    fn over<const SHIFTS: bool>(&self, motion: &Place<'_, T>) -> Over<T> {
        let mut m = motion.rotor.height_m - self.highest_m;
        if SHIFTS {
            m -= motion.tilt.slope.dot(&motion.shift.displacement_m);
        }
        self.made_of(m, &motion.modes.displacement_m, &motion.tilt.slope, &motion.stator_tilt.displacement_m)
    }

    #[inline]
    fn speed<const SHIFTS: bool>(&self, motion: &Place<'_, T>) -> Over<T> {
        let mut m = motion.rotor.velocity_m_s;
        if SHIFTS {
            m -= motion.tilt.slope.dot(&motion.shift.velocity_m_s)
                + motion.tilt.rate_rad_s.dot(&motion.shift.displacement_m);
        }
        self.made_of(m, &motion.modes.velocity_m_s, &motion.tilt.rate_rad_s, &motion.stator_tilt.velocity_m_s)
    }

    #[inline]
    fn made_of(&self, m: T, modes: &Vector3<T>, tilt: &Vector2<T>, stator_tilt: &Vector2<T>) -> Over<T> {
        let q = tilt * self.radius_m - stator_tilt;
        Over {
            m: m - modes.x,
            d: self.shape.x * modes.y + self.shape.y * modes.z,
            q_0: q.dot(&self.outward),
            q_1: cross(&self.outward, &q),
        }
    }

    #[inline]
    fn hub_is_clear<const SHIFTS: bool>(&self, end: &Place<'_, T>) -> bool {
        let eta = end.tilt.slope - self.pin_slope;
        let steep = eta.dot(&eta);
        let room_m = self.clearance_m - self.half_hole_m * steep;
        let mut square = self.half_length_m * self.half_length_m * steep;
        if SHIFTS {
            let shift = end.shift.displacement_m;
            let mixed = self.half_length_m * shift.dot(&eta);
            square += shift.dot(&shift) + (mixed + mixed).abs();
        }
        room_m > T::zero() && square < room_m * room_m
    }

    #[inline]
    fn stops_are_clear(&self, end: &Place<'_, T>) -> bool {
        let steep = end.tilt.slope.dot(&end.tilt.slope);
        let clear =
            |room_m: T, radius_m: T| room_m > T::zero() && radius_m * radius_m * steep < room_m * room_m;
        clear(end.rotor.height_m + self.rim, self.rim_radius_m)
            && clear(self.ceiling - end.rotor.height_m, self.ceiling_radius_m)
    }
}

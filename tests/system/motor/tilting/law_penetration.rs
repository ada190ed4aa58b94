//! How deep the rotor may be in a tooth, the pin, the floor or the ceiling at the end of a step: the stated bound.
//!
//! ```text
//! tooth     J h^3 / (12 k),    J = sum w_n^2 V_n,   V_n^2 = g_n'^2 + w_n^2 g_n^2      constant forces over a span
//! edge      h a |eta| E |eta'| + (h u)^2 / (2 c), h u at most            the normal's error, its turn, in one step
//! circle    the tooth's and h^2 R |eta'|^2 / (2 k |eta|), h R |eta'| / k at most       the lowest side turns
//! ```
//!
//! With `h` the step, `u` the speed of the hole's centre at an edge, `k` the part of a gap that closes in a step, 0.05,
//! and `E` the largest turn of the pin's normal, 0.3. To this comes rounding: a gap is a difference of distances below
//! `R`, rounded a few times in each of `1/k` steps.
#![expect(clippy::disallowed_methods, reason = "an independent yardstick")]

use core::f64::consts::TAU;

use motor_model::{
    ContactPlace, DriveCommand, DriveMode, Freedom, Parameter, Real, TiltingMotor, TiltingParameter,
    TiltingSetup, TiltingState, TiltingVariation,
};

use super::{Sets, UNEQUAL, set_g, slow_in_b, tilting};
use crate::support::motors::{changed, epsilon, steps_in};

const GAP_RETURN: f64 = 0.05;
const TURN_MAX: f64 = 0.3;

/// The largest values of a run.
#[derive(Clone, Copy, Debug, Default)]
struct Most {
    jerk: f64,
    /// `|eta| |eta'|` and `|eta'|^2 / |eta|`.
    rolling: f64,
    turning: f64,
    /// Speed of the hole's centre at an edge.
    hole_m_s: f64,
    /// Distances of which gaps are made.
    size_m: f64,
    deepest: [f64; 8],
}

impl Most {
    fn see<T: Real>(&mut self, motor: &TiltingMotor<T>, natural: &[f64; 5], state: &TiltingState<T>) {
        let (g, v) = (state.modes.displacement_m, state.modes.velocity_m_s);
        let (tilt_g, tilt_v) = (state.stator_tilt.displacement_m, state.stator_tilt.velocity_m_s);
        let modes = (g.iter().chain(&tilt_g)).zip(v.iter().chain(&tilt_v)).zip(natural);
        let jerk = modes.map(|((g, v), w)| w * w * v.to_f64().hypot(w * g.to_f64())).sum::<f64>();
        let steep = state.tilt.slope.map(Real::to_f64).norm();
        let rate = state.tilt.rate_rad_s.map(Real::to_f64).norm();
        self.jerk = self.jerk.max(jerk);
        self.rolling = self.rolling.max(steep * rate);
        let slide = state.shift.velocity_m_s.map(Real::to_f64).norm();
        self.hole_m_s = self.hole_m_s.max(slide + 175e-6 * rate);
        self.turning = self.turning.max(rate * (rate / steep).min(2.0 / motor.step_s()));
        self.size_m = self.size_m.max(state.rotor.height_m.to_f64().abs() + 4.35e-3 * steep);
        for (deepest, place) in self.deepest.iter_mut().zip(ContactPlace::ALL) {
            if let Some(gap_m) = motor.gap_m(state, place) {
                *deepest = deepest.max(-gap_m.to_f64());
            }
        }
    }

    fn bound_m(&self, place: ContactPlace, step_s: f64, clearance_m: f64, epsilon: f64) -> f64 {
        let tooth = self.jerk * step_s.powi(3) / (12.0 * GAP_RETURN);
        let rounding = 4.0 * epsilon * self.size_m / GAP_RETURN;
        rounding
            + match place {
                ContactPlace::Tooth(_) => tooth,
                ContactPlace::UpperEdge | ContactPlace::LowerEdge => {
                    let (slid, hole_m) = (step_s * self.hole_m_s, 1e-3 + clearance_m);
                    step_s * hole_m * TURN_MAX * self.rolling + slid * (slid / (2.0 * clearance_m)).min(1.0)
                }
                ContactPlace::Rim | ContactPlace::Ceiling => {
                    tooth + step_s * step_s * 4.35e-3 * self.turning / (2.0 * GAP_RETURN)
                }
            }
    }
}

/// Runs the commands for a time each and checks every place.
fn check<T: Real>((params, own): &Sets, setup: &TiltingSetup, runs: &[(DriveCommand, f64)]) {
    let motor = TiltingMotor::<T>::try_new(params, own, setup).expect("valid");
    let hz = |parameter| TAU * params.get(parameter);
    let pair = TAU * own.get(TiltingParameter::StatorTiltFrequency);
    let (a, b, c) =
        (hz(Parameter::ModeAFrequency), hz(Parameter::ModeBFrequency), hz(Parameter::ModeCFrequency));
    let (mut state, mut most) = (TiltingState::<T>::default(), Most::default());
    // Clear of the highest tooth.
    state.rotor.height_m = T::from_f64(6e-6);
    for &(command, time_s) in runs {
        for _ in 0..steps_in(time_s, setup.step_s) {
            motor.step(&mut state, command);
            most.see(&motor, &[a, b, c, pair, pair], &state);
        }
    }
    let clearance_m = own.get(TiltingParameter::HubClearance);
    for (deepest, place) in most.deepest.into_iter().zip(ContactPlace::ALL) {
        let bound = most.bound_m(place, setup.step_s, clearance_m, epsilon::<T>());
        assert!(deepest <= bound, "{place:?}: {deepest:e} of {bound:e} m, {setup:?} {most:?}");
    }
}

/// Steady runs of the sets F and G and of the nominal one.
#[test]
fn law_steady_runs_stay_out_of_teeth_and_pin() {
    let nominal = (changed(&[]), tilting(&[]));
    for sets in [slow_in_b(), set_g(), nominal] {
        for freedom in [Freedom::Full, Freedom::WithoutShift] {
            for step_s in [1e-6, 5e-6] {
                let setup = TiltingSetup { freedom, variation: UNEQUAL, ..TiltingSetup::with_step(step_s) };
                for mode in [DriveMode::B, DriveMode::C] {
                    check::<f64>(&sets, &setup, &[(DriveCommand::full(mode), 0.2)]);
                    check::<f32>(&sets, &setup, &[(DriveCommand::full(mode), 0.2)]);
                }
            }
        }
    }
}

/// Changes of the tilting motor's parameters and of those that both motors share.
type Case = (&'static [(TiltingParameter, f64)], &'static [(Parameter, f64)]);

/// A floor, a ceiling, a pin that leans, teeth of unequal height, no restitution and all of it; friction up to 1, more
/// than that of any dry pair here. Friction is solved after the normal impulses, so that beyond all bounds it would
/// press on the gaps.
#[test]
fn law_hard_cases_stay_out() {
    use TiltingParameter::{CeilingHeight, HubClearance, HubFriction, HubRestitution, PinSlope, RimDepth};
    let cases: [Case; 9] = [
        (&[(CeilingHeight, 20e-6), (RimDepth, 100e-6)], &[]),
        (&[(HubClearance, 1.0), (RimDepth, 60e-6)], &[]),
        (&[(PinSlope, 5e-3)], &[]),
        (&[(HubClearance, 1e-7)], &[]),
        (&[(HubFriction, 1.0), (HubRestitution, 0.0)], &[]),
        (&[(HubFriction, 0.0), (HubRestitution, 1.0)], &[]),
        (&[], &[(Parameter::Friction, 1.0), (Parameter::Restitution, 0.0)]),
        (&[], &[(Parameter::Friction, 0.0), (Parameter::Restitution, 0.0)]),
        (&[], &[(Parameter::Restitution, 1.0)]),
    ];
    let runs = [
        (DriveCommand::full(DriveMode::B), 0.03),
        (DriveCommand::OFF, 0.01),
        (DriveCommand::saturating(DriveMode::C, 0.5), 0.03),
        (DriveCommand::OFF, 0.01),
    ];
    let uneven = TiltingVariation { heights_m: [5e-6, -3e-6, 0.0, -6e-6], ..UNEQUAL };
    for (own, shared) in cases {
        let (mut params, mut tilt) = slow_in_b();
        for &(parameter, value) in own {
            tilt = tilt.with(parameter, value).expect("within bounds");
        }
        for &(parameter, value) in shared {
            params = params.with(parameter, value).expect("within bounds");
        }
        for variation in [UNEQUAL, uneven] {
            for freedom in [Freedom::Full, Freedom::WithoutShift] {
                for step_s in [1e-6, 5e-6] {
                    let setup = TiltingSetup { freedom, variation, ..TiltingSetup::with_step(step_s) };
                    check::<f64>(&(params, tilt), &setup, &runs);
                    check::<f32>(&(params, tilt), &setup, &runs);
                }
            }
        }
    }
}

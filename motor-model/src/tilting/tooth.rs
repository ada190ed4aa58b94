//! Four teeth, each with its own amplitude and height, under a rotor that tilts.
//!
//! With `th_k = th + 90 k`, counter-clockwise, `th = 90 - (theta_t + theta_m)` and, in modes B and C, `theta_m` with an
//! extra of each:
//!
//! ```text
//! phi_A = 1,  phi_B = a_k sin 2 th_k,  phi_C = a_k cos 2 th_k,  phi_T1 = cos th_k,  phi_T2 = sin th_k
//! height        u_k = sum phi_n g_n + b_k
//! gap           z + eta . (X_k - x) - u_k                             X_k: where tooth k stands
//! clockwise     psi_B = a_k L cos 2 th_k,  psi_C = -a_k L sin 2 th_k  of the top                     (9a)
//! outward       -(L/2) k_n phi_n   for a deflection that grows as r^k_n, n = A, B, C
//! tilt          -(L/2) (g_T1, g_T2) . t  clockwise and -(L/2) k_T (g_T1, g_T2) . o  outward, along t and o
//! ```
//!
//! The normal direction is the gradient of the gap. The tangential directions lie in the rotor's plane. Without shift
//! the pin holds the rotor against friction outward, which then only takes its share of the circle; without tilt that
//! share is left out too, as in the height-only motor.
//! Second order and left out: the gap's `eta . s_k` by the top's own motion `s_k`, and the slopes' square.

use nalgebra::{Vector2, Vector3};
use rand_core::Rng;
use rand_distr::{Distribution, StandardNormal};

use super::contact::{Contact, ContactPlace, Direction, Mobility};
use super::rigid_body::Twist;
use super::stator_tilt::StatorTiltState;
use super::{TiltingMotion, TiltingSetup};
use crate::error::OutOfBounds;
use crate::impact::FrictionLaw;
use crate::math::{self, Real};
use crate::modes::ModalState;
use crate::params::{MotorParams, Parameter, TiltingParameter, TiltingParams};

/// How one motor's teeth and pin differ from the design's.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TiltingVariation {
    /// Relative deviation of each tooth's amplitude in modes B and C; 0 is nominal.
    pub amplitudes: [f64; 4],
    /// Height of each tooth above the nominal, in m.
    pub heights_m: [f64; 4],
    /// Direction in which the pin leans, in degrees counter-clockwise from x.
    pub pin_direction_deg: f64,
}

impl TiltingVariation {
    /// Draws a motor's variation: normal, with the standard deviations [`Parameter::AmplitudeVariation`] and
    /// [`TiltingParameter::ToothHeightScatter`], and a pin that leans to any side.
    pub fn draw<R: Rng + ?Sized>(params: &MotorParams, tilting: &TiltingParams, rng: &mut R) -> Self {
        let mut one = |sigma: f64| {
            let standard: f64 = StandardNormal.sample(rng);
            // Six sigmas of the widest variation allowed keep the sign of a tooth's motion.
            sigma * standard.clamp(-6.0, 6.0)
        };
        let sigma = params.get(Parameter::AmplitudeVariation);
        let amplitudes = [one(sigma), one(sigma), one(sigma), one(sigma)];
        let sigma_m = tilting.get(TiltingParameter::ToothHeightScatter);
        let heights_m = [one(sigma_m), one(sigma_m), one(sigma_m), one(sigma_m)];
        // The direction of two independent normal deviates is uniform.
        let (x, y) = (one(1.0), one(1.0));
        Self { amplitudes, heights_m, pin_direction_deg: libm::atan2(y, x).to_degrees() }
    }

    /// Refuses what is not finite, and an amplitude that turns the motion of a tooth around.
    pub(super) fn check(&self) -> Result<(), OutOfBounds> {
        for amplitude in self.amplitudes {
            OutOfBounds::check("amplitudes", amplitude, -0.9, 10.0, "")?;
        }
        for height_m in self.heights_m {
            OutOfBounds::check("heights_m", height_m, -0.1, 0.1, "m")?;
        }
        OutOfBounds::check("pin_direction_deg", self.pin_direction_deg, -1e6, 1e6, "deg")?;
        Ok(())
    }

    /// The same amplitudes in both teeth of a pair: what [`crate::AmplitudeVariation`] describes.
    pub fn of_pairs(pairs: &crate::AmplitudeVariation) -> Self {
        let [first, second] = pairs.pairs;
        Self { amplitudes: [first, second, first, second], ..Self::default() }
    }
}

/// One tooth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tooth<T> {
    place: ContactPlace,
    /// Direction from the axis to the tooth.
    pub outward: Vector2<T>,
    /// Where it stands, in m.
    pub position_m: Vector2<T>,
    /// `b_k`: height above the nominal, in m.
    pub height_m: T,
    /// `phi` of modes A, B and C.
    pub shape: Vector3<T>,
    /// Clockwise displacement of the top per modal displacement.
    pub lever: Vector3<T>,
    /// Outward displacement of the top per modal displacement.
    pub rocking: Vector3<T>,
    /// `L/2`, by which the top moves clockwise under a slope of the ring along the rim.
    half_lever: T,
    /// `k_T L/2`, by which it moves outward as the ring tilts.
    tilt_rocking: T,
    /// Height of the rotor's mass centre above its underside.
    half_thickness_m: T,
    friction: T,
    pub(super) restitution: T,
    paper_law: bool,
}

impl<T: Real> Tooth<T> {
    /// The four teeth of a motor, counter-clockwise.
    pub fn all(params: &MotorParams, tilting: &TiltingParams, setup: &TiltingSetup) -> [Self; 4] {
        let TiltingVariation { amplitudes: [a_0, a_1, a_2, a_3], heights_m: [b_0, b_1, b_2, b_3], .. } =
            setup.variation;
        [(0, a_0, b_0), (1, a_1, b_1), (2, a_2, b_2), (3, a_3, b_3)].map(|(number, amplitude, height_m)| {
            Self::new(params, tilting, setup.friction_law, number, 1.0 + amplitude, height_m)
        })
    }

    fn new(
        params: &MotorParams,
        tilting: &TiltingParams,
        law: FrictionLaw,
        number: u8,
        scale: f64,
        height_m: f64,
    ) -> Self {
        use TiltingParameter::{
            ModeARockingExponent, ModeCExtraRockingExponent, ModeCExtraShift, RotorThickness,
            StatorTiltRockingExponent, ToothRockingExponent,
        };
        let offset_deg = 90.0 * f64::from(number);
        let angle_deg = params.effective_tooth_angle_deg() + offset_deg;
        let (sin, cos) = math::sin_cos(angle_deg.to_radians());
        let (sin_b, cos_b) = math::sin_cos(2.0 * (params.mode_b_tooth_angle_deg() + offset_deg).to_radians());
        let (sin_c, cos_c) = math::sin_cos(2.0 * (angle_deg - tilting.get(ModeCExtraShift)).to_radians());
        let (phi_b, phi_c) = (scale * sin_b, scale * cos_c);
        let lever = params.lever();
        let exponent_a = tilting.get(ModeARockingExponent);
        let exponent_b = tilting.get(ToothRockingExponent);
        let exponent_c = exponent_b + tilting.get(ModeCExtraRockingExponent);
        let vector = |a: f64, b: f64, c: f64| Vector3::new(T::from_f64(a), T::from_f64(b), T::from_f64(c));
        let radius = params.get(Parameter::ToothRadius);
        Self {
            place: ContactPlace::Tooth(number),
            outward: Vector2::new(T::from_f64(cos), T::from_f64(sin)),
            position_m: Vector2::new(T::from_f64(radius * cos), T::from_f64(radius * sin)),
            height_m: T::from_f64(height_m),
            shape: vector(1.0, phi_b, phi_c),
            lever: vector(0.0, lever * scale * cos_b, -lever * scale * sin_c),
            rocking: vector(
                0.0 - 0.5 * lever * exponent_a,
                -0.5 * lever * exponent_b * phi_b,
                -0.5 * lever * exponent_c * phi_c,
            ),
            half_lever: T::from_f64(0.5 * lever),
            tilt_rocking: T::from_f64(0.5 * lever * tilting.get(StatorTiltRockingExponent)),
            half_thickness_m: T::from_f64(0.5 * tilting.get(RotorThickness)),
            friction: T::from_f64(params.get(Parameter::Friction)),
            restitution: T::from_f64(params.get(Parameter::Restitution)),
            paper_law: law == FrictionLaw::Paper,
        }
    }

    /// Height of the rotor's underside above the tooth.
    #[inline]
    pub(super) fn gap_m(&self, motion: &TiltingMotion<T>) -> T {
        let arm = self.position_m - motion.shift.displacement_m;
        motion.rotor.height_m + motion.tilt.slope.dot(&arm) - self.top_m(motion)
    }

    #[inline]
    fn top_m(&self, motion: &TiltingMotion<T>) -> T {
        self.height(&motion.modes, &motion.stator_tilt)
    }

    /// Height `u_k` of the tooth's top in m, above that of a nominal tooth at rest.
    #[inline]
    pub fn height(&self, modes: &ModalState<T>, stator_tilt: &StatorTiltState<T>) -> T {
        self.over(&modes.displacement_m) + self.outward.dot(&stator_tilt.displacement_m) + self.height_m
    }

    /// `phi . x` of modes A, B, C, knowing that `phi_A` is 1.
    #[inline]
    fn over(&self, x: &Vector3<T>) -> T {
        x.x + (self.shape.y * x.y + self.shape.z * x.z)
    }

    /// Rate at which the gap opens.
    #[inline]
    pub(super) fn gap_rate_m_s(&self, motion: &TiltingMotion<T>) -> T {
        let arm = self.position_m - motion.shift.displacement_m;
        motion.rotor.velocity_m_s + motion.tilt.rate_rad_s.dot(&arm)
            - motion.tilt.slope.dot(&motion.shift.velocity_m_s)
            - self.over(&motion.modes.velocity_m_s)
            - self.outward.dot(&motion.stator_tilt.velocity_m_s)
    }

    /// The contact with the rotor where it is.
    pub(super) fn contact(&self, motion: &TiltingMotion<T>, mobility: &Mobility<T>) -> Contact<T> {
        let eta = &motion.tilt.slope;
        let arm = self.position_m - motion.shift.displacement_m;
        let lift = Twist { rise: T::one(), turn: T::zero(), shift: -*eta, slope: arm };
        let clockwise = Vector2::new(self.outward.y, -self.outward.x);
        let height = eta.dot(&arm) - self.half_thickness_m;
        let along = |way: Vector2<T>, sway: &Vector3<T>, by_tilt: T| {
            let up = eta.dot(&way);
            let rotor = Twist::of_point((arm, height), (way, up), eta);
            let modes = sway + self.shape * up;
            let stator_tilt = self.outward * up - way * by_tilt;
            (rotor, modes, stator_tilt)
        };
        let (turned, sway, tilt_sway) = along(clockwise, &self.lever, self.half_lever);
        let (mut pushed, mut rock, mut tilt_rock) = along(self.outward, &self.rocking, self.tilt_rocking);
        if mobility.rotor.shift <= T::zero() {
            // The pin holds the rotor against a push outward: it slips, and the push does nothing.
            pushed = Twist::zero();
            if mobility.rotor.slope <= T::zero() {
                (rock, tilt_rock) = (Vector3::zeros(), Vector2::zeros());
            }
        }
        Contact {
            place: self.place,
            normal: Direction::at_tooth(lift, self.shape, self.outward, mobility),
            along: [
                Direction::along_tooth(turned, sway, tilt_sway, mobility),
                Direction::along_tooth(pushed, rock, tilt_rock, mobility),
            ],
            friction: self.friction_coefficient(motion),
            restitution: self.restitution,
            gap_m: self.gap_m(motion),
        }
    }

    /// `c` of the law in force.
    #[inline]
    fn friction_coefficient(&self, motion: &TiltingMotion<T>) -> T {
        if !self.paper_law {
            return self.friction;
        }
        let across = self.lever.dot(&motion.modes.displacement_m).abs();
        let up = self.over(&motion.modes.displacement_m).abs();
        // Compared before dividing: at u = 0 the angle of contact is a right angle and mu is the limit.
        if across < self.friction * up { across / up } else { self.friction }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::modes::Mode;
    use crate::tilting::contact::Velocities;
    use crate::tilting::rigid_body::RotorMobility;
    use crate::{Freedom, TiltingState};

    /// Parameters of a stator whose every mode has another shift and exponent.
    fn sets() -> (MotorParams, TiltingParams) {
        use TiltingParameter::{
            ModeARockingExponent, ModeCExtraRockingExponent, ModeCExtraShift, StatorTiltRockingExponent,
            ToothRockingExponent,
        };
        let tilting = [
            (ModeARockingExponent, -0.3),
            (ToothRockingExponent, 1.6),
            (ModeCExtraRockingExponent, -0.1),
            (ModeCExtraShift, -1.0),
            (StatorTiltRockingExponent, 0.85),
        ];
        (
            MotorParams::nominal().with(Parameter::ModeBExtraShift, 1.3).unwrap(),
            tilting
                .into_iter()
                .fold(TiltingParams::nominal(), |set, (of, value)| set.with(of, value).unwrap()),
        )
    }

    /// Deflections of modes A, B, C, T1 and T2 at `(x, y)`, each 1 m at its antinode at the tooth radius.
    fn deflections(x: f64, y: f64) -> [f64; 5] {
        let radius = 3.063e-3;
        let (part, angle) = (x.hypot(y) / radius, y.atan2(x));
        let shifted = |extra_deg: f64| 2.0 * (angle - extra_deg.to_radians());
        [
            part.powf(-0.3),
            part.powf(1.6) * shifted(1.3).sin(),
            part.powf(1.5) * shifted(-1.0).cos(),
            part.powf(0.85) * angle.cos(),
            part.powf(0.85) * angle.sin(),
        ]
    }

    /// The top of a tooth stands `L R_t / 2` above the neutral plane, and moves by that times the slope of the ring,
    /// here from differences of the deflection: clockwise and outward, in each of the five modes. The differences of
    /// 1 nm are good to 1e-6.
    #[test]
    fn exact_the_top_follows_the_slope_of_the_ring() {
        let (params, tilting) = sets();
        let setup = TiltingSetup::with_step(1e-6);
        let mobility = Mobility {
            rotor: RotorMobility::new(&params, &tilting, Freedom::Full),
            modes: Vector3::from(Mode::all(&params).unwrap().map(|mode| 1.0 / mode.mass_kg)),
            stator_tilt: 1.0 / 5.35e-6,
        };
        let still = TiltingState::<f64>::default();
        for (tooth, number) in Tooth::<f64>::all(&params, &tilting, &setup).iter().zip([0.0, 1.0, 2.0, 3.0]) {
            let contact = tooth.contact(&still.motion(), &mobility);
            let (sin, cos) = (30.0_f64 + 90.0 * number).to_radians().sin_cos();
            let (x, y, nm) = (3.063e-3 * cos, 3.063e-3 * sin, 1e-9);
            for mode in 0..5 {
                let along = |dx: f64, dy: f64| {
                    (deflections(x + dx, y + dy)[mode] - deflections(x - dx, y - dy)[mode]) / (2.0 * nm)
                };
                let slope = [along(nm, 0.0), along(0.0, nm)];
                let top_m = -0.5 * params.lever() * 3.063e-3;
                let wanted =
                    [slope[0] * sin - slope[1] * cos, slope[0] * cos + slope[1] * sin].map(|x| x * top_m);
                let mut moving = Velocities::zero();
                match mode {
                    0..3 => moving.modes[mode] = 1.0,
                    _ => moving.stator_tilt[mode - 3] = 1.0,
                }
                for (way, wanted) in contact.along.iter().zip(wanted) {
                    let speed = way.surface_speed(&moving);
                    assert!((speed - wanted).abs() < 1e-6, "tooth {number}, mode {mode}: {speed} {wanted}");
                }
                let up = contact.normal.surface_speed(&moving);
                assert!((up - deflections(x, y)[mode]).abs() < 1e-12, "tooth {number}, mode {mode}: {up}");
            }
        }
    }
}

//! What the twin's filter assumes of motor and sensors.

use motor_model::{MotorParams, Real};

use crate::filters::constant_rate::ConstantRateTuning;
use crate::vibrometer::impact_detector::ImpactDetectorTuning;

/// Tolerances of the motor, noise of the sensors, and what is left out of both.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TwinTuning<T> {
    /// Camera, rest, and the process noise without vibrometer.
    pub constant_rate: ConstantRateTuning<T>,
    /// The impact detector.
    pub detector: ImpactDetectorTuning<T>,
    /// Tolerances, standard deviations.
    pub tolerance: Tolerance<T>,
    /// How well gap and approach are what the model says.
    pub contact: ContactTuning<T>,
    /// Standard deviation of a tooth's tangential velocity beside what modes and instant do to it, in m/s.
    pub tooth_m_s: T,
    /// Variance that each impact adds to the rate, in rad^2/s^2: smaller blows that follow it below the threshold.
    pub chatter_rad2_s2: T,
    /// Variance of the kicks by impacts not heard, per that of a kick at the detector's threshold, where the mean misfit is twice the usual one.
    pub unheard_part2: T,
    /// Variance of the kick by a blow under a rotor that rides on the teeth, per that of a kick at the detector's threshold.
    pub ridden_part2: T,
    /// Process noise from rest up to the first impact that is heard, in rad^2/s^3: those before it are below the detector's threshold. Afterwards nothing turns the
    /// rotor between impacts.
    pub launching_rad2_s3: T,
}

/// What differs from motor to motor, as parts of the nominal values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance<T> {
    /// Square of the natural frequency of modes A, B, C.
    pub stiffness: [T; 3],
    /// Damping of modes A, B, C.
    pub damping: [T; 3],
    /// Driven amplitude of modes B, C.
    pub amplitude: [T; 2],
    /// Mass ratio, by which the teeth recoil.
    pub recoil: T,
    /// `1 + e`.
    pub restitution: T,
    /// Amplitude of each pair of teeth in B and C.
    pub pair: T,
    /// The teeth's angle, in rad.
    pub tooth_angle_rad: T,
    /// Phase of the drive in rad: 10 us, a tick, by which its command may have been told late, are 0.4.
    pub phase_rad: T,
}

/// How well gap and approach at an impact are what the model says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactTuning<T> {
    /// Standard deviation of the gap in m.
    pub gap_m: T,
    /// The same as a part of the tooth's swing in B and C.
    pub shape_part: T,
    /// Standard deviation of the approach, as a part of it.
    pub approach_part: T,
    /// Noise of the modes' velocity, as a part of a driven steady motion that it would sustain.
    pub fed_part: T,
    /// A jump is noise when it misfits both pairs by more than it misfits none, and this: twice the logarithm of how much more often teeth strike than noise reaches
    /// the threshold.
    pub alarm: T,
    /// Without drive the first jump below this ends what is heard as impacts, in m/s: a rotor that lands chatters and slides, and teaches nothing.
    pub landing_m_s: T,
    /// A misfit beyond this makes the stator doubtful.
    pub surprise: T,
    /// Samples after an impact whose mean tells its jump better.
    pub refining_samples: u8,
}

impl<T: Real> TwinTuning<T> {
    /// For a motor whose nominal parameters are `params`, under the default sensors.
    pub fn new(params: &MotorParams) -> Self {
        let n = T::from_f64;
        Self {
            constant_rate: ConstantRateTuning::default(),
            detector: ImpactDetectorTuning {
                threshold: n(3.6),
                window_samples: n(20.0),
                ..ImpactDetectorTuning::new(params)
            },
            tolerance: Tolerance::default(),
            contact: ContactTuning::default(),
            tooth_m_s: n(5e-5),
            chatter_rad2_s2: n(5e-5),
            unheard_part2: n(1.0),
            ridden_part2: n(0.04),
            launching_rad2_s3: n(4.0),
        }
    }
}

impl<T: Real> Default for Tolerance<T> {
    /// Those of Table 1: half a tolerance is a standard deviation, 0.88 of that where the ends are cut off.
    fn default() -> Self {
        let n = T::from_f64;
        Self {
            stiffness: [n(0.0041), n(0.0014), n(0.0012)],
            damping: [n(0.056), n(0.14), n(0.117)],
            amplitude: [n(0.027), n(0.027)],
            recoil: n(0.042),
            restitution: n(0.013),
            pair: n(0.005),
            tooth_angle_rad: n(2.2e-3),
            phase_rad: n(0.07),
        }
    }
}

impl<T: Real> Default for ContactTuning<T> {
    fn default() -> Self {
        let n = T::from_f64;
        Self {
            gap_m: n(1.2e-8),
            shape_part: n(0.001),
            approach_part: n(0.003),
            fed_part: n(4e-4),
            alarm: n(20.0),
            landing_m_s: n(1e-2),
            surprise: n(8.0),
            refining_samples: 10,
        }
    }
}

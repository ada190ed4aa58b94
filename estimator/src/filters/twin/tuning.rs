//! What the twin's filter assumes of motor and sensors.
//!
//! The noises and limits without a source of their own were tuned so that errors and reported standard deviations agree
//! over motors drawn within the tolerances (`host-sim estimate`).

use motor_model::{MotorParams, Real};

use crate::filters::constant_rate::ConstantRateTuning;
use crate::filters::impact_aided::ImpactAidedTuning;
use crate::instruments::Instruments;
use crate::vibrometer::impact_detector::{ImpactDetectorTuning, window_samples};

/// Time after an impact over which the mean velocity refines its jump, in s.
const REFINING_S: f64 = 1e-4;

/// Prior of the motor, noise of the sensors, and noise of what the model leaves out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TwinTuning<T> {
    /// Camera, rest, and the process noise without a vibrometer.
    pub constant_rate: ConstantRateTuning<T>,
    /// The kicks that the stator's estimate does not explain: as in [`crate::ImpactAided`].
    pub without_stator: ImpactAidedTuning<T>,
    /// The impact detector: threshold 3.6, lower than elsewhere since association finds false alarms.
    pub detector: ImpactDetectorTuning<T>,
    /// Samples after an impact whose mean refines its jump: those of 0.1 ms. 20 leave a twentieth of the variance of
    /// one.
    pub refining_samples: T,
    /// Time between two samples of the vibrometer, in s.
    pub sample_period_s: T,
    /// Prior of the motor's parameters.
    pub prior: TwinPrior<T>,
    /// Noise of the contact measurements, and the gates of their association.
    pub contact: ContactTuning<T>,
    /// Standard deviation of a tooth's tangential velocity beside what modes and instant do to it, in m/s: 3.5e-5,
    /// tuned.
    pub tooth_velocity_m_s: T,
    /// Variance that each impact adds to the rate, in rad^2/s^2: smaller impacts that follow it below the detector's
    /// threshold. 3.5e-5, tuned.
    pub chatter_rad2_s2: T,
    /// Variance of the kicks by undetected impacts when the mean misfit is twice the typical one, per the square of a
    /// kick at the detector's threshold. 1.5, tuned.
    pub undetected_part2: T,
    /// Variance of the kick by an impact of a riding rotor, per the square of a kick at the detector's threshold:
    /// 0.04, a fifth of that kick, measured in simulation.
    pub riding_part2: T,
}

/// Standard deviations of what differs from motor to motor, as parts of the nominal values where no unit is given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TwinPrior<T> {
    /// Stiffness of modes A, B, C: the square of the natural frequency.
    pub stiffness: [T; 3],
    /// Damping of modes A, B, C.
    pub damping: [T; 3],
    /// Driven amplitude of modes B, C.
    pub amplitude: [T; 2],
    /// Mass ratio of rotor and stator, to which the recoil of the modes is proportional.
    pub mass_ratio: T,
    /// `1 + e`, e the restitution.
    pub restitution: T,
    /// Amplitude of each pair of teeth in modes B and C.
    pub pair_amplitude: T,
    /// The teeth's angle, in rad.
    pub tooth_angle_rad: T,
    /// Phase of the drive, in rad. A command that is reported one tick of 10 us late is 0.4 rad off.
    pub drive_phase_rad: T,
}

/// Noise of the contact measurements, and the gates of their association.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactTuning<T> {
    /// Standard deviation of the gap, in m: 12 nm, tuned.
    pub gap_m: T,
    /// Standard deviation of the gap as a part of the tooth's swing in modes B and C: 3e-4, tuned.
    pub gap_per_swing: T,
    /// Standard deviation of the approach as a part of it: 0.001, tuned.
    pub approach_part: T,
    /// Process noise of each mode's velocity: as a part of a driven motion, the steady motion that it would sustain.
    /// 3e-4, tuned.
    pub process_noise_part: T,
    /// An impact is noise when its misfit exceeds that of noise by this: twice the logarithm of the prior odds, how
    /// much more often teeth touch the rotor than noise exceeds the threshold. 20, odds of 22,000.
    pub noise_log_odds: T,
    /// Without drive the first jump below this ends the updates of the stator, in m/s: a rotor that lands chatters and
    /// slides, which the contact measurements do not describe. 0.01, assumed.
    pub landing_m_s: T,
    /// A misfit beyond this inflates the variance of the impact's instant: 6, the 95 % point of two degrees of freedom.
    pub inflation_misfit: T,
}

impl<T: Real> TwinTuning<T> {
    /// For a motor whose nominal parameters are `params`, under `instruments`; the default vibrometer where there is
    /// none.
    pub fn new(params: &MotorParams, instruments: &Instruments) -> Self {
        let vibrometer = instruments.vibrometer.unwrap_or_default();
        let n = T::from_f64;
        Self {
            constant_rate: ConstantRateTuning::for_motor(params, instruments),
            without_stator: ImpactAidedTuning::new(params, instruments),
            detector: ImpactDetectorTuning {
                threshold: n(3.6),
                blind_m_s: n(Instruments::TWIN_SD_M_S),
                ..ImpactDetectorTuning::new(params, &vibrometer)
            },
            refining_samples: window_samples(REFINING_S, &vibrometer),
            sample_period_s: n(vibrometer.period_s()),
            prior: TwinPrior::default(),
            contact: ContactTuning::default(),
            tooth_velocity_m_s: n(3.5e-5),
            chatter_rad2_s2: n(3.5e-5),
            undetected_part2: n(1.5),
            riding_part2: n(0.04),
        }
    }
}

impl<T: Real> Default for TwinPrior<T> {
    /// The tolerances of Table 1: half a tolerance is a standard deviation, 0.88 of that where the ends are cut off.
    fn default() -> Self {
        let n = T::from_f64;
        Self {
            stiffness: [n(0.0041), n(0.0014), n(0.0012)],
            damping: [n(0.056), n(0.14), n(0.117)],
            amplitude: [n(0.027), n(0.027)],
            mass_ratio: n(0.042),
            restitution: n(0.013),
            pair_amplitude: n(0.005),
            tooth_angle_rad: n(2.2e-3),
            drive_phase_rad: n(0.07),
        }
    }
}

impl<T: Real> Default for ContactTuning<T> {
    fn default() -> Self {
        let n = T::from_f64;
        Self {
            gap_m: n(1.2e-8),
            gap_per_swing: n(3e-4),
            approach_part: n(0.001),
            process_noise_part: n(3e-4),
            noise_log_odds: n(20.0),
            landing_m_s: n(1e-2),
            inflation_misfit: n(6.0),
        }
    }
}

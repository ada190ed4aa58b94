//! What the twin's filter assumes of motor and sensors.
//!
//! The noises and limits without a source of their own were tuned so that errors and reported standard deviations agree
//! over motors drawn within the tolerances (`host-sim estimate`).

use motor_model::{MotorParams, Real};

use crate::filters::impact_aided::ImpactAidedTuning;
use crate::instruments::Instruments;
use crate::vibrometer::impact_detector::{ImpactDetectorTuning, window_samples};

/// Time after an impact over which the mean velocity refines its jump, in s.
const REFINING_S: f64 = 1e-4;

/// Noise of the sensors, and noise of what the model leaves out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TwinTuning<T> {
    /// Camera, rest, the process noise without a vibrometer, and the kicks that the stator's estimate does not explain:
    /// as in [`crate::ImpactAided`].
    pub without_stator: ImpactAidedTuning<T>,
    /// The impact detector: threshold 3.6, lower than elsewhere since association finds false alarms.
    pub detector: ImpactDetectorTuning<T>,
    /// Samples after an impact whose mean refines its jump: those of 0.1 ms. 20 leave a twentieth of the variance of
    /// one.
    pub refining_samples: T,
    /// Time between two samples of the vibrometer, in s.
    pub sample_period_s: T,
    /// Standard deviation of a tooth's tangential velocity beside what modes and instant do to it, in m/s: 3.5e-5,
    /// tuned.
    pub tooth_velocity_m_s: T,
    /// Variance that each impact adds to the rate, in rad^2/s^2: smaller impacts that follow it below the detector's
    /// threshold. 3.5e-5, tuned.
    pub chatter_rad2_s2: T,
    /// Variance of the kicks by undetected impacts when the mean misfit is twice the typical one, per the square of a
    /// kick at the detector's threshold. 1.5, tuned.
    pub undetected_part2: T,
    /// Most that the drive acts later than the filter is told, in s: 0, on time, unless it is set.
    pub drive_late_s: T,
}

impl<T: Real> TwinTuning<T> {
    /// For a motor whose nominal parameters are `params`, under `instruments`; the default vibrometer where there is
    /// none.
    pub fn new(params: &MotorParams, instruments: &Instruments) -> Self {
        let vibrometer = instruments.vibrometer.unwrap_or_default();
        let n = T::from_f64;
        Self {
            without_stator: ImpactAidedTuning::new(params, instruments),
            detector: ImpactDetectorTuning {
                threshold: n(3.6),
                blind_m_s: n(Instruments::TWIN_SD_M_S),
                ..ImpactDetectorTuning::new(params, &vibrometer)
            },
            refining_samples: window_samples(REFINING_S, &vibrometer),
            sample_period_s: n(vibrometer.period_s()),
            tooth_velocity_m_s: n(3.5e-5),
            chatter_rad2_s2: n(3.5e-5),
            undetected_part2: n(1.5),
            drive_late_s: T::zero(),
        }
    }
}

//! What [`super::ImpactAided`] assumes of motor and instruments.

use motor_model::{MotorParams, Parameter, Real, math};

use crate::camera::process::Jitter;
use crate::filters::constant_rate::ConstantRateTuning;
use crate::filters::impact_aided::ringing::RingingTuning;
use crate::instruments::Instruments;
use crate::vibrometer::impact_detector::ImpactDetectorTuning;

/// Process noise by impacts below a threshold of 1 mm/s, in modes B and C, in rad^2/s^3.
const MISSED_RAD2_S3: [f64; 2] = [0.4, 4.0];
const THRESHOLD_M_S: f64 = 1e-3;

/// What the filter assumes of motor and sensors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImpactAidedTuning<T> {
    /// Camera, rest, and the process noise without vibrometer.
    pub constant_rate: ConstantRateTuning<T>,
    /// The impact detector.
    pub detector: ImpactDetectorTuning<T>,
    /// Largest kick per jump, `c = mu m_r R_t / J`, in rad/s per m/s.
    pub kick_per_jump_rad_m: T,
    /// Velocity of the tooth above the rotor's per jump, `(1 + r) / (1 + e)`.
    pub approach_per_jump: T,
    /// `s' / (R_t u')` of a tooth in pure mode B, in rad/m.
    pub turn_per_rise_rad_m: T,
    /// What earlier impacts do to the tooth that impacts under mode B.
    pub ringing: RingingTuning<T>,
    /// Variance of a kick under mode B about its mean, per `(c dv)^2`, where the ringing of earlier impacts is not
    /// known.
    pub unexplained_b: T,
    /// Half the width of the distribution of the tooth's rate under mode B, in rad/s, without the change by ringing
    /// between two samples.
    pub tooth_width_rad_s: T,
    /// Variance of the friction, per its nominal value squared.
    pub friction_part2: T,
    /// Variance of a kick of unknown sign, per `(c dv)^2`.
    pub unexplained: T,
    /// Process noise between impacts under mode C, in rad^2/s^3: impacts below the detector's threshold.
    pub missed_rad2_s3: T,
    /// The same under mode B.
    pub missed_b_rad2_s3: T,
    /// The impacts under mode B that the vibrometer has not shown yet: of a slow one, the kicks of one and a
    /// half of the time between two samples.
    pub jitter_b: Jitter<T>,
    /// The part of the kicks under mode C that the next kick undoes, and the impacts not shown yet.
    pub jitter_c: Jitter<T>,
    /// Variance of the rate in modes B and C by impacts not shown yet, in rad^2/s^2.
    pub unseen_rad2_s2: [T; 2],
}

/// Intensity of the kicks in modes B and C at times below a millisecond, in rad^2/s^3: see [`crate::ConstantRate`].
const KICKS_RAD2_S3: [f64; 2] = [4260.0, 970.0];
/// Longest time between two samples at which impacts are located within it and nothing is unseen, in s.
const LOCATED_S: f64 = 1e-5;
/// Samples' periods for which an impact is not shown: half of one until the next sample in the mean, and one more until
/// that sample tells it from noise.
const UNSEEN_PERIODS: f64 = 1.5;

/// Variance of the rate in modes B and C by impacts that a vibrometer with this time between samples has not shown yet,
/// in rad^2/s^2: the intensity of the kicks, over the time for which they are not shown.
fn unseen_rad2_s2(period_s: f64) -> [f64; 2] {
    let unseen_s = if period_s > LOCATED_S { UNSEEN_PERIODS * period_s } else { 0.0 };
    KICKS_RAD2_S3.map(|intensity| intensity * unseen_s)
}

impl<T: Real> ImpactAidedTuning<T> {
    /// For a motor of `params` under `instruments`; the default vibrometer where there is none.
    #[inline(never)]
    pub fn new(params: &MotorParams, instruments: &Instruments) -> Self {
        let vibrometer = instruments.vibrometer.unwrap_or_default();
        let get = |parameter| params.get(parameter);
        let kick = get(Parameter::Friction) * get(Parameter::RotorMass) * get(Parameter::ToothRadius)
            / get(Parameter::RotorInertia);
        let approach = (1.0 + params.tooth_mass_ratio()) / (1.0 + get(Parameter::Restitution));
        let (sin, cos) = math::sin_cos(2.0 * params.mode_b_tooth_angle_deg().to_radians());
        let detector = ImpactDetectorTuning::new(params, &vibrometer);
        let [unseen_b, unseen_c] = unseen_rad2_s2(vibrometer.period_s());
        Self {
            constant_rate: ConstantRateTuning::for_motor(params, instruments),
            detector,
            kick_per_jump_rad_m: T::from_f64(kick),
            approach_per_jump: T::from_f64(approach),
            turn_per_rise_rad_m: T::from_f64(params.lever() * cos / (sin * get(Parameter::ToothRadius))),
            ringing: RingingTuning::new(params),
            unexplained_b: T::from_f64(0.126),
            tooth_width_rad_s: T::from_f64(1.5),
            friction_part2: T::from_f64(0.045),
            unexplained: T::from_f64(0.68),
            missed_b_rad2_s3: T::from_f64(MISSED_RAD2_S3[0]),
            missed_rad2_s3: T::from_f64(MISSED_RAD2_S3[1]),
            jitter_b: Jitter { angle_rad2: T::zero(), rate_rad2_s2: T::from_f64(unseen_b) },
            jitter_c: Jitter { angle_rad2: T::from_f64(1e-9), rate_rad2_s2: T::from_f64(1.2e-3 + unseen_c) },
            unseen_rad2_s2: [unseen_b, unseen_c].map(T::from_f64),
        }
        .with_noise(detector.noise_m_s)
    }

    /// For a vibrometer of this noise: a wider threshold misses larger impacts.
    ///
    /// Jumps up to the threshold are about equally frequent, so their kicks add to the variance as its third power:
    /// from the values at 1 mm/s up to those of the random walk, which has all kicks.
    #[must_use]
    pub(crate) fn with_noise(mut self, noise_m_s: T) -> Self {
        self.detector.noise_m_s = noise_m_s;
        let wider = noise_m_s * self.detector.threshold * T::from_f64(1.0 / THRESHOLD_M_S);
        // The default's own threshold is 1, but for rounding.
        if wider > T::from_f64(1.001) {
            let volume = wider * wider * wider;
            let missed = |at_default: f64, most: T| {
                let missed = T::from_f64(at_default) * volume;
                if missed < most { missed } else { most }
            };
            let walk = &self.constant_rate.random_walk;
            let [b, c] = MISSED_RAD2_S3;
            self.missed_b_rad2_s3 = missed(b, walk.impacted_b_rad2_s3);
            self.missed_rad2_s3 = missed(c, walk.impacted_c_rad2_s3);
        }
        self
    }
}

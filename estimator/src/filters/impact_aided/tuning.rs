//! What [`super::ImpactAided`] assumes of motor and instruments.

use motor_model::{MotorParams, Parameter, Real, Time, math};

use crate::filters::kicks_kept::is_slow;
use crate::vibrometer::next_impact::NextImpactTuning;
use crate::{ConstantRateTuning, ImpactDetectorTuning, Instruments, Jitter, Motion, RingingTuning};

/// Process noise by impacts below a threshold of 1 mm/s, in modes B and C, in rad^2/s^3.
const MISSED_RAD2_S3: [f64; 2] = [0.04, 4.0];
const THRESHOLD_M_S: f64 = 1e-3;
/// Variance of a kick of unknown sign, per `(c dv)^2`.
const UNEXPLAINED: f64 = 0.68;
/// Intensity of the kicks in modes B and C at times below a millisecond, in rad^2/s^3: see [`crate::ConstantRate`].
const KICKS_RAD2_S3: [f64; 2] = [4260.0, 970.0];

/// What the filter assumes of motor and sensors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImpactAidedTuning<T> {
    /// Camera, rest, and the process noise without vibrometer.
    pub constant_rate: ConstantRateTuning<T>,
    /// The impact detector.
    pub detector: ImpactDetectorTuning<T>,
    /// Largest kick per jump, `c = mu m_r R_t / J`, in rad/s per m/s.
    pub(crate) kick_per_jump_rad_m: T,
    /// Velocity of the tooth above the rotor's per jump, `(1 + r) / (1 + e)`.
    pub(crate) approach_per_jump: T,
    /// `s' / (R_t u')` of a tooth in pure mode B, in rad/m.
    pub(crate) turn_per_rise_rad_m: T,
    /// What earlier impacts do to the tooth that impacts under mode B.
    pub(crate) ringing: RingingTuning<T>,
    /// Variance of a kick under mode B about its mean, per `(c dv)^2`, where the ringing of earlier impacts is not
    /// known; where it is, 0.02 to 0.03 of 0.62.
    pub(crate) unexplained_b: T,
    /// Variance of a kick of unknown sign, per `(c dv)^2`.
    pub(crate) unexplained: T,
    /// Process noise between impacts under modes B and C by impacts below the detector's threshold, in rad^2/s^3.
    pub(crate) missed_rad2_s3: [T; 2],
    /// How far a rotor rises or falls between two impacts at most, A of [`super::impact_heights`], in m.
    pub(crate) reach_m: T,
    /// What the impacts do that no sample has shown yet.
    pub(crate) next_impact: NextImpactTuning<T>,
    /// Time between two samples of the vibrometer, in ns.
    pub(crate) sample_period_nanos: u64,
    /// Whether frames come so slowly or late that more kicks are kept: [`crate::filters::kicks_kept`].
    pub(crate) slow_camera: bool,
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
        Self {
            constant_rate: ConstantRateTuning::for_motor(params, instruments),
            detector,
            kick_per_jump_rad_m: T::from_f64(kick),
            approach_per_jump: T::from_f64(approach),
            turn_per_rise_rad_m: T::from_f64(params.lever() * cos / (sin * get(Parameter::ToothRadius))),
            ringing: RingingTuning::new(params),
            unexplained_b: T::from_f64(0.126),
            unexplained: T::from_f64(UNEXPLAINED),
            missed_rad2_s3: MISSED_RAD2_S3.map(T::from_f64),
            reach_m: T::from_f64(get(Parameter::ModeBToothAmplitude)),
            next_impact: NextImpactTuning::new(
                params,
                UNEXPLAINED * kick * kick,
                approach,
                detector.gap_nanos,
            ),
            sample_period_nanos: vibrometer.period_nanos,
            slow_camera: is_slow(&instruments.camera),
        }
        .with_noise(detector.noise_m_s)
    }

    /// Variance of the rate at `at` by impacts since the sample before, which the sample after it shows without their
    /// instants: the intensity of the kicks times that time. The newest sample was taken at `known_until`; the samples
    /// before it are taken as evenly spaced. Zero from the newest sample on.
    #[inline]
    pub(crate) fn between_samples(&self, motion: Motion, at: Time, known_until: Time) -> Jitter<T> {
        if at >= known_until {
            Jitter::none()
        } else {
            self.before_newest(motion, known_until.nanos_since(at))
        }
    }

    #[cold]
    fn before_newest(&self, motion: Motion, before_newest_nanos: u64) -> Jitter<T> {
        let [of_b, of_c] = KICKS_RAD2_S3.map(T::from_f64);
        let rate_rad2_s3 = motion.of(of_b, of_c, T::zero());
        let since_nanos = match before_newest_nanos.checked_rem(self.sample_period_nanos) {
            None | Some(0) => 0,
            Some(until_next) => self.sample_period_nanos - until_next,
        };
        let since_s = T::from_f64(1e-9) * T::from_i32(i32::try_from(since_nanos).unwrap_or(i32::MAX));
        Jitter { angle_rad2: T::zero(), rate_rad2_s2: rate_rad2_s3 * since_s }
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
            let walk = &self.constant_rate.random_walk;
            let [of_b, of_c] = MISSED_RAD2_S3.map(|at_default| T::from_f64(at_default) * volume);
            self.missed_rad2_s3 =
                [of_b.at_most(walk.impacted_b_rad2_s3), of_c.at_most(walk.impacted_c_rad2_s3)];
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use motor_model::DriveMode;

    use super::*;

    /// Samples every 5 us, the newest at 1 ms: at a sample no impact is unseen, before the next one the kicks of the
    /// time since are, after the newest the flight tells, and a rotor that lies on the teeth has none.
    #[test]
    fn exact_kicks_since_the_sample_before_are_unseen() {
        let tuning = ImpactAidedTuning::<f64>::new(&MotorParams::nominal(), &Instruments::default());
        let newest = Time::from_micros(1000);
        let b = Motion::Impacted(DriveMode::B);
        for (nanos, since_s) in [
            (1_000_000, 0.0),
            (1_004_000, 0.0),
            (999_999, 4.999e-6),
            (996_000, 1e-6),
            (995_000, 0.0),
            (400_003, 3e-9),
        ] {
            let at = Time::from_nanos(nanos);
            let unseen = tuning.between_samples(b, at, newest);
            let [of_b, _] = KICKS_RAD2_S3;
            assert!((unseen.rate_rad2_s2 - of_b * since_s).abs() < 1e-12, "{nanos}: {unseen:?}");
            assert_eq!(tuning.between_samples(Motion::Quiet, at, newest), Jitter::none());
        }
    }

    /// Twice the noise, and a threshold of 2 mm/s: eight times the kicks are missed, but never more than all.
    #[test]
    fn exact_missed_kicks_grow_with_the_third_power_of_the_threshold() {
        let tuning = ImpactAidedTuning::<f64>::new(&MotorParams::nominal(), &Instruments::default());
        let walk = tuning.constant_rate.random_walk;
        for (noise_m_s, volume) in [(2e-4, 1.0), (4e-4, 8.0), (2e-3, 1000.0)] {
            let missed = tuning.with_noise(noise_m_s).missed_rad2_s3;
            let all = [walk.impacted_b_rad2_s3, walk.impacted_c_rad2_s3];
            for (own, (at_default, all)) in missed.into_iter().zip(MISSED_RAD2_S3.into_iter().zip(all)) {
                let expected = (volume * at_default).min(all);
                assert!((own / expected - 1.0).abs() < 1e-9, "{noise_m_s}: {own} {expected}");
            }
        }
    }
}

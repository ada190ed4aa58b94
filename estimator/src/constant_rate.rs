//! The simplest filter: angle and rate from the camera, the rate constant but for noise.
//!
//! ```text
//! angle' = rate,   rate' = white noise of intensity q,   camera = angle + noise of variance R
//! ```
//!
//! Each impact kicks the rate; `q` stands for all of them. From the model (Coulomb friction, steady motion): the rate wanders with standard
//! deviation s and correlation time T, so `q = 2 s^2 / T`: 4.4 rad/s and 12 ms in mode B, 0.54 rad/s and 2 ms in mode C. With the
//! default camera the steady standard error of the angle is then `(sqrt 2 (R dt)^(3/4) q^(1/4))^(1/2)`, 13 and 7 milli-degrees.
//!
//! The filter lives at the exposure time of its last frame; [`ConstantRate::estimate`] carries it forward to the present.

use motor_model::{Angle, AngleAccumulator, DriveMode, Real, Time};

use crate::covariance::AngleRateCovariance;
use crate::innovation::{Innovation, Rejection, Source, Verdict};
use crate::measurement::CameraFrame;

/// What is known of the rotor's motion from elsewhere: the drive and the LDV.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// Struck by teeth in this mode, or in flight after it.
    Struck(DriveMode),
    /// Lying on the teeth, perhaps still sliding to a stop.
    Quiet,
}

/// Noise of process and camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConstantRateTuning<T> {
    /// Variance of a frame's angle in rad^2.
    pub camera_rad2: T,
    /// Process noise under mode B in rad^2/s^3.
    pub struck_b_rad2_s3: T,
    /// Process noise under mode C in rad^2/s^3.
    pub struck_c_rad2_s3: T,
    /// Process noise of a rotor that slides to a stop in rad^2/s^3: friction changes the rate by 0.6 to 1.8 rad/s in a millisecond.
    pub sliding_rad2_s3: T,
    /// Process noise at rest in rad^2/s^3.
    pub resting_rad2_s3: T,
    /// Variance of the zero-rate update in rad^2/s^2, one a frame.
    pub zero_rate_rad2_s2: T,
    /// A quiet rotor is at rest once its rate has stayed within this of zero, in rad/s, for [`Self::resting_frames`]: twice the standard error of
    /// the rate, and friction stops it from there within 4 ms.
    pub resting_rate_rad_s: T,
    /// How many frames that takes.
    pub resting_frames: u8,
    /// A frame is refused when its innovation squared exceeds this many times its variance.
    pub gate: T,
    /// Variance added to the rate, once, when a struck rotor's frame is refused, in rad^2/s^2: as a rule it was no bad frame, but a burst of impacts
    /// as the rotor lands, which changes the rate by more than ten rad/s in a fraction of a millisecond.
    pub kick_rad2_s2: T,
    /// After this many refusals in a row the estimate begins anew.
    pub refusals_max: u8,
}

impl<T: Real> Default for ConstantRateTuning<T> {
    /// For the default camera: 1 um of tracking noise and 2 um of quantisation at 3.9 mm are 2.96e-4 rad.
    fn default() -> Self {
        Self {
            camera_rad2: T::from_f64(8.8e-8),
            struck_b_rad2_s3: T::from_f64(3000.0),
            struck_c_rad2_s3: T::from_f64(300.0),
            sliding_rad2_s3: T::from_f64(3000.0),
            resting_rad2_s3: T::from_f64(1e-6),
            zero_rate_rad2_s2: T::from_f64(1e-4),
            resting_rate_rad_s: T::from_f64(2.0),
            resting_frames: 20,
            gate: T::from_f64(36.0),
            kick_rad2_s2: T::from_f64(200.0),
            refusals_max: 20,
        }
    }
}

/// Angle and rate at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate<T> {
    /// The instant.
    pub at: Time,
    /// Angle; whole turns are counted from the turn of the first frame.
    pub angle: Angle,
    /// Rate in rad/s.
    pub rate_rad_s: T,
    /// Variance of the angle in rad^2.
    pub angle_rad2: T,
    /// Variance of the rate in rad^2/s^2.
    pub rate_rad2_s2: T,
    /// Whether the rotor lies still.
    pub resting: bool,
}

/// The filter.
#[derive(Clone, Copy, Debug)]
pub struct ConstantRate<T> {
    tuning: ConstantRateTuning<T>,
    track: Option<Track<T>>,
    refusals: u8,
}

/// What the filter knows once a frame has come.
#[derive(Clone, Copy, Debug)]
struct Track<T> {
    at: Time,
    angle: AngleAccumulator<T>,
    rate_rad_s: T,
    covariance: AngleRateCovariance<T>,
    /// Frames for which the rotor has been quiet and slow, without a break.
    still_frames: u8,
    resting: bool,
}

impl<T: Real> ConstantRate<T> {
    /// Largest rate that a start has to allow for, one standard deviation, in rad/s.
    const START_RATE_RAD_S: f64 = 20.0;

    /// Predicted angle variance in rad^2 beyond which the turn is lost: six standard deviations, the gate, then span it.
    const LOST_RAD2: f64 = 0.25;

    /// A filter that has seen nothing.
    pub fn new(tuning: ConstantRateTuning<T>) -> Self {
        Self { tuning, track: None, refusals: 0 }
    }

    /// Takes a frame in.
    ///
    /// `motion` is what is known of the rotor since the last frame.
    pub fn update_camera(&mut self, frame: &CameraFrame, motion: Motion) -> Innovation<T> {
        let Some(track) = &mut self.track else { return self.restart(frame, Angle::ZERO) };
        if frame.exposed_at <= track.at {
            return refused(frame, T::zero(), T::zero(), Rejection::NotNewer);
        }
        let predicted = track.predicted(frame.exposed_at, self.tuning.process_noise(motion, track.resting));
        // Asked this way round, so that a variance that has overflowed counts as lost too.
        let turn_known = predicted.covariance.angle_rad2() <= T::from_f64(Self::LOST_RAD2);
        if !turn_known {
            return self.restart(frame, predicted.angle.angle());
        }
        let innovation_rad: T =
            frame.angle.minus(predicted.angle.angle()).wrapped().radians_since(Angle::ZERO);
        let variance_rad2 = predicted.covariance.angle_innovation_rad2(self.tuning.camera_rad2);
        if innovation_rad * innovation_rad > self.tuning.gate * variance_rad2 {
            self.refusals = self.refusals.saturating_add(1);
            if self.refusals == 1 && matches!(motion, Motion::Struck(_)) {
                track.covariance.widen_rate(self.tuning.kick_rad2_s2);
            }
            if self.refusals < self.tuning.refusals_max {
                return refused(frame, innovation_rad, variance_rad2, Rejection::Gate);
            }
            return self.restart(frame, predicted.angle.angle());
        }
        self.refusals = 0;
        *track = predicted;
        track.correct(innovation_rad, motion, &self.tuning);
        Innovation {
            source: Source::Camera,
            taken_at: frame.exposed_at,
            innovation_rad,
            variance_rad2,
            verdict: Verdict::Used,
        }
    }

    /// Angle and rate carried forward to `now`; `None` before the first frame.
    pub fn estimate(&self, now: Time, motion: Motion) -> Option<Estimate<T>> {
        let track = self.track.as_ref()?;
        let ahead = track.predicted(now, self.tuning.process_noise(motion, track.resting));
        Some(Estimate {
            at: now,
            angle: ahead.angle.angle(),
            rate_rad_s: ahead.rate_rad_s,
            angle_rad2: ahead.covariance.angle_rad2(),
            rate_rad2_s2: ahead.covariance.rate_rad2_s2(),
            resting: track.resting,
        })
    }

    /// Begins at `frame`, in the turn that brings it nearest to `near`.
    fn restart(&mut self, frame: &CameraFrame, near: Angle) -> Innovation<T> {
        let rate = T::from_f64(Self::START_RATE_RAD_S);
        self.track = Some(Track {
            at: frame.exposed_at,
            angle: AngleAccumulator::at(near.plus(frame.angle.minus(near).wrapped())),
            rate_rad_s: T::zero(),
            covariance: AngleRateCovariance::diagonal(self.tuning.camera_rad2, rate * rate),
            still_frames: 0,
            resting: false,
        });
        self.refusals = 0;
        Innovation {
            source: Source::Camera,
            taken_at: frame.exposed_at,
            innovation_rad: T::zero(),
            variance_rad2: T::zero(),
            verdict: Verdict::Restarted,
        }
    }
}

impl<T: Real> ConstantRateTuning<T> {
    fn process_noise(&self, motion: Motion, resting: bool) -> T {
        match motion {
            Motion::Struck(DriveMode::B) => self.struck_b_rad2_s3,
            Motion::Struck(DriveMode::C) => self.struck_c_rad2_s3,
            Motion::Quiet if resting => self.resting_rad2_s3,
            Motion::Quiet => self.sliding_rad2_s3,
        }
    }
}

impl<T: Real> Track<T> {
    /// The track carried forward to `at`; as it is if `at` is not later.
    #[inline]
    fn predicted(&self, at: Time, noise_rad2_s3: T) -> Self {
        let mut ahead = *self;
        let dt_s: T = at.seconds_since(self.at);
        ahead.at = if at > self.at { at } else { self.at };
        ahead.angle.turn_by_radians(self.rate_rad_s * dt_s);
        ahead.covariance.predict(dt_s, noise_rad2_s3);
        ahead
    }

    fn correct(&mut self, innovation_rad: T, motion: Motion, tuning: &ConstantRateTuning<T>) {
        let gain = self.covariance.update_angle(tuning.camera_rad2);
        self.angle.turn_by_radians(gain.angle * innovation_rad);
        self.rate_rad_s += gain.rate * innovation_rad;
        let still = motion == Motion::Quiet && self.rate_rad_s.abs() < tuning.resting_rate_rad_s;
        self.still_frames = if still { self.still_frames.saturating_add(1) } else { 0 };
        self.resting = self.still_frames >= tuning.resting_frames;
        if self.resting {
            let surplus = -self.rate_rad_s;
            let gain = self.covariance.update_rate(tuning.zero_rate_rad2_s2);
            self.angle.turn_by_radians(gain.angle * surplus);
            self.rate_rad_s += gain.rate * surplus;
        }
    }
}

fn refused<T: Real>(
    frame: &CameraFrame,
    innovation_rad: T,
    variance_rad2: T,
    why: Rejection,
) -> Innovation<T> {
    Innovation {
        source: Source::Camera,
        taken_at: frame.exposed_at,
        innovation_rad,
        variance_rad2,
        verdict: Verdict::Rejected(why),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::SeedableRng;

    const FRAME_NANOS: u64 = 100_000;
    const STRUCK: Motion = Motion::Struck(DriveMode::B);

    fn frame(n: u64, radians: f64) -> CameraFrame {
        let angle = Angle::from_degrees(radians.to_degrees()).wrapped();
        CameraFrame { exposed_at: Time::from_nanos(n * FRAME_NANOS), angle }
    }

    /// Normalised error squared of angle and rate.
    fn nees<T: Real>(track: &Track<T>, angle_rad: f64, rate_rad_s: f64) -> f64 {
        let angle_error = track.angle.angle().minus(Angle::from_degrees(angle_rad.to_degrees()));
        let (x, y) = (angle_error.radians_since::<f64>(Angle::ZERO), track.rate_rad_s.to_f64() - rate_rad_s);
        let p = &track.covariance;
        let [p11, p12, p22] = [p.angle_rad2(), p.angle_rate_rad2_s(), p.rate_rad2_s2()].map(Real::to_f64);
        (p22 * x * x - 2.0 * p12 * x * y + p11 * y * y) / (p11 * p22 - p12 * p12)
    }

    /// Truth that wanders just as the filter assumes: mean NEES and mean NIS over a run.
    fn consistency<T: Real>(seed: u64, frames: u64) -> (f64, f64) {
        let tuning = ConstantRateTuning::<T>::default();
        let (q, r) = (tuning.struck_b_rad2_s3.to_f64(), tuning.camera_rad2.to_f64());
        let mut rng = Pcg64::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let dt = FRAME_NANOS as f64 * 1e-9;
        let (mut angle, mut rate) = (0.0, 10.0 * normal());
        let mut filter = ConstantRate::new(tuning);
        let (mut nees_sum, mut nis_sum) = (0.0, 0.0);
        for n in 1..=frames + 50 {
            // Covariance q [dt^3/3 dt^2/2; dt^2/2 dt].
            let kick = (q * dt).sqrt() * normal();
            angle += rate * dt + 0.5 * dt * kick + (q * dt * dt * dt / 12.0).sqrt() * normal();
            rate += kick;
            let innovation = filter.update_camera(&frame(n, angle + r.sqrt() * normal()), STRUCK);
            if n > 50 {
                nees_sum += nees(filter.track.as_ref().unwrap(), angle, rate);
                nis_sum += innovation.normalised_squared().unwrap().to_f64();
            }
        }
        (nees_sum / frames as f64, nis_sum / frames as f64)
    }

    /// 50 runs of 400 frames. The NIS of a right filter is white: 20,000 chi-square(1), mean 1, standard error 0.01. The NEES is correlated
    /// over some 20 frames: 50 x 20 independent chi-square(2), mean 2, standard error 0.063. Bounds at 3.3 standard errors, both sides.
    fn assert_consistent<T: Real>() {
        let runs: [(f64, f64); 50] = core::array::from_fn(|seed| consistency::<T>(seed as u64, 400));
        let nees = runs.iter().map(|run| run.0).sum::<f64>() / 50.0;
        let nis = runs.iter().map(|run| run.1).sum::<f64>() / 50.0;
        assert!((nees - 2.0).abs() < 0.21, "{nees}");
        assert!((nis - 1.0).abs() < 0.033, "{nis}");
    }

    #[test]
    fn law_filter_is_consistent_in_both_precisions() {
        assert_consistent::<f64>();
        assert_consistent::<f32>();
    }

    /// 3,000 turns at 15 rad/s: every turn is counted, and the error is as small in the last as in the first.
    #[test]
    fn exact_turns_are_counted() {
        let mut filter = ConstantRate::<f32>::new(ConstantRateTuning::default());
        let rate = 15.0;
        let frames = 3000 * 4189;
        // Every tenth frame suffices at this rate: 15 mrad apart.
        for n in (0..frames).step_by(10) {
            filter.update_camera(&frame(n, rate * n as f64 * 1e-4), STRUCK);
        }
        let now = Time::from_nanos((frames - 10) * FRAME_NANOS);
        let estimate = filter.estimate(now, STRUCK).unwrap();
        let truth = Angle::from_degrees((rate * (frames - 10) as f64 * 1e-4).to_degrees());
        assert!(truth.degrees() > 2999.0 * 360.0);
        assert!(
            estimate.angle.minus(truth).degrees().abs() < 1e-4,
            "{}",
            estimate.angle.minus(truth).degrees()
        );
    }

    #[test]
    fn law_old_and_wild_frames_change_nothing() {
        let mut filter = ConstantRate::<f32>::new(ConstantRateTuning::default());
        for n in 1..200 {
            filter.update_camera(&frame(n, 0.1), Motion::Quiet);
        }
        let before = filter.track.unwrap();
        let unchanged = |filter: &ConstantRate<f32>| {
            let now = filter.track.unwrap();
            now.at == before.at && now.angle == before.angle && now.covariance == before.covariance
        };
        for old in [199, 100, 0] {
            let innovation = filter.update_camera(&frame(old, 0.1), Motion::Quiet);
            assert_eq!(innovation.verdict, Verdict::Rejected(Rejection::NotNewer));
            assert!(unchanged(&filter));
        }
        let innovation = filter.update_camera(&frame(201, 0.2), Motion::Quiet);
        assert_eq!(innovation.verdict, Verdict::Rejected(Rejection::Gate));
        assert!((innovation.innovation_rad - 0.1).abs() < 1e-3);
        assert!(unchanged(&filter));
    }

    /// The rate drops from 18 to 1 rad/s between two frames, as when a rotor lands: one frame is refused, the next ones are used.
    #[test]
    fn law_a_kick_is_believed_at_the_second_frame() {
        let mut filter = ConstantRate::<f32>::new(ConstantRateTuning::default());
        let truth =
            |n: u64| if n < 300 { 18e-4 * n as f64 } else { 18e-4 * 300.0 + 1e-4 * (n as f64 - 300.0) };
        let mut refused = 0;
        for n in 1..400 {
            let innovation = filter.update_camera(&frame(n, truth(n)), STRUCK);
            refused += u32::from(innovation.verdict == Verdict::Rejected(Rejection::Gate));
            if n > 310 {
                let error =
                    filter.track.unwrap().angle.angle().minus(Angle::from_degrees(truth(n).to_degrees()));
                assert!(error.degrees().abs() < 0.06, "{n} {}", error.degrees());
            }
        }
        assert!(refused <= 2, "{refused}");
    }

    /// A rotor that really went elsewhere is believed after twenty frames, in the turn nearest to where it was.
    #[test]
    fn exact_sustained_refusal_restarts() {
        let mut filter = ConstantRate::<f32>::new(ConstantRateTuning::default());
        for n in 1..100 {
            filter.update_camera(&frame(n, 3.1), Motion::Quiet);
        }
        let verdicts: [Verdict; 21] = core::array::from_fn(|n| {
            filter.update_camera(&frame(100 + n as u64, -3.1), Motion::Quiet).verdict
        });
        assert!(verdicts[..19].iter().all(|&verdict| verdict == Verdict::Rejected(Rejection::Gate)));
        assert_eq!(verdicts[19], Verdict::Restarted);
        assert_eq!(verdicts[20], Verdict::Used);
        let angle = filter.track.unwrap().angle.angle().degrees();
        assert!((angle - (-3.1_f64).to_degrees() - 360.0).abs() < 0.1, "{angle}");
    }

    /// At rest the error falls to what the reported variance says, through the camera's quantisation.
    #[test]
    fn law_rest_is_measured_to_milli_degrees_and_honestly() {
        let mut worst_ratio = 0.0_f64;
        let mut square_sum = 0.0;
        for seed in 0..200 {
            let mut rng = Pcg64::seed_from_u64(seed);
            let mut filter = ConstantRate::<f32>::new(ConstantRateTuning::default());
            let truth = 0.01 * seed as f64;
            for n in 1..=300 {
                let noise: f64 = StandardNormal.sample(&mut rng);
                let cells = ((truth * 3.9e-3 + 1e-6 * noise) / 2e-6).round();
                filter.update_camera(&frame(n, cells * 2e-6 / 3.9e-3), Motion::Quiet);
            }
            let estimate = filter.estimate(Time::from_nanos(300 * FRAME_NANOS), Motion::Quiet).unwrap();
            assert!(estimate.resting);
            let error = estimate.angle.radians_since::<f64>(Angle::from_degrees(truth.to_degrees()));
            worst_ratio = worst_ratio.max(error.abs() / f64::from(estimate.angle_rad2).sqrt());
            square_sum += error * error / f64::from(estimate.angle_rad2);
            assert!(f64::from(estimate.angle_rad2).sqrt().to_degrees() < 1.5e-3);
        }
        // Mean square of 200 standard normals: 1 +- 0.1; quantisation at half a cell of noise biases by under a tenth of a sigma.
        assert!((square_sum / 200.0 - 1.0).abs() < 0.35, "{}", square_sum / 200.0);
        assert!(worst_ratio < 4.0, "{worst_ratio}");
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// Any frames at any times in any order: never NaN, never a panic, variances positive.
        #[test]
        fn law_any_sequence_leaves_a_finite_estimate(
            frames in prop::collection::vec((any::<u64>(), any::<i64>(), 0..3_u8), 1..60)
        ) {
            let mut filter = ConstantRate::<f32>::new(ConstantRateTuning::default());
            for (nanos, units, motion) in frames {
                let motion = [STRUCK, Motion::Struck(DriveMode::C), Motion::Quiet][usize::from(motion)];
                let frame = CameraFrame { exposed_at: Time::from_nanos(nanos), angle: Angle::from_units(units) };
                let innovation = filter.update_camera(&frame, motion);
                prop_assert!(innovation.innovation_rad.is_finite());
                let track = filter.track.unwrap();
                prop_assert!(track.rate_rad_s.is_finite());
                prop_assert!(track.covariance.angle_rad2() > 0.0 && track.covariance.rate_rad2_s2() > 0.0);
            }
        }
    }
}

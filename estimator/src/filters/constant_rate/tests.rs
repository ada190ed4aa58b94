use super::*;
use crate::camera::angle_rate_covariance::AngleRateCovariance;
use crate::innovation::{Rejection, Verdict};
use crate::tests::{FRAME_NANOS, assert_consistent, frame, nees};
extern crate std;
use motor_model::{Angle, AngleAccumulator, DriveMode};
use proptest::prelude::*;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;
use std::vec::Vec;

mod outliers;

const IMPACTED_B: Motion = Motion::Impacted(DriveMode::B);

impl<T: Real> ConstantRate<T> {
    /// The process of a rotor that always moves so.
    fn process_under(&self, motion: Motion) -> RandomWalk<'_, T> {
        RandomWalk { motions: Motions::always(motion), ..self.process(Time::ZERO) }
    }

    fn update_with_motion(&mut self, frame: &CameraFrame, motion: Motion) -> Innovation<T> {
        let process = RandomWalk {
            tuning: &self.random_walk,
            motions: Motions::always(motion),
            mean_rates: &self.mean_rates,
        };
        let quiet = motion == Motion::Quiet;
        self.tracker.update(frame, FrameContext { clock: Time::ZERO, quiet, disputed: false }, &process)
    }
}

/// The tuning for the default camera on so many marks.
fn of_marks<T: Real>(marks: u8) -> ConstantRateTuning<T> {
    let camera = CameraDescription { marks, ..CameraDescription::default() };
    ConstantRateTuning { track: TrackTuning::new(&camera), ..ConstantRateTuning::default() }
}

/// A truth that follows the filter's assumptions: mean NEES and mean NIS over a run.
fn consistency<T: Real>(marks: u8, seed: u64, frames: u64) -> (f64, f64) {
    consistency_of(&of_marks::<T>(marks), |_| CameraFrame::ALL_MARKS, seed, frames)
}

/// The same with frames from `used` marks, by their number.
fn consistency_of<T: Real>(
    tuning: &ConstantRateTuning<T>,
    used: impl Fn(u64) -> u8,
    seed: u64,
    frames: u64,
) -> (f64, f64) {
    let (q, r) = (tuning.random_walk.impacted_b_rad2_s3.to_f64(), tuning.track.camera_rad2.to_f64());
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
        let factor: f64 = tuning.track.camera.variance_factor(used(n));
        let seen = frame(n, angle + (factor * r).sqrt() * normal());
        let innovation = filter.update_with_motion(&CameraFrame { marks_used: used(n), ..seen }, IMPACTED_B);
        if n > 50 {
            nees_sum += nees(&filter.tracker.track().unwrap().state, angle, rate);
            nis_sum += innovation.normalised_squared().unwrap().to_f64();
        }
    }
    (nees_sum / frames as f64, nis_sum / frames as f64)
}

#[test]
fn law_filter_is_consistent_in_both_precisions() {
    for marks in [1, 2, 3, 8] {
        assert_consistent(|seed| consistency::<f64>(marks, seed, 400));
        assert_consistent(|seed| consistency::<f32>(marks, seed, 400));
    }
}

/// Three marks, of which one or two are missing in half of the frames: the variance of each frame is taken from how
/// many there were.
#[test]
fn law_filter_is_consistent_when_marks_come_and_go() {
    let tuning = of_marks::<f32>(3);
    let used = |n: u64| [3, 1, 0, 2][(n % 4) as usize];
    assert_consistent(|seed| consistency_of(&tuning, used, seed, 400));
}

/// 3,000 turns at 15 rad/s: every turn is counted, and the error is as small in the last as in the first.
#[test]
fn exact_turns_are_counted() {
    let mut filter = ConstantRate::<f32>::new(&ConstantRateTuning::default());
    let rate = 15.0;
    let frames = 3000 * 4189;
    // Every tenth frame suffices at this rate: 15 mrad apart.
    for n in (0..frames).step_by(10) {
        filter.update_with_motion(&frame(n, rate * n as f64 * 1e-4), IMPACTED_B);
    }
    let now = Time::from_nanos((frames - 10) * FRAME_NANOS);
    let estimate = filter.tracker.estimate(now, &filter.process_under(IMPACTED_B)).unwrap();
    let truth = Angle::from_degrees((rate * (frames - 10) as f64 * 1e-4).to_degrees());
    assert!(truth.degrees() > 2999.0 * 360.0);
    assert!(estimate.angle.minus(truth).degrees().abs() < 1e-4, "{}", estimate.angle.minus(truth).degrees());
}

#[test]
fn law_old_frames_and_outliers_change_nothing() {
    let mut filter = ConstantRate::<f32>::new(&ConstantRateTuning::default());
    for n in 1..200 {
        filter.update_with_motion(&frame(n, 0.1), Motion::Quiet);
    }
    let before = filter.tracker.track().unwrap().state;
    let unchanged = |filter: &ConstantRate<f32>| {
        let now = filter.tracker.track().unwrap().state;
        now.at == before.at && now.angle == before.angle && now.covariance == before.covariance
    };
    for (old, why) in
        [(199, Rejection::Duplicate), (180, Rejection::Duplicate), (100, Rejection::OutOfHorizon)]
    {
        let innovation = filter.update_with_motion(&frame(old, 0.1), Motion::Quiet);
        assert_eq!(innovation.verdict, Verdict::Rejected(why));
        assert!(unchanged(&filter));
    }
    let innovation = filter.update_with_motion(&frame(201, 0.2), Motion::Quiet);
    assert_eq!(innovation.verdict, Verdict::Rejected(Rejection::Gate));
    assert!((innovation.innovation_rad - 0.1).abs() < 1e-3);
    assert!(unchanged(&filter));
}

/// The rate changes by up to 20 rad/s between two frames, as when a rotor lands: four frames in a row have to agree on
/// a kick ([`crate::camera::tracker`]), so three are refused at most, with any camera.
#[test]
fn law_a_kick_is_accepted_at_the_fourth_frame() {
    for (marks, change) in
        [1, 2, 8].into_iter().flat_map(|marks| (-20..=20).map(move |change| (marks, change)))
    {
        let mut filter = ConstantRate::<f32>::new(&of_marks(marks));
        let after = 18.0 + f64::from(change);
        let truth = |n: u64| 1e-4 * (18.0 * n.min(300) as f64 + after * n.saturating_sub(300) as f64);
        let mut refused = 0;
        for n in 1..400 {
            let innovation = filter.update_with_motion(&frame(n, truth(n)), IMPACTED_B);
            refused += u32::from(innovation.verdict == Verdict::Rejected(Rejection::Gate));
            if n > 310 {
                let angle = filter.tracker.track().unwrap().state.angle.angle();
                let error = angle.minus(Angle::from_degrees(truth(n).to_degrees()));
                assert!(error.degrees().abs() < 0.06, "{marks} {change} {n} {}", error.degrees());
            }
        }
        assert!(refused <= 3, "{marks} {change}: {refused}");
    }
}

/// Two hundred frames, some of them outliers, in order and shuffled over up to thirty places: the same track, to
/// rounding.
#[test]
fn law_the_order_of_arrival_makes_no_difference() {
    for seed in 0..20 {
        let mut rng = Pcg64::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let (mut angle, mut rate) = (0.0, 12.0);
        let mut frames: Vec<CameraFrame> = Vec::new();
        for n in 1..=200 {
            rate += 0.5 * normal();
            angle += 1e-4 * rate;
            let outlier = if n % 37 == 0 { 0.05 } else { 0.0 };
            frames.push(frame(n, angle + 3e-4 * normal() + outlier));
        }
        let mut places: Vec<(f64, CameraFrame)> = (0..200_u32)
            .map(|n| (f64::from(n) + (9.0 * normal()).clamp(-14.5, 14.5), frames[n as usize]))
            .collect();
        places[0].0 = -100.0;
        places.sort_by(|a, b| a.0.total_cmp(&b.0));
        let end = |frames: &mut dyn Iterator<Item = CameraFrame>| {
            let mut filter = ConstantRate::<f64>::new(&ConstantRateTuning::default());
            for frame in frames {
                let verdict = filter.update_with_motion(&frame, IMPACTED_B).verdict;
                assert!(!matches!(verdict, Verdict::Rejected(Rejection::OutOfHorizon)));
            }
            filter.tracker.track().unwrap().state
        };
        let in_order = end(&mut frames.iter().copied());
        let shuffled = end(&mut places.iter().map(|place| place.1));
        assert!(places.windows(2).any(|pair| pair[0].1.exposed_at > pair[1].1.exposed_at));
        assert_eq!((in_order.at, in_order.angle.angle()), (shuffled.at, shuffled.angle.angle()));
        assert!((in_order.rate_rad_s - shuffled.rate_rad_s).abs() < 1e-12);
        assert_eq!(in_order.covariance, shuffled.covariance);
    }
}

/// A frame older than the lag, kept already or from the future changes nothing. A clock that stands still is not used.
#[test]
fn exact_times_that_cannot_be() {
    let mut filter = ConstantRate::<f64>::new(&ConstantRateTuning::default());
    for n in 1..=100 {
        filter.drive(Time::from_nanos(n * FRAME_NANOS), DriveCommand::full(DriveMode::B));
        filter.update_camera(&frame(n, 1e-3 * n as f64));
    }
    filter.drive(Time::from_nanos(101 * FRAME_NANOS), DriveCommand::full(DriveMode::B));
    let before = filter.tracker.track().unwrap().state;
    for (n, why) in [
        (100, Rejection::Duplicate),
        (69, Rejection::Duplicate),
        (68, Rejection::OutOfHorizon),
        (0, Rejection::OutOfHorizon),
        (112, Rejection::Future),
        (36_000_000, Rejection::Future),
        (u64::MAX / FRAME_NANOS, Rejection::Future),
    ] {
        let innovation = filter.update_camera(&frame(n, 1e-3 * n as f64));
        assert_eq!(innovation.verdict, Verdict::Rejected(why), "{n}");
        let after = filter.tracker.track().unwrap().state;
        assert_eq!((before.at, before.angle, before.covariance), (after.at, after.angle, after.covariance));
    }
    assert_eq!(filter.update_camera(&frame(111, 0.111)).verdict, Verdict::Used);
    // Neither drive nor vibrometer has reported a time since: an outage of ten seconds, in which the turn is lost.
    assert_eq!(filter.update_camera(&frame(100_111, 0.0)).verdict, Verdict::Restarted);
}

/// Frames from a microsecond to ten seconds apart: used, or restarted where the turn is lost; variances positive.
#[test]
fn law_intervals_from_a_microsecond_to_ten_seconds() {
    for interval_nanos in [1_000, 10_000, 1_000_000, 100_000_000, 10_000_000_000] {
        let mut filter = ConstantRate::<f32>::new(&ConstantRateTuning::default());
        for n in 1..=200 {
            let at = Time::from_nanos(n * interval_nanos);
            let seconds = n as f64 * interval_nanos as f64 * 1e-9;
            let angle = Angle::from_degrees((100.0 * seconds).to_degrees()).wrapped();
            let verdict = filter.update_with_motion(&CameraFrame::new(at, angle), IMPACTED_B).verdict;
            let used = matches!(verdict, Verdict::Used | Verdict::Restarted);
            assert!(used || n < 30, "{interval_nanos} {n} {verdict:?}");
            let state = filter.tracker.track().unwrap().state;
            assert!(state.covariance.angle_rad2() > 0.0 && state.covariance.rate_rad2_s2() > 0.0);
        }
    }
}

/// An unusable camera variance is replaced by the default, one below the angle's own resolution is raised to it.
#[test]
fn exact_an_unusable_variance_is_replaced() {
    let default = TrackTuning::<f32>::default().camera_rad2;
    for (given, used) in [
        (0.0, default),
        (-1.0, default),
        (f32::NAN, default),
        (f32::INFINITY, default),
        (1e-40, 1.8e-19),
        (1e-6, 1e-6),
    ] {
        let track = TrackTuning { camera_rad2: given, ..TrackTuning::default() };
        assert!((track.validated().camera_rad2 / used - 1.0).abs() < 1e-6, "{given}");
        let tuning = ConstantRateTuning { track, ..ConstantRateTuning::default() };
        let mut filter = ConstantRate::new(&tuning);
        for n in 1..100 {
            filter.update_with_motion(&frame(n, 1e-3 * n as f64), IMPACTED_B);
        }
        let state = filter.tracker.track().unwrap().state;
        assert!(state.rate_rad_s.is_finite() && state.covariance.angle_rad2() > 0.0);
    }
}

/// At rest P22 is below `u^2` at once and falls by the factor e every m frames to `v_1`. From there its inverse grows
/// by `1 / v_1` a frame up to `n / v_1`, then by the factor e every n frames, to what the process noise allows.
#[test]
fn exact_the_variance_of_the_rate_at_rest_follows_the_ringing() {
    let tuning = ConstantRateTuning::<f64>::default();
    let TrackTuning { ringing_rad2_s2, ringing_frames, stopping_frames, zero_rate_rad2_s2, .. } =
        tuning.track;
    let mut filter = ConstantRate::<f64>::new(&tuning);
    let mut variances = Vec::new();
    for n in 1..2000 {
        filter.update_with_motion(&frame(n, 0.1), Motion::Quiet);
        let track = filter.tracker.track().unwrap();
        if track.resting {
            variances.push(track.state.covariance.rate_rad2_s2());
        }
    }
    assert!(variances.len() + 34 >= 1999, "{}", variances.len());
    assert!(variances[0] < 0.15 * 0.15, "{}", variances[0]);
    let ringing_from = variances.iter().position(|&variance| variance <= ringing_rad2_s2).unwrap();
    let a_frame = (variances[10] / variances[ringing_from - 1]).powf(1.0 / (ringing_from - 11) as f64);
    assert!((a_frame / (1.0 + 1.0 / stopping_frames) - 1.0).abs() < 0.02, "{a_frame}");
    for k in [1, 10, 30] {
        let expected = 1.0 / (1.0 / variances[ringing_from] + k as f64 / ringing_rad2_s2);
        let found = variances[ringing_from + k];
        // The frames add a little information.
        assert!((found / expected - 1.0).abs() < 0.02, "{k}: {found} {expected}");
    }
    let variances = &variances[ringing_from..];
    let fallen = variances[60] / variances[60 + ringing_frames as usize];
    assert!((fallen / (1.0 + 1.0 / ringing_frames).powf(ringing_frames) - 1.0).abs() < 0.02, "{fallen}");
    let least = (tuning.random_walk.resting_rad2_s3 * 1e-4 * zero_rate_rad2_s2).sqrt();
    assert!((variances.last().unwrap() / least - 1.0).abs() < 0.02, "{:?} {least}", variances.last());
}

/// Ten million frames of a rotor that lies still, a thousand seconds, in `f32`: the variances stay positive and above
/// what quantisation and process noise allow, and a rotor that has been moved is found.
#[test]
fn law_a_long_rest_leaves_a_positive_covariance() {
    let tuning = ConstantRateTuning::<f32>::default();
    let mut filter = ConstantRate::<f32>::new(&tuning);
    let mut state = 1_u32;
    let mut shown = |truth: f64| {
        // Noise of three cells, each as likely.
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        truth + 2e-6 / 3.9e-3 * (f64::from((state >> 8) % 3) - 1.0)
    };
    for n in 1..10_000_000 {
        filter.update_with_motion(&frame(n, shown(0.2)), Motion::Quiet);
        let covariance = filter.tracker.track().unwrap().state.covariance;
        let (angle, rate) = (covariance.angle_rad2(), covariance.rate_rad2_s2());
        let correlated = covariance.angle_rate_rad2_s();
        assert!(
            angle > 1e-13 && rate > 1e-12 && correlated * correlated < angle * rate,
            "{n} {covariance:?}"
        );
    }
    for n in 10_000_000..10_000_400 {
        filter.update_with_motion(&frame(n, shown(0.21)), Motion::Quiet);
    }
    let angle = filter.tracker.track().unwrap().state.angle.angle().degrees();
    assert!((angle - 0.21_f64.to_degrees()).abs() < 5e-3, "{angle}");
}

/// Under a slow camera the rate returns to its mean. In the first 50 ms of a motion it wanders five times as much: that
/// is a change of the mode. A step of 4 ms keeps `1 / (1 + x + x^2 / 2)`, `x` a third, of what came before it.
#[test]
fn exact_the_rate_wanders_more_after_a_change_of_mode() {
    let camera = CameraDescription { period_nanos: 20_000_000, ..CameraDescription::default() };
    let instruments = Instruments { camera, ..Instruments::default() };
    let filter = ConstantRate::<f64>::new(&ConstantRateTuning::new(&instruments));
    let x = 4.0 / 12.0;
    let kept: f64 = 1.0 / (1.0 + x + 0.5 * x * x);
    for (millis, factor) in [(0, 5.0), (46, 5.0), (50, 1.0), (60, 1.0)] {
        let at = Time::from_micros(1000 * millis);
        let covariance = AngleRateCovariance::diagonal(0.0, 0.0);
        let angle = AngleAccumulator::at(Angle::ZERO);
        let mut state = State { at, angle, rate_rad_s: 1.0, covariance };
        filter.process_under(IMPACTED_B).carry(&mut state, false, at.plus_nanos(4_000_000));
        let mean_rad_s = filter.mean_rates.rad_s(DriveMode::B, 1.0);
        let expected = [
            kept * kept * 4e-3 * factor * filter.random_walk.impacted_b_rad2_s3,
            mean_rad_s + kept * (1.0 - mean_rad_s),
        ];
        let own = [TrackCovariance::rate_rad2_s2(&state.covariance), state.rate_rad_s];
        for (own, expected) in own.into_iter().zip(expected) {
            assert!((own / expected - 1.0).abs() < 1e-9, "{millis}: {own} {expected}");
        }
    }
}

/// A single mark moved by 50 milli-degrees after a second of rest, without an impact and within the gate: restarted
/// within 20 ms. Without a shift nothing restarts.
#[test]
fn law_a_shift_at_rest_is_found_and_there_is_no_false_one() {
    for (seed, shift_mdeg) in [(1, 50.0), (2, -20.0), (3, 0.0), (4, 0.0), (5, 0.0)] {
        let mut rng = Pcg64::seed_from_u64(seed);
        let mut filter = ConstantRate::<f32>::new(&of_marks(1));
        let mut restarts = 0;
        let truth = |n: u64| (1.0 + if n > 10_000 { 1e-3 * shift_mdeg } else { 0.0_f64 }).to_radians();
        for n in 1..=30_000 {
            let noise: f64 = StandardNormal.sample(&mut rng);
            let cells = ((truth(n) * 3.9e-3 + 1e-6 * noise) / 2e-6).round();
            let verdict = filter.update_with_motion(&frame(n, cells * 2e-6 / 3.9e-3), Motion::Quiet).verdict;
            restarts += u32::from(verdict == Verdict::Restarted);
            if n == 10_200 {
                assert_eq!(restarts, 1 + u32::from(shift_mdeg.abs() > 0.0), "{shift_mdeg}");
            }
        }
        assert_eq!(restarts, 1 + u32::from(shift_mdeg.abs() > 0.0), "{shift_mdeg}");
        let angle = filter.tracker.track().unwrap().state.angle.angle();
        assert!((angle.degrees() - truth(30_000).to_degrees()).abs() < 1e-3, "{}", angle.degrees());
    }
}

/// At rest the error is as large as the reported variance says, with the quantisation of a camera on one mark.
#[test]
fn law_rest_is_measured_to_milli_degrees_and_consistently() {
    let mut worst_ratio = 0.0_f64;
    let mut square_sum = 0.0;
    for seed in 0..200 {
        let mut rng = Pcg64::seed_from_u64(seed);
        let mut filter = ConstantRate::<f32>::new(&of_marks(1));
        let truth = 0.01 * seed as f64;
        for n in 1..=300 {
            let noise: f64 = StandardNormal.sample(&mut rng);
            let cells = ((truth * 3.9e-3 + 1e-6 * noise) / 2e-6).round();
            filter.update_with_motion(&frame(n, cells * 2e-6 / 3.9e-3), Motion::Quiet);
        }
        let estimate = filter
            .tracker
            .estimate(Time::from_nanos(300 * FRAME_NANOS), &filter.process_under(Motion::Quiet))
            .unwrap();
        assert!(estimate.resting);
        let error = estimate.angle.radians_since::<f64>(Angle::from_degrees(truth.to_degrees()));
        worst_ratio = worst_ratio.max(error.abs() / f64::from(estimate.angle_rad2).sqrt());
        square_sum += error * error / f64::from(estimate.angle_rad2);
        assert!(f64::from(estimate.angle_rad2).sqrt().to_degrees() < 1.5e-3);
    }
    // Mean square of 200 standard normals: 1 +- 0.1; quantisation at half a cell of noise biases by under a tenth of a
    // sigma.
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
        let mut filter = ConstantRate::<f32>::new(&ConstantRateTuning::default());
        for (nanos, units, motion) in frames {
            let motion = [IMPACTED_B, Motion::Impacted(DriveMode::C), Motion::Quiet][usize::from(motion)];
            let frame = CameraFrame::new(Time::from_nanos(nanos), Angle::from_units(units));
            let innovation = filter.update_with_motion(&frame, motion);
            prop_assert!(innovation.innovation_rad.is_finite());
            let track = filter.tracker.track().unwrap().state;
            prop_assert!(track.rate_rad_s.is_finite());
            prop_assert!(track.covariance.angle_rad2() > 0.0 && track.covariance.rate_rad2_s2() > 0.0);
        }
    }
}

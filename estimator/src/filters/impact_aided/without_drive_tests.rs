//! The rotor without drive: it is braked, and its rest is measured.

use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;

use super::tests::tuning;
use super::*;
use crate::camera::track_tuning::TrackTuning;
use crate::innovation::{Rejection, Verdict};
use crate::instruments::CameraDescription;
use crate::tests::{FRAME_NANOS, LDV_NANOS, frame, quiet_sample};
use motor_model::Angle;

/// With the drive off friction brakes: the kick is towards rest and not beyond it.
#[test]
fn law_a_rotor_that_lands_is_braked() {
    for rate in [12.0, 0.4, -12.0] {
        let mut filter = ImpactAided::<f64>::new(&tuning());
        filter.update_camera(&frame(1, 0.0));
        let mut state = filter.tracker.track().unwrap().state;
        state.rate_rad_s = rate;
        let kick = filter.impact_kick(Time::from_nanos(FRAME_NANOS), 5e-6, -1e-3, 5e-3);
        kick.apply(&mut state);
        assert!(
            state.rate_rad_s.abs() < rate.abs() && state.rate_rad_s * rate >= 0.0,
            "{}",
            state.rate_rad_s
        );
        assert!(rate.abs() - state.rate_rad_s.abs() <= kick.kick_max_rad_s + 1e-12);
    }
}

/// A rotor that lies quiet on the teeth still slides: an impact brakes it. Once its drive has been off for the time in
/// which a motor of its design settles, some 60 ms, its weight makes the impacts, and they are none.
#[test]
fn law_impacts_of_a_quiet_rotor_brake_it_until_it_has_settled() {
    let mut filter = ImpactAided::<f64>::new(&tuning());
    filter.drive(Time::ZERO, DriveCommand::OFF);
    filter.update_camera(&frame(1, 0.0));
    let impact = VibrometerEvent::Impact { before_m_s: -1e-3, jump_m_s: 5e-3, height_m: 0.0 };
    for n in 1..16_000 {
        filter.update_ldv(&quiet_sample(Time::from_nanos(n * LDV_NANOS)));
        let (at, within) = (Time::from_nanos(n * LDV_NANOS), Some(Time::from_nanos((n - 1) * LDV_NANOS)));
        if [2_000, 6_000, 10_000, 14_000].contains(&n) {
            assert_eq!(filter.watch.motion(at), Motion::Quiet);
            filter.kicks.clear();
            filter.take_detection(&quiet_sample(at), impact, within);
            let slides = at < Time::from_micros(60_000);
            assert_eq!(filter.kicks.len(), usize::from(slides), "{} ns", at.nanos());
        }
    }
}

/// A rotor at rest whose frames are the codes of one mark, 1 s long, and a quiet vibrometer; angle's variance and the
/// last verdict.
fn at_rest(mut code_m: impl FnMut() -> f64) -> (Estimate<f32>, Verdict) {
    let mut one_mark = tuning();
    one_mark.constant_rate.track =
        TrackTuning::new(&CameraDescription { marks: 1, ..CameraDescription::default() });
    let mut filter = ImpactAided::<f32>::new(&one_mark);
    let mut verdict = Verdict::Used;
    for n in 1..=10_000 {
        for k in 0..20 {
            let taken_at = Time::from_nanos(n * FRAME_NANOS - (20 - k) * LDV_NANOS);
            filter.update_ldv(&quiet_sample(taken_at));
        }
        let code_m = 2e-6 * (code_m() / 2e-6).round();
        verdict = filter.update_camera(&frame(n, code_m / 3.9e-3)).verdict;
    }
    (filter.estimate(Time::from_nanos(10_000 * FRAME_NANOS)).unwrap(), verdict)
}

/// One code for ever: the variance stays that of a uniform error, step squared over 12, but for the frames before rest.
#[test]
fn law_one_code_for_ever_keeps_the_quantisation_variance() {
    let (estimate, verdict) = at_rest(|| 1e-7);
    let uniform_rad2 = (2e-6_f64 / 3.9e-3).powi(2) / 12.0;
    assert_eq!(verdict, Verdict::Rejected(Rejection::Repeated));
    assert!(estimate.resting);
    assert!(f64::from(estimate.angle_rad2) > 0.75 * uniform_rad2, "{}", estimate.angle_rad2);
}

/// With dither a second of rest is measured to 0.3 milli-degrees, consistently: 40 rotors, their places spread over a
/// cell.
#[test]
fn law_dithered_rest_is_measured_consistently() {
    let mut square_sum = 0.0;
    for seed in 0..40 {
        let mut rng = Pcg64::seed_from_u64(seed);
        let place = 1e-4 + 2e-6 * seed as f64 / 40.0;
        let (estimate, _) = at_rest(|| {
            let noise: f64 = StandardNormal.sample(&mut rng);
            place + 1e-6 * noise
        });
        let sigma = f64::from(estimate.angle_rad2).sqrt();
        assert!(sigma.to_degrees() < 0.3e-3, "{sigma}");
        let error: f64 = estimate.angle.radians_since(Angle::from_degrees((place / 3.9e-3).to_degrees()));
        square_sum += (error / sigma).powi(2) / 40.0;
    }
    // Mean of 40 chi-squares: 1 +- 0.22.
    assert!((square_sum - 1.0).abs() < 0.66, "{square_sum}");
}

//! The camera against its model, fault by fault.

use motor_model::math;

use super::*;
use crate::world::rotor_path::RotorPoint;

fn camera(sets: &[&str]) -> Camera {
    let sets: Vec<String> = sets.iter().map(|&set| set.to_owned()).collect();
    Camera::new(&Scene::of_sets(&sets).unwrap())
}

/// A level rotor at `angle`.
fn level(angle: Angle) -> Shown {
    Shown { angle, pose: Pose::LEVEL }
}

fn seen_deg(camera: &mut Camera, degrees: f64) -> f64 {
    camera.expose(Time::ZERO, level(Angle::from_degrees(degrees)));
    camera.arrived(Time::from_micros(1000)).unwrap().angle.degrees()
}

/// A single mark's arc is in whole cells.
#[test]
fn exact_quantisation_without_noise() {
    let mut camera = camera(&["camera.marks=1", "camera.noise_m=0"]);
    let cell_deg = (2e-6_f64 / 3.9e-3).to_degrees();
    for (given, cells) in [(0.0, 0.0), (0.4 * cell_deg, 0.0), (0.6 * cell_deg, 1.0), (-7.4 * cell_deg, -7.0)]
    {
        assert!((seen_deg(&mut camera, given) - cells * cell_deg).abs() < 1e-6, "{given}");
    }
    assert!(
        (seen_deg(&mut camera, 720.0 + 7.0 * cell_deg) - 7.0 * cell_deg).abs() < 1e-6,
        "whole turns are not seen"
    );
}

/// A single mark is followed along its arc: the frames are the formula at the head of the camera, to the last bit.
#[test]
fn dual_frames_of_a_single_mark_are_those_of_its_arc() {
    let mut camera = camera(&["camera.marks=1", "seed=7"]);
    let mut noise = random_streams::stream(7, RandomSource::Camera);
    for n in 0..2000_u64 {
        let angle = Angle::from_degrees(0.37 * n as f64);
        camera.expose(Time::from_micros(100 * n), level(angle));
        let error: f64 = StandardNormal.sample(&mut noise);
        let arc_m = 3.9e-3 * angle.wrapped().radians_since::<f64>(Angle::ZERO) + 1e-6 * error;
        let seen_m = 2e-6 * (arc_m / 2e-6).round();
        let expected = Angle::from_degrees((seen_m / 3.9e-3).to_degrees()).wrapped();
        let frame = camera.arrived(Time::from_micros(100 * n + 100)).unwrap();
        assert_eq!((frame.angle, frame.marks_used), (expected, 1), "{n}");
    }
}

/// 7 um across the arc of a single mark are 7 um / 3.9 mm of angle, 103 milli-degrees; along its radius nothing.
#[test]
fn exact_a_shift_of_a_single_mark_is_an_angle() {
    let frame = |marks, shift_m: [f64; 2]| {
        let clearance = "estimator.assumed.hub.clearance_m=7e-6";
        let mut camera = camera(&[marks, "camera.noise_m=0", "camera.resolution_m=0", clearance]);
        let pose = Pose { shift_m, ..Pose::LEVEL };
        camera.expose(Time::ZERO, Shown { angle: Angle::from_degrees(90.0), pose });
        camera.arrived(Time::from_micros(100)).unwrap().angle.degrees() - 90.0
    };
    // At 90 degrees clockwise the mark stands on the negative y axis; a shift to the right turns it counter-clockwise.
    let alias_deg = math::atan2(7e-6, 3.9e-3).to_degrees();
    assert!((alias_deg - 0.1028).abs() < 1e-4);
    assert!((frame("camera.marks=1", [7e-6, 0.0]) + alias_deg).abs() < ROUNDED_DEG);
    assert!(frame("camera.marks=1", [0.0, 7e-6]).abs() < ROUNDED_DEG);
    assert!(frame("camera.marks=2", [7e-6, 0.0]).abs() < ROUNDED_DEG);
}

/// Gaussian noise of 1 um and uniform quantisation of 2 um add as variances: 1 + 4/12 um^2, 17 milli-degrees at 3.9 mm.
/// The angle of several marks has the mean of their independent errors.
#[test]
fn law_noise_has_the_variance_of_tracking_and_quantisation() {
    let n = 40_000;
    for marks in [1, 2, 3, 8] {
        let mut camera = camera(&[&format!("camera.marks={marks}")]);
        // Truth moves by an irrational part of a cell, so that quantisation errors are uniform.
        let errors = (0..n).map(|i| {
            let truth = f64::from(i) * 0.007_639_320_225;
            let error = seen_deg(&mut camera, truth) - Angle::from_degrees(truth).wrapped().degrees();
            Angle::from_degrees(error).wrapped().degrees()
        });
        let mean_square = errors.map(|e| e * e).sum::<f64>() / f64::from(n);
        let one_deg2 =
            (1e-12_f64 + 4e-12 / 12.0) / (3.9e-3 * 3.9e-3) * 1_f64.to_degrees() * 1_f64.to_degrees();
        // The variance of 40,000 squares of a normal is known to 0.7 %.
        let ratio = mean_square * f64::from(marks) / one_deg2;
        assert!((ratio - 1.0).abs() < 0.03, "{marks}: {ratio}");
        assert!((math::sqrt(mean_square * f64::from(marks)) - 0.017).abs() < 0.0005);
    }
}

#[test]
fn exact_a_frame_arrives_one_frame_late_and_once() {
    let mut camera = camera(&[]);
    camera.expose(Time::from_micros(500), level(Angle::ZERO));
    assert!(camera.arrived(Time::from_micros(599)).is_none());
    assert_eq!(camera.arrived(Time::from_micros(600)).unwrap().exposed_at, Time::from_micros(500));
    assert!(camera.arrived(Time::from_micros(700)).is_none());
}

/// Frames exposed every 100 us on a rotor at rest, in order of arrival, with the times of arrival in us.
fn delivered(sets: &[&str], frames: u64) -> Vec<(u64, CameraFrame)> {
    let mut camera = camera(sets);
    let mut delivered = Vec::new();
    for n in 0..frames + 100 {
        let now = Time::from_micros(100 * n);
        if n < frames {
            camera.expose(now, level(Angle::ZERO));
        }
        delivered.extend(std::iter::from_fn(|| camera.arrived(now)).map(|frame| (100 * n, frame)));
    }
    delivered
}

fn stamps_us(delivered: &[(u64, CameraFrame)]) -> Vec<u64> {
    delivered.iter().map(|(_, frame)| frame.exposed_at.nanos() / 1000).collect()
}

/// Frames without noise of a rotor at `degrees` of the time in s, in steps of `step_nanos`.
fn followed(sets: &[&str], step_nanos: u64, nanos: u64, degrees: impl Fn(f64) -> f64) -> Vec<CameraFrame> {
    let exact = ["camera.noise_m=0", "camera.resolution_m=0", "camera.latency_frames=0"];
    let mut camera = camera(&[exact.as_slice(), sets].concat());
    let point = |nanos: u64| RotorPoint {
        at: Time::from_nanos(nanos),
        angle: Angle::from_degrees(degrees(1e-9 * nanos as f64)),
        ..RotorPoint::default()
    };
    for step in 0..nanos / step_nanos {
        let [from, until] = [step, step + 1].map(|step| point(step * step_nanos));
        // As the rig does: only when it is due.
        if until.at >= camera.due() {
            camera.follow(&RotorPath { from, until, struck: false });
        }
    }
    std::iter::from_fn(|| camera.arrived(Time::from_nanos(nanos))).collect()
}

/// Angles are in units of 2^-32 turn, 8.4e-8 degrees: the rotor's at both steps, the one between, the mean, and the
/// camera's arc are each rounded to one.
const ROUNDED_DEG: f64 = 3.0 * 8.4e-8;

/// A frame of a rotor in uniform rotation shows the angle at its stamp, wherever it lies between two steps, and blur
/// does not change it.
#[test]
fn exact_frames_of_uniform_rotation_at_any_rate() {
    let at = |t_s: f64| -20.0 + 613.0 * t_s;
    for sets in [
        &["camera.frame_rate_hz=60"][..],
        &["camera.frame_rate_hz=3000", "camera.phase_frames=0.123"],
        &["camera.frame_rate_hz=29.97", "camera.phase_frames=0.5"],
        &["camera.frame_rate_hz=60", "camera.exposure_frames=0.96"],
        &["camera.frame_rate_hz=29.97", "camera.exposure_frames=1", "camera.phase_frames=0.25"],
        &["camera.frame_rate_hz=3000", "camera.exposure_frames=0.7", "camera.period_jitter_s=2e-5"],
        &["camera.frame_rate_hz=1e5", "camera.exposure_frames=0.05"],
    ] {
        let frames = followed(sets, 1000, 500_000_000, at);
        assert!(frames.len() >= 14, "{sets:?}");
        for frame in frames {
            let expected_deg = at(1e-9 * frame.exposed_at.nanos() as f64);
            let off = frame.angle.minus(Angle::from_degrees(expected_deg)).wrapped().degrees();
            // The middle of an exposure of an odd number of ns is half a ns from its stamp.
            let stamp_deg = 613.0 * 0.5e-9;
            assert!(off.abs() < ROUNDED_DEG + stamp_deg, "{sets:?} {frame:?}: {off:e}");
        }
    }
}

/// An exposure of 16 ms over a curved course is its closed form, in 16,000 steps and in 1,600.
#[test]
fn exact_blur_of_a_slow_camera() {
    let (rate_deg_s, curve_deg_s2) = (900.0, 4e3);
    let at = |t_s: f64| rate_deg_s * t_s + 0.5 * curve_deg_s2 * t_s * t_s;
    for step_nanos in [1000, 10_000] {
        let frames =
            followed(&["camera.frame_rate_hz=50", "camera.exposure_frames=0.8"], step_nanos, 20_000_000, at);
        let [frame] = frames[..] else { panic!("{frames:?}") };
        assert_eq!(frame.exposed_at, Time::from_micros(12_000));
        let step_s = 1e-9 * step_nanos as f64;
        let blurred = at(12e-3) + curve_deg_s2 * (16e-3 * 16e-3 / 24.0 + step_s * step_s / 12.0);
        assert!((frame.angle.degrees() - blurred).abs() < ROUNDED_DEG, "{}", frame.angle.degrees() - blurred);
    }
}

/// Latency is the frames and the seconds, from the end of the exposure.
#[test]
fn exact_latency_in_frames_and_in_seconds() {
    let sets = ["camera.frame_rate_hz=60", "camera.latency_frames=2", "camera.latency_s=5e-3"];
    let mut camera = camera(&sets);
    camera.expose(Time::from_micros(500), level(Angle::ZERO));
    let arrives_at = Time::from_nanos(500_000 + 33_333_333 + 5_000_000);
    assert!(camera.arrived(Time::from_nanos(arrives_at.nanos() - 1)).is_none());
    assert!(camera.arrived(arrives_at).is_some());
}

/// Over an exposure T that ends at t, the mean of a + w t + c t^2 / 2 is its value at the middle and c T^2 / 24 more.
#[test]
fn exact_blur_is_the_mean_over_the_exposure() {
    let (rate_deg_s, curve_deg_s2) = (900.0, 4e7);
    let at = |t_s: f64| 100.0 + rate_deg_s * t_s + 0.5 * curve_deg_s2 * t_s * t_s;
    let frames = followed(&["camera.exposure_frames=0.5"], 1000, 100_000, at);
    let [frame] = frames[..] else { panic!("{frames:?}") };
    assert_eq!(frame.exposed_at, Time::from_micros(75));
    let blurred = at(75e-6) + curve_deg_s2 * 50e-6 * 50e-6 / 24.0;
    // Trapezia of 1 us add c h^2 / 12; units of 2^-32 turn are 8.4e-8 degrees.
    let trapezia = curve_deg_s2 * 1e-12 / 12.0;
    assert!((frame.angle.degrees() - blurred - trapezia).abs() < 2e-7, "{}", frame.angle.degrees());
}

/// A mean of probability p over n frames is known to sqrt(p (1 - p) / n).
#[test]
fn law_dropped_and_duplicated_frames_are_as_many_as_they_should() {
    let n = 20_000;
    let dropped = delivered(&["camera.drop_probability=0.3"], n);
    assert!(dropped.len().abs_diff(14_000) < 260, "{}", dropped.len());
    let twice = delivered(&["camera.duplicate_probability=0.3"], n);
    assert!(twice.len().abs_diff(26_000) < 260, "{}", twice.len());
    let repeats = twice.windows(2).filter(|pair| pair[0] == pair[1]).count();
    assert_eq!(repeats, twice.len() - 20_000, "the second is the first again");
    assert!(delivered(&["camera.drop_probability=1"], 10).is_empty());
}

/// Without noise, a part p of outliers of deviation s is a root mean square of s sqrt p.
#[test]
fn law_outliers_have_their_frequency_and_size() {
    let only = ["camera.noise_m=0", "camera.resolution_m=0", "camera.outlier_m=2e-4"];
    let sets = [only.as_slice(), &["camera.outlier_probability=0.1"]].concat();
    let frames = delivered(&sets, 40_000);
    let arcs_m: Vec<f64> = frames.iter().map(|(_, f)| 3.9e-3 * f.angle.degrees().to_radians()).collect();
    let outliers = arcs_m.iter().filter(|arc_m| arc_m.abs() > 0.0).count();
    assert!(outliers.abs_diff(4000) < 240, "{outliers}");
    let mean_square = arcs_m.iter().map(|arc_m| arc_m * arc_m).sum::<f64>() / 4e4;
    assert!((mean_square / (0.1 * 4e-8) - 1.0).abs() < 0.15, "{mean_square}");
}

#[test]
fn law_stamps_are_off_by_their_jitter_and_the_angle_is_not() {
    let frames = delivered(&["camera.stamp_jitter_s=1e-5"], 20_000);
    let errors_us: Vec<f64> = (frames.iter().enumerate().skip(10))
        .map(|(n, (_, frame))| 1e-3 * frame.exposed_at.nanos() as f64 - 100.0 * n as f64)
        .collect();
    let mean = errors_us.iter().sum::<f64>() / 2e4;
    let mean_square = errors_us.iter().map(|e| e * e).sum::<f64>() / 2e4;
    assert!(mean.abs() < 0.3 && (mean_square / 100.0 - 1.0).abs() < 0.05, "{mean} {mean_square}");
    let without = delivered(&[], 20_000);
    assert!(frames.iter().zip(&without).all(|(a, b)| a.1.angle == b.1.angle && a.0 == b.0));
}

/// Half of the frames come 1, 2 or 3 periods later: 100 us of latency and 0.5 * 200 us on average, and some are
/// overtaken.
#[test]
fn law_late_frames_are_overtaken_and_none_is_lost() {
    let frames = delivered(&["camera.late_probability=0.5"], 20_000);
    let mut stamps = stamps_us(&frames);
    assert!(stamps.windows(2).any(|pair| pair[0] > pair[1]), "out of order");
    let mean_us =
        frames.iter().zip(&stamps).map(|((arrived, _), stamp)| arrived - stamp).sum::<u64>() as f64 / 2e4;
    assert!((mean_us - 200.0).abs() < 4.0, "{mean_us}");
    let latest = frames.iter().zip(&stamps).map(|((arrived, _), stamp)| arrived - stamp).max();
    assert_eq!(latest, Some(400));
    stamps.sort_unstable();
    assert_eq!(stamps, (0..20_000).map(|n| 100 * n).collect::<Vec<_>>());
}

#[test]
fn exact_a_lost_camera_delivers_nothing_of_the_loss() {
    let frames = delivered(&["camera.lost_from_s=0.001", "camera.lost_until_s=0.002"], 30);
    let expected: Vec<u64> = (0..30).filter(|n| !(10..20).contains(n)).map(|n| 100 * n).collect();
    assert_eq!(stamps_us(&frames), expected);
}

/// Pictures 1 ms long from 1 ms on: the last one, zero, or ten degrees further; before and after as without a fault.
#[test]
fn exact_faulty_pictures() {
    let good = delivered(&[], 30);
    let ten = Angle::from_degrees(10.0);
    for (fault, expected) in [
        ("camera.fault=stuck", (|frames, _| frames[9].1.angle) as fn(&[(u64, CameraFrame)], Angle) -> Angle),
        ("camera.fault=zeros", |_, _| Angle::ZERO),
        ("camera.fault=offset", |_, further| further),
    ] {
        let span = ["camera.fault_from_s=0.001", "camera.fault_until_s=0.002"];
        let sets = [fault, span[0], span[1], "camera.fault_offset_deg=10"];
        for (n, (faulty, good_one)) in delivered(&sets, 30).iter().zip(&good).enumerate() {
            let angle = if (10..20).contains(&n) {
                expected(&good, good_one.1.angle.plus(ten).wrapped())
            } else {
                good_one.1.angle
            };
            assert_eq!((faulty.1.angle, faulty.0), (angle, good_one.0), "{fault} {n}");
        }
    }
}

/// A fault does not change the draws of the others and of the noise.
#[test]
fn law_faults_do_not_shift_the_noise() {
    let without = delivered(&[], 1000);
    for set in
        ["camera.drop_probability=0.5", "camera.late_probability=0.5", "camera.outlier_probability=0.01"]
    {
        let disturbed = delivered(&[set], 1000);
        let same = disturbed.iter().filter(|(_, frame)| without.iter().any(|(_, other)| other == frame));
        assert!(same.count() * 100 >= 95 * disturbed.len(), "{set}");
    }
}

/// Within its time a camera loses half of its frames, or delivers them 5 ms later with the stamps that they have; the
/// frames that come are those without a fault.
#[test]
fn law_intermittent_and_delayed_frames() {
    let good = delivered(&[], 20_000);
    let half = delivered(&["faults=camera:intermittent:0.5@0.5..1.5"], 20_000);
    let during = |frames: &[(u64, CameraFrame)]| {
        frames
            .iter()
            .filter(|(_, frame)| (500_000..1_500_000).contains(&(frame.exposed_at.nanos() / 1000)))
            .count()
    };
    // Of 10,000 draws the count is known to 50.
    assert!(during(&good) == 10_000 && during(&half).abs_diff(5000) < 200, "{}", during(&half));
    assert_eq!(good.len() - half.len(), during(&good) - during(&half));
    assert!(half.iter().all(|frame| good.contains(frame)));
    let late = delivered(&["faults=camera:delayed:5e-3@0.5..1.5"], 20_000);
    let stamps = |frames: &[(u64, CameraFrame)]| {
        let mut stamps = stamps_us(frames);
        stamps.sort_unstable();
        stamps
    };
    assert_eq!(stamps(&late), stamps(&good));
    for (arrived_us, frame) in &late {
        let stamp_us = frame.exposed_at.nanos() / 1000;
        let delay_us = if (500_000..1_500_000).contains(&stamp_us) { 5000 } else { 0 };
        assert_eq!(*arrived_us, stamp_us + 100 + delay_us);
    }
}

/// A tenth of the frames within the time is wrong by as much as the scene's outliers are.
#[test]
fn law_outliers_of_a_fault_have_their_time_and_size() {
    let good = delivered(&[], 20_000);
    let faulty = delivered(&["faults=camera:outliers:0.1@1..", "camera.outlier_m=2e-4"], 20_000);
    let off_m: Vec<f64> = (good.iter().zip(&faulty))
        .map(|((_, good), (_, faulty))| 3.9e-3 * faulty.angle.minus(good.angle).degrees().to_radians())
        .collect();
    let wrong = off_m.iter().filter(|off| off.abs() > 0.0).count();
    assert!(off_m[..10_000].iter().all(|off| off.abs() <= 0.0));
    // 1,000 +- 30; those below the resolution of 2 um are not seen: less than one in a hundred.
    assert!(wrong.abs_diff(1000) < 140, "{wrong}");
    let mean_square = off_m.iter().map(|off| off * off).sum::<f64>() / 1e4;
    assert!((mean_square / (0.1 * 4e-8) - 1.0).abs() < 0.25, "{mean_square}");
}

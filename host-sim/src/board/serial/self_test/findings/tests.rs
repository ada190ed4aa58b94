//! Each finding at its bound, and just beyond.

use link::{CameraAges, VelocitySums};

use super::*;

/// The vibrometer's sums of a self-test's samples at `mean_m_s` plus and minus `sd_m_s`.
fn velocity(mean_m_s: f32, sd_m_s: f32) -> VelocitySums {
    let mut sums = VelocitySums::default();
    for _ in 0..10_000 {
        sums.add(mean_m_s + sd_m_s);
        sums.add(mean_m_s - sd_m_s);
    }
    sums
}

/// A board without fault on the default bench, whose camera has 10,000 frames a second.
fn healthy() -> SelfTestReport {
    SelfTestReport {
        amplifier_works: true,
        has_converter: true,
        ticks: 10_000,
        late_ticks: 0,
        velocity: velocity(0.0, 2e-4),
        camera: CameraAges { frames: 1_000, youngest_nanos: 100_000, oldest_nanos: 2_000_000 },
        stack_bytes_max: 6_000,
        stack_bytes: 7_024,
    }
}

/// What is not good of `report` on the default bench, each with a hint.
fn failed(report: &SelfTestReport) -> Vec<&'static str> {
    let found = findings(report, &Instruments::default(), 1e3);
    assert_eq!(found.len(), 5);
    assert!(found.iter().all(|finding| finding.ok == finding.hint.is_none()), "{found:?}");
    found.iter().filter(|finding| !finding.ok).map(|finding| finding.of).collect()
}

#[test]
fn exact_a_healthy_board_passes_and_each_fault_fails_its_own_finding() {
    assert!(failed(&healthy()).is_empty());
    assert_eq!(failed(&SelfTestReport { amplifier_works: false, ..healthy() }), ["amplifier"]);
    assert_eq!(failed(&SelfTestReport { late_ticks: 1, ..healthy() }), ["ticks"]);
    assert_eq!(failed(&SelfTestReport { stack_bytes_max: 6_001, ..healthy() }), ["stack"]);
    assert_eq!(failed(&SelfTestReport { stack_bytes_max: 9_000, ..healthy() }), ["stack"]);
    assert!(failed(&SelfTestReport { stack_bytes: 0, stack_bytes_max: 0, ..healthy() }).is_empty());
    assert_eq!(failed(&SelfTestReport { has_converter: false, ..healthy() }), ["vibrometer"]);
}

/// Rest is what the filters take for rest: 0.57 mm/s of a signal beyond noise of 0.2 mm/s, as (F7) has it. An offset
/// counts from the largest that is described.
#[test]
fn exact_the_vibrometer_has_to_show_rest() {
    let with = |velocity| SelfTestReport { velocity, ..healthy() };
    let limit_m_s = math::sqrt_f32(0.36e-6 - 0.36 * 0.04e-6);
    assert!((limit_m_s - 0.588e-3).abs() < 1e-6, "{limit_m_s}");
    assert!(failed(&with(velocity(0.99 * limit_m_s, 2e-4))).is_empty());
    assert_eq!(failed(&with(velocity(-1.01 * limit_m_s, 2e-4))), ["vibrometer"]);
    let noisy = |part: f32| math::sqrt_f32(4e-8 + part * part * limit_m_s * limit_m_s);
    assert!(failed(&with(velocity(0.0, noisy(0.99)))).is_empty());
    assert_eq!(failed(&with(velocity(0.0, noisy(1.01)))), ["vibrometer"]);
    let one_beyond = VelocitySums { samples: 19_999, ..velocity(0.0, 2e-4) };
    for dead in [velocity(1e-4, 0.0), VelocitySums::default(), one_beyond] {
        assert_eq!(failed(&with(dead)), ["vibrometer"], "{dead:?}");
    }
    let bias_max_m_s = 1e-3;
    let described = VibrometerDescription { bias_max_m_s, ..VibrometerDescription::default() };
    let instruments = Instruments { vibrometer: Some(described), ..Instruments::default() };
    for (mean_m_s, ok) in [(1.5e-3, true), (1.7e-3, false)] {
        let found = findings(&with(velocity(mean_m_s, 2e-4)), &instruments, 0.0);
        assert_eq!(found[3].ok, ok, "{found:?}");
    }
    let none = Instruments { vibrometer: None, ..Instruments::default() };
    let found = findings(&SelfTestReport { has_converter: false, ..healthy() }, &none, 0.0);
    assert_eq!(
        found[3].to_string(),
        "vibrometer         pass: the scene has none; the board has no converter"
    );
}

#[test]
fn exact_the_camera_has_to_be_there_in_time() {
    let with = |frames, youngest_nanos, oldest_nanos| {
        let camera = CameraAges { frames, youngest_nanos, oldest_nanos };
        failed(&SelfTestReport { camera, ..healthy() })
    };
    let latest_nanos = Instruments::default().camera.latency_nanos.cast_signed() + 10_000_000;
    assert!(with(500, 0, latest_nanos).is_empty());
    assert_eq!(with(499, 0, latest_nanos), ["camera"]);
    assert_eq!(with(0, 0, 0), ["camera"]);
    assert_eq!(with(500, 0, latest_nanos + 1_000), ["camera"]);
    // The clock is known to 1 us.
    assert!(with(500, -1_000, 0).is_empty());
    assert_eq!(with(500, -1_001, 0), ["camera"]);
}

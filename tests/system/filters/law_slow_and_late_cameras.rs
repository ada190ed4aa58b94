//! Cameras whose frames are few or come late: no filter takes what it does not know for known.

use estimator::{Rejection, Verdict};
use motor_model::DriveCommand;

use crate::support::fault_bench::{B, Bench, NONE, assert_never_false};

/// Frames come 24.9 ms late, which is the longest latency for which the filters keep the impacts of a driven rotor. Of
/// a rotor at rest no impacts are kept: what its weight makes are none. So each frame is used, but one in 10^5 that is
/// beyond the gate by chance.
#[test]
fn law_late_frames_of_a_rotor_at_rest_are_used() {
    let mut bench = Bench::described(&["camera.latency_s=0.0249"]);
    bench.run(B, 50, NONE);
    bench.run(DriveCommand::OFF, 250, NONE);
    for look in bench.run(DriveCommand::OFF, 300, NONE) {
        let used = look.verdict.is_none_or(|verdict| {
            matches!(verdict, Verdict::Used | Verdict::Rejected(Rejection::Gate | Rejection::Repeated))
        });
        assert!(used, "{look:?}");
    }
}

/// A rotor that has never been driven before a camera of 30 frames a second, and of 10: it has not turned round between
/// two frames, however little is known of its rate. So every frame after the first is used.
#[test]
fn law_a_rotor_at_rest_does_not_turn_between_slow_frames() {
    for frame_rate in ["camera.frame_rate_hz=30", "camera.frame_rate_hz=10"] {
        let mut bench = Bench::described(&[frame_rate]);
        bench.run(DriveCommand::OFF, 400, NONE);
        for look in bench.run(DriveCommand::OFF, 1000, NONE) {
            assert!(look.verdict != Some(Verdict::Restarted), "{frame_rate}: {look:?}");
        }
    }
}

/// The drive goes on with the filters, before a camera of 200 frames a second. The impacts until the first frame has
/// arrived kick a rotor of which no filter knows anything: from its exposure to its arrival, 5 ms, the rate wanders as
/// by the camera alone. No filter is off by more than six standard deviations and calls that good.
#[test]
fn law_kicks_before_the_first_frame_are_not_known() {
    for seed in 1..=8 {
        let seed = format!("seed={seed}");
        let mut bench = Bench::described(&["camera.frame_rate_hz=200", "camera.marks=2", &seed]);
        assert_never_false(&bench.run(B, 150, NONE));
    }
}

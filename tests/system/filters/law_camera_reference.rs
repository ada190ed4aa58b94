//! What the angle counts from: frames that jump, jump back or stick, and a rotor that is jolted. Each after 100 ms of
//! good frames in mode B, unless it says otherwise.

use estimator::{Reason, Verdict};
use motor_model::DriveCommand;
use simulation::runs::filter::FILTERS;

use crate::support::fault_bench::{
    B, Bench, Look, NONE, assert_never_false, assert_within_ms, by_filter, delays_ms,
};

/// 100 ms of good measurements.
fn settled(sets: &[&str]) -> Bench {
    Bench::driven(sets, B)
}

/// E4: frames that are off from now on, by 5 to 180 degrees, are refused, and within 0.5 ms the estimate is not to be
/// used. After 20 frames it begins anew where they say, and stays of no use: what the angle counts from is lost.
#[test]
fn law_a_jump_that_lasts_loses_the_reference() {
    for offset_deg in [-5.0, 20.0, 180.0] {
        let offset = format!("camera.fault_offset_deg={offset_deg}");
        let mut bench = settled(&["camera.fault=offset", "camera.fault_from_s=0.1", &offset]);
        let looks = bench.run(B, 5, NONE);
        for (name, delay) in delays_ms(&looks, |look| look.is_unusable(Reason::FramesRefused)) {
            assert!(delay <= 0.5, "{name}: {delay} ms");
        }
        for (name, delay) in delays_ms(&looks, |look| look.verdict == Some(Verdict::Restarted)) {
            assert!((1.9..2.2).contains(&delay), "{name}: {delay} ms");
        }
        for command in [B, DriveCommand::OFF] {
            let looks = bench.run(command, 50, NONE);
            let other = looks.iter().find(|look| !look.is_unusable(Reason::ReferenceLost));
            assert!(other.is_none(), "{offset_deg}: {other:?}");
        }
    }
}

/// A jump of 0.8 degrees that lasts. A track that refuses frames becomes uncertain, and would take these in after some:
/// that is no reason to believe them. The filter that allows a kick of any size at an impact takes so small a jump for
/// such kicks.
#[test]
fn law_a_jump_is_not_believed_because_the_track_has_become_uncertain() {
    let fault = ["camera.fault=offset", "camera.fault_from_s=0.1", "camera.fault_offset_deg=0.8"];
    let mut bench = settled(&fault);
    bench.run(B, 5, NONE);
    let looks = bench.run(B, 50, NONE);
    let mut of_others = looks.iter().filter(|look| look.name != "impact_aided");
    let other = of_others.find(|look| !look.is_unusable(Reason::ReferenceLost));
    assert!(other.is_none(), "{other:?}");
}

/// A jump of 20 degrees that lasts for 5 ms: when the frames jump back to where the rotor was going, the reference is
/// found again within as many frames as show a jump, and the angle is good within 20 ms: so long the mean of the
/// innovations tells of the frames that were refused.
#[test]
fn law_frames_that_jump_back_find_the_reference_again() {
    for until_s in ["0.103", "0.105"] {
        let until = format!("camera.fault_until_s={until_s}");
        let offset = ["camera.fault=offset", "camera.fault_from_s=0.1", &until, "camera.fault_offset_deg=20"];
        let mut bench = settled(&offset);
        let looks = bench.run(B, 40, NONE);
        assert!(looks.iter().any(|look| look.is_unusable(Reason::ReferenceLost)));
        let looks = &looks[800 * FILTERS.len()..];
        assert_within_ms(15.0, looks, Look::is_good);
        assert!(looks.iter().all(|look| !look.is_unusable(Reason::ReferenceLost)));
        assert_never_false(looks);
    }
}

/// A rotor that is jolted by 60 rad/s, more than a kick explains, has not lost its reference: its angle goes on from
/// where it was.
#[test]
fn law_a_jolt_keeps_the_reference() {
    let mut bench = settled(&["fault.jolt_rad_s=60", "fault.from_s=0.1"]);
    let looks = bench.run(B, 30, NONE);
    assert!(looks.iter().any(|look| look.verdict == Some(Verdict::Restarted)), "no kick explains it");
    assert!(looks.iter().all(|look| !look.is_unusable(Reason::ReferenceLost)));
    assert_within_ms(10.0, &looks[300 * FILTERS.len()..], Look::is_good);
    // A lost turn were 360 degrees, and a lost reference the 0.3 degrees of a tenth of a millisecond.
    let last = &looks[looks.len() - FILTERS.len()..];
    assert!(last.iter().all(|look| look.error_mdeg() < 100.0), "{last:?}");
}

/// E6: the last picture for ever, while the rotor turns. Found within 2.2 ms, which are 20 equal codes, a latency of
/// one frame and one frame until the first of them; its frames taken back and refused; good again when pictures change,
/// or a new start if it took long.
#[test]
fn law_a_stuck_camera_is_found_and_its_frames_taken_back() {
    let mut bench = settled(&["camera.fault=stuck", "camera.fault_from_s=0.1", "camera.fault_until_s=0.12"]);
    let looks = bench.run(B, 20, NONE);
    assert_within_ms(2.2, &looks, |look| look.is_unusable(Reason::CameraStuck));
    for looks in by_filter(&looks) {
        let late = looks.iter().skip(1000).all(|look| look.is_unusable(Reason::CameraStuck));
        assert!(late, "{}: {:?}", looks[0].name, looks[1500]);
    }
    let looks = bench.run(B, 20, NONE);
    assert_within_ms(5.0, &looks, Look::is_good);
}

/// A camera of three marks shows the code zero for 40 ms. Of a camera with so little noise twenty equal codes are no
/// proof, so the filters begin anew at the code. When it is known to be stuck they are
/// again where they were before it, and good within the 20 ms for which the mean of the innovations tells of the code.
#[test]
fn law_a_code_that_proves_stuck_takes_back_the_restart() {
    let fault =
        ["camera.marks=3", "camera.fault=zeros", "camera.fault_from_s=0.1", "camera.fault_until_s=0.14"];
    let mut bench = Bench::described(&fault);
    bench.run(B, 100, NONE);
    let looks = bench.run(B, 40, NONE);
    assert!(looks.iter().any(|look| look.is_unusable(Reason::ReferenceLost)));
    let last = &looks[looks.len() - FILTERS.len()..];
    assert!(last.iter().all(|look| look.is_unusable(Reason::CameraStuck)), "{last:?}");
    let looks = bench.run(B, 30, NONE);
    assert_within_ms(20.0, &looks, Look::is_good);
    assert_never_false(&looks);
}

/// A camera that sticks beside a rotor at rest, which is then driven for 10 ms and rests elsewhere: what the camera
/// repeats is not taken for the new place, however quiet the rotor lies there.
#[test]
fn law_a_camera_that_stuck_before_a_drive_is_not_believed_after_it() {
    let mut bench = settled(&["camera.fault=stuck", "camera.fault_from_s=0.25"]);
    bench.run(DriveCommand::OFF, 170, NONE);
    bench.run(B, 10, NONE);
    let looks = bench.run(DriveCommand::OFF, 200, NONE);
    let other = looks.iter().find(|look| !look.is_unusable(Reason::CameraStuck));
    assert!(other.is_none(), "{other:?}");
}

//! `host-sim jog` and `host-sim self-test`: on the emulated board, behind a pseudo-terminal.

use std::process::{Command, Output, Stdio};

use link::{BoardFault, BoardMessage, JogReport};
use serde_json::Value;

use crate::cabled_board::{CabledBoard, Disturbance};
use crate::programs::host_sim;
use crate::starved::not_starved;
use crate::{refusal, refused};

/// Either mode is on for its time. The simulated rotor turns its way, by what the map of its design says of a drawn
/// motor: within four standard deviations over motors.
#[test]
fn tool_jog_turns_the_rotor_the_way_of_its_mode() {
    for (mode, sign) in [("B", 1.0), ("C", -1.0)] {
        let jog = ["--mode", mode, "--level", "1", "--duration", "0.05", "--format", "json"];
        let (board, Output { status, stdout, stderr }) = not_starved(|| {
            let board = CabledBoard::start_in_real_time();
            let output = board.command("jog", &jog).wait_with_output().expect("it ends");
            board.check_starved(&output.stderr)?;
            Ok((board, output))
        });
        assert!(status.success() && stderr.is_empty(), "{}", String::from_utf8_lossy(&stderr));
        let outcome: Value = serde_json::from_slice(&stdout).expect("JSON and nothing else");
        assert_eq!((&outcome["mode"], &outcome["level"]), (&mode.into(), &1.0.into()), "{outcome}");
        assert_eq!((&outcome["duration_s"], &outcome["velocity"]), (&0.05.into(), &Value::Null), "{outcome}");
        assert!(
            outcome["stop_acknowledged"] == true && outcome["board"]["is_this_loop"] == true,
            "{outcome}"
        );
        let number = |pointer: &str| outcome.pointer(pointer).and_then(Value::as_f64).expect("a number");
        let (turned, forecast) = (number("/simulated_deg"), number("/forecast/turn_deg"));
        assert!(sign * turned > 0.0 && sign * forecast > 0.0, "{outcome}");
        assert!((turned - forecast).abs() <= 4.0 * number("/forecast/sd_deg"), "{outcome}");
        board.hears(|message| (*message == BoardMessage::Jogging).then_some(()));
        let report = board.hears(|message| match message {
            BoardMessage::Jogged(report) => Some(*report),
            _ => None,
        });
        assert!(matches!(report, JogReport { ticks: 5_000, .. }), "{report:?}");
        board.hears(|message| (*message == BoardMessage::Stopped).then_some(()));
    }
}

/// The cable is pulled under a jog: the command says so, and the board switches off long before the duration is over.
/// When the cable is back the board takes the next jog.
#[test]
fn tool_jog_without_its_cable_goes_off() {
    let (mut board, jog) = not_starved(|| {
        let board = CabledBoard::start_in_real_time();
        let mut jog = board.command("jog", &["--duration", "1"]);
        board.says(&mut jog, |message| message == BoardMessage::Jogging)?;
        Ok((board, jog))
    });
    board.pull();
    let error = refusal(jog, 2);
    assert!(error.contains(" was closed after ") && error.contains("; hint: put the cable back"), "{error}");
    let end = board.hears(|message| match message {
        BoardMessage::Jogged(_) | BoardMessage::Fault(_) => Some(message.clone()),
        _ => None,
    });
    assert_eq!(end, BoardMessage::Fault(BoardFault::HostSilent));
    let output = not_starved(|| {
        if board.is_unplugged() {
            board.plug(Disturbance::default());
        }
        let output = board.command("jog", &["--duration", "0.01"]).wait_with_output().expect("it ends");
        board.check_starved(&output.stderr)?;
        Ok(output)
    });
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(text.starts_with("drive              mode B, level 0.5, +0 Hz, for 0.01 s\n"), "{text}");
    for line in
        ["vibrometer         no sample", "simulated rotor    turned by +", "stop               acknowledged"]
    {
        assert!(text.contains(line), "{text}");
    }
}

/// Ctrl-C under a jog: the board acknowledges the stop.
#[test]
fn tool_jog_interrupted_stops_the_drive() {
    let (board, jog) = not_starved(|| {
        let board = CabledBoard::start_in_real_time();
        let mut jog = board.command("jog", &["--duration", "1"]);
        board.says(&mut jog, |message| message == BoardMessage::Jogging)?;
        Ok((board, jog))
    });
    let sent = Command::new("kill").args(["-INT", &jog.id().to_string()]).status();
    assert!(sent.expect("kill starts").success());
    board.hears(|message| (*message == BoardMessage::Stopped).then_some(()));
    let error = refusal(jog, 130);
    assert!(error.contains("interrupted; the drive is off: the board has acknowledged the stop"), "{error}");
}

/// The lines of the result, each `name verdict: what`.
fn verdicts(stdout: &[u8]) -> Vec<(String, String)> {
    let text = String::from_utf8_lossy(stdout);
    let verdict = |line: &str| {
        let (head, found) = line.split_once(": ").expect("a verdict");
        (head.split_whitespace().collect::<Vec<_>>().join(" "), found.to_owned())
    };
    text.lines().map(verdict).collect()
}

/// The emulated board passes: it has no vibrometer, and neither has the scene. With a camera that sends nothing, and a
/// vibrometer in the scene, these two fail, each with a hint.
#[test]
fn tool_self_test_passes_and_names_what_is_dead() {
    let (board, output) = not_starved(|| {
        let board = CabledBoard::start();
        let output = board.command("self-test", &[]).wait_with_output().expect("it ends");
        // While this machine is busy the board's time runs on: frames are then as old as the test says, or so old that
        // their short stamps mean another time.
        board.check_starved(&[&output.stderr[..], &output.stdout].concat())?;
        Ok((board, output))
    });
    let found = verdicts(&output.stdout);
    assert!(output.status.success(), "{found:?} {}", String::from_utf8_lossy(&output.stderr));
    let names: Vec<&str> = found.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["amplifier pass", "ticks pass", "stack pass", "vibrometer pass", "camera pass"]);
    assert_eq!(found[1].1, "0 of 10000 late or lost");
    let output = not_starved(|| {
        let dead = ["--camera", "-", "--set", "ldv.installed=yes"];
        let mut test = board.command("self-test", &dead);
        // Open, and nothing comes.
        let frames = test.stdin.take();
        let output = test.wait_with_output().expect("it ends");
        drop(frames);
        board.check_starved(&output.stderr)?;
        Ok(output)
    });
    let found = verdicts(&output.stdout);
    let failed: Vec<&(String, String)> = found.iter().filter(|(name, _)| name.ends_with("FAIL")).collect();
    let [(vibrometer, converter), (camera, frames)] = failed[..] else { panic!("{found:?}") };
    assert_eq!((vibrometer.as_str(), camera.as_str()), ("vibrometer FAIL", "camera FAIL"));
    assert!(converter.starts_with("the board has no converter; hint: --set ldv.installed=no"), "{converter}");
    assert!(frames.starts_with("0 frames in 0.1 s, 100 are described; hint: "), "{frames}");
    let error = refused(&Output { stdout: Vec::new(), ..output }, 2);
    assert!(error.starts_with("error: the board's self-test fails: vibrometer, camera; hint: "), "{error}");
}

/// What is out of bounds or not read is refused before a port is opened.
#[test]
fn tool_what_cannot_be_asked_by_hand_is_refused() {
    for (arguments, words) in [
        (&["jog", "--level", "2"][..], "jog.level = 2 is outside its bounds 0 to 1"),
        (&["jog", "--duration", "1.5"], "jog.duration_s = 1.5"),
        (&["jog", "--mode", "D"], "jog.mode = d"),
        (&["jog", "--set", "position.to_deg=5"], "jog does not read position.to_deg"),
        (&["self-test", "--set", "jog.level=1"], "self-test does not read jog.level; hint: jog reads it"),
        (&["self-test", "--baud", "921600"], "camera.frame_rate_hz = 10000 needs 1714286 baud"),
        (&["self-test", "--camera", "nowhere.txt"], "nowhere.txt"),
    ] {
        let run = host_sim()
            .args(arguments)
            .args(["--port", "/dev/no-such-port"])
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn();
        let error = refusal(run.expect("host-sim starts"), 2);
        assert!(error.contains(words), "{error}");
    }
}

//! `host-sim run --camera`: frames of a camera program, and of a recording.

use std::io::Write as _;
use std::process::Output;
use std::thread::sleep;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use link::{BoardMessage, Header};
use serde_json::Value;

use crate::cabled_board::{CabledBoard, WAIT_MAX};
use crate::refused;
use crate::starved::not_starved;

/// Frames of a pipe, by the host's clock: the board takes them, and a bad line ends the move with the drive off.
#[test]
fn tool_run_takes_frames_of_a_pipe_up_to_a_bad_line() {
    let (board, lines, output) = not_starved(|| {
        let board = CabledBoard::start();
        let mut run = board.run(&["--camera", "-", "--to", "90", "--tolerance", "0.1"]);
        let mut frames = run.stdin.take().expect("a pipe");
        let begun = Instant::now();
        let mut lines = 0;
        let mut is_taken = true;
        // Until the board has an estimate of these frames.
        while is_taken && !board.has_an_estimate_near(12.0) {
            let now = SystemTime::now().duration_since(UNIX_EPOCH).expect("after 1970").as_secs_f64();
            is_taken = writeln!(frames, "{now:.6} {} 3", 12.0 + 1e-3 * f64::from(lines % 7)).is_ok();
            lines += 1;
            sleep(Duration::from_millis(2));
            assert!(begun.elapsed() < WAIT_MAX, "no estimate of {lines} frames");
        }
        let _ = writeln!(frames, "1 fast 3");
        let output = run.wait_with_output().expect("it ends");
        board.check_starved(&output.stderr)?;
        Ok((board, lines, output))
    });
    let error = refused(&output, 2);
    let line = lines + 1;
    let expected =
        format!("error: -:{line}: angle_deg = fast is no number, bounds -1e6 to 1e6 deg; the drive is off");
    assert!(error.starts_with(&expected), "{error}");
    board.hears(|message| (*message == BoardMessage::Stopped).then_some(()));
}

/// A recording of another day: its frames are exposed one after the other from arming on, none before it. The rotor in
/// it rests at the target, which the board sees and holds. Whether it is to report every 20 ms, as for the live view,
/// or changes alone, it says at once that it holds, and reports no more than that. Frames are stamped by the host's
/// clock: the filter is told the error of the board's, as found before the run in the board's time, or as a key says.
#[test]
fn tool_run_takes_frames_of_a_recording() {
    let folder = tempfile::tempdir().expect("a folder");
    let frames = folder.path().join("frames.txt");
    let lines = (0..60_000).map(|ms| format!("{}.{:03} {} 3\n", 1_000_000_000 + ms / 1000, ms % 1000, 12.0));
    std::fs::write(&frames, lines.collect::<String>()).expect("a recording");
    let recorded =
        ["--camera", frames.to_str().expect("a name in UTF-8"), "--to", "12", "--tolerance", "0.1"];
    let run = [&recorded[..], &["--set", "position.hold_s=0.02", "--format", "json"]].concat();
    let told_us = "estimator.assumed.camera.clock_error_s=0.0003";
    for (asked, period_ticks, of_key_us) in
        [(&[][..], 2000, None), (&["--report-every", "0", "--set", told_us], 10_000, Some(300))]
    {
        let (Output { status, stdout, stderr }, said) = not_starved(|| {
            let board = CabledBoard::start();
            let output = board.run(&[&run[..], asked].concat()).wait_with_output().expect("it ends");
            board.check_starved(&output.stderr)?;
            Ok((output, board.numbered_so_far()))
        });
        assert!(status.success(), "{}", String::from_utf8_lossy(&stderr));
        let outcome: Value = serde_json::from_slice(&stdout).expect("JSON and nothing else");
        assert_eq!(outcome["ok"], true, "{outcome}");
        let number = |pointer: &str| outcome.pointer(pointer).and_then(Value::as_f64).expect("a number");
        assert!((number("/final_angle_deg") - 12.0).abs() < 0.1, "{outcome}");
        let told_us =
            outcome.pointer("/description/clock_error_us").and_then(Value::as_u64).expect("a number");
        let live = String::from_utf8_lossy(&stderr);
        let (least_us, most_us) = of_key_us.map_or((10, 10_000), |key_us| (key_us, key_us));
        assert!((least_us..=most_us).contains(&told_us), "{outcome}");
        assert!(live.contains(&format!("(filter: {told_us} us rms)")), "{live}");
        // A frame for each millisecond of the host since arming, and no more: it stands in the file whenever it is
        // read.
        let sent = number("/line/frames_sent");
        assert!(sent > 0.0 && sent <= 1e3 * number("/host_s") + 1.0, "{outcome}");
        let Told { changes, repetitions, ticks } = Told::of(&said);
        assert!(changes >= 2, "an estimate, and the target is held: {outcome}");
        assert!(repetitions <= 1 + ticks / period_ticks, "{repetitions} in {ticks} ticks: {outcome}");
    }
}

/// What the reports of a board tell.
#[derive(Default)]
struct Told {
    /// Reports of another state than the one before.
    changes: u64,
    /// Reports of the same state, where the line has lost no report between the two: its buffer is full where a busy
    /// machine's emulator takes nothing out of it.
    repetitions: u64,
    /// Ticks between the first report and the last.
    ticks: u64,
}

impl Told {
    fn of(said: &[(Header, BoardMessage)]) -> Self {
        let (mut told, mut first, mut before) = (Self::default(), None, None);
        let mut next = None;
        for (Header { session, sequence, ticks }, message) in said {
            let is_next = next == Some((*session, *sequence));
            next = Some((*session, sequence.wrapping_add(1)));
            before = before.filter(|_| is_next);
            let Some(state) = state(message) else { continue };
            told.ticks = ticks.saturating_sub(*first.get_or_insert(*ticks));
            match before.replace(state) {
                Some(before) if before == state => told.repetitions += 1,
                Some(_) => told.changes += 1,
                None => {}
            }
        }
        told
    }
}

/// What the report of a board has that is told when it changes.
fn state(message: &BoardMessage) -> Option<[u8; 3]> {
    match message {
        BoardMessage::Report(report) => {
            Some([report.applied.mode.number(), report.health.number(), report.phase.number()])
        }
        _ => None,
    }
}

//! `host-sim run`: the whole program on the emulated board, behind a pseudo-terminal that carries bytes no faster than
//! its baud rate.

#[path = "../qemu/programs.rs"]
#[allow(dead_code, reason = "the tests on the emulated board use the rest of it")]
mod programs;

mod by_hand;
mod cabled_board;
mod commissioned;
mod frame_sources;
mod starved;
mod targets;
mod unwritable_map;

use std::io::{Read, Write};
use std::process::{Child, Command, Output, Stdio};
use std::thread::{sleep, spawn};
use std::time::Duration;

use controller::ResponseMap;
use controller::map_correction::{LearntFactors, MapCorrection};
use link::{BoardFault, BoardMessage, LearntRecord, SHORT_FRAME_BYTES, VERSION};
use motor_model::Angle;
use rustix::fs::{OFlags, fcntl_setfl};
use serde_json::Value;
use simulation::math::count::real;
use simulation::scene::{parse_response_map, response_map_text};

use cabled_board::{BAUD, CabledBoard, Disturbance, INSTRUMENTS, PseudoTerminal};
use programs::host_sim;
use starved::{Starved, not_starved};

/// A cable that spoils a frame of the response map, the answer to the question whether it is late, and a later answer.
const DISTURBED: Disturbance = Disturbance { to_board: &[400], from_board: &[200, 300] };

/// A short move.
const SHORT: [&str; 6] = ["--to", "2", "--tolerance", "0.1", "--set", "position.hold_s=0.02"];

/// Ends with `code`, and one line on standard error that begins with `error: `; that line.
#[track_caller]
fn refusal(run: Child, code: i32) -> String {
    refused(&run.wait_with_output().expect("it ends"), code)
}

#[track_caller]
fn refused(Output { status, stdout, stderr }: &Output, code: i32) -> String {
    let stderr = String::from_utf8_lossy(stderr).into_owned();
    assert_eq!(status.code(), Some(code), "{stderr}");
    assert!(stdout.is_empty(), "{}", String::from_utf8_lossy(stdout));
    let errors: Vec<&str> = stderr.lines().filter(|line| line.starts_with("error: ")).collect();
    let [error] = errors[..] else { panic!("{stderr}") };
    assert!(stderr.ends_with(&format!("{error}\n")), "{stderr}");
    error.to_owned()
}

/// What `host-sim explain` says of a log.
#[track_caller]
fn explained(log: &str) -> String {
    let output = host_sim().args(["explain", log]).output().expect("host-sim starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// Hardware in the loop: the board moves the simulated motor to its target, and the drive is off at the end. Frames and
/// reports keep to the board's clock and fit into 70 % of the line in its time; what keeps the line alive keeps to the
/// host's, and loads an emulated board as often as it is slower than a real one. The emulator's line takes no more
/// frames than these. All angles count from half a degree of the camera's: the truth would be beside them by as much.
#[test]
fn tool_run_moves_a_simulated_motor_by_a_board_at_a_serial_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let log = folder.path().join("run.mcap");
    let log = log.to_str().expect("a name in UTF-8");
    let map = folder.path().join("map.toml");
    // By the emulator's speed some moves learn something and some nothing. So the map has learnt before that steps turn
    // by less.
    let prior = LearntFactors::from(&MapCorrection::of(ResponseMap::table_1()));
    let mut before = prior;
    before.bursts[0].value = 0.8;
    let before = ResponseMap::table_1().with_learnt(before).expect("factors that a motor has");
    let before = response_map_text(&before, &map);
    let bench = ["--set", "camera.frame_rate_hz=2500", "--map", map.to_str().expect("a name in UTF-8")];
    let (board, Output { status, stdout, stderr }) = not_starved(|| {
        std::fs::write(&map, &before).expect("a map");
        let board = CabledBoard::start();
        let flags = ["--learn", "--keep", "--zero", "0.5", "--format", "json", "--log", log];
        let run = board.run(&[&SHORT[..], &bench, &flags].concat());
        let output = run.wait_with_output().expect("it ends");
        board.check_starved(&output.stderr)?;
        Ok((board, output))
    });
    let stderr = String::from_utf8_lossy(&stderr);
    assert!(status.success(), "{stderr}");
    let outcome: Value = serde_json::from_slice(&stdout).expect("JSON and nothing else");
    assert!(outcome["ok"] == true && outcome["stop_acknowledged"] == true, "{outcome}");
    assert_eq!(outcome["stopped"], Value::Null, "{outcome}");
    // The board and the command are built of the same checkout. The emulated one has no register that tells its start.
    assert!(outcome["board"]["is_this_loop"] == true, "{outcome}");
    assert_eq!(outcome["board"]["reset_cause"], "unknown", "{outcome}");
    assert_eq!(outcome["board"]["loop_digest"], format!("{:016x}", link::LOOP_DIGEST), "{outcome}");
    let number = |pointer: &str| outcome.pointer(pointer).and_then(Value::as_f64).expect("a number");
    let (angle, error) = (number("/final_angle_deg"), number("/final_error_true_mdeg"));
    assert!((angle - 2.0).abs() < 0.1 && error.abs() <= 100.0, "{outcome}");
    let line_bytes = f64::from(BAUD) / 10.0;
    let frames = number("/line/frame_bytes") / (number("/duration_s") * line_bytes);
    let from_board = number("/line/load_from_board") * number("/host_s") / number("/duration_s");
    for (load, way) in [(frames, "frames"), (from_board, "from the board")] {
        assert!(load > 0.0 && load <= 0.7, "{way} {load}: {outcome}");
    }
    assert!(number("/line/load_to_board") * number("/host_s") * line_bytes >= number("/line/frame_bytes"));
    // Where the host does not know the board's time well enough, as of a starved emulator, a frame is a long one.
    let short = real(SHORT_FRAME_BYTES);
    let mean = number("/line/frame_bytes") / number("/line/frames_sent");
    assert!((short..3.0 * short).contains(&mean), "{mean} bytes a frame: {outcome}");
    // The emulator is slower than the part: so is its clock, and this is told.
    assert!(number("/clock/drift_ppm") < 0.0 && number("/clock/uncertainty_us") > 0.0, "{outcome}");
    assert!(number("/line/frames_sent") > 100.0 && number("/counters/lost_or_damaged") == 0.0, "{outcome}");
    // Without a terminal the live view is plain lines. The board keeps the map as the move has left it.
    let lines: Vec<&str> = stderr.lines().collect();
    let [progress @ .., learnt, kept] = &lines[..] else { panic!("{stderr}") };
    assert!(!progress.is_empty() && progress.iter().all(|line| line.starts_with("time ")), "{stderr}");
    assert!(
        learnt.starts_with("note: ") && learnt.ends_with("has what the move learnt of this motor"),
        "{learnt}"
    );
    assert_eq!(*kept, "note: the board keeps the map over a loss of power");
    let text = explained(log);
    assert!(text.contains("at the target") && text.contains("the run ends as it should"), "{text}");
    // The map is that of the motor now: the same rows, and the factors that the board has told.
    let of_motor = std::fs::read_to_string(&map).expect("the map");
    let of_motor = parse_response_map(&of_motor, &map).expect("a map");
    let zero = BoardMessage::Zeroed { angle_units: Angle::from_degrees(0.5).units() };
    board.hears(|message| (*message == zero).then_some(()));
    let told = board.hears(|message| match message {
        BoardMessage::Learnt(learnt) => Some(*learnt),
        _ => None,
    });
    assert_eq!(Ok(of_motor), ResponseMap::table_1().with_learnt(told.into()));
    assert_ne!(told, LearntRecord::from(prior));
    board.hears(|message| (*message == BoardMessage::Stopped).then_some(()));
    // What it keeps is that map: the next run need not send it.
    let again = not_starved(|| short_move(&board, &bench));
    assert_eq!(again["description"]["sent"], false, "{again}");
}

/// Hardware in the loop: the board holds a rate of the simulated motor to its end, and says what it was by its
/// estimates. The log tells of it.
#[test]
fn tool_run_holds_a_rate_of_a_simulated_motor_by_a_board() {
    let folder = tempfile::tempdir().expect("a folder");
    let log = folder.path().join("run.mcap");
    let log = log.to_str().expect("a name in UTF-8");
    let rate = ["--deg-s", "160", "--duration", "0.6", "--format", "json", "--log", log];
    let (board, Output { status, stdout, stderr }) = not_starved(|| {
        let board = CabledBoard::start();
        let output = board.run(&rate).wait_with_output().expect("it ends");
        board.check_starved(&output.stderr)?;
        Ok((board, output))
    });
    let stderr = String::from_utf8_lossy(&stderr);
    assert!(status.success(), "{stderr}");
    let outcome: Value = serde_json::from_slice(&stdout).expect("JSON and nothing else");
    assert!(outcome["ok"] == true && outcome["stop_acknowledged"] == true, "{outcome}");
    assert_eq!((&outcome["stopped"], &outcome["rate_deg_s"]), (&Value::Null, &160.0.into()), "{outcome}");
    let number = |name: &str| outcome[name].as_f64().expect("a number");
    // Without the start of 0.25 s, and its end is a report, which come every millisecond.
    let measured_s = number("measured_s");
    assert!((0.3..=0.351).contains(&measured_s), "{outcome}");
    // What goes over the line is up to 10 ms old by the board's clock: a board that hears nothing for longer switches
    // off. In that time a full drive, of at most 1,000 deg/s, turns the rotor by 10 degrees. At either end the
    // estimate is off by as much, and the rotor is as far beyond the 3 degrees from the reference at which it is driven
    // back. Each reference that is given up adds the same. How well the loop itself holds a rate is judged in lock
    // step, where nothing is late, by tests/qemu.
    let late_deg = 10.0;
    let slip_deg = (2.0 + number("reference_losses")) * (3.0 + late_deg);
    let (held, truth) = (number("mean_deg_s"), number("true_mean_deg_s"));
    assert!((truth - 160.0).abs() <= slip_deg / measured_s, "{slip_deg}: {outcome}");
    assert!((number("mean_error_percent") - 100.0 * (truth / 160.0 - 1.0)).abs() < 1e-9, "{outcome}");
    assert!((held - truth).abs() <= 2.0 * late_deg / measured_s, "{outcome}");
    let duration_s = number("duration_s");
    assert!((0.6..=0.61).contains(&duration_s), "the report after the end: {outcome}");
    let (told, live): (Vec<&str>, Vec<&str>) = stderr.lines().partition(|line| line.starts_with("note: "));
    assert!(
        matches!(told[..], [told] if told.starts_with("note: by its map this motor reaches ")),
        "{stderr}"
    );
    assert!(live.iter().all(|line| line.contains("   rate +160.00 deg/s, phase ")), "{stderr}");
    let text = explained(log);
    assert!(
        text.contains("the controller holds a rate") && text.contains("held for as long as was asked"),
        "{text}"
    );
    board.hears(|message| (*message == BoardMessage::Stopped).then_some(()));
}

/// The outcome of a short move of `board`.
fn short_move(board: &CabledBoard, arguments: &[&str]) -> Result<Value, Starved> {
    let run = board.run(&[&SHORT[..], &["--format", "json"], arguments].concat());
    let Output { status, stdout, stderr } = run.wait_with_output().expect("it ends");
    board.check_starved(&stderr)?;
    let stderr = String::from_utf8_lossy(&stderr);
    assert!(status.success(), "{stderr}");
    let outcome: Value = serde_json::from_slice(&stdout).expect("JSON and nothing else");
    assert_eq!(outcome["ok"], true, "{outcome}");
    Ok(outcome)
}

/// Whether the board says that it was described a bench, that it keeps one, and that it has forgotten one, while it is
/// told what a run needs. What becomes of the move does not matter.
fn told(board: &CabledBoard, arguments: &[&str]) -> Result<[bool; 3], Starved> {
    drop(board.said_so_far());
    let output = board.run(&[&SHORT[..], arguments].concat()).wait_with_output().expect("it ends");
    let said = board.said_so_far();
    if !said.contains(&BoardMessage::Armed) {
        board.check_starved(&output.stderr)?;
        panic!("not armed: {}", String::from_utf8_lossy(&output.stderr));
    }
    Ok([BoardMessage::Described, BoardMessage::Kept, BoardMessage::Forgotten]
        .map(|message| said.contains(&message)))
}

/// A board that has kept its bench, and is then reset, moves by it: nothing of it is sent again. A run of another bench
/// is sent its own, and leaves what is kept. A board that has forgotten is sent everything, and keeps nothing.
#[test]
fn tool_run_moves_by_what_the_board_has_kept_over_a_reset() {
    not_starved(|| {
        let board = CabledBoard::start();
        assert_eq!(told(&board, &["--keep"])?, [true, true, false]);
        board.reset();
        // It keeps this one already: its flash is left alone.
        let again = not_starved(|| short_move(&board, &["--keep"]));
        assert!(again["description"]["sent"] == false && again["description"]["kept"] == true, "{again}");
        let said = board.said_so_far();
        let of_description = [BoardMessage::Described, BoardMessage::Kept];
        assert!(!said.is_empty() && !said.iter().any(|message| of_description.contains(message)), "{said:?}");
        assert_eq!(told(&board, &["--set", "camera.noise_m=2e-6"])?, [true, false, false]);
        assert_eq!(told(&board, &[])?, [false; 3]);
        assert_eq!(told(&board, &["--forget"])?, [true, false, true]);
        board.reset();
        assert_eq!(told(&board, &[])?, [true, false, false]);
        Ok(())
    });
}

/// The board is told again what the line has lost, or the answer to it, and no more than that: the session goes on.
#[test]
fn tool_run_sends_again_what_the_board_has_not_taken() {
    let (output, said) = not_starved(|| {
        let board = CabledBoard::start_disturbed(DISTURBED);
        let output =
            board.run(&[&SHORT[..], &["--format", "json"]].concat()).wait_with_output().expect("it ends");
        board.check_starved(&output.stderr)?;
        Ok((output, board.said_so_far()))
    });
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let outcome: Value = serde_json::from_slice(&output.stdout).expect("JSON and nothing else");
    assert_eq!(outcome["ok"], true, "{outcome}");
    let refused = outcome.pointer("/counters/lost_or_damaged").and_then(Value::as_f64).expect("a number");
    // The frame is damaged, and missing in the sequence.
    assert!((1.0..=2.0).contains(&refused), "{outcome}");
    let preparation = said.split(|message| *message == BoardMessage::Armed).next().unwrap_or_default();
    let said = |wanted: fn(&BoardMessage) -> bool| preparation.iter().filter(|said| wanted(said)).count();
    assert_eq!(said(|said| matches!(said, BoardMessage::Welcome { .. })), 1, "{preparation:?}");
    // The host asks what is late after each of the two losses.
    assert!(said(|said| matches!(said, BoardMessage::Counters(_))) >= 2, "{preparation:?}");
}

/// A scene that names no filter gets the best that the board was built with; one that names another is refused. A
/// camera that has no frames from the start ends the run.
#[test]
fn tool_run_takes_the_best_filter_that_the_board_has() {
    let absent = |message: &BoardMessage| match message {
        BoardMessage::Fault(BoardFault::OutOfBounds { key }) => key == "estimator.filter",
        _ => false,
    };
    let (said, refusals) = not_starved(|| {
        let board = CabledBoard::start_with_filter("impact_aided");
        let run = |arguments: &[&str]| {
            // A camera of no frames: the run ends once it is armed. Its clock is as good as any filter needs.
            let camera = ["--camera", "-", "--set", "estimator.assumed.camera.clock_error_s=0"];
            let arguments = [&camera[..], &["--set", "ldv.installed=yes", "--to", "2"], arguments].concat();
            let output = board.run(&arguments).wait_with_output().expect("it ends");
            board.check_starved(&output.stderr)?;
            Ok((board.said_so_far(), refused(&output, 2)))
        };
        let (any, any_error) = run(&[])?;
        let (named, named_error) = run(&["--filter", "constant_rate"])?;
        let (best, best_error) = run(&["--filter", "twin"])?;
        Ok(([any, named, best], [any_error, named_error, best_error]))
    });
    let refused = said.each_ref().map(|said| said.iter().filter(|message| absent(message)).count());
    let configured = said.each_ref().map(|said| said.contains(&BoardMessage::Configured));
    assert_eq!((refused, configured), ([1, 0, 1], [true, true, false]), "{refusals:?}");
    let [any, named, best] = refusals;
    for error in [any, named] {
        assert!(error.contains("the source of camera frames ended"), "{error}");
    }
    assert!(best.contains("the board refuses the move: estimator.filter is out of bounds"), "{best}");
    assert!(best.contains("the firmware may be built without it"), "{best}");
}

/// The cable is pulled while the drive is on: the command says so, the log is readable up to there, and the board
/// switches its drive off by itself. When the cable is back, the board drives only after it is told to, and does.
#[test]
fn tool_run_without_its_cable_ends_with_its_log() {
    let folder = tempfile::tempdir().expect("a folder");
    let log = folder.path().join("run.mcap");
    let log = log.to_str().expect("a name in UTF-8");
    let (mut board, run) = not_starved(|| {
        // That of an attempt before.
        let _ = std::fs::remove_file(log);
        let board = CabledBoard::start();
        let mut run = board.run(&["--to", "90", "--tolerance", "0.1", "--log", log]);
        board.drives(&mut run)?;
        Ok((board, run))
    });
    board.pull();
    let error = refusal(run, 2);
    assert!(error.contains(" was closed after ") && error.contains("run.mcap has the run up to "), "{error}");
    assert!(error.contains("; hint: put the cable back"), "{error}");
    assert!(explained(log).contains("cruise"), "{}", explained(log));
    board.hears(|message| (*message == BoardMessage::Fault(BoardFault::HostSilent)).then_some(()));
    // A busy machine may starve the board, but not twice in a row for ever.
    let output = not_starved(|| {
        if board.is_unplugged() {
            board.plug(Disturbance::default());
        }
        let output = board.run(&SHORT).wait_with_output().expect("it ends");
        board.check_starved(&output.stderr)?;
        Ok(output)
    });
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// Ctrl-C while the drive is on: the board acknowledges the stop.
#[test]
fn tool_run_interrupted_stops_the_drive() {
    let (board, run) = not_starved(|| {
        let board = CabledBoard::start();
        let mut run = board.run(&["--to", "90", "--tolerance", "0.1"]);
        board.drives(&mut run)?;
        Ok((board, run))
    });
    let sent = Command::new("kill").args(["-INT", &run.id().to_string()]).status();
    assert!(sent.expect("kill starts").success());
    board.hears(|message| (*message == BoardMessage::Stopped).then_some(()));
    let error = refusal(run, 130);
    assert!(error.contains("interrupted; the drive is off: the board has acknowledged the stop"), "{error}");
}

/// Instruments that the line does not carry, a port that is not there, one that is busy, one that takes nothing, one at
/// which nobody answers, and a board of another version.
#[test]
fn tool_run_without_a_board_says_why() {
    let run_with = |port: &str, instruments: &[&str]| {
        let run = host_sim()
            .args(["run", "--port", port])
            .args(instruments)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn();
        refusal(run.expect("host-sim starts"), 2)
    };
    let run = |port: &str| run_with(port, &INSTRUMENTS);
    let error = run_with("/dev/null", &[]);
    assert!(
        error.contains(": ldv.installed = yes: ") && error.contains("hint: --set ldv.installed=no"),
        "{error}"
    );
    let error = run_with("/dev/null", &["--set", "ldv.installed=no", "--baud", "921600"]);
    let too_slow =
        "error: camera.frame_rate_hz = 10000 needs 1714286 baud, bounds 0 to 5376 Hz at 921600 baud; ";
    assert!(error.starts_with(too_slow), "{error}");
    // A rate or a move, and a rate is one that stays.
    let error = run_with("/dev/null", &["--deg-s", "5", "--to", "3"]);
    assert!(error.contains("'--deg-s <RATE>' cannot be used with '--to <DEG>'"), "{error}");
    let error = run_with("/dev/null", &["--deg-s", "5", "--then", "3"]);
    assert!(error.contains("'--deg-s <RATE>' cannot be used with '--then <DEG|hold|zero>'"), "{error}");
    let error = run_with("/dev/null", &["--then", "home"]);
    assert!(error.contains("'home'") && error.contains("an angle in degrees, hold or zero"), "{error}");
    let error = run_with("/dev/null", &["--duration", "5"]);
    assert!(error.contains("not provided") && error.contains("--deg-s <RATE>"), "{error}");
    let error = run_with("/dev/null", &["--deg-s", "5", "--set", "rate.profile=sweep"]);
    assert!(error.starts_with("error: run --deg-s does not read rate.profile; hint: "), "{error}");
    let error = run_with("/dev/null", &["--deg-s", "2000"]);
    assert!(error.contains("rate.deg_s = 2000"), "{error}");
    // Before the board is looked for, and nothing is said of a rate that is refused.
    let travel = ["--deg-s", "100", "--duration", "2", "--set", "limits.greatest_deg=199"];
    let command = ["run", "--port", "/dev/no-such-port"];
    let output = host_sim().args(command).args(INSTRUMENTS).args(travel).output().expect("host-sim starts");
    let leaves = "error: rate.deg_s = 100 for rate.duration_s = 2 leads to 200 deg, beyond limits.greatest_deg = 199; \
                  hint: the travel is up to 199 deg";
    assert_eq!(refused(&output, 2), leaves);
    assert_eq!(String::from_utf8_lossy(&output.stderr), format!("{leaves}\n"));
    let error = run("/dev/no-such-port");
    assert!(error.starts_with("error: there is no port /dev/no-such-port; hint: "), "{error}");

    let PseudoTerminal { end: mut other, name, port: _port } = PseudoTerminal::open();
    let error = run(&name);
    let silent = format!("error: no board answers on {name} at {BAUD} baud within 2 s; hint: ");
    assert!(error.starts_with(&silent), "{error}");

    // The bytes of the host's first message, but of another version, as a board of that version would answer.
    let mut content = vec![VERSION + 7; 20];
    content.extend(crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&content).to_le_bytes());
    let mut frame = cobs::encode_vec(&content);
    frame.push(0);
    let answering = spawn(move || {
        let _ = other.read(&mut [0; 64]);
        other.write_all(&frame).expect("the line is open");
        other
    });
    let error = run(&name);
    let versions = format!(
        "error: the board speaks protocol version {}, this program version {VERSION}; hint: ",
        VERSION + 7
    );
    assert!(error.starts_with(&versions), "{error}");
    drop(answering.join());

    let PseudoTerminal { end: _unread, name, port: mut full } = PseudoTerminal::open();
    fcntl_setfl(&full, OFlags::NONBLOCK).expect("an open port");
    // The system takes some away after a while, until all of its buffers are full.
    for _ in 0..20 {
        while full.write(&[0]).is_ok() {}
        sleep(Duration::from_millis(2));
    }
    let error = run(&name);
    let stuck = format!("error: port {name} took no byte for 0.2 s; ");
    assert!(error.starts_with(&stuck) && error.contains("; hint: see that the board runs"), "{error}");

    let PseudoTerminal { end: _other, name, port: _port } = PseudoTerminal::open();
    let _holder = serialport::new(&name, BAUD).open().expect("the port is free");
    let error = run(&name);
    assert!(error.starts_with(&format!("error: port {name} is busy: ")), "{error}");
}

//! `host-sim commission --port`: the experiments on the emulated board, behind a pseudo-terminal.

use std::process::Output;

use link::BoardMessage;

use crate::cabled_board::CabledBoard;
use crate::refused;
use crate::starved::not_starved;

/// Nothing turns this motor: the strongest drive of either mode tells it, the motor is refused as in the simulation,
/// and the drive is off. The board was ordered what the plan wants, and has answered with what its rotor did.
#[test]
fn tool_commission_refuses_a_dead_motor_at_a_board() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("mine");
    let arguments = ["--fault", "drive:dead", "--out", out.to_str().expect("a name in UTF-8")];
    let (board, output) = not_starved(|| {
        let board = CabledBoard::start();
        let output = board.command("commission", &arguments).wait_with_output().expect("it ends");
        board.check_starved(&output.stderr)?;
        Ok((board, output))
    });
    let Output { stdout, stderr, .. } = &output;
    // What was measured of it is told all the same.
    let measured = String::from_utf8_lossy(stdout);
    assert!(measured.contains("Mode B is dead. Mode C is dead."), "{measured}");
    let error = refused(&Output { stdout: Vec::new(), ..output.clone() }, 2);
    assert!(error.contains("not fit for use") && error.contains("neither mode turns the rotor"), "{error}");
    let progress = String::from_utf8_lossy(stderr);
    assert!(
        progress.contains("experiment 1, phase Cruise") && progress.contains("experiment 2"),
        "{progress}"
    );
    assert!(!out.join("map.toml").exists());
    for number in [1, 2] {
        board.hears(|message| (*message == BoardMessage::ExperimentTaken { number }).then_some(()));
        board.hears(|message| match message {
            BoardMessage::Response(record) => (record.number == number).then_some(()),
            _ => None,
        });
    }
    board.hears(|message| (*message == BoardMessage::Stopped).then_some(()));
}

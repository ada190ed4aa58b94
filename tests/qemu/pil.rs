//! `host-sim pil`: the firmware in the loop, bit by bit beside the host.

use std::process::Output;
use std::sync::OnceLock;

use controller::commissioning::CommissioningEnd;
use controller::{PositionLoop, TickReport};
use host_sim::board::BoardError;
use host_sim::board::pil::{LockStepBoard, Processor};
use host_sim::board::qemu::{Board, Transport, Wiring};
use host_sim::board::telemetry::LogEntry;
use rand_core::Rng as _;
use rand_pcg::Pcg64;
use serde_json::Value;
use simulation::Scene;
use simulation::runs::tick_driver::TickMeasurements;
use simulation::runs::{commission, position, rate};

use crate::host_sim;

/// The program, built once.
fn elf() -> &'static str {
    static ELF: OnceLock<String> = OnceLock::new();
    ELF.get_or_init(|| crate::elf("pil"))
}

/// `host-sim pil` with it.
fn pil(arguments: &[&str]) -> Output {
    let elf = elf();
    host_sim()
        .args(["pil", "--format", "json", "--elf", elf])
        .args(arguments)
        .output()
        .expect("host-sim starts")
}

#[track_caller]
fn identical(arguments: &[&str]) -> Value {
    let Output { status, stdout, stderr } = pil(arguments);
    let complaint = String::from_utf8_lossy(&stderr);
    assert!(status.success() && complaint.is_empty(), "{arguments:?}: {status} {complaint}");
    let run: Value = serde_json::from_slice(&stdout).expect("JSON and nothing else");
    assert_eq!(run["identical"], true, "{run}");
    run
}

/// Ten seconds on the Cortex-M4F: a move, and a long hold after it.
#[test]
fn tool_pil_ten_seconds_on_a_cortex_m4f() {
    let run = identical(&["--board", "m4", "--set", "position.hold_s=10"]);
    assert!(run["steps"].as_u64().expect("a number") > 1_000_000, "{run}");
    let error_mdeg = run["final_error_mdeg"].as_f64().expect("a number");
    assert!(error_mdeg.abs() <= 20.0 && run["outcome"]["ok"] == true, "{run}");
}

/// The same on the other board, by the other filter, the other way.
#[test]
fn tool_pil_ten_seconds_on_a_cortex_m7() {
    let other = [
        "--board",
        "m7",
        "--to",
        "-90",
        "--set",
        "estimator.filter=impact_aided",
        "--set",
        "position.hold_s=10",
    ];
    let run = identical(&other);
    assert!(run["steps"].as_u64().expect("a number") > 1_000_000, "{run}");
    assert!(run["outcome"]["ok"] == true, "{run}");
}

/// The filter with the twin: of all that both compute, most of it.
#[test]
fn tool_pil_a_move_by_the_twin_on_either_board() {
    for board in ["m4", "m7"] {
        let run = identical(&["--board", board, "--set", "estimator.filter=twin"]);
        assert!(run["outcome"]["ok"] == true, "{run}");
    }
}

/// Other instruments and another motor, which the board learns from the host: a slow camera alone, and modes at other
/// frequencies with a response map of their own.
#[test]
fn tool_pil_other_instruments_and_another_motor() {
    let slow = ["camera.frame_rate_hz=200", "ldv.installed=no", "estimator.filter=best"];
    let mut arguments = vec!["--board", "m4", "--to", "-1"];
    arguments.extend(slow.iter().flat_map(|set| ["--set", set]));
    arguments.extend(["--set", "position.deadline_s=1"]);
    let run = identical(&arguments);
    assert!(run["outcome"]["drive_switches"].as_u64().expect("a number") > 0, "{run}");

    let folder = tempfile::tempdir().expect("a folder");
    let map = folder.path().join("map.toml");
    let map = map.to_str().expect("a name in UTF-8");
    let scene = crate::repository().join("host-sim/scenes/higher_modes.toml");
    let scene = scene.to_str().expect("a name in UTF-8");
    let made = host_sim().args(["response-map", "--motors", "4", "--scene", scene, "--out", map]).output();
    let made = made.expect("host-sim starts");
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    let tolerance = "position.tolerance_deg=0.02";
    let run = identical(&["--board", "m7", "--to", "2", "--scene", scene, "--map", map, "--set", tolerance]);
    assert!(run["outcome"]["ok"] == true, "{run}");
}

/// Short scenes of either rotor, with instruments that drop, repeat, delay and spoil what they measure, and commands
/// that act at once or later. Rotor, filter and board are in all combinations.
#[test]
fn tool_pil_random_scenes() {
    // Each number differs from scene to scene, in steps without a common period.
    for n in 0..50_u32 {
        let spread = |times: u32, of: u32| f64::from(n * times % of) / f64::from(of);
        let sets = [
            format!("seed={n}"),
            format!("position.to_deg={}", 180.0 * (spread(37, 101) - 0.5)),
            format!("position.tolerance_deg={}", 0.01 + 0.1 * spread(29, 97)),
            format!("plant.rotor={}", if n % 5 < 2 { "tilting" } else { "height_only" }),
            format!("estimator.filter={}", ["constant_rate", "impact_aided", "twin"][(n % 3) as usize]),
            format!("camera.drop_probability={}", 0.2 * spread(23, 89)),
            format!("camera.duplicate_probability={}", 0.2 * spread(19, 83)),
            format!("camera.outlier_probability={}", 0.05 * spread(17, 79)),
            format!("camera.late_probability={}", 0.2 * spread(13, 73)),
            format!("camera.lost_from_s={}", 0.1 * spread(11, 71)),
            format!("camera.lost_until_s={}", 0.1 * spread(7, 67)),
            format!("ldv.lost_from_s={}", 0.1 * spread(5, 61)),
            format!("ldv.lost_until_s={}", 0.1 * spread(3, 59)),
            "position.deadline_s=0.1".to_owned(),
            "position.hold_s=0.1".to_owned(),
            format!("board.latency_ticks={}", n * 3 % 17),
        ];
        let mut arguments = vec!["--board", ["m4", "m7"][(n / 2 % 2) as usize]];
        for set in &sets {
            arguments.extend(["--set", set]);
        }
        identical(&arguments);
    }
}

/// A program that says something else than frames is no partner, and the host does not wait for it.
#[test]
fn tool_pil_refuses_another_program_in_one_line() {
    let elf = &crate::elf("parity");
    let Output { status, stdout, stderr } =
        host_sim().args(["pil", "--elf", elf]).output().expect("host-sim starts");
    let complaint = String::from_utf8_lossy(&stderr);
    assert_eq!(status.code(), Some(2), "{complaint}");
    assert!(stdout.is_empty() && complaint.lines().count() == 1, "{complaint}");
    assert!(complaint.starts_with("error: the microcontroller"), "{complaint}");
}

fn scene(sets: &[&str]) -> Scene {
    let sets: Vec<String> = sets.iter().map(|&set| set.to_owned()).collect();
    Scene::of_sets(&sets).expect("settings within bounds")
}

/// What the firmware logs is what the host computes at the same tick, to the last bit; the truth beside it is the
/// plant's; and nothing comes oftener than it may.
#[test]
fn dual_the_log_of_a_run_is_the_hosts_own_at_every_tick() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("out, here");
    let sets = [
        "position.deadline_s=0.15",
        "camera.drop_probability=0.1",
        "camera.outlier_probability=0.05",
        "camera.late_probability=0.1",
        "estimator.filter=impact_aided",
    ];
    let mut arguments = vec!["--telemetry", path.to_str().expect("a name in UTF-8")];
    arguments.extend(sets.iter().flat_map(|set| ["--set", set]));
    let run = identical(&arguments);
    let mut host: Vec<(TickReport, f64)> = Vec::new();
    position::run(&scene(&sets), |moment| host.push((moment.report, moment.angle.degrees())))
        .expect("a scene");
    assert_eq!(run["steps"], host.len());

    let csv = std::fs::read_to_string(path.join("telemetry.csv")).expect("a table");
    let mut last_tick = 0;
    let mut kinds = std::collections::BTreeMap::<String, u32>::new();
    for row in csv.lines().skip(1).map(|row| row.split(',').collect::<Vec<_>>()) {
        let entry = LogEntry { tick: row[0].parse().expect("a tick"), level: "", text: row[4].to_owned() };
        assert!(last_tick == 0 || entry.tick >= last_tick + 10, "{entry:?}");
        last_tick = entry.tick;
        *kinds.entry(entry.text.split('=').next().unwrap_or_default().to_owned()).or_default() += 1;
        let (report, true_deg) = host[usize::try_from(entry.tick).expect("small") - 1];
        assert_eq!(row[5], true_deg.to_string(), "{entry:?}");
        let bits = |name| entry.field::<f32>(name).map(f32::to_bits);
        match entry.kind() {
            "estimate" => {
                let estimate = report.estimate.expect("it is logged");
                assert_eq!(entry.field("angle_units"), Some(estimate.angle.units()), "{entry:?}");
                assert_eq!(bits("rate_rad_s"), Some(estimate.rate_rad_s.to_bits()), "{entry:?}");
                assert_eq!(bits("angle_rad2"), Some(estimate.angle_rad2.to_bits()), "{entry:?}");
                assert_eq!(bits("rate_rad2_s2"), Some(estimate.rate_rad2_s2.to_bits()), "{entry:?}");
                assert_eq!(entry.field("resting"), Some(estimate.resting), "{entry:?}");
            }
            "innovation" => {
                // The tick that took it in: this one, or an earlier one for a frame refused.
                let taken_nanos =
                    entry.tick * PositionLoop::TICK_NANOS - entry.field::<u64>("age_nanos").expect("an age");
                let of = |(report, _): &(TickReport, f64)| {
                    report.camera.filter(|camera| camera.taken_at.nanos() == taken_nanos)
                };
                let innovations: Vec<u32> =
                    host.iter().filter_map(of).map(|camera| camera.innovation_rad.to_bits()).collect();
                assert!(innovations.contains(&bits("rad").expect("an innovation")), "{entry:?}");
            }
            "health" => assert_eq!(entry.text, format!("health {:?}", report.health)),
            "drive" => assert_eq!(bits("amplitude"), Some(report.applied.amplitude().to_bits()), "{entry:?}"),
            _ => (),
        }
    }
    let count =
        |kind: &str| kinds.iter().filter(|(text, _)| text.starts_with(kind)).map(|(_, n)| n).sum::<u32>();
    // 15,000 ticks: an estimate at least every 130, an account of the time every 10,000.
    assert!((115..=150).contains(&count("estimate")), "{kinds:?}");
    assert!(count("innovation Used") > 20 && count("innovation refused") > 20, "{kinds:?}");
    assert!(count("health ") > 2 && count("phase ") > 3 && count("drive ") > 0, "{kinds:?}");
    assert_eq!((count("state armed"), count("timing")), (1, 1), "{kinds:?}");
    assert_eq!(count("phase stopped TimedOut"), 1, "a limit: {kinds:?}");
    assert!(path.join("telemetry.svg").is_file());
}

/// A serial line on which others speak as well.
struct Noisy {
    board: LockStepBoard,
    random: Pcg64,
    ticks: u32,
}

impl Processor for Noisy {
    fn arm(&mut self, preparation: &[link::HostMessage]) -> Result<(), BoardError> {
        self.board.arm(preparation)
    }

    fn tell(&mut self, message: &link::HostMessage) -> Result<link::BoardMessage, BoardError> {
        self.board.tell(message)
    }

    fn tick(&mut self, measurements: &TickMeasurements) -> Result<link::TickRecord, BoardError> {
        self.ticks += 1;
        // Longer than any frame, now and then.
        let length = if self.ticks.is_multiple_of(100) { 1000 } else { self.ticks % 40 };
        let noise: Vec<u8> = (0..length).map(|_| self.random.next_u32().to_le_bytes()[0]).collect();
        self.board.send(&noise)?;
        self.board.tick(measurements)
    }
}

/// L1, over the serial line: noise between the frames of every tick, and every tick is still the host's to the last
/// bit.
#[test]
fn tool_pil_over_a_noisy_serial_line() {
    let scene = scene(&["position.deadline_s=0.005"]);
    let wiring = Wiring { transport: Transport::Uart, log: None };
    let board = LockStepBoard::start(elf().as_ref(), Board::M4, wiring).expect("QEMU starts");
    let mut noisy = Noisy { board, random: Pcg64::new(7, 1), ticks: 0 };
    let run = host_sim::board::pil::run(&scene, &mut noisy).expect("it answers");
    assert!(run.identical && run.steps > 480, "{run:?}");
    let counters = noisy.board.counters().expect("counters");
    assert!(counters.damaged > 350 && counters.oversize > 2, "{counters:?}");
    assert_eq!((counters.lost, counters.duplicates, counters.late), (0, 0, 0), "{counters:?}");
}

/// The firmware ends where the host's own loop ends, to the last digit, and says so in JSON. One move in a thousand
/// ends beyond its tolerance of a milli-degree; none beyond three.
#[test]
fn dual_pil_ends_where_the_host_ends() {
    let sets = ["position.to_deg=-0.5", "seed=4"];
    let run = identical(&["--board", "m7", "--set", sets[0], "--set", sets[1]]);
    let alone = position::run(&scene(&sets), |_| ()).expect("a scene");
    assert_eq!(run["final_error_mdeg"], alone.final_error_mdeg);
    assert_eq!(run["steps"], (alone.duration_s * 1e5).round());
    assert_eq!(run["outcome"]["ok"], alone.ok);
    assert!(run["difference"].is_null() && alone.final_error_mdeg.abs() < 3.0, "{run}");
}

/// The firmware forecasts a move as the host does, to the last bit: with the default bench, without a vibrometer at 200
/// frames a second, and where a tolerance cannot be met.
#[test]
fn dual_pil_forecasts_what_the_host_forecasts() {
    let mut board = LockStepBoard::start(elf().as_ref(), Board::M4, Wiring::default()).expect("QEMU starts");
    let slow = ["camera.frame_rate_hz=200", "ldv.installed=no", "position.to_deg=-37"];
    let fine = ["camera.resolution_m=4e-6", "position.tolerance_deg=0.001"];
    for (sets, is_met) in [(&[][..], true), (&slow, true), (&fine, false)] {
        let scene = scene(sets);
        let host = position::forecast(&scene).expect("a scene");
        assert_eq!(host.is_ok(), is_met, "{sets:?}: {host:?}");
        assert_eq!(board.forecast(&scene).expect("it answers"), host, "{sets:?}");
    }
    board.finish().expect("it ends well");
}

/// The firmware, one bit of whose report is flipped at a tick.
struct Flipped(LockStepBoard, u64);

impl Processor for Flipped {
    fn arm(&mut self, preparation: &[link::HostMessage]) -> Result<(), BoardError> {
        self.0.arm(preparation)
    }

    fn tell(&mut self, message: &link::HostMessage) -> Result<link::BoardMessage, BoardError> {
        self.0.tell(message)
    }

    fn tick(&mut self, measurements: &TickMeasurements) -> Result<link::TickRecord, BoardError> {
        let mut report = self.0.tick(measurements)?;
        self.1 -= 1;
        if self.1 == 0 {
            report.applied.amplitude = f32::from_bits(report.applied.amplitude.to_bits() ^ 1);
        }
        Ok(report)
    }
}

/// L9: where firmware and host disagree, the run ends and says at which step, in which field, with which bits, and of
/// which seed.
#[test]
fn tool_pil_names_the_first_difference() {
    let board = LockStepBoard::start(elf().as_ref(), Board::M4, Wiring::default()).expect("QEMU starts");
    let run = host_sim::board::pil::run(&scene(&["seed=6"]), &mut Flipped(board, 321)).expect("it answers");
    let difference = run.difference.expect("there is one");
    let said = "step 321 of seed 6: applied.amplitude is 0x1 on the microcontroller and 0x0 on the host";
    assert_eq!((run.identical, run.steps, difference.to_string().as_str()), (false, 321, said));
}

/// The firmware holds the rate that the host holds, to the last bit, clockwise by the simplest filter and the other way
/// by that which uses impacts, on either board, and by the twin under late frames; and where nothing turns the rotor,
/// it stops when the host does.
#[test]
fn dual_pil_holds_the_rate_that_the_host_holds() {
    let turning = ["rate.deg_s=160", "rate.duration_s=0.5", "plant.step_s=5e-6"];
    let back =
        ["rate.deg_s=-40", "rate.duration_s=0.5", "estimator.filter=impact_aided", "plant.step_s=5e-6"];
    let dead = ["rate.deg_s=500", "rate.duration_s=0.5", "faults=drive:dead", "plant.step_s=5e-6"];
    // Between frames and their arrival come more kicks than a tick passes.
    let late = [
        "rate.deg_s=50",
        "rate.duration_s=0.5",
        "estimator.filter=twin",
        "camera.frame_rate_hz=60",
        "camera.latency_s=0.02",
        "plant.step_s=5e-6",
    ];
    for (sets, board, stopped) in
        [(&turning[..], "m4", None), (&back, "m7", None), (&dead, "m4", Some("Stuck")), (&late, "m7", None)]
    {
        // The rate is that of the scene, whose own words come after the flag.
        let (rate_deg_s, others) = sets[0].strip_prefix("rate.deg_s=").zip(sets.get(1..)).expect("a rate");
        let mut arguments = vec!["--board", board, "--deg-s", rate_deg_s];
        arguments.extend(others.iter().flat_map(|set| ["--set", set]));
        let run = identical(&arguments);
        let alone = rate::run(&scene(sets), |_| ()).expect("a scene");
        assert_eq!(alone.stopped.as_deref(), stopped, "{alone:?}");
        assert_eq!((run["steps"].as_u64(), &run["difference"]), (Some(50_000), &Value::Null), "{run}");
        assert_eq!(run["outcome"], serde_json::to_value(alone).expect("JSON"), "{sets:?}");
    }
}

/// A limit ends a move on the board where it ends the host's: weaker drives, shorter ones, the end of the travel. A
/// target outside of the travel is refused in one line.
#[test]
fn dual_pil_keeps_the_limits_that_the_host_keeps() {
    for (to, sets, stopped) in [
        ("20", &["limits.amplitude_max=0.5", "position.deadline_s=0.2"][..], Some("TimedOut")),
        ("20", &["limits.drive_on_s=0.02", "position.hold_s=0.01"], None),
        ("-5", &["limits.least_deg=-5", "position.tolerance_deg=0.005", "seed=4"], Some("OutOfTravel")),
    ] {
        let mut arguments = vec!["--board", "m4", "--to", to];
        arguments.extend(sets.iter().flat_map(|set| ["--set", set]));
        let run = identical(&arguments);
        let to = format!("position.to_deg={to}");
        let alone = position::run(&scene(&[&[to.as_str()], sets].concat()), |_| ()).expect("a scene");
        assert_eq!(alone.stopped.as_deref(), stopped, "{alone:?}");
        assert_eq!(run["outcome"], serde_json::to_value(alone).expect("JSON"), "{sets:?}");
    }
    let outside = pil(&["--to", "20", "--set", "limits.greatest_deg=19"]);
    let stderr = String::from_utf8_lossy(&outside.stderr);
    assert!(outside.status.code() == Some(2) && stderr.contains("limits.greatest_deg = 19"), "{stderr}");
}

/// The firmware sweeps both modes and drives cruises as the host does, to the last bit of every report and every
/// response, and the host makes the same of it as of its own: nothing turns this motor, which needs few experiments.
#[test]
fn dual_pil_commissions_as_the_host_does() {
    let run = identical(&["--commission", "--fault", "drive:dead", "--set", "plant.step_s=5e-6"]);
    assert_eq!((&run["is_fit"], &run["difference"]), (&Value::Bool(false), &Value::Null), "{run}");
    // Two sweeps, and the first three cruises of either mode.
    assert_eq!(run["responses"], 8, "{run}");
    // The first cruise of a motor that turns leaves this travel: both end in its tick, after the sweeps or before.
    let travel = ["--set", "limits.greatest_deg=100", "--set", "limits.least_deg=-100"];
    let run = identical(&[&["--commission"], &travel[..]].concat());
    let scene = scene(&["limits.greatest_deg=100", "limits.least_deg=-100"]);
    let alone = commission::run(&scene, |_| ()).expect("a scene").commissioned;
    assert_eq!(alone.end, CommissioningEnd::EndOfTravel);
    let ticks = f64::from(alone.time_s) * 1e5;
    assert!(run["is_fit"] == false && (run["steps"].as_f64().expect("ticks") - ticks).abs() < 2.0, "{run}");
}

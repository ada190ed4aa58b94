//! The whole program at the instruction rates of the parts, armed, under all that a simulated motor shows in a move:
//! whether it meets its deadlines is what `host-sim parts` says of the part.
//!
//! ```text
//! simulated move --> camera frames, 12 bytes each over 6 ticks of the line --> script --> program on its own timer,
//!                \-> two samples of the vibrometer a tick                  --/            at the rate of a part
//! ```
//!
//! The simulated loop has the filter and the latency of the board. So the board decides as it did, and what the script
//! shows is what the board's own drive does to the motor.

use std::convert::Infallible;
use std::io::Write as _;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::OnceLock;

use controller::{LATENCY_TICKS_MAX, PositionLoop};
use estimator::CameraFrame;
use firmware::application::OVERRUNS_MAX;
use host_sim::board::pil::FreeRunningBoard;
use host_sim::scene_files::GalleryScene;
use link::{
    BoardFault, BoardMessage, CommandRecord, Configuration, Counters, FilterKind, HostMessage, PhaseRecord,
    TickRecord, description_messages,
};
use motor_model::{Angle, DriveCommand};
use serde_json::Value;
use simulation::Scene;
use simulation::runs::position;
use simulation::world::instruments::assumed;

use crate::programs::elf_with;
use crate::script::Script;

/// The parts of `host-sim parts`, by their scenes, and their clocks in MHz.
const PARTS: [(&str, u32); 3] = [("stm32g474", 170), ("stm32h743", 480), ("rp2350", 150)];

/// The filters, with their names in a scene and those of their counts.
const FILTERS: [(FilterKind, &str, &str); 3] = [
    (FilterKind::ConstantRate, "constant_rate", "program_tick"),
    (FilterKind::ImpactAided, "impact_aided", "program_tick_impact_aided"),
    (FilterKind::Twin, "twin", "program_tick_twin"),
];

/// The move: a cruise, bursts, and a hold.
const MOVE: [(&str, &str); 3] =
    [("position.to_deg", "10"), ("position.tolerance_deg", "0.1"), ("position.hold_s", "0.02")];

/// Ticks in which the slowest part builds any filter, of 1,500 instructions each: 4.5 million, longer than the watchdog
/// waits, which is 10 ms at 4 ns an instruction.
const BUILD_TICKS: u64 = 3000;

/// The greatest count that was reviewed of an operation.
fn reviewed(operation: &str) -> u64 {
    let records: Value = serde_json::from_str(include_str!("instructions.m4.json")).expect("JSON");
    let records = records.as_array().expect("records");
    let record = records.iter().find(|record| record["operation"] == operation);
    record.and_then(|record| record["max"].as_u64()).unwrap_or_else(|| panic!("{operation} is counted"))
}

/// The scene of a part, with this filter and the move.
fn scene(name: &str, filter: &str) -> Scene {
    let of_gallery = GalleryScene::named(name).expect("a scene of the gallery");
    let mut scene = Scene::default();
    scene.set_all(of_gallery.text, Path::new(name)).expect("settings");
    for (key, value) in MOVE.into_iter().chain([("estimator.filter", filter)]) {
        scene.set(key, value).expect("within its bounds");
    }
    scene
}

/// A move as a board is to make it.
struct ScriptedMove {
    script: Script,
    /// The board's ticks before the first of the loop.
    before: u64,
    /// What the amplifier applied in each tick of the simulation.
    applied: Vec<CommandRecord>,
    /// Where the rotor is at the end.
    end: Angle,
}

impl ScriptedMove {
    /// The move of `scene`. After it the host asks for counters, stops the board and arms it again.
    fn of(scene: &Scene, filter: FilterKind) -> Self {
        let mut script = Script::default();
        Self::arm(&mut script, scene, filter);
        let before = script.ticks();
        let (mut applied, mut end) = (Vec::new(), Angle::ZERO);
        let outcome = position::run_with(scene, |closed_loop, moment| {
            let measurements = closed_loop.measurements();
            script.pass(&measurements.ldv_samples);
            if let Some(frame) = measurements.camera_frame {
                let exposed_at = frame.exposed_at.plus_nanos(before * PositionLoop::TICK_NANOS);
                script.show(CameraFrame { exposed_at, ..frame });
            }
            applied.push(TickRecord::from(&moment.report).applied);
            end = moment.angle;
            ControlFlow::<Infallible>::Continue(())
        });
        let ControlFlow::Continue(outcome) = outcome.expect("a move");
        assert!(outcome.ok, "the simulated loop has the time: {outcome}");
        for message in [HostMessage::Arm, HostMessage::Count, HostMessage::Stop, HostMessage::Arm] {
            script.send(&message);
        }
        script.pass_until_received();
        Self { script, before, applied, end }
    }

    /// The board is told all of `scene`, and armed: the last byte comes in the last tick before those of the loop.
    fn arm(script: &mut Script, scene: &Scene, filter: FilterKind) {
        let latency_ticks = u8::try_from(scene.integer("board.latency_ticks")).expect("16 at most");
        let (motor, map) = (scene.motor_params(), scene.response_map().expect("that of the design"));
        let configuration = Configuration {
            filter,
            target_deg: scene.number("position.to_deg"),
            tolerance_deg: scene.number("position.tolerance_deg"),
            deadline_nanos: scene.nanos("position.deadline_s"),
        };
        script.send(&HostMessage::Hello);
        description_messages(&motor, assumed(scene), latency_ticks, Some(&map))
            .for_each(|message| script.send(&message));
        script.send(&HostMessage::Configure(configuration));
        script.pass_until_received();
        (0..BUILD_TICKS).for_each(|_| script.pass(&[]));
        script.send(&HostMessage::Arm);
        script.pass_until_received();
    }

    /// What a board says of it that has the instructions of a part of so many MHz.
    fn run_at(&self, mhz: u32) -> Said {
        static ELF: OnceLock<String> = OnceLock::new();
        let elf = ELF.get_or_init(|| elf_with(&["board", "scripted"]));
        // 10 us of such a part have 10 instructions a MHz, at one a cycle.
        let clocks_per_tick = 10 * mhz / FreeRunningBoard::INSTRUCTIONS_PER_CLOCK;
        let mut file = tempfile::NamedTempFile::new().expect("a file");
        file.write_all(&self.script.bytes(clocks_per_tick)).expect("a script");
        let board = FreeRunningBoard::start_scripted(Path::new(elf), file.path());
        Said::by(&mut board.expect("QEMU starts, tests/run.sh installs it"))
    }
}

/// What a board has said of a move.
struct Said {
    /// From the answer to the first arming on, without counters, each with its tick.
    messages: Vec<(u64, BoardMessage)>,
    counters: Counters,
    /// Its reports, each with its tick.
    reports: Vec<(u64, TickRecord)>,
}

impl Said {
    /// Until the answer to the arming after the stop.
    fn by(board: &mut FreeRunningBoard) -> Self {
        let (mut messages, mut reports, mut counters, mut welcomes) = (Vec::new(), Vec::new(), None, 0);
        loop {
            let (header, message) = board.receive().expect("the board answers");
            match message {
                BoardMessage::Report(report) => reports.push((header.ticks, report)),
                BoardMessage::Counters(told) => counters = Some(told),
                BoardMessage::Welcome { .. } => welcomes += 1,
                BoardMessage::Described | BoardMessage::Configured => (),
                message => messages.push((header.ticks, message)),
            }
            assert!(welcomes == 1, "the board has started anew: {messages:?}");
            if let (Some(counters), [.., (_, BoardMessage::Stopped), _]) = (&counters, &messages[..]) {
                return Self { messages, counters: *counters, reports };
            }
        }
    }

    fn messages(&self) -> Vec<&BoardMessage> {
        self.messages.iter().map(|(_, message)| message).collect()
    }

    /// Every frame was received, whole and once, and every measurement was fused.
    #[track_caller]
    fn check_line(&self) {
        let Counters { damaged, oversize, duplicates, late, lost, dropped, .. } = self.counters;
        assert_eq!([damaged, oversize, duplicates, late, lost, dropped], [0; 6], "{:?}", self.counters);
    }

    /// Each report, which comes with every change of the drive too, has the drive that was simulated for its tick.
    #[track_caller]
    fn check_drive(&self, made: &ScriptedMove) {
        let off = CommandRecord::from(DriveCommand::OFF);
        for (tick, report) in &self.reports {
            let number = usize::try_from(tick - made.before - 1).expect("a short move");
            let simulated = made.applied.get(number).copied().unwrap_or(off);
            assert_eq!(report.applied, simulated, "tick {number} of the move");
        }
    }
}

/// Each filter on each part; and whether it is behind by the longest latency at most, as the reviewed counts have it.
fn cases(fits: bool) -> Vec<(&'static str, u32, FilterKind, &'static str)> {
    let all = PARTS.into_iter().flat_map(|part| FILTERS.map(|filter| (part, filter)));
    let cases: Vec<_> = all
        .filter(|((_, mhz), (.., tick))| {
            let latency_ticks = reviewed(&format!("{tick}_latency_at_{}", 10 * mhz));
            fits == (latency_ticks <= LATENCY_TICKS_MAX as u64)
        })
        .map(|((part, mhz), (filter, name, _))| (part, mhz, filter, name))
        .collect();
    assert!(!cases.is_empty(), "the test tests nothing");
    cases
}

/// At the latency of the part's scene no command is late, the drive is that of the simulation, and the rotor is held at
/// the target. With a latency of one tick, which is less than the counts say is needed, some commands are late.
#[test]
fn dual_a_program_meets_its_deadlines_on_a_part_that_has_the_time() {
    for (part, mhz, filter, name) in cases(true) {
        let mut scene = scene(part, name);
        let made = ScriptedMove::of(&scene, filter);
        let said = made.run_at(mhz);
        let armed = BoardMessage::Armed;
        assert_eq!(said.messages(), [&armed, &armed, &BoardMessage::Stopped, &armed], "{part}, {name}");
        assert_eq!(said.counters.overruns, 0, "{part}, {name}: {:?}", said.counters);
        said.check_line();
        said.check_drive(&made);
        let (_, last) = said.reports.last().expect("a thousand a second");
        assert_eq!(last.phase.value(), Some(PhaseRecord::Holding), "{part}, {name}: {last:?}");
        let estimate = Angle::from_units(last.estimate.expect("of a rotor at rest").angle_units);
        let off_deg = estimate.minus(made.end).degrees();
        assert!(off_deg.abs() <= scene.number("position.tolerance_deg"), "{part}, {name}: {off_deg}");

        scene.set("board.latency_ticks", "1").expect("within its bounds");
        let late = ScriptedMove::of(&scene, filter).run_at(mhz).counters;
        assert!(late.overruns > 0, "{part}, {name}: {late:?}");
    }
}

/// K9: with the longest latency there is, ten deadlines in a row are missed. The board says so, is off, and stays off
/// until a stop.
#[test]
fn dual_a_program_misses_its_deadlines_on_a_part_without_the_time_and_switches_off() {
    for (part, mhz, filter, name) in cases(false) {
        let mut scene = scene(part, name);
        scene.set("board.latency_ticks", &LATENCY_TICKS_MAX.to_string()).expect("within its bounds");
        let made = ScriptedMove::of(&scene, filter);
        let said = made.run_at(mhz);
        let (armed, overrun) = (BoardMessage::Armed, BoardMessage::Fault(BoardFault::Overrun));
        let expected = [&armed, &overrun, &overrun, &BoardMessage::Stopped, &armed];
        assert_eq!(said.messages(), expected, "{part}, {name}");
        assert!(said.counters.overruns >= OVERRUNS_MAX, "{part}, {name}: {:?}", said.counters);
        said.check_line();
        // A board that is off has nothing to report.
        let off_at = said.messages[1].0;
        assert!(said.reports.iter().all(|(tick, _)| *tick <= off_at), "{part}, {name}: {off_at}");
    }
}

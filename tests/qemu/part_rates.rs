//! The whole program at the instruction rates of the parts, armed, under all that a simulated motor shows in a move:
//! whether it meets its deadlines is what `host-sim parts` says of the part.
//!
//! ```text
//! simulated move --> camera frames, 12 bytes each over 6 ticks of the line --> script --> program on its own timer,
//!                \-> two samples of the vibrometer a tick                  --/            at the rate of a part
//! ```
//!
//! The simulated loop has the filter and the latency of the board. So the board decides as it did, and what the script
//! shows is what the board's own drive does to the motor: the reports of both are the same to the last bit.

use std::convert::Infallible;
use std::io::Write as _;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::OnceLock;

use controller::{LATENCY_TICKS_MAX, PositionLoop};
use estimator::{CameraFrame, LdvSample};
use firmware::application::OVERRUNS_MAX;
use host_sim::board::pil::FreeRunningBoard;
use host_sim::scene_files::GalleryScene;
use link::{
    BoardFault, BoardMessage, CommandRecord, Configuration, Counters, EstimateRecord, FRAME_BYTES_MAX,
    FilterKind, HostMessage, InnovationRecord, MoveLimitsRecord, PhaseRecord, RateConfiguration,
    RateLimitsRecord, TickRecord, description_messages, encode,
};
use motor_model::{Angle, DriveCommand};
use serde_json::Value;
use simulation::Scene;
use simulation::runs::closed_loop::timing;
use simulation::runs::tick_driver::TickMeasurements;
use simulation::runs::{position, rate};
use simulation::world::instruments::assumed;

use crate::programs::elf_with;
use crate::script::{LINE_BYTES_PER_TICK, Script};

/// The parts of `host-sim parts`, by their scenes, and their clocks in MHz.
const PARTS: [(&str, u32); 3] = [("stm32g474", 170), ("stm32h743", 480), ("rp2350", 150)];

/// The filters, with their names in a scene and those of their counts.
const FILTERS: [(FilterKind, &str, &str); 3] = [
    (FilterKind::ConstantRate, "constant_rate", "program_tick"),
    (FilterKind::ImpactAided, "impact_aided", "program_tick_impact_aided"),
    (FilterKind::Twin, "twin", "program_tick_twin"),
];

/// MHz of a processor that has the time for the twin.
const TWIN_MHZ: u32 = 800;

/// The move: a cruise, bursts, and a hold.
const MOVE: [(&str, &str); 3] =
    [("position.to_deg", "10"), ("position.tolerance_deg", "0.1"), ("position.hold_s", "0.02")];

/// The first ticks of a move, which the board is busy with its beginning for, have nothing to show.
const NOT_SHOWN: &str = "ldv:lost@0..0.0001";

/// Ticks in which the slowest part builds any filter, of 1,500 instructions each: 4.5 million, longer than the watchdog
/// waits, which is 10 ms at 4 ns an instruction.
const BUILD_TICKS: u64 = 3000;

/// What was reviewed of an operation: its mean and its greatest count.
fn counts(operation: &str) -> (f64, u64) {
    let records: Value = serde_json::from_str(include_str!("instructions.m4.json")).expect("JSON");
    let records = records.as_array().expect("records");
    let record = records.iter().find(|record| record["operation"] == operation);
    let counts = record.and_then(|record| record["mean"].as_f64().zip(record["max"].as_u64()));
    counts.unwrap_or_else(|| panic!("{operation} is counted"))
}

/// The greatest count that was reviewed of an operation.
fn reviewed(operation: &str) -> u64 {
    counts(operation).1
}

/// The scene of a part, with this filter and the move.
fn scene(name: &str, filter: &str) -> Scene {
    let of_gallery = GalleryScene::named(name).expect("a scene of the gallery");
    let mut scene = Scene::default();
    scene.set_all(of_gallery.text, Path::new(name)).expect("settings");
    for (key, value) in MOVE.into_iter().chain([("estimator.filter", filter), ("faults", NOT_SHOWN)]) {
        scene.set(key, value).expect("within its bounds");
    }
    scene
}

/// A run of the simulated loop as a board is to make it.
struct ScriptedRun {
    script: Script,
    /// The board's ticks before the first of the loop: whole periods of its decisions.
    before: u64,
    /// What was measured in each tick of the simulated loop: samples, and the frame that was taken in.
    shown: Vec<(Vec<LdvSample>, Option<CameraFrame>)>,
    /// What the simulated loop reported in each tick, in the board's time.
    reports: Vec<TickRecord>,
    /// Where the rotor is at the end.
    end: Angle,
    /// Ticks from a decision until its command acts.
    latency_ticks: u8,
}

impl ScriptedRun {
    /// The move of `scene`.
    fn of_move(scene: &Scene, filter: FilterKind) -> Self {
        let mut run = Self::armed(
            scene,
            &HostMessage::Configure(Configuration {
                filter,
                target_deg: scene.number("position.to_deg"),
                tolerance_deg: scene.number("position.tolerance_deg"),
                deadline_nanos: scene.nanos("position.deadline_s"),
                limits: MoveLimitsRecord::default(),
            }),
        );
        let outcome = position::run_with(scene, |closed_loop, moment| {
            run.take(closed_loop.measurements(), (&moment.report).into(), moment.angle)
        });
        let ControlFlow::Continue(outcome) = outcome.expect("a move");
        assert!(outcome.ok, "the simulated loop has the time: {outcome}");
        run.ended()
    }

    /// The rate of `scene`.
    fn of_rate(scene: &Scene, filter: FilterKind) -> Self {
        let mut run = Self::armed(
            scene,
            &HostMessage::ConfigureRate(RateConfiguration {
                filter,
                rate_deg_s: scene.number("rate.deg_s"),
                duration_nanos: scene.nanos("rate.duration_s"),
                limits: RateLimitsRecord::default(),
            }),
        );
        let outcome = rate::run_with(
            scene,
            |_| (),
            |closed_loop, moment| run.take(closed_loop.measurements(), (&moment.report).into(), moment.angle),
        );
        let ControlFlow::Continue(outcome) = outcome.expect("a rate");
        assert_eq!(outcome.stopped, None, "the simulated loop has the time");
        run.ended()
    }

    /// The board is told all of `scene`, and armed.
    fn armed(scene: &Scene, configure: &HostMessage) -> Self {
        let mut script = Script::default();
        let timing = timing(scene);
        let (motor, map) = (scene.motor_params(), scene.response_map().expect("that of the design"));
        script.send(&HostMessage::Hello);
        description_messages(&motor, assumed(scene), timing, Some(&map))
            .for_each(|message| script.send(&message));
        script.send(configure);
        script.pass_until_received();
        (0..BUILD_TICKS).for_each(|_| script.pass(&[]));
        let mut armed = script.clone();
        loop {
            armed.send(&HostMessage::Arm);
            armed.pass_until_received();
            // The move begins with the tick before the one in which it is told.
            if (armed.ticks() - 1).is_multiple_of(timing.decision_ticks.into()) {
                break;
            }
            script.pass(&[]);
            armed = script.clone();
        }
        let (script, before) = (armed.clone(), armed.ticks() - 1);
        Self {
            script,
            before,
            shown: Vec::new(),
            reports: Vec::new(),
            end: Angle::ZERO,
            latency_ticks: timing.latency_ticks,
        }
    }

    /// A tick of the simulated loop.
    fn take(
        &mut self,
        measurements: &TickMeasurements,
        report: TickRecord,
        angle: Angle,
    ) -> ControlFlow<Infallible> {
        let begun_nanos = self.before * PositionLoop::TICK_NANOS;
        let frame = measurements.camera_frame;
        let of_board = |frame: CameraFrame| CameraFrame {
            exposed_at: frame.exposed_at.plus_nanos(begun_nanos),
            ..frame
        };
        self.shown.push((Vec::new(), frame.map(of_board)));
        // A loop that decides in some ticks takes in those of the ticks before as well.
        for sample in &measurements.ldv_samples {
            let tick = (sample.taken_at.nanos() - 1) / PositionLoop::TICK_NANOS;
            self.shown[usize::try_from(tick).expect("a short run")].0.push(*sample);
        }
        let is_decided = self.reports.len() >= self.latency_ticks.into();
        self.reports.push(later(report, begun_nanos, is_decided));
        self.end = angle;
        ControlFlow::Continue(())
    }

    /// Then the host asks for counters, stops the board and arms it again.
    fn ended(mut self) -> Self {
        // The first tick is that in which the last byte has come.
        assert_eq!(self.shown.first(), Some(&(Vec::new(), None)));
        for (samples, frame) in self.shown.drain(..).skip(1) {
            self.script.pass(&samples);
            if let Some(frame) = frame {
                self.script.show(frame);
            }
        }
        for message in [HostMessage::Arm, HostMessage::Count, HostMessage::Stop, HostMessage::Arm] {
            self.script.send(&message);
        }
        self.script.pass_until_received();
        self
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

/// The report of a loop that began `nanos` later. A move of which nothing is under way has no instant since when, nor
/// has what acts before anything is decided.
fn later(report: TickRecord, nanos: u64, is_decided: bool) -> TickRecord {
    let has_begun = is_decided && (report.rate.is_some() || report.since_nanos > 0);
    TickRecord {
        estimate: report.estimate.map(|of| EstimateRecord { at_nanos: of.at_nanos + nanos, ..of }),
        camera: report.camera.map(|of| InnovationRecord { taken_nanos: of.taken_nanos + nanos, ..of }),
        since_nanos: report.since_nanos + if has_begun { nanos } else { 0 },
        ..report
    }
}

/// What a board has said of a move.
struct Said {
    /// From the answer to the first arming on, without counters, each with its tick.
    messages: Vec<(u64, BoardMessage)>,
    counters: Counters,
    /// Its reports, each with its tick.
    reports: Vec<(u64, TickRecord)>,
    /// The bytes of each frame, with its tick.
    frames: Vec<(u64, u64)>,
}

impl Said {
    /// Until the answer to the arming after the stop.
    fn by(board: &mut FreeRunningBoard) -> Self {
        let (mut messages, mut reports, mut counters, mut welcomes) = (Vec::new(), Vec::new(), None, 0);
        let mut frames = Vec::new();
        loop {
            let (header, message) = board.receive().expect("the board answers");
            let bytes = encode(header, &message, &mut [0; FRAME_BYTES_MAX]).expect("it fits");
            frames.push((header.ticks, bytes as u64));
            match message {
                BoardMessage::Report(report) => reports.push((header.ticks, report)),
                BoardMessage::Counters(told) => counters = Some(told),
                BoardMessage::Welcome { .. } => welcomes += 1,
                BoardMessage::Described | BoardMessage::Configured => (),
                message => messages.push((header.ticks, message)),
            }
            assert!(welcomes == 1, "the board has started anew: {messages:?}");
            assert_eq!(
                header.sequence as usize + 1,
                frames.len(),
                "a frame of the board is lost: {messages:?}"
            );
            if let (Some(counters), [.., (_, BoardMessage::Stopped), _]) = (&counters, &messages[..]) {
                return Self { messages, counters: *counters, reports, frames };
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

    /// All traffic of the move is at most 70 % of what the line carries in the board's time, either way.
    #[track_caller]
    fn check_load(&self, made: &ScriptedRun) {
        let move_ticks = made.before + 1..=made.before + made.reports.len() as u64;
        let to_board = made.script.received(move_ticks.clone());
        let of_move = self.frames.iter().filter(|(tick, _)| move_ticks.contains(tick));
        let from_board: u64 = of_move.map(|(_, bytes)| bytes).sum();
        let carried = (made.reports.len() * LINE_BYTES_PER_TICK) as u64;
        for (bytes, way) in [(to_board, "to the board"), (from_board, "from the board")] {
            assert!(bytes > 0 && 10 * bytes <= 7 * carried, "{way}: {bytes} of {carried} bytes");
        }
    }

    /// Each report, which comes with every change of the drive of a move too, is that of the simulated loop in its
    /// tick, to the last bit of every field. After the last tick the drive goes off.
    #[track_caller]
    fn check_reports(&self, made: &ScriptedRun) {
        let off = CommandRecord::from(DriveCommand::OFF);
        let mut compared = 0;
        for (tick, report) in &self.reports {
            let number = usize::try_from(tick - made.before - 1).expect("a short run");
            if let Some(simulated) = made.reports.get(number) {
                compared += 1;
                assert_eq!(
                    simulated.difference(report),
                    None,
                    "tick {number}, left: simulated, on the board"
                );
            } else if number > made.reports.len() + usize::from(made.latency_ticks) {
                assert_eq!(report.applied, off, "tick {number}");
            }
        }
        // A thousand a second.
        assert!(compared >= made.reports.len() / 100, "{compared} of {} ticks", made.reports.len());
    }

    /// The messages are those of a board that makes `made` in time, every frame has arrived, and every report is right.
    #[track_caller]
    fn check(&self, made: &ScriptedRun) {
        let armed = BoardMessage::Armed;
        assert_eq!(self.messages(), [&armed, &armed, &BoardMessage::Stopped, &armed]);
        assert_eq!(self.counters.overruns, 0, "{:?}", self.counters);
        self.check_line();
        self.check_load(made);
        self.check_reports(made);
    }
}

/// The name among the counts of what is counted as `tick` where each tick decides.
fn counted(part: &str, tick: &str) -> String {
    match scene(part, "constant_rate").integer("board.decision_ticks") {
        1 => tick.to_owned(),
        ticks => format!("{tick}_every_{ticks}"),
    }
}

/// By the reviewed counts: each filter on each part that is behind by the longest latency at most, or that falls behind
/// for as long as it runs. Where a tick takes less than there is on average, and is behind by more now and then, a
/// short move need not show it.
fn cases(fits: bool) -> Vec<(&'static str, u32, FilterKind, &'static str)> {
    let all = PARTS.into_iter().flat_map(|part| FILTERS.map(|filter| (part, filter)));
    let cases: Vec<_> = all
        .filter(|((part, mhz), (.., tick))| {
            let (tick, per_tick) = (counted(part, tick), 10 * mhz);
            if fits {
                reviewed(&format!("{tick}_latency_at_{per_tick}")) <= LATENCY_TICKS_MAX as u64
            } else {
                counts(&tick).0 > f64::from(*mhz * 10)
            }
        })
        .map(|((part, mhz), (filter, name, _))| (part, mhz, filter, name))
        .collect();
    assert!(!cases.is_empty(), "the test tests nothing");
    cases
}

/// At the latency of the part's scene no command is late, every report is that of the simulation to the last bit, and
/// the rotor is held at the target. With a latency of one tick, which is less than the counts say is needed, some
/// commands are late.
#[test]
fn dual_a_program_meets_its_deadlines_on_a_part_that_has_the_time() {
    for (part, mhz, filter, name) in cases(true) {
        let mut scene = scene(part, name);
        let made = ScriptedRun::of_move(&scene, filter);
        let said = made.run_at(mhz);
        // For whoever reads why it failed.
        println!("{part}, {name}");
        said.check(&made);
        let (_, last) = said.reports.last().expect("a thousand a second");
        assert_eq!(last.phase.value(), Some(PhaseRecord::Holding), "{last:?}");
        let estimate = Angle::from_units(last.estimate.expect("of a rotor at rest").angle_units);
        let off_deg = estimate.minus(made.end).degrees();
        assert!(off_deg.abs() <= scene.number("position.tolerance_deg"), "{off_deg}");

        scene.set("board.latency_ticks", "1").expect("within its bounds");
        let late = ScriptedRun::of_move(&scene, filter).run_at(mhz).counters;
        assert!(late.overruns > 0, "{late:?}");
    }
}

/// The twin, with the longest latency on a part that has the time for it: every report is that of the simulation. Of
/// the motors 1 to 6 the first one's impacts come so densely that 800 MHz are not enough for it, and 1000 are.
#[test]
fn dual_the_program_with_the_twin_computes_what_the_simulation_does() {
    let (filter, name, tick) = FILTERS[2];
    assert!(reviewed(&format!("{tick}_latency_at_{}", 10 * TWIN_MHZ)) <= LATENCY_TICKS_MAX as u64);
    let mut scene = scene("stm32h743", name);
    for (key, value) in [("board.latency_ticks", LATENCY_TICKS_MAX), ("seed", 2)] {
        scene.set(key, &value.to_string()).expect("within its bounds");
    }
    let made = ScriptedRun::of_move(&scene, filter);
    made.run_at(TWIN_MHZ).check(&made);
}

/// The scene of the STM32H743, with a rotor that tilts in its place, and with a rate in the place of the move: every
/// report is that of the simulation.
#[test]
fn dual_the_program_of_the_stm32h743_computes_what_the_simulation_does() {
    let (part, mhz) = PARTS[1];
    let (filter, name, _) = FILTERS[1];
    let tilting = GalleryScene::named("set_f_plant").expect("a scene of the gallery");
    let mut scene = scene(part, name);
    for (key, value) in [("rate.deg_s", "160"), ("rate.duration_s", "0.5")] {
        scene.set(key, value).expect("within its bounds");
    }
    let made = ScriptedRun::of_rate(&scene, filter);
    made.run_at(mhz).check(&made);

    scene.set_all(tilting.text, Path::new("set_f_plant")).expect("settings");
    let made = ScriptedRun::of_move(&scene, filter);
    made.run_at(mhz).check(&made);
}

/// K9: with the longest latency there is, ten deadlines in a row are missed. The board says so, is off, and stays off
/// until a stop.
#[test]
fn dual_a_program_misses_its_deadlines_on_a_part_without_the_time_and_switches_off() {
    for (part, mhz, filter, name) in cases(false) {
        let mut scene = scene(part, name);
        scene.set("board.latency_ticks", &LATENCY_TICKS_MAX.to_string()).expect("within its bounds");
        let made = ScriptedRun::of_move(&scene, filter);
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

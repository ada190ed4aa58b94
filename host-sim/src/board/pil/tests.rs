use super::*;
use controller::map_correction::{LearntFactor, LearntFactors};
use controller::rate::{Profile, RateHold};
use controller::response_map::Burst;
use controller::{Drive, LoopTiming, PositionLoop, PositioningTuning, RateLoop, ResponseMap, Sense};
use estimator::{CameraFrame, Instruments, LdvSample, ResonanceOffset};
use link::{Coded, MapRows};
use motor_model::{DriveCommand, MotorParams, Parameter, Time};

use simulation::runs::filter::AnyFilter;
use simulation::runs::rate;

/// A change of a report.
type Spoil = fn(&mut TickRecord);

/// Flips the lowest bit of a number on the wire.
fn flip<T>(coded: &mut Coded<T>) {
    *coded = Coded::from_number(coded.number() ^ 1);
}

/// Either loop.
#[expect(clippy::large_enum_variant, reason = "a test has one")]
enum OwnLoop {
    Move(PositionLoop<AnyFilter, ResponseMap>),
    Rate(RateLoop<AnyFilter, ResponseMap>),
}

/// A processor that is the host's own loop once more, from what it is told alone. It spoils a field at a tick.
struct SecondLoop {
    own: Option<OwnLoop>,
    timing: LoopTiming,
    ticks: u64,
    spoil_at: u64,
    spoil: Spoil,
    /// Whether it does not hear what earlier moves have learnt.
    is_forgetful: bool,
}

impl SecondLoop {
    fn new(spoil_at: u64, spoil: Spoil) -> Self {
        Self { own: None, timing: LoopTiming::default(), ticks: 0, spoil_at, spoil, is_forgetful: false }
    }
}

struct Ports<'a> {
    frame: Option<CameraFrame>,
    samples: std::slice::Iter<'a, LdvSample>,
    timing: LoopTiming,
}

impl Sense for Ports<'_> {
    fn camera_frame(&mut self) -> Option<CameraFrame> {
        self.frame.take()
    }

    fn ldv_sample(&mut self) -> Option<LdvSample> {
        self.samples.next().copied()
    }
}

impl Drive for Ports<'_> {
    fn drive(&mut self, command: DriveCommand) -> DriveCommand {
        command
    }

    fn timing(&self) -> LoopTiming {
        self.timing
    }
}

impl Processor for SecondLoop {
    fn arm(&mut self, preparation: &[HostMessage]) -> Result<(), BoardError> {
        let (mut instruments, mut design) = (Instruments::default(), MotorParams::nominal());
        let mut map = *ResponseMap::table_1();
        for message in preparation {
            match message {
                HostMessage::Instruments(described) => instruments = *described,
                &HostMessage::Timing { latency_ticks, decision_ticks } => {
                    self.timing = LoopTiming { latency_ticks, decision_ticks };
                }
                HostMessage::MotorParameter(record) => {
                    design = design.with(Parameter::ALL[usize::from(record.index)], record.value)?;
                }
                HostMessage::MapBegin => map = ResponseMap::without_rows(design),
                HostMessage::MapRows(MapRows::Cruises(rows)) => {
                    let rows: Vec<_> = rows.iter().map(|row| row.cruise().unwrap()).collect();
                    map.append_cruises(&rows).unwrap();
                }
                HostMessage::MapRows(MapRows::Bursts { family, rows }) => {
                    let rows: Vec<_> = rows.iter().map(Burst::from).collect();
                    map.append_bursts(family.value().unwrap(), &rows).unwrap();
                }
                HostMessage::MapLearnt(learnt) if !self.is_forgetful => {
                    map.set_learnt((*learnt).into()).unwrap();
                }
                HostMessage::MapEnd(end) => map.complete(end.step_walk_correlation).unwrap(),
                _ => (),
            }
        }
        let filter = |kind| AnyFilter::new(filter_name(kind), &design, &instruments);
        self.own = Some(match preparation.last() {
            Some(HostMessage::Configure(asked)) => {
                let (target, limits) = asked.checked()?;
                let tuning = PositioningTuning { limits, ..PositioningTuning::new(&instruments) };
                OwnLoop::Move(PositionLoop::new(filter(asked.filter)?, map, target, tuning, Time::ZERO))
            }
            Some(HostMessage::ConfigureRate(asked)) => {
                let (_, tuning) = asked.checked(&instruments)?;
                let profile = Profile::dwell(asked.rate_deg_s)?;
                let hold = RateHold::new(profile, tuning, Time::ZERO);
                OwnLoop::Rate(RateLoop::new(filter(asked.filter)?, map, hold))
            }
            other => panic!("neither a move nor a rate: {other:?}"),
        });
        Ok(())
    }

    fn tell(&mut self, message: &HostMessage) -> Result<BoardMessage, BoardError> {
        match (message, &self.own) {
            (HostMessage::Learnt, Some(OwnLoop::Move(own))) => Ok(BoardMessage::Learnt(own.learnt().into())),
            _ => Err(BoardError::Board("makes no experiments".to_owned())),
        }
    }

    fn tick(&mut self, measurements: &TickMeasurements) -> Result<TickRecord, BoardError> {
        self.ticks += 1;
        let now = Time::from_nanos(self.ticks * PositionLoop::TICK_NANOS);
        let (frame, samples) = (measurements.camera_frame, measurements.ldv_samples.iter());
        let mut ports = Ports { frame, samples, timing: self.timing };
        let mut report = match self.own.as_mut().expect("armed first") {
            OwnLoop::Move(own) => TickRecord::from(&controller::tick(own, now, &mut ports)),
            OwnLoop::Rate(own) => TickRecord::from(&controller::tick_rate(own, now, &mut ports)),
        };
        if self.ticks == self.spoil_at {
            (self.spoil)(&mut report);
        }
        Ok(report)
    }
}

fn scene(sets: &[&str]) -> Scene {
    let sets: Vec<String> = sets.iter().map(|&set| set.to_owned()).collect();
    Scene::of_sets(&sets).unwrap()
}

/// What earlier moves have learnt reaches the processor with the map. One that does not hear it has learnt something
/// else at the end, though a rotor that is at its target tells no difference.
#[test]
fn exact_what_was_learnt_is_compared() {
    let factor = LearntFactor { value: 1.25, variance: 1e-3 };
    let learnt = LearntFactors {
        bursts: [factor; 5],
        step_walk_covariance: 5e-4,
        rates: [factor; 2],
        resonances: [ResonanceOffset { hz: 31.5, hz2: 40.0 }, ResonanceOffset { hz: -20.0, hz2: 90.0 }],
    };
    let map = ResponseMap::table_1().with_learnt(learnt).unwrap();
    let sets = ["position.to_deg=0", "position.tolerance_deg=1", "position.hold_s=0.01"];
    let scene = scene(&sets).with_response_map(map);
    for is_forgetful in [false, true] {
        let mut second = SecondLoop { is_forgetful, ..SecondLoop::new(u64::MAX, |_| ()) };
        let compared = run(&scene, &mut second).unwrap();
        assert_eq!(compared.identical, !is_forgetful);
        let difference = compared.difference.map(|found| (found.field, found.step == compared.steps));
        assert_eq!(difference, is_forgetful.then_some(("learnt", true)));
    }
}

/// Filter, target, tolerance and deadline reach the processor, and the measurements are those that the host took in.
#[test]
fn dual_a_second_loop_computes_the_same_from_what_it_is_told() {
    for sets in [
        &["position.to_deg=-0.5", "position.hold_s=0.01"][..],
        &["position.to_deg=20", "estimator.filter=impact_aided", "position.deadline_s=0.05", "seed=5"][..],
        &["position.to_deg=5", "board.latency_ticks=12", "board.decision_ticks=4", "position.deadline_s=0.1"]
            [..],
        &[
            "position.to_deg=1",
            "position.tolerance_deg=0.5",
            "camera.drop_probability=0.3",
            "position.deadline_s=0.1",
        ][..],
        &["camera.frame_rate_hz=200", "ldv.installed=no", "position.deadline_s=0.1"][..],
    ] {
        let scene = scene(sets);
        let run = run(&scene, &mut SecondLoop::new(0, |_| ())).unwrap();
        assert!(run.identical, "{run:?}");
        let alone = position::run(&scene, |_| ()).unwrap();
        assert_eq!(run.outcome, Some(alone));
        let ticks = (run.outcome.unwrap().duration_s * 1e5).round();
        assert_eq!(ticks.to_string(), run.steps.to_string());
    }
}

/// Moves whose limits matter. The last one ends at its travel.
const LIMITED: [&[&str]; 3] = [
    &["position.to_deg=20", "limits.amplitude_max=0.5", "position.deadline_s=0.2"],
    &["position.to_deg=20", "limits.drive_on_s=0.02", "position.deadline_s=0.1"],
    &["position.to_deg=-5", "limits.least_deg=-5", "position.tolerance_deg=0.005", "seed=4"],
];

/// Each limit of a move reaches the processor, ends it as it ends the host's alone, and matters: without it the move is
/// another one.
#[test]
fn dual_a_second_loop_keeps_the_limits_of_a_move() {
    for sets in LIMITED {
        let limited = scene(sets);
        let run = run(&limited, &mut SecondLoop::new(0, |_| ())).unwrap();
        assert_eq!(run.difference, None, "{sets:?}");
        let outcome = run.outcome.unwrap();
        assert_eq!(outcome, position::run(&limited, |_| ()).unwrap());
        let free: Vec<&str> = sets.iter().copied().filter(|set| !set.starts_with("limits.")).collect();
        assert_ne!(outcome, position::run(&scene(&free), |_| ()).unwrap(), "{sets:?}");
        let ends_at_travel = sets.contains(&"limits.least_deg=-5");
        assert_eq!(outcome.stopped.as_deref() == Some("OutOfTravel"), ends_at_travel, "{outcome:?}");
    }
}

/// What the travel does not allow is refused before a processor is told anything.
#[test]
fn exact_a_target_outside_of_the_travel_is_refused() {
    let outside = scene(&["position.to_deg=20", "limits.greatest_deg=19"]);
    let error = preparation(&outside).unwrap_err().to_string();
    assert!(error.contains("position.to_deg = 20") && error.contains("limits.greatest_deg = 19"), "{error}");
}

/// A rate as well, in the words of the host: 100 deg/s lead to 200 degrees in 2 s, clockwise or not. One for which no
/// drive is allowed is refused too.
#[test]
fn exact_a_rate_that_leaves_the_travel_is_refused() {
    for sets in [
        &["rate.deg_s=100", "limits.greatest_deg=199"][..],
        &["rate.deg_s=-100", "limits.least_deg=-199"],
        &["rate.deg_s=100", "limits.amplitude_max=0.2"],
    ] {
        let refused = scene(&[&["rate.duration_s=2"], sets].concat());
        let error = rate_preparation(&refused).unwrap_err();
        let by_host = rate::run(&refused, |_| ()).unwrap_err();
        assert_eq!(error.to_string(), by_host.to_string());
        assert_eq!(error.hint(), crate::run_reports::hint(&by_host));
        let [key, value] = sets[1].split('=').collect::<Vec<_>>()[..] else { panic!("a key and a value") };
        assert!(error.to_string().contains(&format!("{key} = {value}")), "{error}");
    }
    let within = ["rate.duration_s=2", "rate.deg_s=100", "limits.greatest_deg=201"];
    assert!(rate_preparation(&scene(&within)).is_ok());
}

/// The same of a rate: filter, rate and the window that slow frames ask for.
#[test]
fn dual_a_second_loop_holds_the_same_rate_from_what_it_is_told() {
    for sets in [
        &["rate.deg_s=160", "rate.duration_s=0.5", "plant.step_s=5e-6"][..],
        &[
            "rate.deg_s=160",
            "rate.duration_s=0.5",
            "plant.step_s=5e-6",
            "board.latency_ticks=16",
            "board.decision_ticks=5",
        ][..],
        &["rate.deg_s=-40", "rate.duration_s=0.5", "estimator.filter=impact_aided", "plant.step_s=5e-6"][..],
        &["rate.duration_s=0.6", "camera.frame_rate_hz=200", "ldv.installed=no", "faults=drive:dead"][..],
        &["rate.deg_s=160", "rate.duration_s=0.5", "plant.step_s=5e-6", "limits.amplitude_max=0.6"][..],
        &["rate.deg_s=160", "rate.duration_s=0.5", "plant.step_s=5e-6", "limits.drive_on_total_s=0.1"][..],
    ] {
        let scene = scene(sets);
        let run = hold_rate(&scene, &mut SecondLoop::new(0, |_| ())).unwrap();
        assert_eq!(run.difference, None);
        assert_eq!(run.outcome, Some(rate::run(&scene, |_| ()).unwrap()));
        let ticks = (scene.number("rate.duration_s") * 1e5).round();
        assert_eq!(ticks.to_string(), run.steps.to_string());
    }
}

/// L9, of a rate: a difference in what is asked of the rotor is found and named.
#[test]
fn exact_a_difference_of_a_rate_is_named() {
    let scene = scene(&["rate.duration_s=0.5", "plant.step_s=5e-6"]);
    let spoils: [(&str, Spoil); 5] = [
        ("rate.wanted_rad_s", |r| r.rate = None),
        ("rate.wanted_rad_s", |r| r.rate.as_mut().unwrap().wanted_rad_s += 1.0),
        ("rate.reference_units", |r| *r.rate.as_mut().unwrap().reference_units.as_mut().unwrap() += 1),
        ("rate.reference_units", |r| r.rate.as_mut().unwrap().reference_units = None),
        ("phase", |r| flip(&mut r.phase)),
    ];
    for (field, spoil) in spoils {
        let run = hold_rate(&scene, &mut SecondLoop::new(2000, spoil)).unwrap();
        let difference = run.difference.unwrap();
        assert_eq!((difference.step, difference.field, run.outcome), (2000, field, None));
    }
}

/// L9: one bit of one field at one tick is found and named.
#[test]
fn exact_a_difference_is_named_by_step_field_and_both_values() {
    let scene = scene(&["position.deadline_s=0.05", "seed=3"]);
    let host = std::cell::Cell::new(0);
    position::run(&scene, |moment| {
        if moment.at == Time::from_nanos(2000 * PositionLoop::TICK_NANOS) {
            host.set(moment.report.estimate.unwrap().rate_rad_s.to_bits());
        }
    })
    .unwrap();
    let spoil = |report: &mut TickRecord| {
        let estimate = report.estimate.as_mut().unwrap();
        estimate.rate_rad_s = f32::from_bits(estimate.rate_rad_s.to_bits() ^ 1);
    };
    let run = run(&scene, &mut SecondLoop::new(2000, spoil)).unwrap();
    assert!(!run.identical && run.outcome.is_none());
    assert_eq!(run.steps, 2000);
    let host = host.get();
    let difference = run.difference.unwrap();
    assert_eq!(
        difference.to_string(),
        format!(
            "step 2000 of seed 3: estimate.rate_rad_s is {:#x} on the microcontroller and {host:#x} on the host",
            host ^ 1
        )
    );
}

/// Every field is compared, and so is whether there is an estimate at all.
#[test]
fn law_no_field_of_a_report_is_left_out() {
    let scene = scene(&["position.deadline_s=0.02"]);
    let spoils: [(&str, Spoil); 21] = [
        ("estimate.at_nanos", |r| r.estimate = None),
        ("estimate.at_nanos", |r| r.estimate.as_mut().unwrap().at_nanos += 1),
        ("estimate.angle_units", |r| r.estimate.as_mut().unwrap().angle_units -= 1),
        ("estimate.angle_rad2", |r| r.estimate.as_mut().unwrap().angle_rad2 = f32::NAN),
        ("estimate.angle_rate_rad2_s", |r| r.estimate.as_mut().unwrap().angle_rate_rad2_s += 1.0),
        ("estimate.rate_rad2_s2", |r| r.estimate.as_mut().unwrap().rate_rad2_s2 *= 2.0),
        ("estimate.resting", |r| r.estimate.as_mut().unwrap().resting ^= true),
        ("health", |r| flip(&mut r.health)),
        ("camera.source", |r| flip(&mut r.camera.as_mut().unwrap().source)),
        ("camera.taken_nanos", |r| r.camera.as_mut().unwrap().taken_nanos += 1),
        ("camera.innovation_rad", |r| r.camera.as_mut().unwrap().innovation_rad += 1.0),
        ("camera.variance_rad2", |r| r.camera.as_mut().unwrap().variance_rad2 += 1.0),
        ("camera.verdict", |r| flip(&mut r.camera.as_mut().unwrap().verdict)),
        ("command.mode", |r| flip(&mut r.command.mode)),
        ("command.amplitude", |r| r.command.amplitude += 0.25),
        ("command.frequency_offset_hz", |r| r.command.frequency_offset_hz = -0.0),
        ("applied.mode", |r| flip(&mut r.applied.mode)),
        ("applied.amplitude", |r| r.applied.amplitude += 0.25),
        ("applied.frequency_offset_hz", |r| r.applied.frequency_offset_hz = -0.0),
        ("phase", |r| flip(&mut r.phase)),
        ("since_nanos", |r| r.since_nanos += 1),
    ];
    for (field, spoil) in spoils {
        // A tick with a camera frame: one comes every ten.
        let difference = run(&scene, &mut SecondLoop::new(1000, spoil)).unwrap().difference.unwrap();
        assert_eq!((difference.step, difference.field), (1000, field));
    }
}

/// A numbered field is given by its number and by what the number means.
#[test]
fn exact_a_numbered_field_is_given_with_its_meaning() {
    let spoil = |r: &mut TickRecord| r.health = estimator::Health::Waiting.into();
    let run = run(&scene(&["position.deadline_s=0.02"]), &mut SecondLoop::new(1000, spoil)).unwrap();
    let difference = run.difference.unwrap();
    assert_eq!((difference.field, difference.board.as_str()), ("health", "0x1 (Waiting)"));
}

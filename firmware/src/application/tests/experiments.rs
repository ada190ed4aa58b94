//! Experiments over the link: the loop of the controller, its orders and its responses.

use controller::commissioning::experiment::Experiment;
use controller::commissioning::{
    CommissioningEnd, ExperimentPhase, ExperimentTuning, Experimenter, tick_experiment,
};
use controller::response_map::direction;
use controller::{InFlight, Travel};
use estimator::{ConstantRate, ConstantRateTuning, Instruments};
use link::{
    ExperimentDrive, ExperimentRecord, ExperimentsConfiguration, FilterKind, PhaseRecord, ShownRecord,
};
use motor_model::Angle;

use super::rate::{Measured, Measurements};
use super::*;

const ASKED: ExperimentsConfiguration = ExperimentsConfiguration {
    filter: FilterKind::ConstantRate,
    time_max_nanos: 60_000_000_000,
    travel_deg: None,
    amplitude_max: None,
};

impl Bench {
    fn armed_for_experiments() -> Self {
        let mut bench = Self::new();
        bench.exchange(&HostMessage::Hello);
        assert_eq!(bench.exchange(&HostMessage::ConfigureExperiments(ASKED)), [BoardMessage::Configured]);
        assert_eq!(bench.exchange(&HostMessage::Arm), [BoardMessage::Armed]);
        bench
    }

    fn order(&mut self, number: u16, experiment: Experiment) -> Vec<BoardMessage> {
        self.exchange(&HostMessage::Experiment(ExperimentRecord::new(number, &experiment)))
    }

    /// Rests until the phase is `wanted`; how many ticks the drive was on meanwhile.
    fn rest_until(&mut self, wanted: ExperimentPhase) -> u32 {
        let mut driven = 0;
        for _ in 0..300_000 {
            self.measure();
            let report = self.step().expect("it is armed");
            driven += u32::from(!self.off());
            if phase(&report) == wanted {
                return driven;
            }
        }
        panic!("never {wanted:?}");
    }
}

fn phase(report: &TickRecord) -> ExperimentPhase {
    match report.phase.value() {
        Some(PhaseRecord::Experiment(phase)) => phase,
        other => panic!("no phase of an experiment: {other:?}"),
    }
}

fn taken(number: u16) -> [BoardMessage; 1] {
    [BoardMessage::ExperimentTaken { number }]
}

const TRAIN: Experiment =
    Experiment::Train { mode: DriveMode::C, amplitude: 0.5, offset_hz: 0.0, ticks: 30, count: 4 };

/// Every report of a train and a sweep is that of the controller's own loop on the same measurements, to the last bit,
/// without a latency and with one, deciding in every tick and in one of four. So are the responses.
#[test]
fn dual_the_experiments_of_a_board_are_those_of_the_controllers_loop() {
    for (latency_ticks, decision_ticks) in [(0, 1), (5, 1), (8, 4)] {
        let mut bench = Bench::new();
        bench.exchange(&HostMessage::Hello);
        bench.exchange(&HostMessage::Timing { latency_ticks, decision_ticks });
        bench.exchange(&HostMessage::ConfigureExperiments(ASKED));
        bench.exchange(&HostMessage::Arm);
        let instruments = Instruments::default();
        let nominal = MotorParams::nominal();
        let mut filter = ConstantRate::<f32>::new(&ConstantRateTuning::for_motor(&nominal, &instruments));
        let mut own = Experimenter::new(ExperimentTuning::new(&instruments), Time::ZERO);
        let mut in_flight = InFlight::new();
        let orders = [TRAIN, Experiment::Sweep { mode: DriveMode::B, amplitude: 1.0 }];
        let mut responses = Vec::new();
        let timing = LoopTiming { latency_ticks, decision_ticks };
        let mut waiting = Measurements { timing, ..Measurements::default() };
        for tick in 1..=320_000_u64 {
            let now = time(tick);
            let dither_deg = if tick.is_multiple_of(20) { 0.01 } else { 0.0 };
            let measured = Measured::at(time(tick - 1), tick, Angle::from_degrees(dither_deg));
            waiting.add(&measured);
            if let Some(sample) = measured.sample {
                bench.exchange(&HostMessage::Ldv([sample.into()].into_iter().collect()));
            }
            if let Some(frame) = measured.frame {
                bench.exchange(&HostMessage::Camera(frame.into()));
            }
            let theirs = bench.step().unwrap();
            let report = tick_experiment(&mut filter, &mut own, &mut in_flight, now, &mut waiting);
            assert_eq!(TickRecord::from(&*report).difference(&theirs), None, "tick {tick}");
            if own.phase() == ExperimentPhase::Ready {
                if let Some(response) = own.response() {
                    let [BoardMessage::Response(theirs)] = &bench.exchange(&HostMessage::Response)[..] else {
                        panic!("it is over");
                    };
                    assert_eq!((theirs.number, &theirs.shown), (own.number(), &response.into()));
                    responses.push(theirs.shown.clone());
                }
                let Some(order) = orders.get(usize::from(own.number())) else { break };
                assert!(own.order(*order));
                assert_eq!(bench.order(own.number(), *order), taken(own.number()));
            }
        }
        assert!(
            matches!(&responses[..], [ShownRecord::Train { .. }, ShownRecord::Sweep(points)] if points.len() == 13),
            "{responses:?}"
        );
    }
}

/// Nothing is driven before an order. The order once more is answered again and starts nothing, another one has to
/// wait, and a response stays until the next order.
#[test]
fn law_orders_come_one_by_one_and_a_lost_answer_is_asked_again() {
    let mut bench = Bench::armed_for_experiments();
    assert_eq!(bench.exchange(&HostMessage::Response), fault(BoardFault::NotInOrder));
    assert_eq!(bench.order(1, TRAIN), fault(BoardFault::NotInOrder), "the rotor is not known to rest");
    assert_eq!(bench.rest_until(ExperimentPhase::Ready), 0);
    assert_eq!(bench.exchange(&HostMessage::Response), fault(BoardFault::NotInOrder), "there was none");
    for wrong in [0, 2, u16::MAX] {
        assert_eq!(bench.order(wrong, TRAIN), fault(BoardFault::NotInOrder), "{wrong}");
    }
    assert_eq!(bench.order(1, TRAIN), taken(1));
    assert_eq!(bench.order(1, TRAIN), taken(1));
    assert_eq!(bench.order(2, TRAIN), fault(BoardFault::NotInOrder));
    // Four bursts, each as long as was ordered.
    assert_eq!(bench.rest_until(ExperimentPhase::Ready), 120);
    let first = bench.exchange(&HostMessage::Response);
    assert!(matches!(&first[..], [BoardMessage::Response(record)] if record.number == 1), "{first:?}");
    assert_eq!(bench.exchange(&HostMessage::Response), first);
    assert_eq!(bench.order(1, TRAIN), taken(1), "that of a host that has not heard of it");
    assert_eq!(bench.rest_until(ExperimentPhase::Ready), 0);
    assert_eq!(bench.order(2, TRAIN), taken(2));
    assert_eq!(bench.rest_until(ExperimentPhase::Ready), 120);
}

/// A stop ends an experiment at once. Armed again, they are counted anew.
#[test]
fn law_a_stop_ends_an_experiment_and_arming_begins_anew() {
    let mut bench = Bench::armed_for_experiments();
    bench.rest_until(ExperimentPhase::Ready);
    assert_eq!(
        bench.order(1, Experiment::Cruise { mode: DriveMode::B, amplitude: 1.0, offset_hz: 0.0 }),
        taken(1)
    );
    bench.rest_until(ExperimentPhase::Cruising);
    assert!(!bench.off());
    assert_eq!(bench.exchange(&HostMessage::Stop), [BoardMessage::Stopped]);
    assert!(bench.off());
    assert_eq!(bench.exchange(&HostMessage::Response), fault(BoardFault::NoExperiments));
    assert_eq!(bench.order(2, TRAIN), fault(BoardFault::NoExperiments));
    assert_eq!(bench.exchange(&HostMessage::Arm), [BoardMessage::Armed]);
    bench.rest_until(ExperimentPhase::Ready);
    assert_eq!(bench.order(2, TRAIN), fault(BoardFault::NotInOrder));
    assert_eq!(bench.order(1, TRAIN), taken(1));
}

/// L5, during an experiment; and the time that was asked for ends them.
#[test]
fn law_a_silent_host_and_the_end_of_the_time_switch_off() {
    let mut bench = Bench::armed_for_experiments();
    bench.rest_until(ExperimentPhase::Ready);
    bench.order(1, Experiment::Sweep { mode: DriveMode::B, amplitude: 1.0 });
    bench.rest_until(ExperimentPhase::Sweeping);
    assert!(!bench.off());
    bench.exchange(&HostMessage::Count);
    assert!((0..SILENT_TICKS).all(|_| bench.board.tick().is_some()));
    assert_eq!(bench.board.tick(), None);
    assert!(bench.off());
    bench.exchange(&HostMessage::Stop);
    // The time counts from arming, which is later than it is long.
    (0..60_000).for_each(|_| assert!(bench.board.tick().is_none()));
    let short = ExperimentsConfiguration { time_max_nanos: 500_000_000, ..ASKED };
    assert_eq!(bench.exchange(&HostMessage::ConfigureExperiments(short)), [BoardMessage::Configured]);
    bench.exchange(&HostMessage::Arm);
    bench.rest_until(ExperimentPhase::Ready);
    bench.order(1, Experiment::Sweep { mode: DriveMode::B, amplitude: 1.0 });
    bench.rest_until(ExperimentPhase::Ended(CommissioningEnd::TimeOver));
    assert!(bench.off());
    assert_eq!(bench.order(2, TRAIN), fault(BoardFault::NotInOrder));
}

/// Each number is refused by its key, in a configuration and in an order. Other tasks know no orders.
#[test]
fn law_experiments_out_of_bounds_are_refused_by_name() {
    let refused = |key: &str| fault(BoardFault::OutOfBounds { key: key.try_into().unwrap() });
    let mut bench = Bench::new();
    bench.begin();
    assert_eq!(bench.order(1, TRAIN), fault(BoardFault::NoExperiments));
    assert_eq!(bench.exchange(&HostMessage::ConfigureExperiments(ASKED)), fault(BoardFault::Armed));
    bench.exchange(&HostMessage::Stop);
    let long = ExperimentsConfiguration { time_max_nanos: u64::MAX, ..ASKED };
    assert_eq!(bench.exchange(&HostMessage::ConfigureExperiments(long)), refused("experiment.time_max_s"));
    bench.exchange(&HostMessage::ConfigureExperiments(ASKED));
    bench.exchange(&HostMessage::Arm);
    bench.rest_until(ExperimentPhase::Ready);
    let record = ExperimentRecord::new(1, &TRAIN);
    let endless = ExperimentDrive::Train { ticks: u32::MAX, count: 1 };
    for (record, key) in [
        (ExperimentRecord { mode: None.into(), ..record }, "experiment.mode"),
        (ExperimentRecord { amplitude: 1.5, ..record }, "experiment.amplitude"),
        (ExperimentRecord { drive: endless, ..record }, "experiment.ticks"),
    ] {
        assert_eq!(bench.exchange(&HostMessage::Experiment(record)), refused(key));
    }
    assert_eq!(bench.order(1, TRAIN), taken(1), "none of them counted");
    assert_eq!(bench.exchange(&HostMessage::Hold), fault(BoardFault::NoMove));
}

/// A cruise is driven until the rotor leaves the travel, which counts from the zero, and that tick ends the experiments
/// for good: at the board as in the controller's own loop, to the last bit of every report.
#[test]
fn dual_the_travel_ends_the_experiments_of_a_board_as_of_the_controllers_loop() {
    let (zero_deg, least_deg, greatest_deg) = (100.0, -5.0, 5.0);
    let asked = ExperimentsConfiguration { travel_deg: Some((least_deg, greatest_deg)), ..ASKED };
    for (mode, limit_deg) in [(DriveMode::B, greatest_deg), (DriveMode::C, least_deg)] {
        let mut bench = Bench::new();
        bench.exchange(&HostMessage::Hello);
        let angle_units = Angle::from_degrees(zero_deg).units();
        bench.exchange(&HostMessage::Zero { angle_units: Some(angle_units) });
        bench.exchange(&HostMessage::ConfigureExperiments(asked));
        bench.exchange(&HostMessage::Arm);
        let instruments = Instruments::default();
        let nominal = MotorParams::nominal();
        let mut filter = ConstantRate::<f32>::new(&ConstantRateTuning::for_motor(&nominal, &instruments));
        // By the camera's angle.
        let travel = Travel::try_new(least_deg + zero_deg, greatest_deg + zero_deg).unwrap();
        let tuning = ExperimentTuning::new(&instruments).with_limits(travel, 1.0);
        let mut own = Experimenter::new(tuning, Time::ZERO);
        let mut in_flight = InFlight::new();
        let (mut turned_deg, mut last_deg, mut ended) = (0.0, None, 0);
        for tick in 1..=100_000_u64 {
            let dither_deg = if tick.is_multiple_of(20) { 0.01 } else { 0.0 };
            let angle = Angle::from_degrees(zero_deg + turned_deg + dither_deg);
            let mut measured = Measured::at(time(tick - 1), tick, angle);
            bench.exchange(&HostMessage::Ldv(measured.sample.map(Into::into).into_iter().collect()));
            if let Some(frame) = measured.frame {
                bench.exchange(&HostMessage::Camera(frame.into()));
            }
            let theirs = bench.step().unwrap();
            let now = time(tick);
            let report = tick_experiment(&mut filter, &mut own, &mut in_flight, now, &mut measured);
            let mut ours = TickRecord::from(&*report);
            if let Some(estimate) = &mut ours.estimate {
                estimate.angle_units -= angle_units;
            }
            assert_eq!(ours.difference(&theirs), None, "tick {tick}");
            if own.phase() == ExperimentPhase::Ready && own.number() == 0 {
                let cruise = Experiment::Cruise { mode, amplitude: 1.0, offset_hz: 0.0 };
                assert!(own.order(cruise));
                assert_eq!(bench.order(1, cruise), taken(1));
            }
            if !bench.off() {
                turned_deg += f64::from(direction(mode)) * 50.0 * 1e-5;
                last_deg = Some(turned_deg);
            }
            ended += u32::from(phase(&theirs) == ExperimentPhase::Ended(CommissioningEnd::EndOfTravel));
        }
        let last_deg = last_deg.expect("it was driven");
        assert!(ended > 10_000 && bench.off(), "{ended} {:?} {last_deg}", own.phase());
        // The rotor was driven up to the limit, as far as a camera of 10 kHz tells.
        assert!((last_deg - limit_deg).abs() < 0.1, "{last_deg}");
    }
}

/// An order that drives harder than is allowed is refused by name, and starts nothing.
#[test]
fn law_a_stronger_experiment_than_is_allowed_is_refused() {
    let mut bench = Bench::new();
    bench.exchange(&HostMessage::Hello);
    let weak = ExperimentsConfiguration { amplitude_max: Some(0.25), ..ASKED };
    bench.exchange(&HostMessage::ConfigureExperiments(weak));
    bench.exchange(&HostMessage::Arm);
    bench.rest_until(ExperimentPhase::Ready);
    let key = "experiment.amplitude".try_into().unwrap();
    assert_eq!(bench.order(1, TRAIN), fault(BoardFault::OutOfBounds { key }));
    let weaker = Experiment::Cruise { mode: DriveMode::C, amplitude: 0.25, offset_hz: 0.0 };
    assert_eq!(bench.order(1, weaker), taken(1));
}

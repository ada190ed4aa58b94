//! B1: a loop so far behind that the queue loses ticks, and with them samples, while the rotor bounces.

use std::collections::VecDeque;

use estimator::{
    AngleFilter, Estimate, ImpactAided, ImpactAidedTuning, Instruments, LdvSample, RandomWalkTuning,
};
use link::Configuration;
use motor_model::Time;

use super::*;

/// Ticks that wait at most.
const WAITING: u64 = QUEUE_LENGTH as u64 - 1;

/// Samples from one impact to the next.
const SAMPLES_PER_FLIGHT: u16 = 60;

/// The velocity of a rotor that falls freely between impacts, and is on average at rest.
pub(super) fn flight_m_s(number: u32) -> f32 {
    let fall_m_s = 9.81 * 5e-6;
    let since = (number % u32::from(SAMPLES_PER_FLIGHT)) as u16;
    fall_m_s * (0.5 * f32::from(SAMPLES_PER_FLIGHT) - f32::from(since))
}

/// A board with `impact_aided`, and the same filter by itself, which is shown what the board's loop runs.
struct Beside {
    bench: Bench,
    interrupts: u64,
    filter: ImpactAided<f32>,
    /// The decisions that do not act yet.
    in_flight: VecDeque<Option<Estimate<f32>>>,
    /// The drive that the loop was told last.
    drive: DriveCommand,
}

impl Beside {
    /// Driven, with the longest latency.
    fn driven() -> Self {
        let mut bench = Bench::new();
        let configuration = Configuration { filter: link::FilterKind::ImpactAided, ..MOVE };
        let ticks = LATENCY_TICKS_MAX as u8;
        let messages = [
            HostMessage::Timing { latency_ticks: ticks, decision_ticks: 1 },
            HostMessage::ReportPeriod { ticks: 1 },
            HostMessage::Configure(configuration),
            HostMessage::Arm,
        ];
        for message in [HostMessage::Hello].iter().chain(&messages) {
            assert!(!matches!(bench.exchange(message)[..], [BoardMessage::Fault(_)]), "{message:?}");
        }
        let tuning = ImpactAidedTuning::new(&MotorParams::nominal(), &Instruments::default());
        let filter = ImpactAided::new(&tuning);
        let mut beside =
            Self { bench, interrupts: 0, filter, in_flight: VecDeque::new(), drive: DriveCommand::OFF };
        while !beside.bench.is_on() {
            assert!(beside.interrupts < 5000, "the loop does not drive");
            beside.ticks(1);
        }
        beside.bench.timer_task.converter.bounces = true;
        beside.ticks(500);
        beside
    }

    /// Interrupts, each with its tick. Every tenth has a frame of a dithered camera.
    fn ticks(&mut self, count: u64) {
        for _ in 0..count {
            self.interrupts += 1;
            self.bench.timer_task.interrupt();
            let has_frame = self.interrupts.is_multiple_of(10);
            self.run(self.interrupts, has_frame);
        }
    }

    /// The loop is held up for so many interrupts, and then runs those of their ticks that are left.
    fn held_up_for(&mut self, interrupts: u64) {
        (0..interrupts).for_each(|_| {
            self.bench.timer_task.interrupt();
        });
        (1..=WAITING.min(interrupts)).for_each(|waiting| self.run(self.interrupts + waiting, false));
        self.interrupts += interrupts;
    }

    /// The tick of interrupt `number`: its report has the estimate of the filter by itself, to the last bit.
    fn run(&mut self, number: u64, has_frame: bool) {
        let now = instant(number);
        let angle_units = 350_546 * i32::from(number.is_multiple_of(20));
        let frame = CameraRecord { exposed_nanos: now.nanos(), angle_units, marks_used: 0, residual: 0 };
        if has_frame {
            self.bench.exchange(&HostMessage::Camera(frame));
        }
        self.bench.received.clear();
        assert!(self.bench.run_tick());
        let [BoardMessage::Report(report)] = self.bench.received[..] else {
            panic!("{number}: {:?}", self.bench.received)
        };
        show_samples(&mut self.filter, number, self.bench.timer_task.converter.bounces);
        if has_frame {
            self.filter.update_camera(&frame.into());
        }
        self.in_flight.push_back(estimate(&self.filter, number));
        let decided =
            if self.in_flight.len() > LATENCY_TICKS_MAX { self.in_flight.pop_front() } else { None };
        assert_eq!(report.estimate, decided.flatten().map(EstimateRecord::from), "tick {number}");
        self.drive = report.applied.command().unwrap();
        self.filter.drive(now, self.drive);
    }
}

/// The instant of interrupt `number`.
fn instant(number: u64) -> Time {
    Time::from_nanos(number * PositionLoop::TICK_NANOS)
}

/// Shows `filter` the samples of the tick of interrupt `number`.
fn show_samples(filter: &mut ImpactAided<f32>, number: u64, bounces: bool) {
    for half in [1, 0] {
        let sample = 2 * number - half;
        let taken_at = Time::from_nanos(sample * PositionLoop::TICK_NANOS / 2);
        let velocity_m_s = RotorAtRest::velocity_m_s(sample as u32, bounces);
        filter.update_ldv(&LdvSample { taken_at, velocity_m_s });
    }
}

/// What `filter` says in the tick of interrupt `number` of the instant in which the command acts.
fn estimate(filter: &ImpactAided<f32>, number: u64) -> Option<Estimate<f32>> {
    filter.assess_for(instant(number), instant(number + LATENCY_TICKS_MAX as u64)).0
}

/// None, fewer than the filter takes for a gap, and more: every sample has the time at which it was taken.
#[test]
fn dual_the_filter_is_told_of_every_lost_tick() {
    for lost in [0, 1, 4, 5, 9] {
        let mut beside = Beside::driven();
        beside.held_up_for(WAITING + lost);
        beside.ticks(200);
        let late = WAITING - LATENCY_TICKS_MAX as u64;
        let overruns = beside.bench.loop_task.counters().overruns;
        assert!(u64::from(overruns) == late + lost && beside.bench.is_on(), "{lost}: {overruns}");
    }
}

/// In 50 us and more without samples impacts are not known: the variance of the rate grows as that of the random walk
/// of the rate does, by more than that of a filter that saw them, whether there was one or not. Where there was none,
/// by all of it but for what the impacts do that are too small to be seen.
#[test]
fn law_after_lost_ticks_the_rate_is_as_uncertain_as_after_a_random_walk() {
    let per_s = RandomWalkTuning::<f32>::default().impacted_b_rad2_s3;
    for (lost, before, has_impact) in [(5, 0, false), (9, 0, false), (9, 15, true)] {
        let mut beside = Beside::driven();
        beside.ticks(before);
        beside.held_up_for(WAITING + lost);
        let mut whole = beside.filter.clone();
        let next = beside.interrupts + 1;
        for number in next - lost..=next {
            show_samples(&mut whole, number, true);
            whole.drive(instant(number), beside.drive);
        }
        let flights = |number: u64| 2 * number / u64::from(SAMPLES_PER_FLIGHT);
        assert_eq!(flights(next) > flights(next - lost), has_impact, "{lost}");
        beside.ticks(1);
        let variance = |filter| estimate(filter, next).unwrap().rate_rad2_s2;
        let grown = variance(&beside.filter) - variance(&whole);
        let walk = per_s * (f32::from(lost as u16) * 10e-6 + 5e-6);
        let least = if has_impact { 0.0 } else { 0.9 * walk };
        assert!(least < grown && grown < 1.1 * walk, "{lost}: {grown}, walk {walk}");
    }
}

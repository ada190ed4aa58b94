//! Loops of any timing: what acts when, what is reported, and how long bursts are.

use estimator::{
    AngleFilter, CameraFrame, Estimate, Health, ImpactInnovation, Innovation, Instruments, LdvSample, Source,
    Verdict,
};
use motor_model::{Angle, DriveMode};

use super::*;
use crate::commissioning::experiment::Experiment;
use crate::commissioning::{ExperimentTuning, Experimenter, tick_experiment};
use crate::loop_timing::DECISION_TICKS_MAX;
use crate::ports::{Drive, Sense};
use crate::positioning::PositioningTuning;
use crate::rate::{Profile, RateHold, RateTuning};
use crate::response_map::{Family, ResponseMap};
use crate::target::Target;
use crate::tick::{PositionLoop, RateLoop, TICK_NANOS, tick, tick_rate};

/// A rotor at rest at angle zero, whatever is measured, and the drive that it was told of last.
#[derive(Default)]
struct AtRest {
    told: DriveCommand,
}

impl AngleFilter<f32> for AtRest {
    fn drive(&mut self, _: Time, command: DriveCommand) {
        self.told = command;
    }

    fn update_ldv(&mut self, _: &LdvSample) -> Option<ImpactInnovation<f32>> {
        None
    }

    fn update_camera(&mut self, frame: &CameraFrame) -> Innovation<f32> {
        let (source, taken_at, verdict) = (Source::Camera, frame.exposed_at, Verdict::Used);
        Innovation { source, taken_at, innovation_rad: 0.0, variance_rad2: 0.0, verdict }
    }

    fn estimate(&self, at: Time) -> Option<Estimate<f32>> {
        let (angle, rate_rad_s, angle_rad2, rate_rad2_s2) = (Angle::ZERO, 0.0, 1e-12, 1e-12);
        let (angle_rate_rad2_s, resting) = (0.0, true);
        Some(Estimate { at, angle, rate_rad_s, angle_rad2, angle_rate_rad2_s, rate_rad2_s2, resting })
    }

    fn assess_for(&self, _: Time, instant: Time) -> (Option<Estimate<f32>>, Health) {
        (self.estimate(instant), Health::Good)
    }
}

/// A frame in each tick, exposed in it.
struct Late {
    now: Time,
    timing: LoopTiming,
}

impl Sense for Late {
    fn camera_frame(&mut self) -> Option<CameraFrame> {
        Some(CameraFrame::new(self.now, Angle::ZERO))
    }

    fn ldv_sample(&mut self) -> Option<LdvSample> {
        None
    }
}

impl Drive for Late {
    fn drive(&mut self, command: DriveCommand) -> DriveCommand {
        command
    }

    fn timing(&self) -> LoopTiming {
        self.timing
    }
}

/// Latencies and periods of decisions: none, the least, whole multiples and others, and the most.
fn timings() -> impl Iterator<Item = LoopTiming> {
    let all = [(0, 1), (1, 1), (5, 1), (16, 1), (0, 2), (0, 4), (8, 4), (7, 4), (5, 4), (16, 8), (0, 8)];
    all.into_iter().map(|(latency_ticks, decision_ticks)| LoopTiming { latency_ticks, decision_ticks })
}

/// A map's shortest burst leaves time for a decision in it.
#[test]
fn law_a_burst_is_twice_as_long_as_any_period_of_decisions() {
    let map = ResponseMap::table_1();
    let ticks = Family::ALL.into_iter().flat_map(|family| map.bursts(family)).map(|burst| burst.ticks);
    assert_eq!(ticks.min(), Some(2 * DECISION_TICKS_MAX as u32));
}

/// Whatever the timing, a tick of a decision reports the one that acts in it, and so an estimate for it, and what
/// became of its own frame. The other ticks report neither. The filter is told of the command that acts.
#[test]
fn law_every_loop_reports_the_decision_that_acts_and_the_frame_that_came() {
    let map = ResponseMap::table_1();
    for timing in timings() {
        let target = Target::try_new(90.0, 0.1).unwrap();
        let mut position =
            PositionLoop::new(AtRest::default(), map, target, PositioningTuning::default(), Time::ZERO);
        let hold = RateHold::new(Profile::dwell(100.0).unwrap(), RateTuning::default(), Time::ZERO);
        let mut rate = RateLoop::new(AtRest::default(), map, hold);
        let tuning = ExperimentTuning::new(&Instruments::default());
        let (mut experimenter, mut in_flight) = (Experimenter::new(tuning, Time::ZERO), InFlight::new());
        let (mut filter, mut driven) = (AtRest::default(), [false; 3]);
        let LoopTiming { latency_ticks, decision_ticks } = timing;
        for n in 0..20_000 {
            let now = Time::from_nanos(n * TICK_NANOS);
            let mut ports = Late { now, timing };
            let moved = tick(&mut position, now, &mut ports);
            let held = tick_rate(&mut rate, now, &mut ports);
            // Once it is ready.
            let _ =
                experimenter.order(Experiment::Cruise { mode: DriveMode::C, amplitude: 1.0, offset_hz: 0.0 });
            let experiment = tick_experiment(&mut filter, &mut experimenter, &mut in_flight, now, &mut ports);
            let told = [position.filter_mut().told, rate.filter().told, filter.told];
            assert_eq!(told, [moved.applied, held.applied, experiment.applied], "{n} {timing:?}");
            driven.iter_mut().zip(told).for_each(|(driven, told)| *driven |= told.mode().is_some());
            let of_grid = |n: u64| n == 0 || n.is_multiple_of(decision_ticks.into());
            let acting = n.checked_sub(latency_ticks.into()).filter(|n| of_grid(*n)).map(|_| now);
            let framed = of_grid(n).then_some(now);
            for (estimate, camera) in [
                (moved.estimate, moved.camera),
                (held.estimate, held.camera),
                (experiment.estimate, experiment.camera),
            ] {
                assert_eq!(estimate.map(|estimate| estimate.at), acting, "{n} {timing:?}");
                assert_eq!(camera.map(|camera| camera.taken_at), framed, "{n} {timing:?}");
            }
        }
        assert_eq!(driven, [true; 3], "{timing:?}");
    }
}

/// Bursts are as long as they were planned, in a move and in experiments, though they end within a period: 27 ticks
/// are no multiple of 2, 4 or 8. The rotor lies still, so that the move drives one after the other.
#[test]
fn exact_a_burst_is_as_long_as_planned_whenever_the_loop_decides() {
    let map = ResponseMap::table_1();
    for timing in timings() {
        let target = Target::try_new(-0.004, 0.0001).unwrap();
        let mut position =
            PositionLoop::new(AtRest::default(), map, target, PositioningTuning::default(), Time::ZERO);
        let tuning = ExperimentTuning::new(&Instruments::default());
        let (mut experimenter, mut in_flight) = (Experimenter::new(tuning, Time::ZERO), InFlight::new());
        let mut filter = AtRest::default();
        let (mut bursts, mut on_ticks, mut tried) = (0, 0, 0);
        for n in 0..40_000_u64 {
            let now = Time::from_nanos(n * TICK_NANOS);
            let mut ports = Late { now, timing };
            let moved = tick(&mut position, now, &mut ports);
            if moved.applied.mode().is_some() {
                on_ticks += 1;
            } else if on_ticks > 0 {
                assert_eq!(on_ticks, 27, "{n} {timing:?}");
                (bursts, on_ticks) = (bursts + 1, 0);
            }
            let burst =
                Experiment::Train { mode: DriveMode::C, amplitude: 1.0, offset_hz: 0.0, ticks: 27, count: 1 };
            let _ = experimenter.number() == 0 && experimenter.order(burst);
            let report = tick_experiment(&mut filter, &mut experimenter, &mut in_flight, now, &mut ports);
            tried += u32::from(report.applied.mode().is_some());
        }
        assert!(bursts > 0 && tried == 27, "{bursts} {tried} {timing:?}");
    }
}

impl Decision for usize {
    const UNDECIDED: Self = usize::MAX;

    fn applied(&self) -> DriveCommand {
        DriveCommand::OFF
    }
}

#[test]
fn exact_a_decision_acts_after_its_latency() {
    let at = |tick: usize| Time::from_nanos(TICK_NANOS * tick as u64);
    for latency in [0, 1, 2, 7, LATENCY_TICKS_MAX] {
        let mut in_flight = InFlight::new();
        let acting = |in_flight: &mut InFlight<usize>, tick: usize| {
            in_flight.put(at(tick + latency), |decision| *decision = tick);
            *in_flight.acting(at(tick))
        };
        for tick in 0..100_usize {
            let expected = tick.checked_sub(latency).unwrap_or(usize::MAX);
            assert_eq!(acting(&mut in_flight, tick), expected, "{latency}");
        }
        in_flight.clear();
        for tick in 100..100 + latency {
            assert_eq!(acting(&mut in_flight, tick), usize::UNDECIDED, "{latency}");
        }
    }
}

/// Ticks that are lost make no decision late: it acts in the first tick after its time.
#[test]
fn exact_lost_ticks_delay_no_decision() {
    let at = |tick: usize| Time::from_nanos(TICK_NANOS * tick as u64);
    let mut in_flight = InFlight::new();
    for tick in 0..4 {
        in_flight.put(at(tick + 4), |decision| *decision = tick);
        assert_eq!(*in_flight.acting(at(tick)), usize::MAX);
    }
    assert_eq!(*in_flight.acting(at(6)), 2);
    assert_eq!(*in_flight.acting(at(9)), 3);
}

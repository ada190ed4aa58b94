//! A loop whose commands act some ticks after they were decided.
//!
//! ```text
//! tick k:      measurements of k -> estimate for k + n -> decision -> command, which acts from tick k + n on
//! tick k + n:  the amplifier applies it, the filter is told, and the report of the tick has the decision
//! ```
//!
//! The `n` ticks between are the processor's: the work of a tick may take that long, if a tick takes less than its
//! period on average. To a filter with a model of the stator an impact brings the work of ten ticks, and the ticks
//! after it bring little. What the loop does is a function of the measurements alone, however long each tick takes: all
//! commands act after the same time, and the filter is told of each when it acts.

use motor_model::{DriveCommand, Time};

use crate::tick::TICK_NANOS;

/// Longest latency of a loop in ticks: a period of the slower drive.
pub const LATENCY_TICKS_MAX: usize = 16;

/// When a command acts that is decided at `now`.
pub(crate) fn acts_at(now: Time, latency_ticks: usize) -> Time {
    now.plus_nanos(TICK_NANOS * latency_ticks.min(LATENCY_TICKS_MAX) as u64)
}

/// What [`InFlight`] holds.
pub trait Decision: Copy {
    /// That of a tick before the first decision acts: drive off.
    const UNDECIDED: Self;
}

impl Decision for DriveCommand {
    const UNDECIDED: Self = Self::OFF;
}

/// Places of the ring: one for each tick of the longest latency, and one for the tick under way.
const PLACES: usize = LATENCY_TICKS_MAX + 1;

/// The decisions whose commands do not act yet: a ring. Each is written in its place and read there, since a report has
/// more than a hundred bytes.
#[derive(Clone, Debug)]
pub struct InFlight<R> {
    /// `None` before there are any.
    decisions: Option<[R; PLACES]>,
    /// Place of the newest.
    newest: usize,
}

impl<R> Default for InFlight<R> {
    fn default() -> Self {
        Self::new()
    }
}

impl<R> InFlight<R> {
    /// No decision.
    pub const fn new() -> Self {
        Self { decisions: None, newest: 0 }
    }

    /// Forgets all decisions, and makes the places of new ones, which otherwise the next tick does.
    #[cold]
    #[inline(never)]
    pub fn clear(&mut self)
    where
        R: Decision,
    {
        self.decisions = Some(undecided());
    }

    /// Lets `decide` write the decision of this tick in its place, all of it, and gives the one whose command acts from
    /// this tick on: that of `latency_ticks` before, and with a latency of 0 this one. In the first ticks it is
    /// [`Decision::UNDECIDED`].
    ///
    /// The latency is always the same. Above [`LATENCY_TICKS_MAX`] it counts as that.
    #[expect(clippy::indexing_slicing, reason = "below PLACES, which the compiler sees")]
    #[inline]
    pub fn exchange(&mut self, latency_ticks: usize, decide: impl FnOnce(&mut R)) -> &mut R
    where
        R: Decision,
    {
        let decisions = self.decisions.get_or_insert_with(undecided);
        self.newest = (self.newest + 1) % PLACES;
        decide(&mut decisions[self.newest]);
        let acting = (self.newest + PLACES - latency_ticks.min(LATENCY_TICKS_MAX)) % PLACES;
        &mut decisions[acting]
    }
}

#[cold]
#[inline(never)]
fn undecided<R: Decision>() -> [R; PLACES] {
    [R::UNDECIDED; PLACES]
}

#[cfg(test)]
mod tests {
    use estimator::{
        AngleFilter, CameraFrame, Estimate, Health, ImpactInnovation, Innovation, Instruments, LdvSample,
        Source, Verdict,
    };
    use motor_model::{Angle, DriveMode};

    use super::*;
    use crate::commissioning::experiment::Experiment;
    use crate::commissioning::{ExperimentTuning, Experimenter, tick_experiment};
    use crate::ports::{Drive, Sense};
    use crate::positioning::PositioningTuning;
    use crate::rate::{Profile, RateHold, RateTuning};
    use crate::response_map::ResponseMap;
    use crate::target::Target;
    use crate::tick::{PositionLoop, RateLoop, tick, tick_rate};

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
        latency_ticks: usize,
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

        fn latency_ticks(&self) -> usize {
            self.latency_ticks
        }
    }

    /// Whatever the latency, a tick reports the decision that acts in it, and so an estimate for it, and what became of
    /// its own frame. The filter is told of that decision's command.
    #[test]
    fn law_every_loop_reports_the_decision_that_acts_and_the_frame_that_came() {
        let map = ResponseMap::table_1();
        for latency_ticks in [0, 1, 5, LATENCY_TICKS_MAX] {
            let target = Target::try_new(90.0, 0.1).unwrap();
            let mut position =
                PositionLoop::new(AtRest::default(), map, target, PositioningTuning::default(), Time::ZERO);
            let hold = RateHold::new(Profile::dwell(100.0).unwrap(), RateTuning::default(), Time::ZERO);
            let mut rate = RateLoop::new(AtRest::default(), map, hold);
            let tuning = ExperimentTuning::new(&Instruments::default());
            let (mut experimenter, mut in_flight) = (Experimenter::new(tuning, Time::ZERO), InFlight::new());
            let (mut filter, mut driven) = (AtRest::default(), [false; 3]);
            for n in 0..20_000 {
                let now = Time::from_nanos(n as u64 * TICK_NANOS);
                let mut ports = Late { now, latency_ticks };
                let moved = tick(&mut position, now, &mut ports);
                let held = tick_rate(&mut rate, now, &mut ports);
                // Once it is ready.
                let _ = experimenter.order(Experiment::Cruise {
                    mode: DriveMode::C,
                    amplitude: 1.0,
                    offset_hz: 0.0,
                });
                let experiment =
                    tick_experiment(&mut filter, &mut experimenter, &mut in_flight, now, &mut ports);
                let told = [position.filter_mut().told, rate.filter().told, filter.told];
                assert_eq!(told, [moved.applied, held.applied, experiment.applied], "{n} of {latency_ticks}");
                driven.iter_mut().zip(told).for_each(|(driven, told)| *driven |= told.mode().is_some());
                let acting = (n >= latency_ticks).then_some(now);
                for (estimate, camera) in [
                    (moved.estimate, moved.camera),
                    (held.estimate, held.camera),
                    (experiment.estimate, experiment.camera),
                ] {
                    assert_eq!(estimate.map(|estimate| estimate.at), acting, "{n} of {latency_ticks}");
                    assert_eq!(camera.map(|camera| camera.taken_at), Some(now), "{n} of {latency_ticks}");
                }
            }
            assert_eq!(driven, [true; 3], "{latency_ticks}");
        }
    }

    impl Decision for usize {
        const UNDECIDED: Self = usize::MAX;
    }

    #[test]
    fn exact_a_decision_acts_after_its_latency() {
        for latency in [0, 1, 2, 7, LATENCY_TICKS_MAX] {
            let mut in_flight = InFlight::new();
            for tick in 0..100 {
                let acting = *in_flight.exchange(latency, |decision| *decision = tick);
                assert_eq!(acting, tick.checked_sub(latency).unwrap_or(usize::MAX), "{latency}");
            }
            in_flight.clear();
            for tick in 0..latency {
                let acting = *in_flight.exchange(latency, |decision| *decision = tick);
                assert_eq!(acting, usize::UNDECIDED, "{latency}");
            }
            let acts_at = acts_at(Time::from_nanos(30_000), latency);
            assert_eq!(acts_at.nanos(), 30_000 + 10_000 * latency as u64);
        }
    }
}

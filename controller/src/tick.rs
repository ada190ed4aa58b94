//! The loop body of firmware and simulation: fuse what arrived, estimate, decide, drive.

use core::borrow::Borrow;

use estimator::{AngleFilter, ConstantRate, Estimate, Health, Innovation};
use motor_model::{Angle, DriveCommand, Time};

use crate::in_flight::{Decision, Due, InFlight};
use crate::loop_timing::LoopTiming;
use crate::map_correction::LearntFactors;
use crate::ports::{Drive, LDV_SAMPLES_PER_TICK_MAX, Sense};
use crate::positioning::{Positioning, PositioningPhase, PositioningTuning};
use crate::rate::{RateHold, RateProfile, RateStop};
use crate::resonance_tracker::ResonanceTracker;
use crate::response_map::ResponseMap;
use crate::target::Target;

/// Period of the loop in ns. The bursts of [`crate::response_map`] are counted in it, so another period needs another
/// map.
pub const TICK_NANOS: u64 = 10_000;

/// The state of the positioning loop, with the filter `F` that it estimates by and the response map that it plans by.
///
/// `M` is the map or refers to it: by default to a static one, which takes no memory in the loop.
#[derive(Clone, Debug)]
pub struct PositionLoop<F = ConstantRate<f32>, M = &'static ResponseMap> {
    filter: F,
    map: M,
    positioning: Positioning,
    tracker: ResonanceTracker,
    in_flight: InFlight<TickReport>,
}

impl PositionLoop {
    /// Period of the loop in ns, whatever the filter.
    pub const TICK_NANOS: u64 = TICK_NANOS;
}

impl<F, M: Borrow<ResponseMap>> PositionLoop<F, M> {
    /// The filter, to run or read on its own.
    pub fn filter_mut(&mut self) -> &mut F {
        &mut self.filter
    }

    /// A loop that positions to `target` from `now` on, by a filter that is new or goes on from an earlier move.
    pub fn new(filter: F, map: M, target: Target, tuning: PositioningTuning, now: Time) -> Self {
        let positioning = Positioning::new(map.borrow(), target, tuning, now);
        let tracker = ResonanceTracker::of(map.borrow());
        Self { filter, map, positioning, tracker, in_flight: InFlight::new() }
    }

    /// Begins another move at `now`, as a loop from [`Self::new`] would, with the filter as it is. The filter is not
    /// moved in memory: a large one needs no second place on the stack. With a latency the reports until its first
    /// decision acts are still of the move before.
    pub fn begin(&mut self, target: Target, tuning: PositioningTuning, now: Time) {
        self.positioning = Positioning::new(self.map.borrow(), target, tuning, now);
    }

    /// Replaces the target from `now` on, see [`Positioning::retarget`].
    pub fn retarget(&mut self, target: Target, now: Time) {
        self.positioning.retarget(target, now);
    }

    /// Ends the move, drive off.
    pub fn cancel(&mut self) {
        self.positioning.cancel();
    }

    /// The response map, to read.
    pub fn map(&self) -> &ResponseMap {
        self.map.borrow()
    }

    /// The state machine, to read.
    pub fn positioning(&self) -> &Positioning {
        &self.positioning
    }

    /// What has been learnt of this motor, as plain data.
    pub fn learnt(&self) -> LearntFactors {
        LearntFactors::new(self.positioning.correction(), self.tracker.offsets())
    }
}

/// What a tick of the positioning loop did. With a latency the decision is the one whose command acts from this tick
/// on, and its estimate, which is for this tick too, is from measurements that are older by the latency.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TickReport {
    /// The estimate the decision was based on; `None` before the first camera frame, and in a tick without a decision.
    pub estimate: Option<Estimate<f32>>,
    /// Whether it may be used.
    pub health: Health,
    /// What became of the camera frame that arrived, if one did.
    pub camera: Option<Innovation<f32>>,
    /// The command of the state machine.
    pub command: DriveCommand,
    /// The command that the amplifier applies.
    pub applied: DriveCommand,
    /// What positioning is doing.
    pub phase: PositioningPhase,
}

impl Decision for TickReport {
    const UNDECIDED: Self = Self {
        estimate: None,
        health: Health::Waiting,
        camera: None,
        command: DriveCommand::OFF,
        applied: DriveCommand::OFF,
        phase: PositioningPhase::Waiting(Health::Waiting),
    };

    fn applied(&self) -> DriveCommand {
        self.applied
    }

    fn pass(&mut self) {
        (self.estimate, self.camera) = (None, None);
    }
}

/// One tick of the loop at `now`.
///
/// To be called every [`PositionLoop::TICK_NANOS`]. A late or missed tick costs accuracy of the cut-off, nothing else,
/// since every measurement carries its own time. Takes at most one camera frame, and [`LDV_SAMPLES_PER_TICK_MAX`]
/// vibrometer samples for each tick. An estimate whose health is [`Health::Unusable`] counts as none.
///
/// Where the loop decides in every few ticks ([`LoopTiming`]), the ticks between do nothing: no measurement is taken,
/// and the report is the one before without estimate and frame.
pub fn tick<F: AngleFilter<f32>, M: Borrow<ResponseMap>, P: Sense + Drive>(
    state: &mut PositionLoop<F, M>,
    now: Time,
    ports: &mut P,
) -> TickReport {
    let PositionLoop { filter, map, positioning, tracker, in_flight } = state;
    *tick_by((*map).borrow(), filter, positioning, tracker, in_flight, now, ports)
}

/// The same with `map`, `filter`, `positioning`, `tracker` and what is `in_flight` in places of their own, for a
/// program that keeps one map, which outlives its moves. The report is read in its place, which a later tick takes.
pub fn tick_by<'d, F: AngleFilter<f32>, P: Sense + Drive>(
    map: &ResponseMap,
    filter: &mut F,
    positioning: &mut Positioning,
    tracker: &mut ResonanceTracker,
    in_flight: &'d mut InFlight<TickReport>,
    now: Time,
    ports: &mut P,
) -> &'d mut TickReport {
    let timing = ports.timing();
    let due = in_flight.due(now, timing);
    if due != Due::Decision {
        return without_decision(filter, in_flight, due, now, ports);
    }
    let acts_at = timing.acts_at(now);
    let Fused { camera, estimate, health } = fuse_for(filter, now, acts_at, timing, ports);
    let command = positioning.decide(map, acts_at, estimate.as_ref(), health);
    let command = tune(tracker, map, filter, acts_at, command, estimate.as_ref());
    let applied = ports.drive(command);
    let (report, tells) = in_flight.exchange(
        now,
        timing,
        || positioning.burst_end(),
        |decision| {
            // Field by field: otherwise a report is made elsewhere and moved.
            decision.estimate = estimate;
            decision.health = health;
            decision.command = command;
            decision.applied = applied;
            decision.camera = None;
            decision.phase = positioning.phase();
        },
    );
    report.camera = camera;
    if tells {
        filter.drive(now, report.applied);
    }
    report
}

/// The state of the rate loop, with the filter `F` that it estimates by and the response map, as in [`PositionLoop`].
#[derive(Clone, Debug)]
pub struct RateLoop<F, M = &'static ResponseMap> {
    filter: F,
    map: M,
    hold: RateHold,
    tracker: ResonanceTracker,
    in_flight: InFlight<RateReport>,
}

impl<F, M: Borrow<ResponseMap>> RateLoop<F, M> {
    /// A loop that follows a rate, by a filter that is new or goes on from earlier.
    pub fn new(filter: F, map: M, hold: RateHold) -> Self {
        let tracker = ResonanceTracker::of(map.borrow());
        Self { filter, map, hold, tracker, in_flight: InFlight::new() }
    }

    /// The filter, to read.
    pub fn filter(&self) -> &F {
        &self.filter
    }

    /// Follows another rate from now on; the filter goes on.
    pub fn follow(&mut self, hold: RateHold) {
        self.hold = hold;
    }
}

/// What a tick of the rate loop did; with a latency as [`TickReport`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RateReport {
    /// The estimate the decision was based on; `None` as in [`TickReport`].
    pub estimate: Option<Estimate<f32>>,
    /// Whether it may be used.
    pub health: Health,
    /// What became of the camera frame that arrived, if one did.
    pub camera: Option<Innovation<f32>>,
    /// The command of the rate's controller.
    pub command: DriveCommand,
    /// The command that the amplifier applies.
    pub applied: DriveCommand,
    /// The commanded rate in rad/s, clockwise positive.
    pub wanted_rad_s: f32,
    /// The angle that the rotor should have; `None` before the first usable estimate. That of the last
    /// decision in a tick without one.
    pub reference: Option<Angle>,
    /// Since when the command is given.
    pub since: Time,
    /// Why the rate is held no more; `None` while it is.
    pub stopped: Option<RateStop>,
}

impl Decision for RateReport {
    const UNDECIDED: Self = Self {
        estimate: None,
        health: Health::Waiting,
        camera: None,
        command: DriveCommand::OFF,
        applied: DriveCommand::OFF,
        wanted_rad_s: 0.0,
        reference: None,
        since: Time::ZERO,
        stopped: None,
    };

    fn applied(&self) -> DriveCommand {
        self.applied
    }

    fn pass(&mut self) {
        (self.estimate, self.camera) = (None, None);
    }
}

/// One tick of the rate loop at `now`, otherwise as [`tick`].
pub fn tick_rate<F: AngleFilter<f32>, M: Borrow<ResponseMap>, P: Sense + Drive>(
    state: &mut RateLoop<F, M>,
    now: Time,
    ports: &mut P,
) -> RateReport {
    let RateLoop { filter, map, hold, tracker, in_flight } = state;
    *tick_rate_by((*map).borrow(), filter, hold, tracker, in_flight, now, ports)
}

/// The same with `map`, `filter`, `hold`, `tracker` and what is `in_flight` in places of their own, as [`tick_by`].
pub fn tick_rate_by<'d, F: AngleFilter<f32>, C: RateProfile, P: Sense + Drive>(
    map: &ResponseMap,
    filter: &mut F,
    hold: &mut RateHold<C>,
    tracker: &mut ResonanceTracker,
    in_flight: &'d mut InFlight<RateReport>,
    now: Time,
    ports: &mut P,
) -> &'d mut RateReport {
    let timing = ports.timing();
    let due = in_flight.due(now, timing);
    if due != Due::Decision {
        return without_decision(filter, in_flight, due, now, ports);
    }
    let acts_at = timing.acts_at(now);
    let Fused { camera, estimate, health } = fuse_for(filter, now, acts_at, timing, ports);
    let command = hold.decide(map, acts_at, estimate.as_ref(), health);
    let command = tune(tracker, map, filter, acts_at, command, estimate.as_ref());
    let applied = ports.drive(command);
    let (report, tells) = in_flight.exchange(
        now,
        timing,
        || None,
        |decision| {
            decision.estimate = estimate;
            decision.health = health;
            decision.command = command;
            decision.applied = applied;
            decision.camera = None;
            decision.wanted_rad_s = hold.wanted_rad_s(acts_at);
            decision.reference = hold.reference();
            decision.since = hold.since();
            decision.stopped = hold.stopped();
        },
    );
    report.camera = camera;
    if tells {
        filter.drive(now, report.applied);
    }
    report
}

/// A tick at `now` that decides nothing: the filter is told of a decision that acts from now on, if that is `due`.
/// Samples until then are of the drive before it.
#[cold]
#[inline(never)]
pub(crate) fn without_decision<'d, F: AngleFilter<f32>, R: Decision>(
    filter: &mut F,
    in_flight: &'d mut InFlight<R>,
    due: Due,
    now: Time,
    ports: &mut impl Sense,
) -> &'d mut R {
    if due == Due::Nothing {
        return in_flight.passed();
    }
    while let Some(sample) = ports.ldv_sample() {
        filter.update_ldv(&sample);
    }
    let (report, tells) = in_flight.act(now);
    if tells {
        filter.drive(now, report.applied());
    }
    report
}

/// `command` at the frequency of its resonance, which the filter is told where it has moved. Drives are on by a usable
/// estimate alone.
#[inline]
fn tune<F: AngleFilter<f32>>(
    tracker: &mut ResonanceTracker,
    map: &ResponseMap,
    filter: &mut F,
    acts_at: Time,
    command: DriveCommand,
    estimate: Option<&Estimate<f32>>,
) -> DriveCommand {
    let tuned = tracker.tune(map, acts_at, command, estimate);
    if let Some(offsets) = tracker.take_moved() {
        filter.retune(&offsets);
    }
    tuned
}

/// The estimate once every measurement that arrived is fused.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fused {
    /// What became of the camera frame that arrived, if one did.
    pub camera: Option<Innovation<f32>>,
    /// The estimate; `None` before the first camera frame.
    pub estimate: Option<Estimate<f32>>,
    /// Whether it may be used.
    pub health: Health,
}

/// The first half of a tick, for a controller of one's own: gives `filter` what has arrived at `now`, and estimates.
///
/// The second half is to decide, to drive, and to tell the filter the drive that is applied ([`AngleFilter::drive`]).
pub fn fuse<F: AngleFilter<f32>>(filter: &mut F, now: Time, ports: &mut impl Sense) -> Fused {
    fuse_for(filter, now, now, LoopTiming::default(), ports)
}

/// The same with the estimate for `instant`: when the command acts that is decided by it.
#[inline]
pub(crate) fn fuse_for<F: AngleFilter<f32>>(
    filter: &mut F,
    now: Time,
    instant: Time,
    timing: LoopTiming,
    ports: &mut impl Sense,
) -> Fused {
    for _ in 0..LDV_SAMPLES_PER_TICK_MAX * usize::from(timing.decision_ticks) {
        let Some(sample) = ports.ldv_sample() else { break };
        filter.update_ldv(&sample);
    }
    let camera = ports.camera_frame().map(|frame| filter.update_camera(&frame));
    let (estimate, health) = filter.assess_for(now, instant);
    Fused { camera, estimate, health }
}

#[cfg(test)]
mod tests {
    use super::*;
    use estimator::{CameraFrame, ImpactInnovation, LdvSample, Reason};
    use motor_model::{Angle, DriveMode};

    /// An estimate a quarter turn from the target, with a small variance and the given health.
    struct FixedHealth(Health);

    impl AngleFilter<f32> for FixedHealth {
        fn drive(&mut self, _: Time, _: DriveCommand) {}

        fn update_ldv(&mut self, _: &LdvSample) -> Option<ImpactInnovation<f32>> {
            None
        }

        fn update_camera(&mut self, _: &CameraFrame) -> Innovation<f32> {
            unreachable!("there is no camera")
        }

        fn estimate(&self, now: Time) -> Option<Estimate<f32>> {
            let (rate_rad_s, angle_rad2, rate_rad2_s2) = (0.0, 1e-12, 1e-12);
            Some(Estimate {
                at: now,
                angle: Angle::ZERO,
                rate_rad_s,
                angle_rad2,
                angle_rate_rad2_s: 0.0,
                rate_rad2_s2,
                resting: true,
            })
        }

        fn assess_for(&self, _: Time, instant: Time) -> (Option<Estimate<f32>>, Health) {
            (self.estimate(instant), self.0)
        }
    }

    struct NoInstruments;

    impl Sense for NoInstruments {
        fn camera_frame(&mut self) -> Option<CameraFrame> {
            None
        }

        fn ldv_sample(&mut self) -> Option<LdvSample> {
            None
        }
    }

    impl Drive for NoInstruments {
        fn drive(&mut self, command: DriveCommand) -> DriveCommand {
            command
        }
    }

    #[test]
    fn law_an_unusable_estimate_drives_nothing() {
        let target = Target::try_new(90.0, 0.1).unwrap();
        for (health, mode) in [
            (Health::Good, Some(DriveMode::B)),
            (Health::Degraded(Reason::VibrometerSilent), Some(DriveMode::B)),
            (Health::Unusable(Reason::FramesRefused), None),
            (Health::Unusable(Reason::Uncertain), None),
        ] {
            let (map, tuning) = (ResponseMap::table_1(), PositioningTuning::default());
            let mut state = PositionLoop::new(FixedHealth(health), map, target, tuning, Time::ZERO);
            let report = tick(&mut state, Time::ZERO, &mut NoInstruments);
            assert_eq!((report.command.mode(), report.health), (mode, health));
        }
    }
}

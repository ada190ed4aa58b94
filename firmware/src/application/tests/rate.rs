//! A rate over the link: the loop of the controller, its end, and what ends it before.

use std::collections::VecDeque;

use controller::rate::{Profile, RateHold, RateStop, RateTuning};
use controller::{RateLoop, Sense, tick_rate};
use estimator::{CameraFrame, ConstantRate, ConstantRateTuning, Health, Instruments};
use link::{FilterKind, PhaseRecord, RateConfiguration, RateLimitsRecord, RatePhase};
use motor_model::Angle;

use super::*;

const MS: u64 = 1_000_000;
pub(super) const RATE: RateConfiguration = RateConfiguration {
    filter: FilterKind::ConstantRate,
    rate_deg_s: 100.0,
    duration_nanos: 20_000 * MS,
    limits: RateLimitsRecord {
        travel_deg: None,
        on_max_nanos: None,
        amplitude_max: None,
        progress_window_nanos: None,
    },
};

impl Bench {
    /// A board that is armed for a rate.
    fn armed_for(rate: RateConfiguration) -> Self {
        let mut bench = Self::new();
        bench.exchange(&HostMessage::Hello);
        assert_eq!(bench.exchange(&HostMessage::ConfigureRate(rate)), [BoardMessage::Configured]);
        assert_eq!(bench.exchange(&HostMessage::Arm), [BoardMessage::Armed]);
        bench
    }

    /// The next tick of a rotor at rest.
    fn rest(&mut self) -> TickRecord {
        self.measure();
        self.step().expect("it is armed")
    }
}

fn phase(report: &TickRecord) -> RatePhase {
    match report.phase.value() {
        Some(PhaseRecord::Rate(phase)) => phase,
        other => panic!("no phase of a rate: {other:?}"),
    }
}

/// What one tick measures of a rotor at `angle`.
pub(super) struct Measured {
    pub(super) frame: Option<CameraFrame>,
    pub(super) sample: Option<LdvSample>,
}

impl Measured {
    pub(super) fn at(now: Time, tick: u64, angle: Angle) -> Self {
        let frame = CameraFrame { exposed_at: now, angle: angle.wrapped(), marks_used: 0, residual: 0 };
        let velocity_m_s = if tick.is_multiple_of(2) { 1e-5 } else { -1e-5 };
        Self {
            frame: tick.is_multiple_of(10).then_some(frame),
            sample: Some(LdvSample { taken_at: now, velocity_m_s }),
        }
    }
}

/// What was measured and waits for a loop of this timing.
#[derive(Default)]
pub(super) struct Measurements {
    pub(super) frames: VecDeque<CameraFrame>,
    pub(super) samples: VecDeque<LdvSample>,
    pub(super) timing: LoopTiming,
}

impl Measurements {
    pub(super) fn add(&mut self, measured: &Measured) {
        self.frames.extend(measured.frame);
        self.samples.extend(measured.sample);
    }
}

impl Sense for Measurements {
    fn camera_frame(&mut self) -> Option<CameraFrame> {
        self.frames.pop_front()
    }

    fn ldv_sample(&mut self) -> Option<LdvSample> {
        self.samples.pop_front()
    }
}

impl Drive for Measurements {
    fn drive(&mut self, command: DriveCommand) -> DriveCommand {
        command
    }

    fn timing(&self) -> LoopTiming {
        self.timing
    }
}

impl Sense for Measured {
    fn camera_frame(&mut self) -> Option<CameraFrame> {
        self.frame.take()
    }

    fn ldv_sample(&mut self) -> Option<LdvSample> {
        self.sample.take()
    }
}

impl Drive for Measured {
    fn drive(&mut self, command: DriveCommand) -> DriveCommand {
        command
    }
}

/// Every report of 5000 ticks is that of the controller's own loop on the same measurements, to the last bit: a rotor
/// that turns at three quarters of the rate, then stands, and whose frames fail for a while.
#[test]
fn dual_the_rate_of_a_board_is_that_of_the_controllers_loop() {
    let mut bench = Bench::armed_for(RATE);
    let instruments = Instruments::default();
    let filter =
        ConstantRate::<f32>::new(&ConstantRateTuning::for_motor(&MotorParams::nominal(), &instruments));
    let hold = RateHold::new(Profile::dwell(100.0).unwrap(), RateTuning::new(&instruments), Time::ZERO);
    let mut own = RateLoop::new(filter, ResponseMap::table_1(), hold);
    let Profile::Dwell { rate_rad_s: wanted } = Profile::dwell(100.0).unwrap() else { panic!("a dwell") };
    let mut since_nanos = 0;
    let (mut followed, mut waited, mut changes, mut last) = (0, 0, 0, None);
    for tick in 1..=5000_u64 {
        let now = time(tick);
        let turning: f64 = time(tick.min(3000)).seconds_since(Time::ZERO);
        let dither_deg = if tick.is_multiple_of(20) { 0.01 } else { 0.0 };
        let mut measured =
            Measured::at(time(tick - 1), tick, Angle::from_degrees(75.0 * turning + dither_deg));
        if (3500..4700).contains(&tick) {
            measured.frame = None;
        }
        if let Some(sample) = measured.sample {
            bench.exchange(&HostMessage::Ldv([sample.into()].into_iter().collect()));
        }
        if let Some(frame) = measured.frame {
            bench.exchange(&HostMessage::Camera(frame.into()));
        }
        let theirs = bench.step().unwrap();
        let ours = TickRecord::from(&tick_rate(&mut own, now, &mut measured));
        assert_eq!(ours.difference(&theirs), None, "tick {tick}");
        followed += u32::from(phase(&theirs) == RatePhase::Following);
        waited += u32::from(phase(&theirs) == RatePhase::Waiting);
        let is_new = last.replace(theirs.command) != Some(theirs.command);
        changes += u32::from(is_new);
        // The first command is that of arming.
        if is_new && tick > 1 {
            since_nanos = now.nanos();
        }
        assert_eq!(theirs.since_nanos, since_nanos, "tick {tick}");
        assert_eq!(theirs.rate.unwrap().wanted_rad_s.to_bits(), wanted.to_bits(), "tick {tick}");
    }
    assert!(followed > 2000 && waited > 500 && changes > 20, "{followed} {waited} {changes}");
}

/// The rate is held up to its duration, to the tick. From then on the drive is off and nothing is asked, and the
/// estimate goes on.
#[test]
fn exact_a_rate_is_over_after_its_duration() {
    let mut bench = Bench::armed_for(RateConfiguration { duration_nanos: 100 * MS, ..RATE });
    let mut driven = 0;
    for tick in 1..=10_000 {
        let report = bench.rest();
        assert_ne!(phase(&report), RatePhase::Over, "tick {tick}");
        driven += u32::from(!bench.off());
    }
    assert!(driven > 5000, "{driven}");
    for _ in 0..1000 {
        let report = bench.rest();
        assert_eq!(phase(&report), RatePhase::Over);
        assert!(report.estimate.is_some() && report.rate.unwrap().wanted_rad_s.abs() <= 0.0 && bench.off());
    }
    assert!(bench.board.is_armed());
}

/// The tick of the limit ends it, the report says why, and the end of the duration changes nothing of that.
#[test]
fn law_a_limit_ends_a_rate_and_is_told() {
    let none = RateLimitsRecord::default();
    for (limits, why) in [
        (none, RateStop::Stuck),
        (RateLimitsRecord { on_max_nanos: Some(50 * MS), ..none }, RateStop::DrivenTooLong),
        (RateLimitsRecord { travel_deg: Some((-10.0, 0.001)), ..none }, RateStop::EndOfTravel),
        (RateLimitsRecord { progress_window_nanos: Some(20 * MS), ..none }, RateStop::Stuck),
    ] {
        let mut bench = Bench::armed_for(RateConfiguration { duration_nanos: 600 * MS, limits, ..RATE });
        let mut stopped_at = None;
        for tick in 1..=65_000_u64 {
            let report = bench.rest();
            if let RatePhase::Stopped(found) = phase(&report) {
                assert_eq!((found, bench.off()), (why, true), "tick {tick} of {limits:?}");
                stopped_at.get_or_insert(tick);
            } else {
                assert_eq!(stopped_at, None, "tick {tick} of {limits:?}");
            }
        }
        let stopped_ms = stopped_at.expect("a limit") / 100;
        // Two windows of driven time, or the time with the drive on, after some ms without an estimate; the travel ends
        // before the rotor is driven.
        let expected_ms = match (why, limits.progress_window_nanos) {
            (RateStop::EndOfTravel, _) => 0..50,
            (RateStop::DrivenTooLong, _) => 50..100,
            (_, None) => 300..500,
            (_, Some(_)) => 40..150,
        };
        assert!(expected_ms.contains(&stopped_ms), "{why:?} after {stopped_ms} ms");
    }
}

/// L5, during a rate.
#[test]
fn law_a_silent_host_switches_a_rate_off() {
    let mut bench = Bench::armed_for(RATE);
    bench.drive();
    bench.exchange(&HostMessage::Count);
    assert!((0..SILENT_TICKS).all(|_| bench.board.tick().is_some()));
    assert_eq!(bench.board.tick(), None);
    assert!(bench.off());
    assert!(!bench.drives_again(), "frames alone start nothing");
    assert_eq!(bench.exchange(&HostMessage::Arm), fault(BoardFault::HostSilent));
    assert_eq!(bench.exchange(&HostMessage::Stop), [BoardMessage::Stopped]);
    assert_eq!(bench.exchange(&HostMessage::Arm), [BoardMessage::Armed]);
    bench.drive();
}

/// A stop ends a rate at once. Armed again it begins anew, with all of its duration and a filter without measurements.
#[test]
fn law_a_stop_ends_a_rate_and_arming_begins_it_anew() {
    let mut bench = Bench::armed_for(RateConfiguration { duration_nanos: 100 * MS, ..RATE });
    bench.drive();
    assert_eq!(bench.exchange(&HostMessage::Stop), [BoardMessage::Stopped]);
    assert!(bench.off() && !bench.board.is_armed() && !bench.drives_again());
    for _ in 0..20_000 {
        assert_eq!(bench.board.tick(), None);
    }
    // Drops the measurements that came in the meantime.
    assert_eq!(bench.exchange(&HostMessage::Stop), [BoardMessage::Stopped]);
    assert_eq!(bench.exchange(&HostMessage::Arm), [BoardMessage::Armed]);
    let report = bench.step().unwrap();
    assert_eq!((report.estimate, report.health.value()), (None, Some(Health::Waiting)));
    bench.drive();
}

/// An estimate that is lost during a rate switches the drive off in that tick, as frames do not come any more.
#[test]
fn law_a_rate_without_frames_drives_no_more() {
    let mut bench = Bench::armed_for(RATE);
    bench.drive();
    let mut off_since = None;
    for tick in 0..60_000_u64 {
        bench.exchange(&HostMessage::Count);
        let report = bench.step().unwrap();
        let unusable = matches!(report.health.value(), Some(Health::Unusable(_)));
        assert_eq!(unusable, phase(&report) == RatePhase::Waiting);
        assert!(!unusable || bench.off(), "tick {tick}");
        if unusable {
            off_since.get_or_insert(tick);
        }
    }
    assert!(off_since.is_some());
}

/// A rate out of bounds is refused by name, as a whole: what was configured before stays. So is any while armed.
#[test]
fn law_a_rate_out_of_bounds_is_refused_by_name() {
    let mut bench = Bench::new();
    bench.exchange(&HostMessage::Hello);
    let window = RateLimitsRecord { progress_window_nanos: Some(0), ..RATE.limits };
    let travel = RateLimitsRecord { travel_deg: Some((1.0, 1.0)), ..RATE.limits };
    let on_max = RateLimitsRecord { on_max_nanos: Some(u64::MAX), ..RATE.limits };
    let bad = [
        (RateConfiguration { rate_deg_s: 2000.0, ..RATE }, "rate.deg_s"),
        (RateConfiguration { rate_deg_s: f64::NAN, ..RATE }, "rate.deg_s"),
        (RateConfiguration { duration_nanos: u64::MAX, ..RATE }, "rate.duration_s"),
        (RateConfiguration { limits: window, ..RATE }, "rate.progress_window_s"),
        (RateConfiguration { limits: travel, ..RATE }, "travel.greatest_deg"),
        (RateConfiguration { limits: on_max, ..RATE }, "rate.on_max_s"),
    ];
    for (rate, key) in bad {
        let refused = fault(BoardFault::OutOfBounds { key: key.try_into().unwrap() });
        assert_eq!(bench.exchange(&HostMessage::ConfigureRate(rate)), refused);
        assert_eq!(bench.exchange(&HostMessage::Arm), fault(BoardFault::NotReady));
    }
    bench.exchange(&HostMessage::ConfigureRate(RATE));
    for (rate, _) in bad {
        bench.exchange(&HostMessage::ConfigureRate(rate));
    }
    assert_eq!(bench.exchange(&HostMessage::Arm), [BoardMessage::Armed]);
    for message in [HostMessage::ConfigureRate(RATE), HostMessage::Configure(MOVE)] {
        assert_eq!(bench.exchange(&message), fault(BoardFault::Armed));
    }
    bench.drive();
    assert!(bench.rest().rate.is_some());
    // The last configuration counts, whichever kind it is of.
    bench.exchange(&HostMessage::Stop);
    assert_eq!(bench.exchange(&HostMessage::Configure(MOVE)), [BoardMessage::Configured]);
    bench.exchange(&HostMessage::Arm);
    assert!(bench.rest().rate.is_none());
}

//! Which ticks are reported.

use link::{
    CHANGE_TICKS, PhaseRecord, REPORT_TICKS, REPORT_TICKS_MAX, RateConfiguration, RateLimitsRecord,
    RatePhase, checked_report_ticks,
};

use super::*;

fn every(ticks: u16) -> HostMessage {
    HostMessage::ReportPeriod { ticks }
}

impl Bench {
    /// A board that waits to be armed for a move, with a report every `ticks`, 0 for those of changes.
    fn reporting_every(ticks: u16) -> Self {
        let mut bench = Self::new();
        bench.exchange(&HostMessage::Hello);
        assert_eq!(bench.exchange(&every(ticks)), [BoardMessage::ReportPeriod { ticks }]);
        assert_eq!(bench.exchange(&HostMessage::Configure(MOVE)), [BoardMessage::Configured]);
        bench
    }

    /// The report of the next tick on the board's own timer, if there is one, of a host that is there.
    fn timed(&mut self) -> Option<TickRecord> {
        self.exchange(&HostMessage::Count);
        self.board.tick_and_report(false)
    }

    /// The same of a rotor at rest.
    fn timed_at_rest(&mut self) -> Option<TickRecord> {
        self.measure();
        self.timed()
    }
}

/// The report says what the amplifier really applies.
#[test]
fn law_the_report_says_what_is_applied() {
    let mut bench = Bench::new();
    bench.board.amplifier_mut().broken = true;
    bench.begin();
    let mut commanded = false;
    for _ in 0..3000 {
        bench.measure();
        if let Some(report) = bench.step() {
            commanded |= report.command.mode.value() != Some(None);
            assert_eq!(report.applied.mode, None.into());
        }
    }
    assert!(commanded);
}

/// Without measurements nothing changes: a report comes with the first tick and every period from there, up to the
/// longest, and as often of a board that reports changes alone. Nothing comes in between, and nothing after a stop.
#[test]
fn exact_reports_come_every_period() {
    for (asked, period) in [(1, 1), (7, 7), (100, 100), (2000, 2000), (REPORT_TICKS_MAX, 10_000), (0, 10_000)]
    {
        let mut bench = Bench::reporting_every(asked);
        assert!((0..50).all(|_| bench.timed().is_none()), "not armed");
        bench.exchange(&HostMessage::Arm);
        for tick in 0..=3 * period {
            assert_eq!(bench.timed().is_some(), tick % period == 0, "{asked}: {tick}");
        }
        bench.exchange(&HostMessage::Stop);
        assert!((0..period).all(|_| bench.timed().is_none()));
        bench.exchange(&HostMessage::Arm);
        assert!(bench.timed().is_some(), "the first tick, whenever the last period began");
    }
}

/// A host that asks for nothing has a thousand a second, as one whose session begins anew.
#[test]
fn exact_a_session_begins_with_a_report_every_millisecond() {
    let mut bench = Bench::reporting_every(0);
    bench.begin();
    let count = (0..10 * REPORT_TICKS).filter(|_| bench.timed().is_some()).count();
    assert_eq!(count, 10);
}

/// The period may be changed while a move is under way, which goes on.
#[test]
fn exact_a_period_is_changed_at_once() {
    let mut bench = Bench::reporting_every(0);
    bench.exchange(&HostMessage::Arm);
    assert!(bench.timed().is_some() && (0..300).all(|_| bench.timed().is_none()));
    assert_eq!(bench.exchange(&every(5)), [BoardMessage::ReportPeriod { ticks: 5 }]);
    let reported: Vec<bool> = (0..11).map(|_| bench.timed().is_some()).collect();
    assert!(reported.iter().enumerate().all(|(tick, &is)| is == (tick % 5 == 0)), "{reported:?}");
    assert!(bench.board.is_armed());
}

/// A period that is too long is refused by name, and the one before stays.
#[test]
fn law_a_period_out_of_bounds_is_refused_by_name() {
    let mut bench = Bench::reporting_every(5);
    let key = "board.report_period_ticks".try_into().unwrap();
    assert_eq!(bench.exchange(&every(REPORT_TICKS_MAX + 1)), fault(BoardFault::OutOfBounds { key }));
    bench.exchange(&HostMessage::Arm);
    assert_eq!((0..20).filter(|_| bench.timed().is_some()).count(), 4);
}

/// Whatever the period, the host is told of every tick in which a move changes its drive.
#[test]
fn exact_every_change_of_the_drive_is_told_in_its_tick() {
    for period in [1, 100, 2000, REPORT_TICKS_MAX, 0] {
        let mut bench = Bench::reporting_every(period);
        bench.exchange(&HostMessage::Arm);
        let (mut driven, mut changes) = (bench.driven(), 0);
        for tick in 0..3 * u32::from(REPORT_TICKS_MAX) {
            let report = bench.timed_at_rest();
            let before = mem::replace(&mut driven, bench.driven());
            if driven != before {
                changes += 1;
                assert_eq!(report.map(|report| report.applied), Some(driven.into()), "{period}: {tick}");
            }
        }
        assert!(changes >= 2, "{period}: a cruise begins, and ends since nothing turns: {changes}");
    }
}

/// Whatever the period, the host is told of another health and another phase at the latest [`CHANGE_TICKS`] after it
/// was last told anything, and not before: of an estimate that may be used, and of one that may not since the camera is
/// silent. Beside it is a board that reports every tick.
#[test]
fn exact_a_change_of_health_or_phase_is_told() {
    // That rotor is where it is to be: no drive tells that it is held.
    let here = Configuration { target_deg: 0.015, tolerance_deg: 1.0, ..MOVE };
    for (period, moves) in [(100, MOVE), (2000, here), (REPORT_TICKS_MAX, MOVE), (0, MOVE), (0, here)] {
        let [mut bench, mut beside] = [period, 1].map(Bench::reporting_every);
        for bench in [&mut bench, &mut beside] {
            bench.exchange(&HostMessage::Configure(moves));
            bench.exchange(&HostMessage::Arm);
        }
        let (mut told_at, mut told, mut changes) = (0, None, 0);
        let mut drive = DriveCommand::OFF.into();
        for tick in 1..=2 * u32::from(REPORT_TICKS_MAX) {
            let [report, whole] = [&mut bench, &mut beside]
                .map(|bench| if tick < 5000 { bench.timed_at_rest() } else { bench.timed() });
            let whole = whole.expect("a report of every tick");
            let now = (whole.phase, whole.health);
            if let Some(report) = report {
                assert_eq!(report.difference(&whole), None, "{period}: {tick}");
                changes += u32::from(told != Some(now));
                let of_period = (tick - 1).is_multiple_of(checked_report_ticks(period).unwrap().into());
                let of_drive = mem::replace(&mut drive, report.applied) != report.applied;
                let is_late = tick - told_at >= u32::from(CHANGE_TICKS);
                assert!(of_period || of_drive || is_late, "{period}: {tick} after {told_at}");
                (told_at, told) = (tick, Some(now));
            }
            let is_told = told == Some(now) || tick - told_at < u32::from(CHANGE_TICKS);
            assert!(is_told, "{period}: {tick}, {now:?} after {told:?}");
        }
        assert!(changes >= 4 - u32::from(moves == here), "{period}: {changes}");
    }
}

/// A rate changes its drive too often for a report of each change: of a rotor that is known there are those of the
/// period alone.
#[test]
fn exact_a_rate_is_reported_by_its_period() {
    let rate = RateConfiguration {
        filter: MOVE.filter,
        rate_deg_s: 100.0,
        duration_nanos: 20_000_000_000,
        limits: RateLimitsRecord::default(),
    };
    let mut bench = Bench::reporting_every(2000);
    bench.exchange(&HostMessage::ConfigureRate(rate));
    bench.exchange(&HostMessage::Arm);
    let (mut driven, mut changes, mut reported, mut following) = (bench.driven(), 0, Vec::new(), 0);
    for tick in 0..20_000_u32 {
        let report = bench.timed_at_rest();
        changes += u32::from(mem::replace(&mut driven, bench.driven()) != driven);
        if let Some(report) = report {
            reported.push(tick);
            following += u32::from(report.phase.value() == Some(PhaseRecord::Rate(RatePhase::Following)));
        }
    }
    let of_period = reported.iter().filter(|tick| **tick % 2000 == 0).count();
    assert_eq!(of_period, 10, "{reported:?}");
    // From waiting to following.
    assert!(changes > 0 && following >= 9 && reported.len() <= 12, "{changes} {following} {reported:?}");
}

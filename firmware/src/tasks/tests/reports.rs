//! The reports between those that come every millisecond.

use core::mem;

use controller::commissioning::experiment::Experiment;
use link::{ExperimentRecord, ExperimentsConfiguration, FilterKind, RateConfiguration, RateLimitsRecord};

use super::*;

/// Bursts that are shorter than the time between two reports are told to the tick.
#[test]
fn exact_every_change_of_the_drive_is_reported() {
    let experiments = ExperimentsConfiguration {
        filter: FilterKind::ConstantRate,
        time_max_nanos: 60_000_000_000,
        travel_deg: None,
        amplitude_max: None,
    };
    let train = Experiment::Train { mode: DriveMode::C, amplitude: 0.5, offset_hz: 0.0, ticks: 30, count: 4 };
    let mut bench = Bench::new();
    for message in [HostMessage::Hello, HostMessage::ConfigureExperiments(experiments), HostMessage::Arm] {
        bench.exchange(&message);
    }
    let order = HostMessage::Experiment(ExperimentRecord::new(1, &train));
    let mut tick = 0;
    while bench.exchange(&order) != [BoardMessage::ExperimentTaken { number: 1 }] {
        tick += 1;
        assert!(tick < 100_000, "ready to be ordered");
        bench.rest(tick);
    }
    bench.received.clear();
    (tick + 1..tick + 60_000).for_each(|tick| bench.rest(tick));
    let (mut before, mut changes) = (Some(None), Vec::new());
    for received in &bench.received {
        let BoardMessage::Report(report) = received else { continue };
        let mode = report.applied.mode.value().unwrap();
        if before.replace(mode).is_some_and(|before| before != mode) {
            changes.push((mode.is_some(), report.estimate.unwrap().at_nanos / PositionLoop::TICK_NANOS));
        }
    }
    assert_eq!(changes.len(), 8, "{changes:?}");
    for burst in changes.chunks(2) {
        assert!(burst[0].0 && !burst[1].0 && burst[1].1 - burst[0].1 == 30, "{changes:?}");
    }
    assert!((600..=600 + 8 + 1).contains(&bench.received.len()), "{}", bench.received.len());
}

/// A rate changes its drive some thousand times a second: it is reported every millisecond and no more often.
#[test]
fn exact_a_rate_is_reported_every_millisecond() {
    let rate = RateConfiguration {
        filter: FilterKind::ConstantRate,
        rate_deg_s: 100.0,
        duration_nanos: 20_000_000_000,
        limits: RateLimitsRecord::default(),
    };
    let mut bench = Bench::new();
    for message in [HostMessage::Hello, HostMessage::ConfigureRate(rate), HostMessage::Arm] {
        bench.exchange(&message);
    }
    let (mut was_on, mut changes) = (false, 0);
    for tick in 1..=20_000 {
        bench.rest(tick);
        changes += u32::from(mem::replace(&mut was_on, bench.is_on()) != bench.is_on());
    }
    assert!(changes > 0, "it drives");
    let reports = bench.received.iter().filter(|received| matches!(received, BoardMessage::Report(_)));
    assert_eq!(reports.count(), 200);
}

#![expect(
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "positive, and far below 2^53"
)]

use proptest::prelude::*;

use super::*;

/// A time of day: far from zero, as a host's clock is.
const HOST: i64 = 1_795_000_000_000_000_000;

/// A board that started `start` ns after [`HOST`] and whose clock runs faster by `drift`.
#[derive(Clone, Copy)]
struct Truth {
    start: f64,
    drift: f64,
}

impl Truth {
    /// The board's time at `host` ns after [`HOST`].
    fn board(self, host: f64) -> f64 {
        (host - self.start) * (1.0 + self.drift)
    }

    /// An exchange begun at `sent` ns after [`HOST`] with these delays on the ways there and back.
    fn exchange(self, sent: i64, there: i64, back: i64) -> Exchange {
        let counted = self.board((sent + there) as f64);
        let ticks = (counted / TICK_NANOS as f64).floor() as u64;
        Exchange { sent_nanos: HOST + sent, received_nanos: HOST + sent + there + back, ticks }
    }
}

/// The worse of two exchanges is known to half of 3 ms and half a tick, whichever is the later one. Of one exchange it
/// is that one.
#[test]
fn exact_the_worse_exchange_of_a_clock() {
    for (round_trips_ms, worst_ms) in [(&[2, 3][..], 3.0), (&[3, 2], 3.0), (&[2], 2.0)] {
        let mut sync = ClockSync::default();
        for (n, round_trip_ms) in (0..).zip(round_trips_ms.iter().flat_map(|ms| [ms; 8])) {
            let sent_nanos = HOST + 10_000_000 * n;
            sync.add(Exchange {
                sent_nanos,
                received_nanos: sent_nanos + 1_000_000 * round_trip_ms,
                ticks: 7,
            });
        }
        let worst = sync.at(HOST).unwrap().exchange_uncertainty_nanos();
        assert!((worst - 500_000.0 * worst_ms - 5_000.0).abs() < 1e-6, "{round_trips_ms:?}: {worst}");
    }
}

/// Equal delays both ways: the middle of the exchange is when the board counted, in the middle of a tick here, so that
/// offset and drift come out to the rounding.
#[test]
fn exact_equal_delays_give_offset_and_drift() {
    let truth = Truth { start: -1e9, drift: 1e-3 };
    let mut sync = ClockSync::default();
    for window in 0..3 {
        for n in 0..8 {
            // Whole ticks of the board.
            let counted = window * 1_000_000_000;
            let there = 1_000_000 + 100_000 * ((n + 3) % 8);
            let mut exchange = truth.exchange(counted - there, there, there);
            exchange.ticks = (truth.board(counted as f64) / 1e4).round() as u64;
            sync.add(exchange);
        }
    }
    let clock = sync.at(HOST + 2_000_000_000).unwrap();
    assert_eq!(sync.shortest_nanos(), Some(2_000_000));
    // The true counts are whole ticks, and stand for the middle of the tick.
    for host in [0, 1_500_000_000, 2_000_000_000, 7_000_000_000] {
        let error = clock.board_nanos(HOST + host) as f64 - truth.board(host as f64) - 5_000.0;
        assert!(error.abs() <= 1.0, "{host}: {error}");
    }
    assert!((clock.drift().unwrap() - 1e-3).abs() < 1e-12, "{clock:?}");
    // Half a round trip of 2 ms and half a tick at the late exchange; this twice over the time between the exchanges.
    assert!((clock.uncertainty_nanos(HOST + 2_000_000_000) - 1_005_000.0).abs() < 1.0);
    assert!((clock.drift_uncertainty().unwrap() - 2.0 * 1_005_000.0 / 2e9).abs() < 1e-12);
}

/// Unequal delays: the error is half their difference.
#[test]
fn exact_unequal_delays_err_by_half_their_difference() {
    let truth = Truth { start: 0.0, drift: 0.0 };
    let mut sync = ClockSync::default();
    sync.add(truth.exchange(5_000 - 300_000, 300_000, 1_300_000));
    let clock = sync.at(HOST).unwrap();
    assert_eq!((clock.drift(), clock.drift_uncertainty()), (None, None));
    // The board counted at 5 us, in the middle of its first tick, and the middle of the exchange is 0.5 ms later.
    assert_eq!(clock.board_nanos(HOST + 1_000_000), 500_000);
    assert!((clock.uncertainty_nanos(HOST) - 805_000.0).abs() < 1e-6);
}

/// Bytes that wait in an adapter delay questions, or answers, by 40 ms from some time on: a delay of one way alone. The
/// error is within the uncertainty, and the uncertainty tells of the delay.
#[test]
fn law_what_waits_on_one_way_is_within_the_uncertainty() {
    let truth = Truth { start: -1e9, drift: 5e-5 };
    for (there, back) in [(40_000_000, 0), (0, 40_000_000)] {
        let mut sync = ClockSync::default();
        let mut now = 0;
        for n in 0..64 {
            let waits = n >= 32;
            let delay = |more: i64| 150_000 + if waits { more } else { 0 };
            sync.add(truth.exchange(now, delay(there), delay(back)));
            now += 100_000_000;
            let clock = sync.at(HOST + now).unwrap();
            let error = clock.board_nanos(HOST + now) as f64 - truth.board(now as f64);
            let bound = clock.uncertainty_nanos(HOST + now);
            // Of a single exchange it leaves the drift out.
            let drift = if clock.drift().is_none() { 5e-5 * now as f64 } else { 0.0 };
            assert!(error.abs() <= bound * (1.0 + 5e-5) + drift + 1.0, "{n}: {error} {bound}");
        }
        assert!(sync.at(HOST + now).unwrap().uncertainty_nanos(HOST + now) > 20_000_000.0);
    }
}

#[test]
fn exact_no_exchange_no_clock_and_no_time_before_the_start() {
    let mut sync = ClockSync::default();
    sync.add(Exchange { sent_nanos: 10, received_nanos: 9, ticks: 1 });
    assert_eq!((sync.at(0), sync.shortest_nanos()), (None, None));
    sync.add(Exchange { sent_nanos: 10, received_nanos: 10, ticks: 1 });
    assert_eq!(sync.at(0).unwrap().board_nanos(-1_000_000), 0);
}

proptest! {
    /// Any delays, drift and time: the error is within the uncertainty, and memory is bounded.
    #[test]
    fn law_the_error_is_within_the_uncertainty(
        start in -1e12..0.0_f64,
        drift in -0.9..0.01_f64,
        delays in proptest::collection::vec((0..5_000_000_i64, 0..5_000_000_i64, 1..200_000_000_i64), 16..120),
        later in 0..10_000_000_000_i64,
    ) {
        let truth = Truth { start, drift };
        let mut sync = ClockSync::default();
        let mut now = 0;
        for (there, back, pause) in delays {
            sync.add(truth.exchange(now, there, back));
            now += there + back + pause;
        }
        for host in [now, now + later] {
            let clock = sync.at(HOST + host).unwrap();
            let error = clock.board_nanos(HOST + host) as f64 - truth.board(host as f64);
            let bound = clock.uncertainty_nanos(HOST + host) * (1.0 + drift.abs()) + 1.0;
            prop_assert!(error.abs() <= bound, "{error} {bound}");
            if let (Some(found), Some(bound)) = (clock.drift(), clock.drift_uncertainty()) {
                prop_assert!((found - drift).abs() <= bound * (1.0 + drift.abs()) + 1e-12);
            }
        }
    }
}

/// A day of ten exchanges a second.
#[test]
fn law_memory_is_bounded() {
    let truth = Truth { start: 0.0, drift: 3e-5 };
    let mut sync = ClockSync::default();
    for n in 0..864_000 {
        sync.add(truth.exchange(100_000_000 * n, 700_000, 700_000));
    }
    assert!(sync.kept.len() < KEPT_MAX);
    let clock = sync.at(HOST + 86_400_000_000_000).unwrap();
    assert!((clock.drift().unwrap() - 3e-5).abs() < 1e-7, "{:?}", clock.drift());
}

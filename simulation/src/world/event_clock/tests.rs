//! Clocks against closed forms.

use rand_core::SeedableRng;

use super::*;

/// Every event of an hour at a rate and a phase, in integers: event `n` of `of.0 / of.1` ns a period is at
/// `(n + phase.0 / phase.1) of.0 / of.1`, and the nearest nanosecond is meant.
fn assert_an_hour_is_exact(rate_hz: f64, (period, per): (u128, u128), (phase, parts): (u128, u128)) {
    #[expect(clippy::cast_precision_loss, reason = "small numbers")]
    let mut clock = EventClock::new(EventRate::from_hz(rate_hz), phase as f64 / parts as f64);
    let first = u128::from(phase == 0);
    for n in first.. {
        let (above, below) = ((n * parts + phase) * period, parts * per);
        let expected = (2 * above + below) / (2 * below);
        if expected > 3_600_000_000_000 {
            break;
        }
        assert_eq!(u128::from(clock.due().nanos()), expected, "event {n} at {rate_hz} Hz");
        clock.advance();
    }
}

#[test]
fn exact_instants_over_an_hour() {
    assert_an_hour_is_exact(60.0, (50_000_000, 3), (0, 1));
    assert_an_hour_is_exact(60.0, (50_000_000, 3), (1, 4));
    assert_an_hour_is_exact(3000.0, (1_000_000, 3), (0, 1));
    assert_an_hour_is_exact(29.97, (100_000_000_000, 2997), (0, 1));
    assert_an_hour_is_exact(29.97, (100_000_000_000, 2997), (3, 8));
    assert_an_hour_is_exact(10.0, (100_000_000, 1), (1, 2));
}

/// Where a whole number of nanoseconds is a period, every event is at its multiple, and none is at the start.
#[test]
fn exact_multiples_of_whole_periods() {
    for (rate_hz, period_nanos) in [(10_000.0, 100_000), (200_000.0, 5000), (1e6, 1000), (10.0, 100_000_000)]
    {
        for phase in [0.0, 1.0] {
            let mut clock = EventClock::new(EventRate::from_hz(rate_hz), phase);
            for n in 1..1000 {
                assert_eq!(clock.due(), Time::from_nanos(n * period_nanos), "{rate_hz} {phase}");
                clock.advance();
            }
        }
    }
}

#[test]
fn exact_spans() {
    let rate = EventRate::from_hz(60.0);
    assert_eq!([0, 1, 2, 3].map(|n| rate.span_nanos(n)), [0, 16_666_667, 33_333_333, 50_000_000]);
    assert_eq!(rate.part_nanos(0.5), 8_333_334);
}

/// Displacements have the deviation asked for, do not add up, and keep the order. A variance of n independent numbers
/// is known to `sqrt(2 / n)`, 1 % here: bounds are four of these.
#[test]
fn law_jitter_has_its_variance_and_does_not_add_up() {
    let deviation_nanos = 20_000.0;
    let even = EventClock::new(EventRate::from_hz(3000.0), 0.3);
    let mut clock = even.clone().with_jitter(deviation_nanos, Pcg64::seed_from_u64(4));
    let (mut even, mut last) = (even, Time::ZERO);
    let (mut sum, mut squares, mut products, mut before) = (0.0, 0.0, 0.0, 0.0);
    let count = 20_000;
    for _ in 0..count {
        assert!(clock.due() > last);
        last = clock.due();
        #[expect(clippy::cast_precision_loss, reason = "below 2^53")]
        let by = clock.due().nanos() as f64 - even.due().nanos() as f64;
        let relative = by / deviation_nanos;
        sum += relative;
        squares += relative * relative;
        products += relative * before;
        before = relative;
        clock.advance();
        even.advance();
    }
    let [mean, variance, correlation] = [sum, squares, products].map(|sum| sum / f64::from(count));
    assert!(mean.abs() < 4.0 / 141.0, "{mean}");
    assert!((variance - 1.0).abs() < 0.04, "{variance}");
    assert!(correlation.abs() < 4.0 / 141.0, "{correlation}");
}

//! Filters with slow and late cameras, on a rotor that turns.

use estimator::{CameraDescription, Health, Instruments, Reason};
use motor_model::{DriveCommand, DriveMode};

use crate::bench::{Bench, filters};

/// Slow cameras, down to ten frames a second, and late ones, up to 50 ms: a rotor in mode B whose rate follows the law
/// assumed (mean 14 rad/s, standard deviation 4.4, correlation time 12 ms). The turn is kept: no restart, each error
/// less than half a turn. The errors over the reported deviations have a mean square within 0.2 to 2: wide is allowed
/// where the mean rate is not known, too narrow is not. The health between frames is wide, not lost.
#[test]
fn law_slow_and_late_cameras_keep_the_turn() {
    for (period_nanos, latency_nanos) in [
        (5_000_000, 5_000_000),
        (20_000_000, 0),
        (20_000_000, 50_000_000),
        (100_000_000, 0),
        (1_000_000, 50_000_000),
    ] {
        let camera = CameraDescription { period_nanos, latency_nanos, ..CameraDescription::default() };
        let instruments = Instruments { camera, vibrometer: None };
        let (mut square_sum, mut count) = (0.0, 0_u32);
        for seed in 0..8 {
            let mut filter = filters(&instruments).swap_remove(0);
            let mut bench = Bench::new(camera, seed);
            let mut rate = 0.0;
            for n in 0..230_000_u64 {
                let driven = n >= 30_000;
                let kick = 4.4 * (2.0e-5_f64 / 12e-3).sqrt() * bench.normal();
                rate = if driven { rate + (14.0 - rate) * 1e-5 / 12e-3 + kick } else { 0.0 };
                let command = if driven { DriveCommand::full(DriveMode::B) } else { DriveCommand::OFF };
                let (estimate, health) = bench.tick(filter.as_mut(), command, rate, None);
                if n > 60_000 {
                    let estimate = estimate.unwrap();
                    let error_rad = bench.error_rad(&estimate);
                    assert!(error_rad.abs() < 3.1, "{period_nanos} {latency_nanos} {seed}: turn lost");
                    let usable = matches!(
                        health,
                        Health::Good | Health::Degraded(Reason::Uncertain | Reason::NoiseMismatch)
                    );
                    assert!(usable, "{period_nanos} {latency_nanos} {seed} {n}: {health:?}");
                    square_sum += error_rad * error_rad / f64::from(estimate.angle_rad2);
                    count += 1;
                }
            }
            assert_eq!(bench.restarts, 1, "{period_nanos} {latency_nanos} {seed}");
        }
        let mean = square_sum / f64::from(count);
        assert!((0.2..2.0).contains(&mean), "{period_nanos} {latency_nanos}: {mean}");
    }
}

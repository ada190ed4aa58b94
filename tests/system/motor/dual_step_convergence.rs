//! Located impacts: what a user asks of the twin comes out the same at 10 and 20 us as at 0.5 us.
//!
//! | amplitude | quantity | 0.5 us, to a standard error |
//! |---|---|---|
//! | B 1 | mean rate, impacts/s | 15.142 +- 0.036 rad/s, 245.1 +- 0.5 |
//! | B 0.3 | | 1.049 +- 0.008 rad/s, 2224 +- 12 |
//! | C 1 | | -1.528 +- 0.003 rad/s, 2308 +- 5 |
//!
//! over 320 s of model time in B at full amplitude, 64 s in the others. Impacts are those that approach faster than 1
//! mm/s.

use motor_model::{DriveCommand, DriveMode, MotorParams, MotorSetup, Real};

use crate::support::closeness::{Within, assert_close};
use crate::support::motors::{Bench, located};
use crate::support::steady::{Steady, varied};

/// Largest deviation allowed at a step: 2 % at 10 us, 5 % at 20 us.
const BANDS: [(f64, f64); 2] = [(10e-6, 0.02), (20e-6, 0.05)];

fn setup(step_s: f64, seed: u8) -> MotorSetup {
    varied(&MotorParams::nominal(), &located(step_s), seed)
}

fn command(mode: DriveMode, amplitude: f32) -> DriveCommand {
    DriveCommand::try_new(mode, amplitude).expect("a valid amplitude")
}

/// Averages over `seeds` runs of 4 s after 0.3 s.
fn steady<T: Real>(command: DriveCommand, step_s: f64, seeds: u8) -> Steady {
    Steady::over::<T>(&MotorParams::nominal(), &located(step_s), command, seeds, (0.3, 4.0))
}

fn check_steady<T: Real>(mode: DriveMode, amplitude: f32, seeds: u8, rate_rad_s: f64, impacts_per_s: f64) {
    for (step_s, band) in BANDS {
        let found = steady::<T>(command(mode, amplitude), step_s, seeds);
        println!("{mode:?} {amplitude} {step_s:e} {found:?}");
        let what = format!("{mode:?} {amplitude} at {step_s:e} s, {} bytes", size_of::<T>());
        let within = Within::relative(band);
        assert_close(found.rate_rad_s, rate_rad_s, within, format_args!("rate, {what}"));
        assert_close(found.impacts_per_s, impacts_per_s, within, format_args!("impacts/s, {what}"));
    }
}

/// 128 s of model time a step: 0.06 rad/s and 0.7 impacts/s to a standard error, 0.4 and 0.3 %.
#[test]
fn dual_mode_b_at_full_amplitude() {
    check_steady::<f64>(DriveMode::B, 1.0, 32, 15.142, 245.1);
    check_steady::<f32>(DriveMode::B, 1.0, 32, 15.142, 245.1);
}

/// 200 s: 0.004 rad/s and 7 impacts/s, 0.4 and 0.3 %.
#[test]
fn dual_mode_b_at_small_amplitude() {
    check_steady::<f64>(DriveMode::B, 0.3, 50, 1.049, 2224.0);
}

/// 48 s: 0.004 rad/s and 6 impacts/s, 0.3 %.
#[test]
fn dual_mode_c_at_full_amplitude() {
    check_steady::<f64>(DriveMode::C, 1.0, 12, -1.528, 2308.0);
    check_steady::<f32>(DriveMode::C, 1.0, 12, -1.528, 2308.0);
}

/// Mode C at 0.3 never throws the rotor: it walks on teeth in sustained contact, without chance but for the pairs'
/// amplitudes.
#[test]
fn dual_walking() {
    let rate = |step_s| {
        let found = steady_walk::<f64>(step_s);
        assert_close(
            steady_walk::<f32>(step_s),
            found,
            Within::relative(1e-3),
            format_args!("f32 at {step_s:e} s"),
        );
        found
    };
    let fine = steady_walk::<f64>(0.5e-6);
    assert_close(fine, -0.0250, Within::absolute(0.0003), "0.5 us");
    for step_s in [1e-6, 5e-6, 10e-6, 20e-6] {
        // Spans of at most 5 us each way: what remains at the coarse steps is 0.34 %.
        let found = rate(step_s);
        assert_close(found, -0.0250, Within::absolute(0.0003), format_args!("{step_s:e} s"));
        assert_close(found, fine, Within::relative(0.005), format_args!("{step_s:e} s"));
    }
}

/// Mean rate over 0.3 s of walking, averaged over 4 amplitude variations.
fn steady_walk<T: Real>(step_s: f64) -> f64 {
    let time_s = 0.3;
    let walk = command(DriveMode::C, 0.3);
    (0..4)
        .map(|seed| {
            let mut bench = Bench::<T>::new(&MotorParams::nominal(), &setup(step_s, seed));
            bench.run(walk, 0.1);
            let origin = bench.angle_rad();
            bench.run(walk, time_s);
            0.25 * (bench.angle_rad() - origin) / time_s
        })
        .sum()
}

/// Net turn in milli-degrees of a burst from rest, 60 ms after it, averaged over 20 amplitude variations.
fn burst_mdeg<T: Real>(mode: DriveMode, on_s: f64, step_s: f64) -> f64 {
    (0..20)
        .map(|seed| {
            let mut bench = Bench::<T>::new(&MotorParams::nominal(), &setup(step_s, seed));
            bench.run(DriveCommand::OFF, 0.05);
            let origin = bench.state.rotor.angle.angle();
            bench.run(command(mode, 0.3), on_s);
            bench.run(DriveCommand::OFF, 0.06);
            bench.state.rotor.angle.angle().minus(origin).degrees() * 1e3 / 20.0
        })
        .sum()
}

/// Two, five and ten cycles of C, two of B, to the nearest 20 us: a whole number of every step. Measured at 0.5 us:
/// -1.122, -3.624, -7.826 and 7.359 mdeg; at 10 us off by 0.2, 0.02, 0.01 and 0.7 %, at 20 us by 0.2, 0.02, 0.01 and
/// 0.9 %.
#[test]
fn dual_bursts_from_rest() {
    for (mode, on_s) in
        [(DriveMode::C, 260e-6), (DriveMode::C, 680e-6), (DriveMode::C, 1340e-6), (DriveMode::B, 320e-6)]
    {
        let fine = burst_mdeg::<f64>(mode, on_s, 0.5e-6);
        for (step_s, band) in [(5e-6, 0.02), BANDS[0], BANDS[1]] {
            for found in [burst_mdeg::<f64>(mode, on_s, step_s), burst_mdeg::<f32>(mode, on_s, step_s)] {
                let what = format!("{mode:?}, {on_s:e} s on, step {step_s:e} s");
                assert_close(found, fine, Within::relative(band), what);
            }
        }
    }
}

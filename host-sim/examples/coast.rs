//! Prints what `controller::gear` says of its gears: rate at cut-off and coast afterwards, over drawn motors.
//!
//! `cargo run --release -p host-sim --example coast`

use average::{Estimate, Variance};
use controller::gear::{CLOCKWISE, COUNTER_CLOCKWISE, Gear};
use host_sim::{CommandError, Scene, plant::Plant};
use motor_model::{DriveCommand, math};

/// Motors drawn within Table 1's tolerances.
const MOTORS: u64 = 40;
/// Steady motion is reached well before this; a gear with a shorter limit is cut off at its own.
const DRIVEN_MAX_NANOS: u64 = 150_000_000;
/// By then every rotor has stopped.
const STOPPED_NANOS: u64 = 200_000_000;

/// Runs one motor: degrees turned, rate in deg/s at cut-off, and coast in milli-degrees.
fn coast(gear: &Gear, seed: u64) -> Result<[f64; 3], CommandError> {
    let mut scene = Scene::default();
    scene.set("seed", &seed.to_string())?;
    let mut plant = Plant::draw(&scene)?;
    let until = |plant: &mut Plant, nanos: u64, command| {
        while plant.now().nanos() < nanos {
            plant.step(command);
        }
    };
    let driven_nanos = gear.longest_nanos.min(DRIVEN_MAX_NANOS);
    until(&mut plant, driven_nanos, DriveCommand::saturating(gear.mode, gear.amplitude));
    let cut_off = plant.state().rotor;
    until(&mut plant, driven_nanos + STOPPED_NANOS, DriveCommand::OFF);
    let coast = plant.state().rotor.angle.angle().minus(cut_off.angle.angle());
    Ok([cut_off.angle.angle().degrees(), cut_off.rate_rad_s.to_degrees(), 1e3 * coast.degrees()])
}

fn main() -> Result<(), CommandError> {
    println!("| drive | on for | turned deg | rate deg/s | coast mdeg |");
    println!("|---|---|---|---|---|");
    for gear in CLOCKWISE.iter().chain(&COUNTER_CLOCKWISE) {
        let mut columns = [Variance::new(), Variance::new(), Variance::new()];
        for seed in 1..=MOTORS {
            for (column, value) in columns.iter_mut().zip(coast(gear, seed)?) {
                column.add(value);
            }
        }
        let [turned, rate, coast] = columns
            .map(|column| format!("{:.3} +- {:.3}", column.mean(), math::sqrt(column.sample_variance())));
        let on_ms = gear.longest_nanos.min(DRIVEN_MAX_NANOS) / 1_000_000;
        println!("| {:?}, {} | {on_ms} ms | {turned} | {rate} | {coast} |", gear.mode, gear.amplitude);
    }
    Ok(())
}

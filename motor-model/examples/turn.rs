//! Drives mode C for 0.1 s from rest and prints angle, rate and impacts every 10 ms.

use motor_model::{DriveCommand, DriveMode, Motor, MotorParams, MotorSetup, MotorState, OutOfBounds};

const STEP_S: f64 = 10e-6;
const STEPS_PER_LINE: u32 = 1000;
const LINES: u32 = 10;

fn main() -> Result<(), OutOfBounds> {
    let motor = Motor::<f64>::try_new(&MotorParams::nominal(), &MotorSetup::with_step(STEP_S))?;
    let command = DriveCommand::full(DriveMode::C);
    let mut state = MotorState::default();
    println!("time     angle      rate        impacts");
    for line in 1..=LINES {
        let mut impacts = 0;
        for _ in 0..STEPS_PER_LINE {
            impacts += motor.step(&mut state, command).len();
        }
        let time_ms = 1e3 * STEP_S * f64::from(line * STEPS_PER_LINE);
        let angle_deg = state.rotor.angle.angle().degrees();
        println!("{time_ms:3.0} ms {angle_deg:+8.3} deg {:+7.3} rad/s {impacts:5}", state.rotor.rate_rad_s);
    }
    Ok(())
}

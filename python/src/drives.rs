//! A drive as one number: its size is the amplitude, its sign the mode. Positive is mode B, which turns clockwise.

use motor_model::{DriveCommand, DriveMode, OutOfBounds};

/// The command of a signed amplitude in -1 to 1 and an offset from the mode's frequency.
///
/// # Errors
/// When either is outside its bounds.
#[expect(clippy::cast_possible_truncation, reason = "a command is f32")]
pub fn command(drive: f64, frequency_offset_hz: f64) -> Result<DriveCommand, OutOfBounds> {
    OutOfBounds::check("drive", drive, -1.0, 1.0, "")?;
    let mode = if drive < 0.0 { DriveMode::C } else { DriveMode::B };
    let command =
        if drive.abs() > 0.0 { DriveCommand::try_new(mode, drive.abs() as f32)? } else { DriveCommand::OFF };
    if command == DriveCommand::OFF {
        return Ok(command);
    }
    command.with_frequency_offset(frequency_offset_hz as f32)
}

/// The signed amplitude of a command.
pub fn signed(command: DriveCommand) -> f64 {
    let amplitude = f64::from(command.amplitude());
    match command.mode() {
        Some(DriveMode::C) => -amplitude,
        Some(DriveMode::B) => amplitude,
        None => 0.0,
    }
}

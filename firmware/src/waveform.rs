//! The waveform of the coil's current: samples of a sine whose phase is continuous.
//!
//! ```text
//! phase += frequency / sample rate (in turns, modulo 1),    level = amplitude sin(phase)
//! ```
//!
//! The phase is the integer accumulator of [`motor_model::Phase`]. As in the model, it continues through changes of
//! mode, frequency and amplitude, and does not change while the drive is off. A change of command needs no
//! transcendental function: the increment of a mode is computed once, and that of an offset is a product.

use motor_model::{DriveCommand, DriveMode, OutOfBounds, Phase};

/// Units of the increment in a turn.
const UNITS_PER_TURN: f64 = 4_294_967_296.0;

/// Increments of the phase in a sample.
#[derive(Clone, Copy, Debug)]
pub struct ModeIncrements {
    /// Of modes B and C.
    b: Phase,
    c: Phase,
    /// Of a hertz, in units of 2^-32 turn.
    units_per_hz: f32,
}

impl ModeIncrements {
    /// Those of modes at `b_hz` and `c_hz`.
    ///
    /// # Errors
    /// When the sample rate is not a number, or not 4 to 1000 times either frequency with any offset.
    pub fn try_new(b_hz: f64, c_hz: f64, sample_rate_hz: f64) -> Result<Self, OutOfBounds> {
        let offset_hz = f64::from(DriveCommand::FREQUENCY_OFFSET_MAX_HZ);
        let (highest_hz, lowest_hz) = (b_hz.max(c_hz) + offset_hz, b_hz.min(c_hz) - offset_hz);
        let bounds = (4.0 * highest_hz, 1000.0 * lowest_hz);
        OutOfBounds::check("waveform.sample_rate_hz", sample_rate_hz, bounds.0, bounds.1, "Hz")?;
        #[expect(clippy::cast_possible_truncation, reason = "rounded to f32")]
        let units_per_hz = (UNITS_PER_TURN / sample_rate_hz) as f32;
        let [b, c] = [b_hz, c_hz].map(|hz| increment(hz, sample_rate_hz));
        Ok(Self { b, c, units_per_hz })
    }
}

// Never inlined: a microcontroller has room for one copy.
#[inline(never)]
fn increment(hz: f64, sample_rate_hz: f64) -> Phase {
    Phase::from_turns(hz / sample_rate_hz)
}

/// The drive as a sequence of samples.
#[derive(Clone, Debug)]
pub struct Waveform {
    phase: Phase,
    modes: ModeIncrements,
    command: DriveCommand,
    increment: Phase,
}

impl Waveform {
    /// A waveform of these modes, switched off.
    pub fn new(modes: ModeIncrements) -> Self {
        Self { phase: Phase::ZERO, modes, command: DriveCommand::OFF, increment: Phase::ZERO }
    }

    /// Sets the modes from the next command on.
    pub fn set_modes(&mut self, modes: ModeIncrements) {
        self.modes = modes;
    }

    /// Sets the drive from the next sample on.
    pub fn command(&mut self, command: DriveCommand) {
        self.command = command;
        let mode = match command.mode() {
            None => return,
            Some(DriveMode::B) => self.modes.b,
            Some(DriveMode::C) => self.modes.c,
        };
        #[expect(clippy::cast_possible_truncation, reason = "at most 2^30: a quarter of the sample rate")]
        let offset = (command.frequency_offset_hz() * self.modes.units_per_hz) as i32;
        let offset = Phase::from_units((i64::from(offset) << 32).cast_unsigned());
        self.increment = mode.advanced(offset);
    }

    /// The command in force.
    pub fn commanded(&self) -> DriveCommand {
        self.command
    }

    /// The next sample, -1 to 1; 0 when off.
    #[inline]
    pub fn sample(&mut self) -> f32 {
        if self.command.mode().is_none() {
            return 0.0;
        }
        self.phase = self.phase.advanced(self.increment);
        let (sin, _) = self.phase.sin_cos::<f32>();
        (self.command.amplitude() * sin).clamp(-1.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE_HZ: f64 = 100_000.0;

    fn waveform() -> Waveform {
        Waveform::new(ModeIncrements::try_new(6300.0, 7460.0, RATE_HZ).unwrap())
    }

    fn drive(mode: DriveMode, amplitude: f32, offset_hz: f32) -> DriveCommand {
        DriveCommand::try_new(mode, amplitude).unwrap().with_frequency_offset(offset_hz).unwrap()
    }

    /// Mode, offset and amplitude change, and the drive stops and restarts. Each sample is the sine of the sum of all
    /// increments so far.
    #[test]
    fn exact_samples_are_the_sine_of_one_phase_throughout() {
        let mut waveform = waveform();
        let mut turns = 0.0_f64;
        for (command, hz) in [
            (drive(DriveMode::B, 1.0, 0.0), 6300.0),
            (drive(DriveMode::C, 0.5, 0.0), 7460.0),
            (drive(DriveMode::C, 0.9, -250.0), 7210.0),
            (DriveCommand::OFF, 0.0),
            (drive(DriveMode::B, 0.25, 2000.0), 8300.0),
        ] {
            waveform.command(command);
            for n in 0..1000 {
                turns = (turns + hz / RATE_HZ).fract();
                let sine = libm::sin(core::f64::consts::TAU * turns);
                let expected = f64::from(command.amplitude()) * sine;
                let sample = f64::from(waveform.sample());
                assert!((sample - expected).abs() < 1e-6, "{command:?} {n}: {sample} {expected}");
            }
        }
    }

    /// 6300 Hz at 100 kHz is 63 turns in 1000 samples, to 2^-64 turn each, so the phase does not drift in an hour.
    #[test]
    fn exact_no_phase_is_lost_in_an_hour() {
        let mut waveform = waveform();
        waveform.command(drive(DriveMode::B, 1.0, 0.0));
        waveform.sample();
        let increment = u128::from(waveform.phase.units());
        let hour = 360_000_000_u128;
        #[expect(clippy::cast_precision_loss, reason = "a small part of a turn")]
        let off = (increment * hour).wrapping_sub((22_680_000_u128) << 64).cast_signed() as f64;
        assert!(off.abs() / 18_446_744_073_709_551_616.0 < 1e-9, "{off}");
    }

    #[test]
    fn exact_sample_rates_that_cannot_show_the_drive_are_refused() {
        for rate_hz in [30_000.0, 1e8, f64::NAN] {
            let refused = ModeIncrements::try_new(6300.0, 7460.0, rate_hz).unwrap_err();
            assert_eq!(refused.key, "waveform.sample_rate_hz");
        }
    }
}

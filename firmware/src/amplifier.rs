//! The amplifier of the coil: a bridge with a pulse width, and a pin that enables it.
//!
//! At half the pulse width the coil has no current. While the drive is off the pin is low and the width is half. After
//! an error of the pin or of the pulse width the drive stays off until a restart.

use embedded_hal::digital::OutputPin;
use embedded_hal::pwm::SetDutyCycle;
use motor_model::DriveCommand;

use crate::waveform::{ModeIncrements, Waveform};

/// An amplifier on pins of any board.
#[derive(Debug)]
pub struct Amplifier<P, E> {
    waveform: Waveform,
    width: P,
    enable: E,
    enabled: bool,
    failed: bool,
}

impl<P: SetDutyCycle, E: OutputPin> Amplifier<P, E> {
    /// An amplifier that is switched off.
    pub fn new(waveform: Waveform, width: P, enable: E) -> Self {
        let mut amplifier = Self { waveform, width, enable, enabled: true, failed: false };
        amplifier.off();
        amplifier
    }

    /// Sets the drive from the next sample on.
    pub fn command(&mut self, command: DriveCommand) {
        self.waveform.command(if self.failed { DriveCommand::OFF } else { command });
        if self.waveform.commanded().mode().is_none() && self.enabled {
            self.off();
        }
    }

    /// Sets the modes from the next command on.
    pub fn set_modes(&mut self, modes: ModeIncrements) {
        self.waveform.set_modes(modes);
    }

    /// Outputs the next sample, to be called at the waveform's sample rate; the drive that is really applied.
    #[inline]
    pub fn sample(&mut self) -> DriveCommand {
        if self.waveform.commanded().mode().is_none() {
            return DriveCommand::OFF;
        }
        let level = self.waveform.sample();
        let put = self.width.set_duty_cycle(duty(level, self.width.max_duty_cycle())).is_ok();
        let enabled = put && (self.enabled || self.enable.set_high().is_ok());
        if enabled {
            self.enabled = true;
        } else {
            self.failed = true;
            self.waveform.command(DriveCommand::OFF);
            self.off();
        }
        self.waveform.commanded()
    }

    /// Whether no error has occurred.
    pub fn works(&self) -> bool {
        !self.failed
    }

    fn off(&mut self) {
        // The pin first: it alone switches the current off.
        let disabled = self.enable.set_low().is_ok();
        let centred = self.width.set_duty_cycle(self.width.max_duty_cycle() / 2).is_ok();
        self.enabled = false;
        self.failed |= !(disabled && centred);
    }
}

/// The pulse width of a level from -1 to 1.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "within 0 to max; casts saturate"
)]
fn duty(level: f32, max: u16) -> u16 {
    (0.5 * f32::from(max) * (1.0 + level) + 0.5) as u16
}

#[cfg(test)]
mod tests {
    use motor_model::DriveMode;

    use super::*;
    use crate::test_support::{Pin, Pins};

    fn amplifier(pins: &Pins) -> Amplifier<Pin<'_>, Pin<'_>> {
        pins.enabled.set(true);
        let waveform = Waveform::new(ModeIncrements::try_new(6300.0, 7460.0, 100_000.0).unwrap());
        Amplifier::new(waveform, Pin(pins), Pin(pins))
    }

    #[test]
    fn law_it_is_off_from_the_start_and_at_command() {
        let pins = Pins::default();
        let mut amplifier = amplifier(&pins);
        assert!(!pins.enabled.get());
        assert_eq!(amplifier.sample(), DriveCommand::OFF);
        amplifier.command(DriveCommand::full(DriveMode::B));
        assert_eq!(amplifier.sample(), DriveCommand::full(DriveMode::B));
        assert!(pins.enabled.get());
        amplifier.command(DriveCommand::OFF);
        assert!(!pins.enabled.get(), "at once, not at the next sample");
        assert_eq!(pins.widths.borrow().last(), Some(&500));
    }

    /// The width follows the sine: over the whole range at full drive, over a tenth of it at a tenth.
    #[test]
    fn exact_widths() {
        for (amplitude, lowest, highest) in [(1.0, 0, 1000), (0.1, 450, 550)] {
            let pins = Pins::default();
            let mut amplifier = amplifier(&pins);
            amplifier.command(DriveCommand::try_new(DriveMode::C, amplitude).unwrap());
            (0..10_000).for_each(|_| assert!(amplifier.sample().mode().is_some()));
            let widths = pins.widths.borrow();
            assert_eq!((widths.iter().min(), widths.iter().max()), (Some(&lowest), Some(&highest)));
            let mean = widths.iter().map(|&width| f64::from(width)).sum::<f64>() / 10_001.0;
            assert!((mean - 500.0).abs() < 0.2, "{mean}");
        }
    }

    #[test]
    fn law_after_an_error_the_drive_stays_off() {
        let pins = Pins::default();
        let mut amplifier = amplifier(&pins);
        amplifier.command(DriveCommand::full(DriveMode::B));
        amplifier.sample();
        pins.broken.set(true);
        assert_eq!(amplifier.sample(), DriveCommand::OFF);
        assert!(!pins.enabled.get() && !amplifier.works());
        pins.broken.set(false);
        amplifier.command(DriveCommand::full(DriveMode::B));
        assert_eq!(amplifier.sample(), DriveCommand::OFF);
        assert!(!pins.enabled.get());
    }
}

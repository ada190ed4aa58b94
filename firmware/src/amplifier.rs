//! The amplifier of the coil: a bridge with a pulse width, and a pin that enables it.
//!
//! At half the pulse width the coil has no current. While the drive is off the pin is low and the width is half.
//!
//! The bridge may cut itself off, by its over-current output at the board's break input ([`Cutoff`]): the hardware
//! does, and the program finds it at the next sample. After that, and after an error of the pin or of the pulse width,
//! the amplifier has failed. It stays off until the host arms anew.

use embedded_hal::digital::OutputPin;
use embedded_hal::pwm::SetDutyCycle;
use motor_model::DriveCommand;

use crate::waveform::{ModeIncrements, Waveform};

/// A bridge that can be cut off without the program. Then both its pins are low: no pulses, and not enabled.
pub trait Cutoff {
    /// Whether the bridge is cut off. Once it is, it stays so until [`Self::reconnect`].
    fn is_cut(&self) -> bool;

    /// Gives the pins back to the program, unless the reason for the cut goes on.
    fn reconnect(&mut self);
}

/// An amplifier on pins of any board.
#[derive(Debug)]
pub struct Amplifier<P, E> {
    waveform: Waveform,
    width: P,
    enable: E,
    enabled: bool,
    failed: bool,
}

impl<P: SetDutyCycle + Cutoff, E: OutputPin> Amplifier<P, E> {
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
        if self.width.is_cut() && !self.failed {
            self.fail();
        }
        if self.waveform.commanded().mode().is_none() {
            return DriveCommand::OFF;
        }
        let level = self.waveform.sample();
        let put = self.width.set_duty_cycle(duty(level, self.width.max_duty_cycle())).is_ok();
        let enabled = put && (self.enabled || self.enable.set_high().is_ok());
        if enabled {
            self.enabled = true;
        } else {
            self.fail();
        }
        self.waveform.commanded()
    }

    /// Whether it has not failed since the last [`Self::rearm`].
    pub fn works(&self) -> bool {
        !self.failed
    }

    /// Tries again after a failure, with the drive off. A failure that goes on is found at once, or at the next sample.
    pub fn rearm(&mut self) {
        if self.failed {
            self.failed = false;
            self.off();
            self.width.reconnect();
        }
    }

    fn fail(&mut self) {
        self.failed = true;
        self.waveform.command(DriveCommand::OFF);
        self.off();
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
    fn law_after_an_error_the_drive_stays_off_until_it_is_armed_anew() {
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
        amplifier.rearm();
        assert!(!pins.enabled.get() && amplifier.works(), "it works, and waits for a command");
        amplifier.command(DriveCommand::full(DriveMode::B));
        assert_eq!(amplifier.sample(), DriveCommand::full(DriveMode::B));
        assert!(pins.enabled.get());
    }

    /// A pulse of over-current is enough, whether the drive is on or off. While it lasts, arming anew changes nothing.
    #[test]
    fn law_a_bridge_that_is_cut_off_has_failed_until_it_is_armed_anew() {
        for command in [DriveCommand::full(DriveMode::C), DriveCommand::OFF] {
            let pins = Pins::default();
            let mut amplifier = amplifier(&pins);
            amplifier.command(command);
            assert_eq!(amplifier.sample(), command);
            pins.set_over_current(true);
            assert_eq!(amplifier.sample(), DriveCommand::OFF);
            assert!(!pins.enabled.get() && !amplifier.works());
            assert_eq!(pins.widths.borrow().last(), Some(&500));
            amplifier.rearm();
            assert_eq!(amplifier.sample(), DriveCommand::OFF);
            assert!(!amplifier.works(), "the reason goes on");
            pins.set_over_current(false);
            amplifier.command(command);
            assert_eq!(amplifier.sample(), DriveCommand::OFF);
            assert!(!pins.enabled.get() && !amplifier.works(), "latched");
            amplifier.rearm();
            amplifier.command(command);
            assert_eq!(amplifier.sample(), command);
            assert!(amplifier.works() && pins.enabled.get() == command.mode().is_some());
        }
    }
}

//! What the unit tests share: the pins of an amplifier, a move, frames of the host.

extern crate std;

use core::cell::{Cell, RefCell};
use std::vec::Vec;

use embedded_hal::digital::{self, OutputPin};
use embedded_hal::pwm::{self, SetDutyCycle};
use link::{Configuration, FRAME_BYTES_MAX, FilterKind, Header, HostMessage, encode};

/// The pins of an amplifier, as a test sees them.
#[derive(Default)]
pub struct Pins {
    /// Every width so far.
    pub widths: RefCell<Vec<u16>>,
    pub enabled: Cell<bool>,
    /// Whether every further width is refused.
    pub broken: Cell<bool>,
}

/// Either pin.
pub struct Pin<'a>(pub &'a Pins);

#[derive(Debug)]
pub struct Broken;

impl pwm::Error for Broken {
    fn kind(&self) -> pwm::ErrorKind {
        pwm::ErrorKind::Other
    }
}

impl digital::Error for Broken {
    fn kind(&self) -> digital::ErrorKind {
        digital::ErrorKind::Other
    }
}

impl pwm::ErrorType for Pin<'_> {
    type Error = Broken;
}

impl digital::ErrorType for Pin<'_> {
    type Error = Broken;
}

impl SetDutyCycle for Pin<'_> {
    fn max_duty_cycle(&self) -> u16 {
        1000
    }

    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Broken> {
        self.0.widths.borrow_mut().push(duty);
        if self.0.broken.get() { Err(Broken) } else { Ok(()) }
    }
}

impl OutputPin for Pin<'_> {
    fn set_low(&mut self) -> Result<(), Broken> {
        self.0.enabled.set(false);
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Broken> {
        self.0.enabled.set(true);
        Ok(())
    }
}

pub const MOVE: Configuration = Configuration {
    filter: FilterKind::ConstantRate,
    target_deg: 90.0,
    tolerance_deg: 0.02,
    deadline_nanos: 30_000_000_000,
};

pub fn framed(header: Header, message: &HostMessage) -> Vec<u8> {
    let mut frame = [0; FRAME_BYTES_MAX];
    let length = encode(header, message, &mut frame).unwrap();
    frame[..length].to_vec()
}

//! What the unit tests share: the pins of an amplifier, a move, frames of the host, maps and a design.

extern crate std;

use core::cell::{Cell, RefCell};
use std::vec::Vec;

use controller::ResponseMap;
use controller::response_map::{Burst, Cruise, Family, direction};
use embedded_hal::digital::{self, OutputPin};
use embedded_hal::pwm::{self, SetDutyCycle};
use link::{Configuration, FRAME_BYTES_MAX, FilterKind, Header, HostMessage, MoveLimitsRecord, encode};
use motor_model::{DriveMode, MotorParams, Parameter};

use crate::amplifier::Cutoff;

/// The pins of an amplifier, as a test sees them.
#[derive(Default)]
pub struct Pins {
    /// Every width so far.
    pub widths: RefCell<Vec<u16>>,
    pub enabled: Cell<bool>,
    /// Whether every further width is refused.
    pub broken: Cell<bool>,
    /// Whether the bridge asks to be cut off, and whether it is.
    over_current: Cell<bool>,
    cut: Cell<bool>,
}

impl Pins {
    /// Begins or ends an over-current of the bridge. The hardware cuts it off at once, and leaves it so.
    pub fn set_over_current(&self, is_over: bool) {
        self.over_current.set(is_over);
        if is_over {
            self.cut.set(true);
            self.enabled.set(false);
        }
    }

    /// Whether the hardware has cut the bridge off.
    pub fn is_cut(&self) -> bool {
        self.cut.get()
    }
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

impl Cutoff for Pin<'_> {
    fn is_cut(&self) -> bool {
        self.0.cut.get()
    }

    fn reconnect(&mut self) {
        self.0.cut.set(self.0.over_current.get());
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
    limits: MoveLimitsRecord { travel_deg: None, on_max_nanos: None, amplitude_max: None },
};

pub fn framed(header: Header, message: &HostMessage) -> Vec<u8> {
    let mut frame = [0; FRAME_BYTES_MAX];
    let length = encode(header, message, &mut frame).unwrap();
    frame[..length].to_vec()
}

/// A map of `design` with `rows` in each table, at most 16.
pub fn map_of(design: MotorParams, rows: u8) -> ResponseMap {
    let place = |row: u8| f32::from(row + 1);
    let cruises: Vec<Cruise> = (0..rows)
        .map(|row| {
            // The first half of them is of mode B.
            let mode = if row < rows.div_ceil(2) { DriveMode::B } else { DriveMode::C };
            Cruise {
                mode,
                amplitude: 0.05 * place(row),
                rate_rad_s: direction(mode) * place(row),
                rate_sd_rad_s: 0.1,
                coast_s: 0.01,
                coast_sd_rad: 0.001,
            }
        })
        .collect();
    let bursts: Vec<Burst> = (0..rows)
        .map(|row| Burst {
            amplitude: 1.0,
            // Three bytes of postcard's, the most that a map has.
            ticks: 999_900 + u32::from(row),
            turn_rad: 0.01 * place(row),
            motors_sd_rad: 0.001,
            repeat_sd_rad: 0.001,
        })
        .collect();
    ResponseMap::try_new(design, &cruises, [&bursts[..]; Family::ALL.len()], -0.25).unwrap()
}

/// A design no parameter of which is Table 1's.
pub fn other_design() -> MotorParams {
    Parameter::ALL.into_iter().fold(MotorParams::nominal(), |design, parameter| {
        let (value, spec) = (design.get(parameter), parameter.spec());
        // Within the bounds, whichever of the two is nearer.
        let least = spec.min.max(0.5 * value - 1.0);
        design.with(parameter, 0.99 * value + 0.01 * least).unwrap()
    })
}

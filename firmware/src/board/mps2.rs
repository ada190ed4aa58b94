//! Registers of the mps2 boards. The emulated board has no pulse-width timer and no bridge: a latch of ten bits stands
//! for the pulse width, and lamp 0 for the enabling pin. Nor has it a flash that a program can write: memory outside of
//! the program's variables stands for one. A reset of the board leaves that memory as it is; what was kept ends with
//! the emulator.
//!
//! With the feature `scripted` what the emulator has put into memory is host and vibrometer: module `script`.

#![expect(unsafe_code, reason = "registers lie at fixed addresses, in memory that nothing else uses")]

#[cfg(feature = "scripted")]
pub mod script;

use core::convert::Infallible;

use embedded_hal::digital::{self, OutputPin};
use embedded_hal::pwm::{self, SetDutyCycle};

use link::{LINE_BAUD, ResetCause};

use embedded_storage_async::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};

use super::Parts;
use crate::amplifier::Cutoff;
use crate::main_loop::SerialLine;
use crate::store::{SLOT_BYTES, check_range, store_bytes};

/// Lamp 0 stands for the bridge's enabling pin.
const LAMPS: *mut u32 = 0x4002_8000 as *mut u32;
/// Stands for the pulse width.
const LATCH: *mut u32 = 0x4002_804c as *mut u32;
/// Timers, which count down to 0.
const RECEIVING: usize = 0x4000_0000;
const SENDING: usize = 0x4000_1000;
const UART: usize = 0x4000_4000;
const WATCHDOG: usize = 0x4000_8000;

/// Frequency of the processor and of everything on its bus.
pub const CLOCK_HZ: u32 = 25_000_000;

/// Ticks of the loop in a second.
const TICKS_PER_S: u32 = 100_000;

/// Clocks of the timer in a tick of 10 us.
#[cfg(not(feature = "scripted"))]
pub const fn clocks_per_tick() -> u32 {
    CLOCK_HZ / TICKS_PER_S
}
#[cfg(feature = "scripted")]
pub use script::clocks_per_tick;

fn write(base: usize, offset: usize, value: u32) {
    let register = (base + offset) as *mut u32;
    // SAFETY: `base` is one of this board's devices and `offset` one of its registers, in CMSDK's manual.
    unsafe { register.write_volatile(value) }
}

fn read(base: usize, offset: usize) -> u32 {
    let register = (base + offset) as *const u32;
    // SAFETY: as above.
    unsafe { register.read_volatile() }
}

/// Switches the bridge off by one store, so that it is safe at any time.
#[inline]
pub fn drive_off() {
    // SAFETY: the address of a register.
    unsafe { LAMPS.write_volatile(0) }
}

/// Whether the bridge is on.
pub fn drive_is_on() -> bool {
    // SAFETY: the address of a register.
    unsafe { LAMPS.read_volatile() & 1 == 1 }
}

impl Parts {
    /// The parts of the board; never `None`. No register of it tells why it started.
    pub fn take() -> Option<Self> {
        let line = Line::start();
        Some(Self {
            width: Width,
            enable: Enable,
            pulses: Pulses,
            line,
            vibrometer: Vibrometer,
            #[cfg(feature = "keep")]
            flash: Flash,
            watchdog: Watchdog,
            reset_cause: ResetCause::Unknown,
        })
    }
}

/// The bridge's enabling pin.
#[derive(Debug)]
pub struct Enable;

impl digital::ErrorType for Enable {
    type Error = Infallible;
}

impl OutputPin for Enable {
    fn set_low(&mut self) -> Result<(), Infallible> {
        drive_off();
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        // SAFETY: the address of a register.
        unsafe { LAMPS.write_volatile(1) }
        Ok(())
    }
}

/// This board has neither pulses nor samples.
#[derive(Debug)]
pub struct Pulses;

impl Pulses {
    /// Nothing to do.
    #[inline]
    pub fn start(self) {}
}

/// The pulse width.
#[derive(Debug)]
pub struct Width;

impl pwm::ErrorType for Width {
    type Error = Infallible;
}

impl SetDutyCycle for Width {
    fn max_duty_cycle(&self) -> u16 {
        1000
    }

    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Infallible> {
        // SAFETY: the address of a register.
        unsafe { LATCH.write_volatile(duty.into()) }
        Ok(())
    }
}

impl Cutoff for Width {
    /// Never: nothing of this board can cut a bridge off.
    #[inline]
    fn is_cut(&self) -> bool {
        false
    }

    fn reconnect(&mut self) {}
}

/// The serial line to the host.
#[cfg(not(feature = "scripted"))]
pub use self::Uart as Line;
#[cfg(feature = "scripted")]
pub use script::Line;

/// The emulated serial line. The device carries a byte whenever it is asked to. Two timers hold it to the rate of a
/// real board's line, in the board's time.
///
/// | direction | its timer |
/// |---|---|
/// | to the board | counts down from [`u32::MAX`] since no byte was there; each byte gives back its clocks |
/// | from the board | counts down the clocks of the bytes that were taken, as a DMA sends them |
#[derive(Debug)]
pub struct Uart;

impl Uart {
    const DATA: usize = 0;
    const STATE: usize = 4;
    const CONTROL: usize = 8;
    const DIVIDER: usize = 16;
    const TIMER_CONTROL: usize = 0;
    const TIMER_COUNT: usize = 4;

    /// Bytes that are taken at once, as on the real boards.
    const SENT_BYTES: usize = 128;

    /// Bits of a byte on the line: start, eight of data, stop.
    const BITS_PER_BYTE: u32 = 10;

    /// Clocks that a byte takes on the line.
    fn clocks_per_byte() -> u32 {
        clocks_per_tick() / (LINE_BAUD / Self::BITS_PER_BYTE / TICKS_PER_S)
    }

    /// Both directions. The divider is the least that the device takes.
    fn start() -> Self {
        write(UART, Self::DIVIDER, 16);
        write(UART, Self::CONTROL, 0b11);
        for (timer, count) in [(RECEIVING, u32::MAX), (SENDING, 1)] {
            write(timer, Self::TIMER_COUNT, count);
            write(timer, Self::TIMER_CONTROL, 1);
        }
        Self
    }
}

impl SerialLine for Uart {
    fn read(&mut self) -> Option<u8> {
        if read(UART, Self::STATE) & 0b10 == 0 {
            write(RECEIVING, Self::TIMER_COUNT, u32::MAX);
            return None;
        }
        let count = read(RECEIVING, Self::TIMER_COUNT).checked_add(Self::clocks_per_byte())?;
        write(RECEIVING, Self::TIMER_COUNT, count);
        #[expect(clippy::cast_possible_truncation, reason = "the register has eight bits")]
        Some(read(UART, Self::DATA) as u8)
    }

    /// Takes nothing while it is busy.
    fn write(&mut self, bytes: &[u8]) -> usize {
        if read(SENDING, Self::TIMER_COUNT) > 0 {
            return 0;
        }
        let is_free = |_: &&u8| read(UART, Self::STATE) & 0b01 == 0;
        let bytes = bytes.iter().take(Self::SENT_BYTES).take_while(is_free);
        let taken = bytes.inspect(|byte| write(UART, Self::DATA, u32::from(**byte))).count();
        #[expect(clippy::cast_possible_truncation, reason = "128 at most")]
        write(SENDING, Self::TIMER_COUNT, taken as u32 * Self::clocks_per_byte());
        taken
    }
}

/// This board has no vibrometer: the samples come from the host.
#[cfg(not(feature = "scripted"))]
pub use crate::tasks::NoConverter as Vibrometer;
#[cfg(feature = "scripted")]
pub use script::Vibrometer;

/// Stands for a flash: writing clears bits, and erasing sets those of a page. It never fails.
#[derive(Debug)]
pub struct Flash;

impl Flash {
    /// In the middle of the 4 MiB that both boards have at the address of the program's variables, which take 128 KiB.
    const START: *mut u8 = 0x2020_0000 as *mut u8;

    /// The byte at `offset`, which is below [`store_bytes`]: the operations check it.
    fn at(offset: u32) -> *mut u8 {
        Self::START.wrapping_add(offset as usize)
    }
}

impl ErrorType for Flash {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        check_range::<Self>(offset, bytes.len(), Self::READ_SIZE)?;
        for (at, byte) in (offset..).zip(bytes) {
            // SAFETY: within memory that nothing else uses.
            *byte = unsafe { Self::at(at).read_volatile() };
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        store_bytes::<Self>() as usize
    }
}

impl NorFlash for Flash {
    /// As on an STM32G474.
    const WRITE_SIZE: usize = 8;
    const ERASE_SIZE: usize = SLOT_BYTES as usize;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        check_range::<Self>(from, to.saturating_sub(from) as usize, Self::ERASE_SIZE)?;
        for at in from..to {
            // SAFETY: as above.
            unsafe { Self::at(at).write_volatile(0xff) }
        }
        Ok(())
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        check_range::<Self>(offset, bytes.len(), Self::WRITE_SIZE)?;
        for (at, byte) in (offset..).zip(bytes) {
            let place = Self::at(at);
            // SAFETY: as above.
            unsafe { place.write_volatile(place.read_volatile() & byte) }
        }
        Ok(())
    }
}

/// Restarts the board when it is not fed in time. The drive is off after every start.
#[derive(Debug)]
pub struct Watchdog;

impl Watchdog {
    const LOAD: usize = 0;
    const CONTROL: usize = 8;
    const CLEAR: usize = 12;
    const LOCK: usize = 0xc00;
    const KEY: u32 = 0x1acc_e551;

    /// 5 ms. The watchdog restarts the board after twice this time. Construction of a filter, the longest time between
    /// two feeds, takes over 2 ms at 250 million instructions a second.
    const CLOCKS: u32 = CLOCK_HZ / 200;
    /// 250 ms.
    const STORING_CLOCKS: u32 = CLOCK_HZ / 4;

    /// Starts it. From now on it must be fed every 5 ms; after 10 ms without, it restarts the board.
    pub fn start(&mut self) {
        write(WATCHDOG, Self::LOCK, Self::KEY);
        write(WATCHDOG, Self::LOAD, Self::CLOCKS);
        write(WATCHDOG, Self::CONTROL, 0b11);
    }

    /// Restarts the count. To be called once a tick that the loop has run.
    #[inline]
    pub fn feed(&mut self) {
        Self::restart();
    }

    fn restart() {
        write(WATCHDOG, Self::CLEAR, 1);
        write(WATCHDOG, Self::LOAD, Self::CLOCKS);
    }

    /// Does `work` of the store, for which the watchdog waits half a second.
    pub fn while_storing<T>(&mut self, work: impl FnOnce() -> T) -> T {
        write(WATCHDOG, Self::LOAD, Self::STORING_CLOCKS);
        let done = work();
        Self::restart();
        done
    }
}

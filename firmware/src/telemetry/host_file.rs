//! The log of the emulated board goes into a file of the host.

use core::cell::RefCell;

use cortex_m::interrupt::{self, Mutex, free};
use cortex_m::register::primask;
use defmt::{Encoder, Logger};

use crate::semihosting::{HostFile, argument_writer};

/// More than the longest entry takes. A longer entry would be dropped.
const FRAME_BYTES_MAX: usize = 128;

struct Channel {
    file: Option<HostFile>,
    encoder: Encoder,
    frame: heapless::Vec<u8, FRAME_BYTES_MAX>,
    too_long: bool,
    /// Whether interrupts were enabled before the entry.
    interrupts_enabled: bool,
}

static CHANNEL: Mutex<RefCell<Channel>> = Mutex::new(RefCell::new(Channel {
    file: None,
    encoder: Encoder::new(),
    frame: heapless::Vec::new(),
    too_long: false,
    interrupts_enabled: false,
}));

/// Opens the file that the emulator's command line names (`telemetry=FILE`, as its last argument); whether there is
/// one. Without a file there is no log.
pub fn open() -> bool {
    let file = argument_writer(b"telemetry=");
    let opened = file.is_some();
    with_channel(|channel| channel.file = file);
    opened
}

/// Runs `action` on the channel. It is never borrowed here: each borrow ends with the call.
fn with_channel(action: impl FnOnce(&mut Channel)) {
    free(|token| {
        if let Ok(mut channel) = CHANNEL.borrow(token).try_borrow_mut() {
            action(&mut channel);
        }
    });
}

impl Channel {
    /// Appends what the encoder makes of a part of an entry.
    fn encode(&mut self, step: impl FnOnce(&mut Encoder, &mut dyn FnMut(&[u8]))) {
        let Self { encoder, frame, too_long, .. } = self;
        step(encoder, &mut |bytes| *too_long |= frame.extend_from_slice(bytes).is_err());
    }

    fn send(&mut self) {
        if let Some(file) = self.file.as_ref().filter(|_| !self.too_long) {
            // An entry that the host does not take is lost.
            let _ = file.write(&self.frame);
        }
        self.frame.clear();
        self.too_long = false;
    }
}

#[defmt::global_logger]
struct ToHost;

// SAFETY: interrupts are disabled between `acquire` and `release`, so no entry begins within another.
#[expect(unsafe_code, reason = "the line above states why")]
unsafe impl Logger for ToHost {
    fn acquire() {
        let interrupts_enabled = primask::read().is_active();
        interrupt::disable();
        with_channel(|channel| {
            channel.interrupts_enabled = interrupts_enabled;
            channel.encode(|encoder, write| encoder.start_frame(write));
        });
    }

    unsafe fn flush() {}

    unsafe fn release() {
        let mut interrupts_enabled = false;
        with_channel(|channel| {
            channel.encode(|encoder, write| encoder.end_frame(write));
            channel.send();
            interrupts_enabled = channel.interrupts_enabled;
        });
        if interrupts_enabled {
            // SAFETY: interrupts were enabled before `acquire`.
            unsafe { interrupt::enable() }
        }
    }

    unsafe fn write(bytes: &[u8]) {
        with_channel(|channel| channel.encode(|encoder, write| encoder.write(bytes, write)));
    }
}

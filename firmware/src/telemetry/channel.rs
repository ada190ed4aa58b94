//! Where the log goes from the emulator: into a file of the host.

use core::cell::RefCell;

use cortex_m::interrupt::{self, Mutex, free};
use cortex_m::register::primask;
use defmt::{Encoder, Logger};

use crate::semihosting::{HostFile, argument_writer};

/// More than the longest entry takes; a longer one would be lost whole.
const FRAME_BYTES_MAX: usize = 128;

struct Channel {
    file: Option<HostFile>,
    encoder: Encoder,
    frame: heapless::Vec<u8, FRAME_BYTES_MAX>,
    overlong: bool,
    /// Whether interrupts were on before the entry.
    interruptible: bool,
}

static CHANNEL: Mutex<RefCell<Channel>> = Mutex::new(RefCell::new(Channel {
    file: None,
    encoder: Encoder::new(),
    frame: heapless::Vec::new(),
    overlong: false,
    interruptible: false,
}));

/// Opens the file that the emulator's command line names (`telemetry=FILE`, last); whether there is one. Without, nothing is told.
pub fn open() -> bool {
    let file = argument_writer(b"telemetry=");
    let opened = file.is_some();
    with(|channel| channel.file = file);
    opened
}

/// Nobody holds it longer than a call: there is always one.
fn with(action: impl FnOnce(&mut Channel)) {
    free(|token| {
        if let Ok(mut channel) = CHANNEL.borrow(token).try_borrow_mut() {
            action(&mut channel);
        }
    });
}

impl Channel {
    /// What the encoder makes of an entry, or of a part of it.
    fn encode(&mut self, step: impl FnOnce(&mut Encoder, &mut dyn FnMut(&[u8]))) {
        let Self { encoder, frame, overlong, .. } = self;
        step(encoder, &mut |bytes| *overlong |= frame.extend_from_slice(bytes).is_err());
    }

    fn send(&mut self) {
        if let Some(file) = self.file.as_ref().filter(|_| !self.overlong) {
            // A host that does not take it any more loses it.
            let _ = file.write(&self.frame);
        }
        self.frame.clear();
        self.overlong = false;
    }
}

#[defmt::global_logger]
struct ToHost;

// SAFETY: no interrupt comes between `acquire` and `release`, and no entry begins within another.
#[expect(unsafe_code, reason = "what the logger promises is in the line above")]
unsafe impl Logger for ToHost {
    fn acquire() {
        let interruptible = primask::read().is_active();
        interrupt::disable();
        with(|channel| {
            channel.interruptible = interruptible;
            channel.encode(|encoder, write| encoder.start_frame(write));
        });
    }

    unsafe fn flush() {}

    unsafe fn release() {
        let mut interruptible = false;
        with(|channel| {
            channel.encode(|encoder, write| encoder.end_frame(write));
            channel.send();
            interruptible = channel.interruptible;
        });
        if interruptible {
            // SAFETY: they were on before `acquire`.
            unsafe { interrupt::enable() }
        }
    }

    unsafe fn write(bytes: &[u8]) {
        with(|channel| channel.encode(|encoder, write| encoder.write(bytes, write)));
    }
}

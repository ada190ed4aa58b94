//! Any messages and raw bytes to the program of the microcontroller, in any order: it answers with frames only, and
//! never drives unless it is armed or jogged.

#![no_main]

use std::cell::Cell;

use controller::{Drive, LoopTiming};
use firmware::application::{Application, MoveMemory};
use firmware::design::DesignedDrive;
use libfuzzer_sys::fuzz_target;
use link::{BoardMessage, FRAME_BYTES_MAX, Header, HostMessage, decode, encode};
use motor_model::{DriveCommand, MotorParams, OutOfBounds};

struct Watched<'a>(&'a Cell<DriveCommand>);

impl Drive for Watched<'_> {
    fn drive(&mut self, command: DriveCommand) -> DriveCommand {
        self.0.set(command);
        command
    }
}

impl DesignedDrive for Watched<'_> {
    type Design = ();

    fn design(_: &MotorParams) -> Result<(), OutOfBounds> {
        Ok(())
    }

    fn follow(&mut self, (): ()) {
        assert_eq!(self.0.get(), DriveCommand::OFF, "the modes change while the drive is on");
    }

    fn keep_time(&mut self, _: LoopTiming) {
        assert_eq!(self.0.get(), DriveCommand::OFF, "the timing changes while the drive is on");
    }
}

fuzz_target!(|bytes: &[u8]| {
    let driven = Cell::new(DriveCommand::OFF);
    let mut memory = MoveMemory::new();
    let mut board = Application::new(Watched(&driven), &mut memory);
    let mut rest = bytes;
    let mut header = Header { session: 1, sequence: 0, ticks: 0 };
    while let Some((&what, after)) = rest.split_first() {
        rest = after;
        let mut frame = [0; FRAME_BYTES_MAX];
        let mut send = |frame: &[u8]| {
            decode::<BoardMessage>(&mut frame.to_vec()).expect("the board sends frames");
        };
        match postcard::take_from_bytes::<HostMessage>(rest) {
            Ok((message, after)) if what < 200 => {
                rest = after;
                header.session = u32::from(what < 190);
                header.sequence = header.sequence.wrapping_add(u32::from(what % 16 != 0));
                let length = encode(header, &message, &mut frame).expect("a message fits a frame");
                board.receive(&frame[..length], &mut send);
            }
            _ if what < 220 => assert_eq!(board.tick().is_some(), board.is_armed()),
            _ if what < 230 => board.record_deadline(what % 2 == 0),
            _ => board.receive(&rest[..rest.len().min(usize::from(what))], &mut send),
        }
        assert!(board.is_driving() || driven.get() == DriveCommand::OFF);
    }
});

//! Any text as the frames of a camera program: each line is refused in one line, or has a time and an angle in bounds.

#![no_main]

use host_sim::board::serial::frame_text::FrameText;
use libfuzzer_sys::fuzz_target;

/// The latest time of a frame, 9e9 s.
const LATEST_NANOS: i64 = 9_000_000_000_000_000_000;

fuzz_target!(|bytes: &[u8]| {
    let mut reader = FrameText::new("frames");
    for line in String::from_utf8_lossy(bytes).lines() {
        match reader.read(line) {
            Ok(frame) => assert!(frame.is_none_or(|frame| (0..=LATEST_NANOS).contains(&frame.exposed_nanos))),
            Err(fault) => {
                let fault = fault.to_string();
                assert!(fault.starts_with("frames:") && fault.lines().count() == 1, "{fault}");
            }
        }
    }
});

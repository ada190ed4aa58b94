//! Any bytes on the link, in both directions: what is no frame is refused, what is one comes back as the same bytes.

#![no_main]

use libfuzzer_sys::fuzz_target;
use link::{BoardMessage, Deframer, FRAME_BYTES_MAX, HostMessage, decode, encode};
use serde::Serialize;
use serde::de::DeserializeOwned;

fn check<M: Serialize + DeserializeOwned>(frame: &[u8]) {
    if let Ok((header, message)) = decode::<M>(&mut frame.to_vec()) {
        let mut again = [0; FRAME_BYTES_MAX];
        let length = encode(header, &message, &mut again).expect("a message that came in a frame fits one");
        let (read, same) = decode::<M>(&mut again[..length].to_vec()).expect("what was encoded is a frame");
        let mut once_more = [0; FRAME_BYTES_MAX];
        let length_again = encode(read, &same, &mut once_more).expect("it fits");
        assert_eq!(again[..length], once_more[..length_again]);
    }
}

fuzz_target!(|bytes: &[u8]| {
    let mut deframer = Deframer::default();
    for &byte in bytes {
        if let Some(frame) = deframer.push(byte) {
            check::<HostMessage>(frame);
            check::<BoardMessage>(frame);
        }
    }
});

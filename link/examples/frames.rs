//! Sends three messages over a line that damages a byte of the second, and prints what the receiver makes of them.

use link::{CameraRecord, Deframer, FRAME_BYTES_MAX, FrameError, Header, HostMessage, decode, encode};

fn main() -> Result<(), FrameError> {
    let camera = CameraRecord { exposed_nanos: 100_000, angle_units: 350_546, marks_used: 0, residual: 0 };
    let messages = [HostMessage::Hello, HostMessage::Camera(camera), HostMessage::Stop];
    let mut line = Vec::new();
    for (sequence, message) in (0..).zip(&messages) {
        let mut frame = [0; FRAME_BYTES_MAX];
        let length = encode(Header { session: 7, sequence, ticks: 0 }, message, &mut frame)?;
        println!("sent      {message:?} in {length} bytes");
        line.extend_from_slice(&frame[..length]);
    }

    // One bit, in the middle of the second frame.
    let second = line.iter().position(|&byte| byte == 0).map_or(0, |end| end + 1);
    line[second + 12] ^= 0x10;

    let mut deframer = Deframer::default();
    for byte in line {
        if let Some(frame) = deframer.push(byte) {
            match decode::<HostMessage>(frame) {
                Ok((header, message)) => println!("received  number {}: {message:?}", header.sequence),
                Err(error) => println!("refused   {error}"),
            }
        }
    }
    Ok(())
}

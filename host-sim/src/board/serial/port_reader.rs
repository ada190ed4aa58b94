//! The thread that reads the port of a session.

use std::io::{ErrorKind, Read as _};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Sender;
use std::thread::{JoinHandle, spawn};

use link::{BoardMessage, Deframer, FrameError, decode};
use serialport::SerialPort;

use super::host_clock::host_nanos;
use super::session::Event;

/// A thread that reads a port until this is dropped. Then the port is closed, and may be opened anew.
pub(super) struct PortReader {
    is_over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl PortReader {
    /// Forwards the frames that `port` brings as events.
    pub(super) fn start(port: Box<dyn SerialPort>, events: Sender<Event>) -> Self {
        let is_over = Arc::new(AtomicBool::new(false));
        let seen = Arc::clone(&is_over);
        Self { is_over, thread: Some(spawn(move || forward(port, &events, &seen))) }
    }
}

impl Drop for PortReader {
    /// Waits until the port is closed: at most for the time that a read takes.
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // One that panicked has closed it too.
            let _ = thread.join();
        }
    }
}

/// Forwards what the port brings, until it is closed, nobody listens or the session is over.
fn forward(mut port: Box<dyn SerialPort>, events: &Sender<Event>, is_over: &AtomicBool) {
    let (mut deframer, mut block) = (Deframer::default(), [0; 4096]);
    let mut bytes = 0;
    while !is_over.load(Ordering::Relaxed) {
        let length = match port.read(&mut block) {
            Ok(0) => {
                let _ = events.send(Event::Closed("end of the line".to_owned()));
                return;
            }
            Ok(length) => length,
            Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted) => continue,
            Err(error) => {
                let _ = events.send(Event::Closed(error.to_string()));
                return;
            }
        };
        let at_nanos = host_nanos();
        for &byte in &block[..length] {
            bytes += 1;
            let Some(frame) = deframer.push(byte) else { continue };
            let event = match decode::<BoardMessage>(frame) {
                Ok((header, message)) => Event::Board { header, message, at_nanos, bytes },
                Err(FrameError::Version { theirs }) => Event::OtherVersion { theirs },
                // Noise, or a frame that a restart of the board has cut short.
                Err(_) => continue,
            };
            bytes = 0;
            if events.send(event).is_err() {
                return;
            }
        }
    }
}

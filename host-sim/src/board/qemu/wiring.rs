//! How host and emulated program are connected.

use std::ffi::OsString;
use std::path::Path;

use clap::ValueEnum;

/// What carries the frames between host and emulated program.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Transport {
    /// Calls to the host: fast
    #[default]
    Semihosting,
    /// The emulated serial line, byte by byte
    Uart,
}

/// The connections of an emulated program.
#[derive(Clone, Copy, Debug, Default)]
pub struct Wiring<'a> {
    /// What carries the frames.
    pub transport: Transport,
    /// The file that the program logs into; it has to exist.
    pub log: Option<&'a Path>,
}

impl Wiring<'_> {
    /// What the emulator connects the serial line to.
    pub(super) fn serial(&self) -> &'static str {
        match self.transport {
            Transport::Semihosting => "none",
            Transport::Uart => "stdio",
        }
    }

    /// What the program may ask of the host, and its command line. A comma in a name is written twice.
    pub(super) fn semihosting(&self) -> OsString {
        let mut text = OsString::from("enable=on,target=native,arg=firmware");
        if self.transport == Transport::Uart {
            text.push(",arg=link=uart");
        }
        if let Some(log) = self.log {
            text.push(",arg=telemetry=");
            text.push(log.to_string_lossy().replace(',', ",,"));
        }
        text
    }
}

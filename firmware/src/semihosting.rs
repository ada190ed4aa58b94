//! Semihosting: files of the machine that emulates or debugs the microcontroller, and the program's command line.
//!
//! `cortex-m-semihosting` has these calls, but no safe function to read a file; this module has.

use core::ffi::CStr;

use cortex_m_semihosting::{nr, syscall};

/// An open file, pipe or device of the host.
#[derive(Debug)]
pub struct HostFile {
    descriptor: usize,
}

impl HostFile {
    /// Opens a file for reading.
    pub fn reader(path: &CStr) -> Option<Self> {
        Self::open(path, nr::open::R_BINARY)
    }

    /// Opens a file for writing.
    pub fn writer(path: &CStr) -> Option<Self> {
        Self::open(path, nr::open::W_TRUNC_BINARY)
    }

    fn open(path: &CStr, mode: usize) -> Option<Self> {
        #[expect(unsafe_code, reason = "the host reads `path` up to its zero and nothing else")]
        let descriptor = unsafe { syscall!(OPEN, path.as_ptr(), mode, path.count_bytes()) };
        (descriptor != usize::MAX).then_some(Self { descriptor })
    }

    /// Waits for bytes and reads those available, up to the length of `buffer`; an empty slice at the end of the file.
    pub fn read<'a>(&self, buffer: &'a mut [u8]) -> &'a [u8] {
        let length = buffer.len();
        #[expect(
            unsafe_code,
            reason = "the host writes at most `length` bytes, into `buffer`, during the call"
        )]
        let unread = unsafe { syscall!(READ, self.descriptor, buffer.as_mut_ptr(), length) };
        // After an error the number of unread bytes is the length, or more.
        buffer.get(..length.saturating_sub(unread)).unwrap_or_default()
    }

    /// Writes all of `bytes`; whether the host took all.
    pub fn write(&self, mut bytes: &[u8]) -> bool {
        while !bytes.is_empty() {
            #[expect(unsafe_code, reason = "the host reads `bytes` during the call")]
            let unwritten = unsafe { syscall!(WRITE, self.descriptor, bytes.as_ptr(), bytes.len()) };
            let written = bytes.len().saturating_sub(unwritten);
            if written == 0 {
                return false;
            }
            bytes = bytes.get(written..).unwrap_or_default();
        }
        true
    }
}

/// Longest command line.
const LINE_BYTES: usize = 1024;

/// The command line with its terminating zero; empty when there is none.
fn command_line(buffer: &mut [u8; LINE_BYTES]) -> &[u8] {
    #[expect(unsafe_code, reason = "the host writes at most so many bytes, into `buffer`, during the call")]
    let failed = unsafe { syscall!(GET_CMDLINE, buffer.as_mut_ptr(), LINE_BYTES) };
    if failed == 0 { buffer } else { &[] }
}

/// The index in a command line at which `argument` ends.
fn end_of(line: &[u8], argument: &[u8]) -> Option<usize> {
    line.windows(argument.len()).position(|window| window == argument).map(|place| place + argument.len())
}

/// Whether the command line contains `argument`.
pub fn has_argument(argument: &[u8]) -> bool {
    end_of(command_line(&mut [0; LINE_BYTES]), argument).is_some()
}

/// Opens for writing the file whose name follows `argument`, up to the end of the command line.
pub fn argument_writer(argument: &[u8]) -> Option<HostFile> {
    let mut line = [0; LINE_BYTES];
    let line = command_line(&mut line);
    let path = line.get(end_of(line, argument)?..)?;
    HostFile::writer(CStr::from_bytes_until_nul(path).ok()?)
}

//! Files of the machine that emulates or debugs the microcontroller: bytes in and out, in blocks.
//!
//! `cortex-m-semihosting` has these calls without a safe reading side; here they have both.

use cortex_m_semihosting::{nr, syscall};

/// An open file, pipe or device of the host.
#[derive(Debug)]
pub struct HostFile {
    descriptor: usize,
}

impl HostFile {
    /// Opens a file for reading. `path` ends with a zero.
    pub fn reader(path: &'static core::ffi::CStr) -> Option<Self> {
        Self::open(path, nr::open::R_BINARY)
    }

    /// Opens a file for writing. `path` ends with a zero.
    pub fn writer(path: &'static core::ffi::CStr) -> Option<Self> {
        Self::open(path, nr::open::W_TRUNC_BINARY)
    }

    fn open(path: &'static core::ffi::CStr, mode: usize) -> Option<Self> {
        #[expect(unsafe_code, reason = "the host reads `path` up to its zero and nothing else")]
        let descriptor = unsafe { syscall!(OPEN, path.as_ptr(), mode, path.count_bytes()) };
        (descriptor != usize::MAX).then_some(Self { descriptor })
    }

    /// Waits for bytes and reads what is there, up to the length of `buffer`; an empty slice at the end of the file.
    pub fn read<'a>(&self, buffer: &'a mut [u8]) -> &'a [u8] {
        let length = buffer.len();
        #[expect(
            unsafe_code,
            reason = "the host writes at most `length` bytes, into `buffer`, during the call"
        )]
        let unread = unsafe { syscall!(READ, self.descriptor, buffer.as_mut_ptr(), length) };
        // At an error as many bytes are unread as were asked for, or more.
        buffer.get(..length.saturating_sub(unread)).unwrap_or_default()
    }

    /// Writes all of `bytes`; whether the host took them.
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

//! Records of an MCAP file: a code, the length of the content, the content.

use std::io::{self, Cursor};

use binrw::{BinWrite, BinWriterExt as _};

/// Appends a record whose content `write` appends.
pub(super) fn append(
    into: &mut Vec<u8>,
    code: u8,
    write: impl FnOnce(&mut Vec<u8>) -> io::Result<()>,
) -> io::Result<()> {
    into.push(code);
    let length_at = into.len();
    into.extend([0; 8]);
    let start = into.len();
    write(into)?;
    let length = (into.len() - start) as u64;
    into[length_at..start].copy_from_slice(&length.to_le_bytes());
    Ok(())
}

/// Appends the fields of a record.
pub(super) fn fields<R: for<'a> BinWrite<Args<'a> = ()>>(into: &mut Vec<u8>, record: &R) -> io::Result<()> {
    let mut end = Cursor::new(&mut *into);
    end.set_position(end.get_ref().len() as u64);
    end.write_le(record).map_err(io::Error::other)
}

/// Appends a record that has fields alone.
pub(super) fn record<R: for<'a> BinWrite<Args<'a> = ()>>(
    into: &mut Vec<u8>,
    code: u8,
    of: &R,
) -> io::Result<()> {
    append(into, code, |into| fields(into, of))
}

//! Received bytes, cut into frames.

use crate::frame::FRAME_BYTES_MAX;

/// Collects the bytes of a frame up to the zero that ends it. Bytes beyond the longest frame are dropped up to the
/// next zero, so that the memory is bounded.
#[derive(Clone, Debug)]
pub struct Deframer {
    bytes: [u8; FRAME_BYTES_MAX],
    length: usize,
    too_long: bool,
    /// Frames dropped because they were too long.
    pub oversize: u32,
}

impl Default for Deframer {
    fn default() -> Self {
        Self { bytes: [0; FRAME_BYTES_MAX], length: 0, too_long: false, oversize: 0 }
    }
}

impl Deframer {
    /// Adds a byte. Returns the frame that it ends, without the zero. An empty frame, by which a sender flushes a line,
    /// is skipped.
    #[inline]
    pub fn push(&mut self, byte: u8) -> Option<&mut [u8]> {
        if byte != 0 {
            match self.bytes.get_mut(self.length) {
                Some(place) => {
                    *place = byte;
                    self.length += 1;
                }
                None => self.too_long = true,
            }
            return None;
        }
        let length = core::mem::take(&mut self.length);
        if core::mem::take(&mut self.too_long) {
            self.oversize = self.oversize.saturating_add(1);
            return None;
        }
        self.bytes.get_mut(..length).filter(|frame| !frame.is_empty())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lengths(deframer: &mut Deframer, bytes: impl IntoIterator<Item = u8>) -> heapless::Vec<usize, 8> {
        bytes.into_iter().filter_map(|byte| deframer.push(byte).map(|frame| frame.len())).collect()
    }

    #[test]
    fn exact_frames_end_at_zeros_and_empty_ones_are_none() {
        let mut deframer = Deframer::default();
        assert_eq!(lengths(&mut deframer, [0, 0, 1, 2, 0, 0, 3]), [2]);
        assert_eq!(lengths(&mut deframer, [4, 5, 0]), [3]);
        assert_eq!(deframer.push(7), None);
        assert_eq!(deframer.push(0), Some(&mut [7][..]));
    }

    /// A frame of the greatest length passes, one byte more does not, and neither spoils the next.
    #[test]
    fn law_oversize_frames_are_dropped_and_counted() {
        let mut deframer = Deframer::default();
        let frame = |length| core::iter::repeat_n(9, length).chain([0]);
        assert_eq!(lengths(&mut deframer, frame(FRAME_BYTES_MAX)), [FRAME_BYTES_MAX]);
        assert_eq!(lengths(&mut deframer, frame(FRAME_BYTES_MAX + 1).chain(frame(3))), [3]);
        assert_eq!(lengths(&mut deframer, frame(1_000_000).chain(frame(2))), [2]);
        assert_eq!(deframer.oversize, 2);
    }
}

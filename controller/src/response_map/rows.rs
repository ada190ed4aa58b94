//! Rows of a table with a fixed capacity.

use core::fmt;

/// Up to `N` rows.
#[derive(Clone, Copy)]
pub(super) struct Rows<T, const N: usize> {
    rows: [T; N],
    count: usize,
}

impl<T: Copy, const N: usize> Rows<T, N> {
    /// The first `N` of `rows`; the room left holds `fill`.
    pub(super) const fn of(rows: &[T], fill: T) -> Self {
        let mut kept = [fill; N];
        let mut count = 0;
        while count < N && count < rows.len() {
            #[expect(clippy::indexing_slicing, reason = "below both lengths")]
            {
                kept[count] = rows[count];
            }
            count += 1;
        }
        Self { rows: kept, count }
    }

    /// Appends `rows`; whether there is room for them. Without room nothing is appended.
    pub(super) fn append(&mut self, rows: &[T]) -> bool {
        let room = self.rows.get_mut(self.count..).and_then(|rest| rest.get_mut(..rows.len()));
        let Some(room) = room else { return false };
        for (place, row) in room.iter_mut().zip(rows) {
            *place = *row;
        }
        self.count += rows.len();
        true
    }

    /// Keeps the first `count` rows.
    pub(super) fn truncate(&mut self, count: usize) {
        self.count = self.count.min(count);
    }

    /// The rows.
    pub(super) fn as_slice(&self) -> &[T] {
        self.rows.get(..self.count).unwrap_or(&self.rows)
    }
}

/// The same rows; what fills the room left does not count.
impl<T: Copy + PartialEq, const N: usize> PartialEq for Rows<T, N> {
    fn eq(&self, other: &Self) -> bool {
        self.as_slice() == other.as_slice()
    }
}

impl<T: Copy + fmt::Debug, const N: usize> fmt::Debug for Rows<T, N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.as_slice()).finish()
    }
}

//! A study whose runs are numbered, in parts: each process makes some of the runs, and their rows are put together.

use std::any::Any;
use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::Path;

use rayon::prelude::*;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::report::OutputError;
use simulation::scene::SceneError;

/// A part of the runs: those whose number leaves `index` when divided by `count`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// Which part, from 0.
    pub index: u64,
    /// Of how many.
    pub count: u64,
}

impl Shard {
    /// All runs.
    pub const ALL: Self = Self { index: 0, count: 1 };

    /// The rows of this part, of `all` rows that lie side by side: parts in their order are the whole.
    pub fn range(self, all: u64) -> Range<u64> {
        let begin = |part: u64| {
            let product = u128::from(all) * u128::from(part) / u128::from(self.count);
            u64::try_from(product).unwrap_or(all)
        };
        begin(self.index)..begin(self.index + 1)
    }

    /// The numbers of this part, of `all` runs.
    pub fn numbers(self, all: u64) -> Vec<u64> {
        (0..all).filter(|number| number % self.count == self.index).collect()
    }
}

impl Shard {
    /// The numbers of this part, of `all` things called `what`.
    ///
    /// # Errors
    /// When it has none.
    pub fn numbers_of_some(self, all: u64, what: &str) -> Result<Vec<u64>, SceneError> {
        let numbers = self.numbers(all);
        if !numbers.is_empty() {
            return Ok(numbers);
        }
        let Self { index, count } = self;
        Err(SceneError::Conflict {
            conflict: format!("part {}/{count} of {all} {what} has none", index + 1),
            hint: format!("as many parts as {what} at most"),
        })
    }
}

/// Why no more runs are made.
enum Ended<E> {
    /// A run failed.
    Failed(E),
    /// The progress unwound.
    Unwound(Box<dyn Any + Send>),
}

/// Makes each of the runs `numbers`, and calls `progress` after each. The rows come in the order of the numbers,
/// whatever the number of threads. A progress that unwinds ends the study: the runs under way are made, and no others.
///
/// # Errors
/// That of the first run that fails.
pub fn run_each<T: Send, E: Send>(
    numbers: Vec<u64>,
    one: impl Fn(u64) -> Result<T, E> + Sync,
    progress: &(impl Fn() + Sync),
) -> Result<Vec<T>, E> {
    let one = |number| {
        let row = one(number).map_err(Ended::Failed);
        catch_unwind(AssertUnwindSafe(progress)).map_err(Ended::Unwound)?;
        row
    };
    match numbers.into_par_iter().with_max_len(1).map(one).collect() {
        Ok(rows) => Ok(rows),
        Err(Ended::Failed(error)) => Err(error),
        Err(Ended::Unwound(payload)) => resume_unwind(payload),
    }
}

/// The rows of several parts in the order of their numbers; a row that came twice stands once.
///
/// # Errors
/// When a number is missing before the last one, or two rows have the same number and differ.
pub fn merged<T: PartialEq>(parts: Vec<Vec<T>>, number: impl Fn(&T) -> u64) -> Result<Vec<T>, OutputError> {
    let mut rows: Vec<T> = parts.into_iter().flatten().collect();
    rows.sort_by_key(&number);
    rows.dedup();
    for (expected, row) in (0..).zip(&rows) {
        let found = number(row);
        if found < expected {
            let why = format!("run {found} stands twice, with different results");
            return Err(OutputError::NotWhole(why));
        }
        if found > expected {
            return Err(OutputError::NotWhole(format!("run {expected} is missing")));
        }
    }
    Ok(rows)
}

/// Rows as CSV, which [`read`] reads again.
///
/// # Errors
/// When a row cannot be laid out: never.
pub fn csv<T: Serialize>(rows: &[T]) -> Result<String, OutputError> {
    crate::report::files::csv(None, rows.iter())
}

/// The rows of a file that [`csv()`] has made.
///
/// # Errors
/// When it cannot be read, or has other rows.
pub fn read<T: DeserializeOwned>(path: &Path) -> Result<Vec<T>, OutputError> {
    let refused = |error: csv::Error| OutputError::unexpected(path, error);
    let mut reader = csv::Reader::from_path(path).map_err(refused)?;
    reader.deserialize().map(|row| row.map_err(refused)).collect()
}

/// Rows that hold more than a table can, in bytes, which [`unpacked`] reads.
///
/// # Errors
/// When a row cannot be laid out: never.
pub fn packed<T: Serialize>(rows: &[T]) -> Result<Vec<u8>, OutputError> {
    postcard::to_stdvec(rows).map_err(|error| OutputError::Table(error.to_string()))
}

/// The rows of a file that [`packed`] has made.
///
/// # Errors
/// When it cannot be read, or has other rows.
pub fn unpacked<T: DeserializeOwned>(path: &Path) -> Result<Vec<T>, OutputError> {
    let bytes = crate::report::files::read(path)?;
    postcard::from_bytes(&bytes).map_err(|error| OutputError::unexpected(path, error))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};

    /// Of many runs few are made once the progress unwinds: at most one on each thread, and one that was begun.
    #[test]
    fn exact_a_progress_that_unwinds_ends_the_study() {
        let (made, threads) = (AtomicUsize::new(0), rayon::current_num_threads());
        let one = |number: u64| {
            made.fetch_add(1, Ordering::SeqCst);
            Ok::<_, ()>(number)
        };
        let study = || run_each((0..100_000).collect(), one, &|| resume_unwind(Box::new("enough")));
        let payload = catch_unwind(AssertUnwindSafe(study)).unwrap_err();
        assert_eq!(payload.downcast_ref(), Some(&"enough"));
        assert!(made.load(Ordering::SeqCst) <= 2 * threads, "{made:?} runs on {threads} threads");
    }
}

//! A study whose runs are numbered, in parts: each process makes some of the runs, and their rows are put together.

use std::any::Any;
use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

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

/// Column of a table of a part: the digest of the scene that its runs are of.
const DIGEST_COLUMN: &str = "scene_digest";

/// The digest of the scene, and of all else that is the same in every part of a study: runs of two scenes make no
/// whole.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SceneDigest(String);

impl SceneDigest {
    /// That of what is the same, line by line: CRC-32 in eight digits.
    pub fn of(lines: impl IntoIterator<Item = String>) -> Self {
        let mut hasher = crc32fast::Hasher::new();
        for line in lines {
            hasher.update(line.as_bytes());
            hasher.update(b"\n");
        }
        Self(format!("{:08x}", hasher.finalize()))
    }

    /// `table`, a CSV, with the digest in a column behind the others.
    ///
    /// # Errors
    /// When a row cannot be laid out: never.
    pub fn marked(&self, table: &str) -> Result<String, OutputError> {
        let refused = |error: csv::Error| OutputError::Table(error.to_string());
        let mut reader = csv::ReaderBuilder::new().has_headers(false).from_reader(table.as_bytes());
        let mut writer = csv::Writer::from_writer(Vec::new());
        let mut cell = DIGEST_COLUMN;
        for record in reader.records() {
            let mut record = record.map_err(refused)?;
            record.push_field(cell);
            writer.write_record(&record).map_err(refused)?;
            cell = &self.0;
        }
        let bytes = writer.into_inner().map_err(|error| OutputError::Table(error.to_string()))?;
        Ok(String::from_utf8_lossy(&bytes).into_owned())
    }

    /// Refuses a part of another scene than `other` has, which has this one.
    fn admit<T>(&self, part: &Part<T>, other: &str) -> Result<(), OutputError> {
        if part.digest.as_ref() == Some(self) {
            return Ok(());
        }
        Err(OutputError::OtherScene {
            path: part.path.clone(),
            found: part.digest.as_ref().map_or_else(|| "none".to_owned(), |found| found.0.clone()),
            other: other.to_owned(),
            expected: self.0.clone(),
        })
    }
}

/// A file with the rows of a part.
#[derive(Clone, Debug)]
pub struct Part<T> {
    /// The file.
    pub path: PathBuf,
    /// The digest of its scene; `None` of a table that has none.
    pub digest: Option<SceneDigest>,
    /// Its rows.
    pub rows: Vec<T>,
}

/// Refuses parts of another scene than that with the digest `wanted`.
///
/// # Errors
/// When two parts differ, or all are of another scene.
pub fn refuse_other_scenes<T>(parts: &[Part<T>], wanted: &SceneDigest) -> Result<(), OutputError> {
    let Some(first) = parts.first() else { return Ok(()) };
    if let Some(digest) = &first.digest {
        let name = first.path.display().to_string();
        parts.iter().try_for_each(|part| digest.admit(part, &name))?;
    }
    parts.iter().try_for_each(|part| wanted.admit(part, "this command"))
}

/// The rows of several parts in the order of their numbers; a row that came twice stands once.
///
/// # Errors
/// When a number is missing before the last one, or two rows have the same number and differ.
pub fn merged<T: PartialEq>(parts: Vec<Part<T>>, number: impl Fn(&T) -> u64) -> Result<Vec<T>, OutputError> {
    let mut rows: Vec<T> = parts.into_iter().flat_map(|part| part.rows).collect();
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

/// The part in a file that [`csv()`] has made, with a digest if it is [marked](SceneDigest::marked).
///
/// # Errors
/// When it cannot be read, has other rows, or rows of two scenes.
pub fn read<T: DeserializeOwned>(path: &Path) -> Result<Part<T>, OutputError> {
    let refused = |error: csv::Error| OutputError::unexpected(path, error);
    let mut reader = csv::Reader::from_path(path).map_err(refused)?;
    let columns = reader.headers().map_err(refused)?.clone();
    let place = columns.iter().position(|name| name == DIGEST_COLUMN);
    let mut part = Part { path: path.to_owned(), digest: None, rows: Vec::new() };
    for record in reader.records() {
        let record = record.map_err(refused)?;
        let digest = place.and_then(|place| record.get(place)).map(|text| SceneDigest(text.to_owned()));
        if part.rows.is_empty() {
            part.digest = digest;
        } else if part.digest != digest {
            return Err(OutputError::unexpected(path, "its rows are of two scenes"));
        }
        part.rows.push(record.deserialize(Some(&columns)).map_err(refused)?);
    }
    Ok(part)
}

/// Rows that hold more than a table can, with the digest of their scene, in bytes, which [`unpacked`] reads.
///
/// # Errors
/// When a row cannot be laid out: never.
pub fn packed<T: Serialize>(digest: &SceneDigest, rows: &[T]) -> Result<Vec<u8>, OutputError> {
    postcard::to_stdvec(&(digest, rows)).map_err(|error| OutputError::Table(error.to_string()))
}

/// The part in a file that [`packed`] has made.
///
/// # Errors
/// When it cannot be read, or has other rows.
pub fn unpacked<T: DeserializeOwned>(path: &Path) -> Result<Part<T>, OutputError> {
    let bytes = crate::report::files::read(path)?;
    let (digest, rows) =
        postcard::from_bytes(&bytes).map_err(|error| OutputError::unexpected(path, error))?;
    Ok(Part { path: path.to_owned(), digest: Some(digest), rows })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};

    /// A row of a table.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    struct Row {
        number: u64,
        words: String,
        value: Option<f64>,
    }

    fn rows(numbers: [u64; 2]) -> [Row; 2] {
        numbers.map(|number| Row { number, words: "a, \"b\"\nc".to_owned(), value: None })
    }

    fn digest(line: &str) -> SceneDigest {
        SceneDigest::of([line.to_owned()])
    }

    /// Tables and packed rows come back with their digest, and a table without one has none.
    #[test]
    fn exact_a_part_is_read_with_the_digest_of_its_scene() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, bytes: &[u8]| {
            let path = folder.path().join(name);
            std::fs::write(&path, bytes).unwrap();
            path
        };
        let (rows, of) = (rows([0, 1]), digest("one"));
        let table = csv(&rows).unwrap();
        let marked = of.marked(&table).unwrap();
        let parts = [
            (read::<Row>(&write("marked.csv", marked.as_bytes())).unwrap(), Some(of.clone())),
            (read(&write("plain.csv", table.as_bytes())).unwrap(), None),
            (unpacked(&write("rows.postcard", &packed(&of, &rows).unwrap())).unwrap(), Some(of.clone())),
        ];
        for (part, digest) in parts {
            assert_eq!((&part.rows[..], part.digest), (&rows[..], digest), "{:?}", part.path);
        }
        let two = digest("two").marked(&table).unwrap();
        let both = format!("{marked}{}", two.split_once('\n').unwrap().1);
        let refused = read::<Row>(&write("both.csv", both.as_bytes())).unwrap_err();
        assert!(refused.to_string().ends_with("both.csv: its rows are of two scenes"), "{refused}");
    }

    /// A row that comes twice stands once, unless it differs.
    #[test]
    fn exact_a_run_with_two_results_is_refused() {
        let part = |numbers, words: &str| Part {
            path: PathBuf::new(),
            digest: None,
            rows: rows(numbers).map(|row| Row { words: words.to_owned(), ..row }).to_vec(),
        };
        let whole = |second| merged(vec![part([0, 2], "a"), second], |row: &Row| row.number);
        assert_eq!(whole(part([1, 2], "a")).unwrap().len(), 3);
        let refused = whole(part([1, 2], "b")).unwrap_err();
        assert_eq!(
            refused.to_string(),
            "the parts are not one whole: run 2 stands twice, with different results"
        );
    }

    /// Parts of two scenes, and parts of another scene than that of the command, are refused with both named.
    #[test]
    fn exact_parts_of_another_scene_are_refused() {
        let part =
            |name: &str, digest, numbers| Part { path: name.into(), digest, rows: rows(numbers).to_vec() };
        let [one, two] = ["one", "two"].map(digest);
        let parts = |first: &Option<SceneDigest>, second: &Option<SceneDigest>| {
            [part("a.csv", first.clone(), [0, 1]), part("b.csv", second.clone(), [2, 3])]
        };
        let (of_one, of_two) = (Some(one.clone()), Some(two.clone()));
        assert!(refuse_other_scenes(&parts(&of_one, &of_one), &one).is_ok());
        for (parts, said) in [
            (
                parts(&of_one, &of_two),
                format!("b.csv is of another scene than a.csv: its digest is {}, not {}", two.0, one.0),
            ),
            (
                parts(&of_two, &of_two),
                format!(
                    "a.csv is of another scene than this command: its digest is {}, not {}",
                    two.0, one.0
                ),
            ),
            (
                parts(&None, &None),
                format!("a.csv is of another scene than this command: its digest is none, not {}", one.0),
            ),
        ] {
            assert_eq!(refuse_other_scenes(&parts, &one).unwrap_err().to_string(), said);
        }
    }

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

//! The folder of a sweep, or of a part of one.
//!
//! | file | content |
//! |---|---|
//! | `rows.parquet` | the rows: the same bytes for any number of threads, parts and interruptions |
//! | `times.parquet` | the time of each row on its machine |
//! | `manifest.json` | version, command, seed, plan and effective scene; which part; whether it is done, what failed |
//! | `rows.partial.csv` | the rows that are done, while some are not ([`super::journal`]) |
//! | `.lock` | held by the process that writes here |

use std::fs::{File, TryLockError};
use std::io::Write as _;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::journal::Journal;
use super::summary::SummarySums;
use super::tables::{Column, ROWS_FILE, TIMES_FILE, TableReader, TablesWriter, unwritable};
use super::{FailureCounts, Row, SweepError, SweepPlan, SweepSummary};
use crate::report::OutputError;
use crate::report::files::{self, Output};
use crate::studies::shard::Shard;

/// File of the manifest.
const MANIFEST_FILE: &str = "manifest.json";
/// File of the rows that are done.
const JOURNAL_FILE: &str = "rows.partial.csv";
const LOCK_FILE: &str = ".lock";
/// What a sweep writes beside its lock.
const OWN_FILES: [&str; 4] = [MANIFEST_FILE, JOURNAL_FILE, ROWS_FILE, TIMES_FILE];

/// What becomes of a sweep that is in the folder already.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Existing {
    /// It is left, and the new one refused.
    Refuse,
    /// It goes on, if it is the same.
    Resume,
    /// It is replaced.
    Replace,
}

/// The folder of a sweep before its first row, which no other process writes to.
pub struct LockedFolder {
    path: PathBuf,
    lock: File,
    wanted: Manifest,
    /// The same sweep that is there already.
    found: Option<Manifest>,
}

/// The folder of a sweep that is being made, which no other process writes to.
pub struct SweepFolder {
    path: PathBuf,
    columns: Vec<Column>,
    manifest: Manifest,
    journal: Journal,
    /// Held until the folder is dropped.
    _lock: File,
}

/// What a folder has.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Manifest {
    /// What its parts have in common.
    pub(super) described: Value,
    /// The part.
    pub(super) part: Shard,
    /// How many of its rows have failed; `None` until all are done.
    pub(super) failures: Option<FailureCounts>,
}

impl Manifest {
    /// As JSON. The tables of all parts together are those of one process, and so is their manifest.
    fn text(&self) -> String {
        let mut object = self.described.clone();
        object["part"] = json!({"number": self.part.index + 1, "of": self.part.count});
        object["complete"] = json!(self.failures.is_some());
        object["failures"] = json!(self.failures);
        let mut text = serde_json::to_string_pretty(&object).unwrap_or_default();
        text.push('\n');
        text
    }

    /// The manifest in a folder, if there is one.
    pub(super) fn read(folder: &Path) -> Result<Option<Self>, SweepError> {
        let path = folder.join(MANIFEST_FILE);
        if !path.exists() {
            return Ok(None);
        }
        let refused = || OutputError::unexpected(&path, "it is no manifest of a sweep");
        let mut object: Value = serde_json::from_slice(&files::read(&path)?).map_err(|_| refused())?;
        let fields = object.as_object_mut().ok_or_else(refused)?;
        let part = fields.remove("part").ok_or_else(refused)?;
        let whole = |value: &Value| value.as_u64().filter(|number| *number > 0).ok_or_else(refused);
        let part = Shard { index: whole(&part["number"])? - 1, count: whole(&part["of"])? };
        fields.remove("complete");
        let failures = fields.remove("failures").filter(|failures| !failures.is_null());
        let count = |failures: &Value, name: &str| failures[name].as_u64().unwrap_or_default();
        let failures = failures.map(|failures| FailureCounts {
            refused: count(&failures, "refused"),
            diverged: count(&failures, "diverged"),
            panicked: count(&failures, "panicked"),
            no_figure: count(&failures, "no_figure"),
        });
        Ok(Some(Self { described: object, part, failures }))
    }

    fn write(&self, folder: &Path) -> Result<(), SweepError> {
        let mut file = Output::create(&folder.join(MANIFEST_FILE))?;
        file.write_all(self.text().as_bytes()).map_err(|source| file.unwritable(source))?;
        Ok(file.publish()?)
    }
}

/// Makes the folder if it does not exist, and locks it.
fn locked(path: &Path) -> Result<File, SweepError> {
    std::fs::create_dir_all(path).map_err(|source| unwritable(path, source))?;
    let lock_path = path.join(LOCK_FILE);
    let refused = |source| unwritable(&lock_path, source);
    let lock = File::options().write(true).create(true).truncate(false).open(&lock_path).map_err(refused)?;
    match lock.try_lock() {
        Ok(()) => Ok(lock),
        Err(TryLockError::WouldBlock) => Err(SweepError::Locked { folder: path.to_owned() }),
        Err(TryLockError::Error(source)) => Err(refused(source)),
    }
}

/// Deletes what a sweep has left.
fn cleared(path: &Path, names: &[&str]) -> Result<(), SweepError> {
    for name in names {
        match std::fs::remove_file(path.join(name)) {
            Err(source) if source.kind() != std::io::ErrorKind::NotFound => {
                return Err(unwritable(&path.join(name), source));
            }
            _ => {}
        }
    }
    Ok(())
}

/// Refuses a folder that has a sweep, unless that is to be replaced.
fn refuse_files(
    path: &Path,
    existing: Existing,
    refusal: impl Fn(PathBuf) -> SweepError,
) -> Result<(), SweepError> {
    let found = OWN_FILES.iter().map(|name| path.join(name)).find(|path| path.exists());
    match found {
        Some(path) if existing != Existing::Replace => Err(refusal(path)),
        _ => Ok(()),
    }
}

impl LockedFolder {
    /// The folder of `part` of the sweep of `plan`. Nothing in it is changed yet.
    ///
    /// # Errors
    /// When another process writes to it, or it has a sweep that is not to be gone on with or replaced.
    pub fn open(path: &Path, plan: &SweepPlan, part: Shard, existing: Existing) -> Result<Self, SweepError> {
        let lock = locked(path)?;
        let wanted = Manifest { described: plan.described(), part, failures: None };
        let found = match Manifest::read(path)? {
            Some(found) if existing == Existing::Resume => {
                same(path, &wanted, &found)?;
                Some(found)
            }
            _ => {
                refuse_files(path, existing, |path| SweepError::Begun { path })?;
                None
            }
        };
        Ok(Self { path: path.to_owned(), lock, wanted, found })
    }

    /// What is there already if all rows are done.
    ///
    /// # Errors
    /// When the rows cannot be read.
    pub fn finished(&self) -> Result<Option<SweepSummary>, SweepError> {
        match &self.found {
            Some(found) if found.failures.is_some() => {
                cleared(&self.path, &[JOURNAL_FILE])?;
                summary_of(&self.path, found).map(Some)
            }
            _ => Ok(None),
        }
    }

    /// Begins the sweep of `plan`, or goes on with it.
    ///
    /// # Errors
    /// When the folder cannot be written, or the rows in it are damaged.
    pub fn begin(self, plan: &SweepPlan) -> Result<SweepFolder, SweepError> {
        let Self { path, lock, wanted, found } = self;
        if found.is_none() {
            cleared(&path, &OWN_FILES)?;
            wanted.write(&path)?;
        }
        let columns = plan.columns();
        let rows = wanted.part.range(plan.rows());
        let journal = Journal::open(&path.join(JOURNAL_FILE), &columns, &rows)?;
        Ok(SweepFolder { path, columns, manifest: wanted, journal, _lock: lock })
    }
}

impl SweepFolder {
    /// Rows that are done.
    pub fn done(&self) -> u64 {
        self.journal.done
    }

    /// Adds a row, whose cells `plan` makes.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn append(&mut self, plan: &SweepPlan, row: &Row) -> Result<(), SweepError> {
        self.journal.append(&plan.cells(row), row.time_s)
    }

    /// Writes the tables and the manifest of a sweep whose rows are all done.
    ///
    /// # Errors
    /// When they cannot be written; the rows stay in the journal.
    pub fn finish(mut self) -> Result<SweepSummary, SweepError> {
        let mut tables = TablesWriter::create(&self.path, &self.columns, &self.manifest.described)?;
        self.journal.read(&self.columns, |cells, time| tables.push(cells, time))?;
        let summary = tables.publish()?;
        self.manifest.failures = Some(summary.failures);
        self.manifest.write(&self.path)?;
        cleared(&self.path, &[JOURNAL_FILE])?;
        Ok(summary)
    }
}

/// Writes the tables and the manifest of a whole sweep into a folder by `fill`.
pub(super) fn written_whole(
    path: &Path,
    described: &Value,
    columns: &[Column],
    existing: Existing,
    fill: impl FnOnce(&mut TablesWriter) -> Result<(), SweepError>,
) -> Result<SweepSummary, SweepError> {
    let _lock = locked(path)?;
    refuse_files(path, existing, |path| OutputError::Exists { path }.into())?;
    let mut manifest = Manifest { described: described.clone(), part: Shard::ALL, failures: None };
    let mut tables = TablesWriter::create(path, columns, described)?;
    fill(&mut tables)?;
    cleared(path, &[MANIFEST_FILE, JOURNAL_FILE])?;
    let summary = tables.publish()?;
    manifest.failures = Some(summary.failures);
    manifest.write(path)?;
    Ok(summary)
}

/// Refuses a folder of another sweep or another part.
fn same(path: &Path, wanted: &Manifest, found: &Manifest) -> Result<(), SweepError> {
    let difference = difference(&wanted.described, &found.described).or_else(|| {
        let text = |part: Shard| format!("{}/{}", part.index + 1, part.count);
        let differs = wanted.part != found.part;
        differs.then(|| format!("it is part {}, not {}", text(found.part), text(wanted.part)))
    });
    difference
        .map_or(Ok(()), |difference| Err(SweepError::OtherSweep { folder: path.to_owned(), difference }))
}

/// The first field in which two sweeps differ.
pub(super) fn difference(wanted: &Value, found: &Value) -> Option<String> {
    let (Value::Object(fields), Value::Object(others)) = (wanted, found) else {
        return (wanted != found).then(|| format!("{found}, not {wanted}"));
    };
    let mut names = fields.keys().chain(others.keys().filter(|name| !fields.contains_key(*name)));
    names.find_map(|name| {
        let [wanted, found] = [fields, others].map(|of| of.get(name).unwrap_or(&Value::Null));
        difference(wanted, found).map(|of_field| format!("{name} = {of_field}"))
    })
}

/// What is printed of a folder whose rows are all done.
fn summary_of(path: &Path, manifest: &Manifest) -> Result<SweepSummary, SweepError> {
    let table = TableReader::open(&path.join(ROWS_FILE))?;
    let mut sums = SummarySums::new(table.columns(), &manifest.described);
    for cells in table.rows()? {
        sums.add(&cells?);
    }
    Ok(sums.summary(path.to_owned()))
}

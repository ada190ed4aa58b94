//! The parts of a sweep put together: the same bytes as those of one process.

use std::path::{Path, PathBuf};

use super::folder::{Existing, Manifest, difference, written_whole};
use super::tables::{Cells, ROWS_FILE, TIMES_FILE, TableReader};
use super::{SweepError, SweepSummary};
use crate::report::files;
use crate::report::parquet_table::Cell;

/// A part that is done.
struct Part {
    folder: PathBuf,
    manifest: Manifest,
}

/// Puts together the parts in `folders`, in any order, into the folder `into`. A part that was made twice counts once.
///
/// # Errors
/// When a part is missing, not done, of another sweep, or was made twice with different results.
pub fn merge(folders: &[PathBuf], into: &Path, existing: Existing) -> Result<SweepSummary, SweepError> {
    let parts = parts(folders)?;
    let Some(first) = parts.first() else {
        return Err(SweepError::NotWhole { why: "there is none".to_owned() });
    };
    let described = &first.manifest.described;
    let columns = TableReader::open(&first.folder.join(ROWS_FILE))?.columns().to_vec();
    written_whole(into, described, &columns, existing, |tables| {
        let mut next = 0;
        for part in &parts {
            let rows = TableReader::open(&part.folder.join(ROWS_FILE))?;
            let times = TableReader::open(&part.folder.join(TIMES_FILE))?;
            let mut times = times.rows()?;
            for cells in rows.rows()? {
                let cells = cells?;
                if cells.first() != Some(&Some(Cell::Whole(next))) {
                    return Err(SweepError::Damaged { path: part.folder.join(ROWS_FILE), row: next });
                }
                let time: Option<Cells> = times.next().transpose()?;
                tables.push(&cells, time.and_then(|mut time| time.pop().flatten()))?;
                next += 1;
            }
        }
        let rows = described["rows"].as_u64().unwrap_or_default();
        let whole = next == rows;
        whole
            .then_some(())
            .ok_or_else(|| SweepError::NotWhole { why: format!("they have {next} rows of {rows}") })
    })
}

/// The parts in their order, each once.
fn parts(folders: &[PathBuf]) -> Result<Vec<Part>, SweepError> {
    let mut parts: Vec<Part> = Vec::new();
    for folder in folders {
        let unfinished = |why: &str| SweepError::Unfinished { folder: folder.clone(), why: why.to_owned() };
        let manifest = Manifest::read(folder)?.ok_or_else(|| unfinished("it has no manifest.json"))?;
        if manifest.failures.is_none() {
            return Err(unfinished("some of its rows are not done"));
        }
        if let Some(first) = parts.first() {
            let differs = difference(&first.manifest.described, &manifest.described);
            let differs = differs.or_else(|| {
                let of = |manifest: &Manifest| manifest.part.count;
                (of(&first.manifest) != of(&manifest)).then(|| "another number of parts".to_owned())
            });
            if let Some(difference) = differs {
                let (folder, first) = (folder.clone(), first.folder.clone());
                return Err(SweepError::OtherPart { folder, first, difference });
            }
        }
        let twin = parts.iter().find(|part| part.manifest.part == manifest.part);
        match twin {
            None => parts.push(Part { folder: folder.clone(), manifest }),
            Some(twin) if same_rows(&twin.folder, folder)? => {}
            Some(twin) => {
                let why = format!(
                    "{} and {} are the same part and differ",
                    twin.folder.display(),
                    folder.display()
                );
                return Err(SweepError::NotWhole { why });
            }
        }
    }
    parts.sort_by_key(|part| part.manifest.part.index);
    let count = parts.first().map_or(0, |part| part.manifest.part.count);
    let has = |index: &u64| parts.iter().any(|part| part.manifest.part.index == *index);
    match (0..count).find(|index| !has(index)) {
        Some(index) => Err(SweepError::NotWhole { why: format!("part {}/{count} is missing", index + 1) }),
        None => Ok(parts),
    }
}

fn same_rows(one: &Path, other: &Path) -> Result<bool, SweepError> {
    Ok(files::read(&one.join(ROWS_FILE))? == files::read(&other.join(ROWS_FILE))?)
}

//! Other scenes on which a study is repeated: its tables show them beside the first.

use crate::report::document::{Block, Table};
use crate::report::page::PlacedValue;
use simulation::scene::Scene;

/// A scene with the name that tables give it.
#[derive(Clone, Debug)]
pub struct BesideScene {
    /// Its name in tables.
    pub name: String,
    /// The scene.
    pub scene: Scene,
}

/// What a study found on such a scene.
#[derive(Clone, Debug)]
pub struct Beside<T> {
    /// The name of the scene in tables.
    pub name: String,
    /// The finding.
    pub found: T,
}

impl<T> Beside<T> {
    /// The same scene with what `next` makes of the finding.
    ///
    /// # Errors
    /// That of `next`.
    pub fn and_then<U, E>(self, next: impl FnOnce(T) -> Result<U, E>) -> Result<Beside<U>, E> {
        Ok(Beside { name: self.name, found: next(self.found)? })
    }
}

impl BesideScene {
    /// Runs a study on each of `scenes`, in order.
    ///
    /// # Errors
    /// That of the first run that fails.
    pub fn run_each<T, E>(
        scenes: &[Self],
        mut study: impl FnMut(&Scene) -> Result<T, E>,
    ) -> Result<Vec<Beside<T>>, E> {
        let run = |beside: &Self| Ok(Beside { name: beside.name.clone(), found: study(&beside.scene)? });
        scenes.iter().map(run).collect()
    }
}

/// What a study found on several scenes.
pub(crate) struct SideBySide {
    /// The figures, one row a scene or several in each.
    pub(crate) tables: Vec<Table>,
    /// What they mean.
    pub(crate) about: String,
}

impl SideBySide {
    /// For the terminal.
    pub(crate) fn blocks(self) -> Vec<Block> {
        let heading = [Block::Heading("Side by side".to_owned()), Block::Paragraph(self.about)];
        heading.into_iter().chain(self.tables.into_iter().map(Block::Table)).collect()
    }

    /// For the page of the study.
    pub(crate) fn page_values(&self) -> [PlacedValue; 2] {
        let tables: Vec<String> = self.tables.iter().map(Table::markdown).collect();
        [("table_scenes", tables.join("\n")), ("about_scenes", self.about.clone())]
    }
}

/// The largest error of estimates or runs, if there are `any`; a dash where there are none.
pub(crate) fn worst_of(any: bool, error: impl FnOnce() -> String) -> String {
    if any { error() } else { "-".to_owned() }
}

/// The first finding under its name, then those beside it.
pub(crate) fn side_by_side<'a, T>(
    name: &'a str,
    first: &'a T,
    beside: &'a [Beside<T>],
) -> impl Iterator<Item = (&'a str, &'a T)> {
    std::iter::once((name, first)).chain(beside.iter().map(|other| (other.name.as_str(), &other.found)))
}

/// The name of the command's own scene in tables.
pub(crate) const FIRST: &str = "as asked";

//! `--learn`: what moves learn of the motor, kept in the file of its map from move to move.

use std::io::Write as _;
use std::path::PathBuf;

use clap::Args;
use controller::ResponseMap;
use controller::map_correction::LearntFactors;

use super::{MapArgs, progress};
use crate::cli::CommandError;
use crate::report::files::Output;
use simulation::scene::{Scene, response_map_text};

#[derive(Debug, Default, Args)]
pub(super) struct LearnArgs {
    #[command(flatten)]
    pub(super) map: MapArgs,
    /// Keep what the move learns of the motor in the file of --map, which is then the map of this motor: the next move
    /// begins with it. A move that does not reach its target leaves the file as it is
    #[arg(long, requires = "map")]
    learn: bool,
}

/// Why nothing was learnt: a drive that fails is no property of the motor.
pub(super) const NOT_REACHED: &str = "the move did not reach its target";

/// The map's file, to be written anew.
pub(super) struct LearningMap {
    path: PathBuf,
    output: Output,
}

impl LearnArgs {
    /// By `map`, which stays as it is.
    pub(super) fn by(map: MapArgs) -> Self {
        Self { map, learn: false }
    }

    /// The map's file, if the move is to learn. It is opened before the move.
    ///
    /// # Errors
    /// When the map is no file, or cannot be written.
    pub(super) fn open(&self) -> Result<Option<LearningMap>, CommandError> {
        let Some(path) = self.map.map.as_deref().filter(|_| self.learn) else { return Ok(None) };
        if !path.is_file() {
            return Err(CommandError::NoMapFile { path: path.to_owned() });
        }
        Ok(Some(LearningMap { path: path.to_owned(), output: Output::create(path)? }))
    }
}

impl LearningMap {
    /// Writes the map of `scene` with what was learnt, in the place of the file as it was, and says so; returns that
    /// map. Without that the file stays, and the reason is told.
    ///
    /// # Errors
    /// When it cannot be written; the file is then as it was.
    pub(super) fn publish(
        self,
        scene: &Scene,
        learnt: Result<LearntFactors, &'static str>,
    ) -> Result<Option<ResponseMap>, CommandError> {
        let Self { path, mut output } = self;
        let learnt = match learnt {
            Ok(learnt) => learnt,
            Err(reason) => {
                progress::note(&format!("note: {} is as it was: {reason}", path.display()));
                return Ok(None);
            }
        };
        let map = scene.response_map()?.with_learnt(learnt).map_err(CommandError::NotLearnt)?;
        let text = response_map_text(&map, &path);
        output.write_all(text.as_bytes()).map_err(|source| output.unwritable(source))?;
        output.publish()?;
        progress::note(&format!("note: {} has what the move learnt of this motor", path.display()));
        Ok(Some(map))
    }
}

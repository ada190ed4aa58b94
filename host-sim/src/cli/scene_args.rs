//! The flags of every command that takes a scene.

use std::path::PathBuf;

use clap::{Args, ValueHint};

use super::progress;
use super::readers::Reader;
use crate::cli::CommandError;
use crate::scene_files;
use simulation::scene::{Origin, Scene};

/// Where the settings of a command come from.
#[derive(Debug, Default, Args)]
pub(super) struct SceneArgs {
    /// Scene file in TOML, or the name of a scene of the gallery (`host-sim scenes`)
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    scene: Option<PathBuf>,
    #[command(flatten)]
    assigned: AssignedArgs,
}

/// What is set beside a scene file.
#[derive(Debug, Default, Args)]
pub(super) struct AssignedArgs {
    /// Set one key, over the scene file; repeatable. `host-sim keys COMMAND` lists the keys that a command reads
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Add a fault, for example camera:lost@1.0..2.0, ldv:stuck@0.5.. or drive:weak:0.7; repeatable. `host-sim keys
    /// --faults` lists the words
    #[arg(long, value_name = "WORD")]
    fault: Vec<String>,
    /// Seed of the random numbers of the run
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    seed: Option<String>,
}

impl SceneArgs {
    /// The scene of the gallery of this name, and nothing set beside it.
    pub fn named(name: &str) -> Self {
        Self { scene: Some(name.into()), ..Self::default() }
    }

    /// The scene of `command`, with `flags` (key and value, if given) over everything else.
    ///
    /// # Errors
    /// When the scene is refused, or sets a key that the command does not read.
    pub fn load(&self, command: &str, flags: &[(&str, &Option<String>)]) -> Result<Scene, CommandError> {
        self.load_for(Reader::named(command), flags)
    }

    /// The same for a command that reads other keys with one flag than with another.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn load_for(
        &self,
        reader: &Reader,
        flags: &[(&str, &Option<String>)],
    ) -> Result<Scene, CommandError> {
        self.assigned.load(self.scene.as_ref(), Some(reader), flags)
    }
}

impl AssignedArgs {
    /// The scene in `file` with what is set beside it, with `flags` over everything else.
    ///
    /// # Errors
    /// When the scene is refused, or sets a key that `reader` does not read.
    pub fn load(
        &self,
        file: Option<&PathBuf>,
        reader: Option<&Reader>,
        flags: &[(&str, &Option<String>)],
    ) -> Result<Scene, CommandError> {
        let admit = |key| reader.map_or(Ok(()), |reader| reader.admit(key));
        let (mut scene, passed_over) =
            scene_files::load_admitted(file.map(PathBuf::as_path), &self.set, &admit)?;
        if let Some(reader) = reader {
            progress::note_passed_over(reader.command, &passed_over);
        }
        for word in &self.fault {
            scene.add_fault(word, &admit, Origin::Flag)?;
        }
        for (key, value) in flags.iter().chain(&[("seed", &self.seed)]) {
            if let Some(value) = value {
                scene.assign(key, value, &admit, Origin::Flag)?;
            }
        }
        Ok(scene)
    }
}

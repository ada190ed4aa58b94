//! `init`, `scene` and `scenes`: a scene file to begin with, what a scene sets, and the gallery.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use clap::builder::PossibleValuesParser;
use clap::{Args, ValueHint};
use serde::Serialize;

use super::Format;
use super::readers::{READERS, Reader};
use super::scene_args::AssignedArgs;
use crate::cli::CommandError;
use crate::report::OutputError;
use crate::report::files::{self, Output};
use crate::report::table::Table;
use crate::scene_files::{GALLERY, GalleryScene};
use simulation::scene::{Origin, Scene, SceneError, registry, template};

/// The command whose keys are meant.
#[derive(Debug, Args)]
struct ReaderArgs {
    /// Only the keys that this command reads
    #[arg(id = "for", long = "for", value_name = "COMMAND")]
    #[arg(value_parser = PossibleValuesParser::new(READERS.map(|reader| reader.command)))]
    command: Option<String>,
}

impl ReaderArgs {
    fn reader(&self) -> Option<&'static Reader> {
        self.command.as_deref().map(Reader::named)
    }

    fn reads(&self, key: &str) -> bool {
        self.reader().is_none_or(|reader| reader.reads(key))
    }
}

#[derive(Debug, Args)]
pub(super) struct InitArgs {
    /// The file to write
    #[arg(value_name = "FILE", default_value = "scene.toml", value_hint = ValueHint::FilePath)]
    file: PathBuf,
    #[command(flatten)]
    reader: ReaderArgs,
    /// Write over a file that is there
    #[arg(long)]
    force: bool,
    /// How to print the result
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
}

/// What `init` has written.
#[derive(Serialize)]
struct Written<'a> {
    written: &'a Path,
    keys: usize,
}

impl InitArgs {
    pub(super) fn execute(&self) -> Result<(), CommandError> {
        let path = &self.file;
        if !self.force && path.is_file() {
            return Err(OutputError::Exists { path: path.clone() }.into());
        }
        let mut file = Output::create(path)?;
        let text = template(&|key| self.reader.reads(key));
        file.write_all(text.as_bytes()).map_err(|source| file.unwritable(source))?;
        file.publish()?;
        let command = self.reader.command.as_deref().unwrap_or("position");
        let said = format!(
            "written            {0}\nedit it, then       host-sim {command} --scene {0}\n",
            path.display()
        );
        let keys = registry().filter(|setting| self.reader.reads(setting.key)).count();
        Ok(files::print(&self.format.of(said, files::json_line(&Written { written: path, keys })))?)
    }
}

#[derive(Debug, Args)]
pub(super) struct SceneCommandArgs {
    /// Scene file in TOML, or the name of a scene of the gallery
    #[arg(value_name = "FILE", value_hint = ValueHint::FilePath)]
    file: Option<PathBuf>,
    #[command(flatten)]
    reader: ReaderArgs,
    /// Only what was set, without the keys at their defaults
    #[arg(long)]
    only_set: bool,
    #[command(flatten)]
    assigned: AssignedArgs,
    /// How to print the result
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
}

/// A key of the effective scene.
#[derive(Serialize)]
struct EffectiveKey {
    key: &'static str,
    value: serde_json::Value,
    unit: &'static str,
    #[serde(flatten)]
    origin: Origin,
}

impl SceneCommandArgs {
    pub(super) fn execute(&self) -> Result<(), CommandError> {
        let scene = self.assigned.load(self.file.as_ref(), self.reader.reader(), &[])?;
        let keys = |key: &'static str| self.reader.reads(key);
        let text = match self.format {
            Format::Text => scene.text(&keys, self.only_set),
            Format::Json => self.json(&scene),
        };
        Ok(files::print(&text)?)
    }

    fn json(&self, scene: &Scene) -> String {
        let settings = registry().filter(|setting| self.reader.reads(setting.key));
        let shown = settings.filter(|setting| !self.only_set || scene.is_set(setting.key));
        let keys: Vec<EffectiveKey> = shown
            .map(|setting| EffectiveKey {
                key: setting.key,
                value: scene.value_json(setting.key),
                unit: setting.unit,
                origin: scene.origin(setting.key),
            })
            .collect();
        files::json_lines(&keys)
    }
}

#[derive(Debug, Args)]
pub(super) struct ScenesArgs {
    /// Print the file of this scene, to begin one's own with; without a name, list all
    #[arg(value_name = "NAME")]
    name: Option<String>,
    /// How to print the result
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
}

/// A scene of the gallery in JSON.
#[derive(Serialize)]
struct ListedScene {
    name: &'static str,
    look_at: &'static str,
    command: &'static str,
    text: &'static str,
}

impl From<&GalleryScene> for ListedScene {
    fn from(scene: &GalleryScene) -> Self {
        Self { name: scene.name, look_at: scene.look_at(), command: scene.command(), text: scene.text }
    }
}

impl ScenesArgs {
    pub(super) fn execute(&self) -> Result<(), CommandError> {
        let text = match (&self.name, self.format) {
            (Some(name), format) => {
                let scene = GalleryScene::named(name).ok_or_else(|| SceneError::NoSuchScene {
                    name: name.clone(),
                    nearest: GalleryScene::nearest(name).map(|scene| scene.name),
                })?;
                format.of(scene.text.to_owned(), files::json_line(&ListedScene::from(scene)))
            }
            (None, Format::Text) => listed(),
            (None, Format::Json) => {
                files::json_lines(&GALLERY.iter().map(ListedScene::from).collect::<Vec<_>>())
            }
        };
        Ok(files::print(&text)?)
    }
}

/// The gallery as a table.
fn listed() -> String {
    let mut table = Table::new(&["scene", "look at", "command"]);
    for scene in GALLERY {
        table.push([scene.name, scene.look_at(), scene.command()].map(str::to_owned).to_vec());
    }
    table.text()
}

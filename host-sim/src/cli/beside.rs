//! `--beside`: the scenes on which a study is repeated.

use std::path::Path;

use clap::Args;

use super::progress;
use super::readers::Reader;
use crate::cli::CommandError;
use crate::scene_files;
use crate::studies::beside::BesideScene;
use simulation::scene::{Admission, Origin, Scene, SceneError};

#[derive(Debug, Default, Args)]
pub(super) struct BesideArgs {
    /// Repeat the study with other settings and show both: scene files, names of scenes and KEY=VALUE with commas
    /// between them, set over the scene of the command; repeatable
    #[arg(long, value_name = "FILE,KEY=VALUE,...")]
    beside: Vec<String>,
}

impl BesideArgs {
    /// As if each of `texts` came with a flag of its own.
    pub(super) fn of(texts: &[&str]) -> Self {
        Self { beside: texts.iter().map(|text| (*text).to_owned()).collect() }
    }

    /// Whether there is a scene.
    pub(super) fn is_given(&self) -> bool {
        !self.beside.is_empty()
    }

    /// The scenes, each that of the `command` with other settings over it. `provide` makes each ready to run.
    ///
    /// # Errors
    /// When a file cannot be read, or sets what the command does not read.
    pub(super) fn scenes(
        &self,
        command: &str,
        scene: &Scene,
        provide: impl Fn(Scene) -> Result<Scene, CommandError>,
    ) -> Result<Vec<BesideScene>, CommandError> {
        let reader = Reader::named(command);
        let of_one = |text: &String| {
            let (name, scene) = changed(scene, text, (command, &|key| reader.admit(key)))?;
            Ok(BesideScene { name, scene: provide(scene)? })
        };
        self.beside.iter().map(of_one).collect()
    }
}

/// `scene` with the scene files and assignments of `text` over it, and a name made of them.
fn changed(
    scene: &Scene,
    text: &str,
    (command, admit): (&str, Admission),
) -> Result<(String, Scene), SceneError> {
    let mut scene = scene.clone();
    let mut names = Vec::new();
    for part in text.split(',').map(str::trim).filter(|part| !part.is_empty()) {
        if let Some((key, value)) = part.split_once('=') {
            scene.assign(key.trim(), value.trim(), admit, Origin::Flag)?;
            names.push(part.to_owned());
        } else {
            let path = Path::new(part);
            let passed_over = scene_files::read_into(&mut scene, path, admit)?;
            progress::note_passed_over(command, &passed_over);
            names.push(path.file_stem().unwrap_or(path.as_os_str()).to_string_lossy().replace('_', " "));
        }
    }
    Ok((names.join(", "), scene))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file, then a key over it, both over the scene; what they do not set stays.
    #[test]
    fn exact_files_and_keys_are_set_over_the_scene_in_order() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rotor_that_tilts.toml");
        std::fs::write(&path, "[plant]\nrotor = \"tilting\"\nstep_s = 5e-6\n").unwrap();
        let scene = Scene::of_sets(&["seed=7".to_owned(), "plant.step_s=1e-5".to_owned()]).unwrap();
        let text = format!("{},camera.marks=3, plant.rotor = tilting_without_shift", path.display());
        let (name, changed) = changed(&scene, &text, ("estimate", &|_| Ok(()))).unwrap();
        assert_eq!(name, "rotor that tilts, camera.marks=3, plant.rotor = tilting_without_shift");
        assert_eq!((changed.seed(), changed.integer("camera.marks")), (7, 3));
        assert_eq!(changed.choice("plant.rotor"), "tilting_without_shift");
        assert!((changed.number("plant.step_s") - 5e-6).abs() < 1e-12);
    }

    #[test]
    fn exact_what_a_command_does_not_read_is_refused() {
        let args = BesideArgs { beside: vec!["rate.deg_s=5".to_owned()] };
        let refused = args.scenes("estimate", &Scene::default(), Ok).unwrap_err();
        assert!(refused.one_line().contains("estimate does not read rate.deg_s"), "{}", refused.one_line());
    }
}

//! Scenes and response maps in files, and the gallery of scenes that are part of the program.

mod gallery;

use std::cell::{Cell, RefCell};
use std::io::{self, Read as _};
use std::path::Path;

use controller::ResponseMap;
use simulation::scene::{Admission, Scene, SceneError, parse_response_map};

pub use gallery::{COMMISSIONED_TILTING, GALLERY, GalleryScene, commissioned_map};

/// Longest file; a scene is a page of text.
const LENGTH_MAX_BYTES: u64 = 1 << 20;

/// Beginnings of the keys that say what one command shall do, and the filter: commands that compare filters choose it
/// themselves.
const TASKS: [&str; 6] = ["simulate.", "position.", "rate.", "calibrate.", "record.", "estimator.filter"];

/// A scene from an optional TOML file, or name of the [`GALLERY`], and `key=value` assignments, in this order.
///
/// # Errors
/// When the file cannot be read or is malformed, or a key or value is refused.
pub fn load(file: Option<&Path>, sets: &[String]) -> Result<Scene, SceneError> {
    load_admitted(file, sets, &|_| Ok(())).map(|(scene, _)| scene)
}

/// The same, refusing every key that `admit` refuses; and the keys that were passed over, see [`read_into`].
///
/// # Errors
/// When the file cannot be read or is malformed, or a key or value is refused.
pub fn load_admitted(
    file: Option<&Path>,
    sets: &[String],
    admit: Admission,
) -> Result<(Scene, Vec<&'static str>), SceneError> {
    let mut scene = Scene::default();
    let passed_over = file.map_or(Ok(Vec::new()), |path| read_into(&mut scene, path, admit))?;
    scene.assign_all(sets, admit)?;
    Ok((scene, passed_over))
}

/// Sets in `scene` everything that the file at `path` sets, or the scene of the gallery of that name where there is no
/// such file, as far as `admit` takes it. A scene of the gallery shows its motor and its instruments by any command:
/// its keys of [`TASKS`] that `admit` refuses are passed over, and returned, unless nothing would be left. What a file
/// of the user's own sets in vain is refused: it was meant to do something.
///
/// # Errors
/// When the file cannot be read or is malformed, or a key or value is refused.
pub fn read_into(scene: &mut Scene, path: &Path, admit: Admission) -> Result<Vec<&'static str>, SceneError> {
    match (read(path), name_of(path)) {
        (Ok(text), _) => scene.set_admitted(&text, path, admit).map(|()| Vec::new()),
        (Err(error), Some(name)) if error.kind() == io::ErrorKind::NotFound => {
            let of_gallery = GalleryScene::named(name).ok_or_else(|| SceneError::NoSuchScene {
                name: name.to_owned(),
                nearest: GalleryScene::nearest(name).map(|scene| scene.name),
            })?;
            let passed_over = RefCell::new(Vec::new());
            let is_shown = Cell::new(false);
            let admit_or_pass = |key: &'static str| match admit(key) {
                Err(_) if TASKS.iter().any(|task| key.starts_with(task)) => {
                    passed_over.borrow_mut().push(key);
                    Ok(())
                }
                admitted => {
                    is_shown.set(is_shown.get() || key != "seed");
                    admitted
                }
            };
            scene.set_admitted(of_gallery.text, &of_gallery.path(), &admit_or_pass)?;
            let passed_over = passed_over.into_inner();
            if let (false, Some(key)) = (is_shown.get(), passed_over.first()) {
                admit(key)?;
            }
            for key in &passed_over {
                scene.unset(key);
            }
            Ok(passed_over)
        }
        (Err(source), _) => Err(SceneError::Unreadable { path: path.to_owned(), source }),
    }
}

/// The name that `path` may be in the gallery: one word, without a folder.
fn name_of(path: &Path) -> Option<&str> {
    path.to_str().filter(|name| !name.contains(['/', '\\']))
}

/// Reads the map in the file at `path`, JSON if it ends in `.json`, TOML otherwise; or takes that of the commissioned
/// motor of the gallery's scene of that name where there is no such file.
///
/// # Errors
/// When it cannot be read, or is refused as by [`parse_response_map`].
pub fn read_response_map(path: &Path) -> Result<ResponseMap, SceneError> {
    match (read(path), name_of(path)) {
        (Ok(text), _) => parse_response_map(&text, path),
        (Err(error), Some(name)) if error.kind() == io::ErrorKind::NotFound => {
            let text = commissioned_map(name).ok_or_else(|| SceneError::NoSuchMap {
                name: name.to_owned(),
                known: gallery::commissioned_names().collect(),
            })?;
            parse_response_map(text, path)
        }
        (Err(source), _) => Err(SceneError::Unreadable { path: path.to_owned(), source }),
    }
}

fn read(path: &Path) -> io::Result<String> {
    let mut text = String::new();
    let length = std::fs::File::open(path)?.take(LENGTH_MAX_BYTES + 1).read_to_string(&mut text)?;
    if u64::try_from(length).unwrap_or(u64::MAX) > LENGTH_MAX_BYTES {
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, "longer than 1 MiB"));
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_a_name_without_a_file_is_of_the_gallery() {
        let of_name = |name: &str| load(Some(Path::new(name)), &[]);
        assert_eq!(of_name("heavy-rotor").unwrap().seed(), 3);
        for (name, hint) in [
            ("heavy_rotr.toml", "did you mean heavy_rotor?"),
            ("xyzzy", "`host-sim scenes` lists the gallery"),
        ] {
            assert_eq!(
                of_name(name).unwrap_err().one_line(),
                format!(
                    "error: there is no file {name}, and no scene of that name in the gallery; hint: {hint}"
                )
            );
        }
    }

    /// A scene of the gallery shows its instruments by another command too; what a file of the user's own sets for
    /// another command is refused.
    #[test]
    fn exact_the_task_of_a_scene_of_the_gallery_is_passed_over() {
        let admit = |key: &'static str| match key {
            "position.tolerance_deg" | "ldv.installed" => {
                Err(SceneError::NotRead { refusal: format!("no {key}"), hint: String::new() })
            }
            _ => Ok(()),
        };
        let task_alone = |key: &'static str| if key == "ldv.installed" { Ok(()) } else { admit(key) };
        let (scene, passed_over) = load_admitted(Some(Path::new("slow_camera")), &[], &task_alone).unwrap();
        assert_eq!(passed_over, ["position.tolerance_deg"]);
        assert!(!scene.is_set("position.tolerance_deg") && scene.choice("ldv.installed") == "no");
        assert!(load_admitted(Some(Path::new("slow_camera")), &[], &admit).is_err(), "no task");
        let no_task = |key: &'static str| {
            if key.starts_with("rate.") {
                return Err(SceneError::NotRead { refusal: format!("no {key}"), hint: String::new() });
            }
            Ok(())
        };
        assert!(load_admitted(Some(Path::new("rate_staircase")), &[], &no_task).is_err(), "nothing is left");
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/slow_camera.toml");
        assert!(load_admitted(Some(&file), &[], &task_alone).is_err(), "a file of one's own");
    }

    /// A scene of a microcontroller names its filter. A command that runs all filters takes the latency alone.
    #[test]
    fn exact_the_filter_of_a_scene_of_the_gallery_is_passed_over_by_a_command_that_has_its_own() {
        let own_filters = |key: &'static str| match key {
            "estimator.filter" => {
                Err(SceneError::NotRead { refusal: format!("no {key}"), hint: String::new() })
            }
            _ => Ok(()),
        };
        let (scene, passed_over) = load_admitted(Some(Path::new("stm32g474")), &[], &own_filters).unwrap();
        assert_eq!(passed_over, ["estimator.filter"]);
        assert!(!scene.is_set("estimator.filter") && scene.integer("board.latency_ticks") == 16);
    }

    #[test]
    fn exact_a_map_without_a_file_is_that_of_a_commissioned_motor() {
        let named = read_response_map(Path::new(COMMISSIONED_TILTING)).unwrap();
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("maps/set_f_plant.toml");
        assert_eq!(named, read_response_map(&file).unwrap());
        let complaint = |path: &str| read_response_map(Path::new(path)).unwrap_err().one_line();
        // A scene whose motor was not commissioned, and a word that is nothing.
        for missing in ["set_g_plant", "set_f_plnt"] {
            let hint = "by name: set_f_plant; `host-sim commission` makes that of another motor";
            let expected =
                format!("error: there is no file {missing}, and no map of that name; hint: {hint}");
            assert_eq!(complaint(missing), expected);
        }
        // In a folder it is a file.
        let error = complaint("nowhere/set_f_plant");
        assert!(error.starts_with("error: cannot read nowhere/set_f_plant: "), "{error}");
    }

    #[test]
    fn exact_missing_binary_and_endless_files() {
        let missing = load(Some(Path::new("/nonexistent/scene.toml")), &[]).unwrap_err().one_line();
        assert!(missing.starts_with("error: cannot read /nonexistent/scene.toml: "), "{missing}");
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), [0xff, 0xfe, 0]).unwrap();
        assert!(load(Some(file.path()), &[]).unwrap_err().one_line().contains("UTF-8"));
        std::fs::write(file.path(), vec![b'#'; 2 << 20]).unwrap();
        assert!(load(Some(file.path()), &[]).unwrap_err().one_line().contains("longer than 1 MiB"));
    }
}

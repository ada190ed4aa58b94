//! What a command does beside its run, for a caller in the same process such as the Python module: it refuses the keys
//! that it would ignore, and it prints its result as JSON.

use simulation::scene::{Scene, SceneError};

use super::readers::Reader;
use super::report::Request;
use super::result_json;
pub use crate::report::files::json_line;
use crate::report::key_figure::KeyFigure;

/// Refuses a scene that sets a key which `command` does not read.
///
/// # Errors
/// That of the first of these keys, in alphabetical order.
///
/// # Panics
/// When no such command takes a scene: a slip in the program.
pub fn refuse_unread_keys(command: &str, scene: &Scene) -> Result<(), SceneError> {
    let reader = Reader::named(command);
    scene.keys_set().try_for_each(|key| reader.admit(key))
}

/// What `command` prints with `--format json`: `result`, a JSON object, with what it is of before its fields.
///
/// # Panics
/// When no such command takes a scene: a slip in the program.
pub fn json(command: &'static str, scene: &Scene, key_figures: &[KeyFigure], result: &str) -> String {
    result_json::of(&Request::of_scene(command, scene), key_figures, result)
}

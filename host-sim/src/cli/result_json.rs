//! The JSON of a result: what it is of, its key figures, then the result itself. `host-sim compare` reads it.

use std::collections::BTreeMap;

use serde::Serialize;
use serde_json::Value;

use super::report::Request;
use crate::report::key_figure::KeyFigure;
use simulation::scene::Scene;

/// What stands before a result.
#[derive(Serialize)]
struct Head<'a> {
    /// Name of the command.
    command: &'static str,
    /// Version of this program.
    version: &'static str,
    /// The keys of the scene that differ from their defaults; left out of a command that takes no scene.
    #[serde(skip_serializing_if = "Option::is_none")]
    scene: Option<BTreeMap<&'static str, Value>>,
    /// The figures by which the result is judged, where the command has some.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    key_figures: Vec<&'a KeyFigure>,
}

/// `result`, a JSON object, with what it is of before its fields, on one line.
pub(super) fn of(request: &Request, key_figures: &[KeyFigure], result: &str) -> String {
    let head = Head {
        command: request.command,
        version: env!("CARGO_PKG_VERSION"),
        scene: request.scene.map(|scene| set_keys(scene, request)),
        key_figures: key_figures.iter().filter(|figure| figure.has_value()).collect(),
    };
    let head = serde_json::to_string(&head).unwrap_or_default();
    let fields = result.trim().strip_prefix('{').unwrap_or_default().trim_start();
    let comma = if fields.starts_with('}') { "" } else { "," };
    format!("{}{comma}{fields}\n", head.strip_suffix('}').unwrap_or(&head))
}

/// The keys of a scene that differ from their defaults.
fn set_keys(scene: &Scene, request: &Request) -> BTreeMap<&'static str, Value> {
    let default = Scene::default();
    let differs = |key: &&'static str| scene.value_json(key) != default.value_json(key);
    let keys = scene.keys_set().filter(|key| request.reads(key)).filter(differs);
    keys.map(|key| (key, scene.value_json(key))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_the_head_stands_before_the_fields() {
        let scene = Scene::of_sets(&["seed=7".to_owned(), "camera.marks=2".to_owned()]).unwrap();
        let request = Request::of_scene("position", &scene);
        let version = env!("CARGO_PKG_VERSION");
        assert_eq!(
            of(&request, &[], "{\"ok\":true}\n"),
            format!(
                "{{\"command\":\"position\",\"version\":\"{version}\",\"scene\":{{\"seed\":7}},\"ok\":true}}\n"
            ),
        );
        let figures = [KeyFigure::single("rate", "rad/s", 2.0), KeyFigure::single("none", "", f64::NAN)];
        let text = of(&Request::without_scene("accuracy"), &figures, "{}\n");
        let value: Value = serde_json::from_str(&text).unwrap();
        assert_eq!(value["key_figures"].as_array().unwrap().len(), 1, "{text}");
        assert!(value.get("scene").is_none() && text.ends_with("}]}\n"), "{text}");
    }
}

//! A scene as the text of a scene file: what it sets, and beside it every other key, commented out, at its default.
//!
//! Keys stand in tables, each table once. Reading the text gives the same scene.

use std::fmt::Write as _;

use super::keys::TABLE_TITLES;
use super::{Kind, Origin, Scene, Setting, registry};

/// Longest line.
const WIDTH: usize = 100;

/// Which keys of a scene are written.
pub type Keys<'a> = &'a dyn Fn(&'static str) -> bool;

/// A table of a scene file and its settings; the first has no name and stands before all headers.
fn tables(keys: Keys) -> Vec<(&'static str, Vec<Setting>)> {
    let mut tables: Vec<(&'static str, Vec<Setting>)> = vec![("", Vec::new())];
    for setting in registry().filter(|setting| keys(setting.key)) {
        let table = setting.key.rsplit_once('.').map_or("", |(table, _)| table);
        match tables.iter_mut().find(|(name, _)| *name == table) {
            Some((_, settings)) => settings.push(setting),
            None => tables.push((table, vec![setting])),
        }
    }
    tables
}

/// The last word of a key, which is its name in its table.
fn name(key: &str) -> &str {
    key.rsplit_once('.').map_or(key, |(_, name)| name)
}

fn title(table: &str) -> &'static str {
    TABLE_TITLES.iter().find(|(name, _)| *name == table).map_or("", |(_, title)| title)
}

/// A paragraph of comment lines.
fn comment(text: &mut String, prose: &str) {
    let options = textwrap::Options::new(WIDTH).initial_indent("# ").subsequent_indent("# ");
    for line in textwrap::wrap(prose, options) {
        text.push_str(&line);
        text.push('\n');
    }
}

/// Meaning, bounds, and what is known of the value of a setting.
fn explanation(setting: &Setting) -> String {
    let space = if setting.unit.is_empty() { "" } else { " " };
    let mut facts = match setting.kind {
        Kind::Faults => vec!["for example [\"camera:lost@1.0..2.0\", \"drive:weak:0.7@0.05..\"]".to_owned()],
        Kind::Schedule { .. } => {
            vec!["for example \"b:1 for 0.5, off for 0.3, c:0.5@7440..7480 for 2\"".to_owned()]
        }
        kind => vec![format!("{}{space}{}", kind.bounds_text().replace('|', " | "), setting.unit)],
    };
    if let Kind::As { key } = setting.kind {
        facts.push(format!("as {key} unless it is set"));
    }
    let origin = setting.origin_text();
    if !origin.is_empty() {
        facts.push(format!("origin: {origin}"));
    }
    match setting.tolerance_text().as_str() {
        "" => {}
        "exact" => facts.push("the same in every drawn motor".to_owned()),
        tolerance => facts.push(format!("drawn motors: {tolerance}")),
    }
    format!("{}; {}", setting.meaning, facts.join("; "))
}

/// The scene file of a newcomer: every key of `keys` with its meaning, unit, bounds and default, commented out. It sets
/// nothing.
#[must_use]
pub fn template(keys: Keys) -> String {
    let mut text = String::new();
    comment(
        &mut text,
        "A scene: every value of a run by its key. Each key stands at its default and is commented out. To set one, \
         take the # before it away. Its unit is the end of its name. `host-sim scene` with the name of this file \
         prints what it sets.",
    );
    for (table, settings) in tables(keys).into_iter().filter(|(_, settings)| !settings.is_empty()) {
        text.push('\n');
        if !table.is_empty() {
            let title = title(table);
            if !title.is_empty() {
                comment(&mut text, title);
            }
            let _ = writeln!(text, "[{table}]");
        }
        for (number, setting) in settings.iter().enumerate() {
            if number > 0 || !table.is_empty() {
                text.push('\n');
            }
            comment(&mut text, &explanation(setting));
            let default = Scene::default().value_text(setting.key);
            let _ = writeln!(text, "#{} = {default}", name(setting.key));
        }
    }
    text
}

impl Scene {
    /// The value of a key as it stands in a scene file.
    ///
    /// # Panics
    /// When there is no such key: a slip in the program.
    pub fn value_text(&self, key: &'static str) -> String {
        self.value(key).toml()
    }

    /// The value of a key in JSON.
    ///
    /// # Panics
    /// When there is no such key: a slip in the program.
    pub fn value_json(&self, key: &'static str) -> serde_json::Value {
        self.value(key).json()
    }

    /// Whether something sets the key.
    pub fn is_set(&self, key: &str) -> bool {
        self.set.contains_key(key)
    }

    /// The scene as a scene file, each value with its origin: what was set of `keys`, and the others commented out
    /// unless `only_set`.
    #[must_use]
    pub fn text(&self, keys: Keys, only_set: bool) -> String {
        let wanted = |key| keys(key) && (!only_set || self.is_set(key));
        let mut text = String::new();
        for (table, settings) in tables(&wanted).into_iter().filter(|(_, settings)| !settings.is_empty()) {
            if !table.is_empty() {
                let gap = if text.is_empty() { "" } else { "\n" };
                let _ = writeln!(text, "{gap}[{table}]");
            }
            let lines: Vec<(String, Origin)> = settings
                .iter()
                .map(|setting| {
                    let mark = if self.is_set(setting.key) { "" } else { "#" };
                    let line = format!("{mark}{} = {}", name(setting.key), self.value_text(setting.key));
                    (line, self.origin(setting.key))
                })
                .collect();
            let width = lines.iter().map(|(line, _)| line.chars().count()).max().unwrap_or(0);
            for (line, origin) in lines {
                let _ = writeln!(text, "{line:width$}  # {origin}");
            }
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    const ALL: Keys = &|_| true;

    fn read(text: &str) -> Scene {
        let mut scene = Scene::default();
        scene.set_all(text, Path::new("scene.toml")).unwrap_or_else(|error| panic!("{error}\n{text}"));
        scene
    }

    #[test]
    fn exact_the_template_sets_nothing() {
        assert_eq!(read(&template(ALL)), Scene::default());
    }

    /// With every # before a key taken away it sets every key, to the default.
    #[test]
    fn exact_the_template_has_every_key_at_its_default() {
        let text = template(ALL);
        assert!(text.lines().all(|line| line.chars().count() <= WIDTH), "{text}");
        let bare =
            |line: &str| line.strip_prefix('#').filter(|rest| !rest.starts_with(' ')).map(str::to_owned);
        let active: Vec<String> =
            text.lines().map(|line| bare(line).unwrap_or_else(|| line.to_owned())).collect();
        let scene = read(&active.join("\n"));
        let default = Scene::default();
        for setting in registry() {
            assert!(scene.is_set(setting.key), "{}", setting.key);
            assert_eq!(scene.value_text(setting.key), default.value_text(setting.key), "{}", setting.key);
        }
        assert!(text.contains(
            "# standard deviation of the tracking noise, before quantisation; 0 to 0.001 m\n#noise_m"
        ));
    }

    #[test]
    fn exact_every_first_table_has_a_title() {
        for (table, _) in tables(ALL).iter().filter(|(table, _)| !table.is_empty() && !table.contains('.')) {
            assert!(!title(table).is_empty(), "{table}");
        }
        for (table, _) in TABLE_TITLES {
            assert!(tables(ALL).iter().any(|(name, _)| name == table), "{table}");
        }
    }

    /// Its own text gives the scene again, and each line says where its value comes from.
    #[test]
    fn exact_a_scene_s_text_is_the_scene() {
        let mut scene = read("seed = 18446744073709551615\n[motor.mode_b]\nfrequency_hz = 6301.25\n");
        for (key, value) in
            [("simulate.drive", "b"), ("plant.motor.friction", "0.1"), ("camera.noise_m", "1e-7")]
        {
            scene.assign(key, value, &|_| Ok(()), Origin::Set).unwrap();
        }
        for only_set in [false, true] {
            let text = scene.text(ALL, only_set);
            assert_eq!(read(&text), scene, "{text}");
            assert!(text.contains("\n[motor.mode_b]\n") && text.contains("  # scene.toml:3\n"), "{text}");
            assert!(text.contains("noise_m = 1e-7") && text.contains("  # --set\n"), "{text}");
            let shows = |line: &str| text.lines().any(|found| found.split_whitespace().eq(line.split(' ')));
            for default in [
                "#to_deg = 90 # default",
                "#marks = 2 # as camera.marks",
                "#restitution = 0.6 # drawn by the seed around motor.restitution",
            ] {
                assert_eq!(shows(default), !only_set, "{default}: {text}");
            }
        }
        assert_eq!(Scene::default().text(ALL, true), "");
    }
}

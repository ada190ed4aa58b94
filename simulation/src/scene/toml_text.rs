//! Reading a scene from the text of a TOML file, so that every refusal names line and column.

use std::ops::Range;
use std::path::Path;

use toml::Spanned;
use toml::de::{DeArray, DeTable, DeValue};

use super::faults;
use super::setting::{nearest_key, nearest_table};
use super::{Admission, Kind, Origin, Scene, SceneError, Setting, registry};

/// Sets in `scene` everything that `text` sets; `path` is for messages.
pub(super) fn parse_into(
    scene: &mut Scene,
    text: &str,
    path: &Path,
    admit: Admission,
) -> Result<(), SceneError> {
    let place = Place { path, text, admit };
    let table = DeTable::parse(text).map_err(|error| place.malformed(error.span(), error.message()))?;
    place.set_table(scene, "", table.get_ref())
}

/// The file being read: its name and text for messages, and the keys that it may set.
struct Place<'a> {
    path: &'a Path,
    text: &'a str,
    admit: Admission<'a>,
}

impl Place<'_> {
    /// Sets what stands in a table, in the order of the file, so that of several mistakes the first is named.
    fn set_table(&self, scene: &mut Scene, prefix: &str, table: &DeTable<'_>) -> Result<(), SceneError> {
        let mut entries: Vec<_> = table.iter().collect();
        entries.sort_by_key(|(name, _)| name.span().start);
        for (name, value) in entries {
            let key = format!("{prefix}{}", name.get_ref());
            let inner = format!("{key}.");
            let is_table = registry().any(|setting| setting.key.starts_with(&inner));
            let setting = registry().find(|setting| setting.key == key);
            match (value.get_ref(), setting) {
                (DeValue::Table(table), None) if is_table => self.set_table(scene, &inner, table)?,
                (DeValue::Table(_), None) => {
                    let nearest = nearest_table(&key);
                    return Err(self.refused(name.span(), SceneError::UnknownTable { table: key, nearest }));
                }
                (_, Some(setting)) => self.set_value(scene, &setting, value)?,
                (_, None) if is_table => {
                    return Err(self.refused(value.span(), SceneError::IsTable { table: key }));
                }
                (_, None) => {
                    let nearest = nearest_key(&key);
                    return Err(self.refused(name.span(), SceneError::UnknownKey { key, nearest }));
                }
            }
        }
        Ok(())
    }

    fn set_value(
        &self,
        scene: &mut Scene,
        setting: &Setting,
        value: &Spanned<DeValue<'_>>,
    ) -> Result<(), SceneError> {
        if let (Kind::Faults, DeValue::Array(words)) = (setting.kind, value.get_ref()) {
            return self.set_faults(scene, words);
        }
        let (line, _) = line_and_column(self.text, value.span().start);
        let origin = Origin::File { path: self.path.to_owned(), line };
        self.written(setting, value)
            .and_then(|text| scene.assign(setting.key, text, self.admit, origin))
            .map_err(|source| self.refused(value.span(), source))
    }

    /// Sets the faults to those of a list of words, in the place of all that were set before.
    fn set_faults(&self, scene: &mut Scene, words: &DeArray<'_>) -> Result<(), SceneError> {
        let mut of_file = scene.clone();
        of_file.assign(faults::KEY, "", self.admit, Origin::Program)?;
        for word in words {
            let DeValue::String(text) = word.get_ref() else {
                let wanted = "words in quotes";
                let found = self.text.get(word.span()).unwrap_or_default().to_owned();
                return Err(
                    self.refused(word.span(), SceneError::WrongType { key: faults::KEY, found, wanted })
                );
            };
            let (line, _) = line_and_column(self.text, word.span().start);
            let origin = Origin::File { path: self.path.to_owned(), line };
            let added = of_file.add_fault(text, self.admit, origin);
            added.map_err(|source| self.refused(word.span(), source))?;
        }
        *scene = of_file;
        Ok(())
    }

    /// The text of a value whose type is the setting's.
    fn written<'v>(&self, setting: &Setting, value: &'v Spanned<DeValue<'_>>) -> Result<&'v str, SceneError> {
        let wanted = match setting.kind.resolved() {
            Kind::Choice { .. } => "a word in quotes",
            Kind::Schedule { .. } => "drives in quotes",
            Kind::Faults => "a list of words in quotes",
            _ => "a decimal number",
        };
        let is_word = wanted != "a decimal number";
        let wrong_type = |found: String| SceneError::WrongType { key: setting.key, found, wanted };
        match value.get_ref() {
            DeValue::String(text) if is_word => Ok(text),
            DeValue::Integer(integer) if integer.radix() == 10 => Ok(integer.as_str()),
            DeValue::Float(float) => Ok(float.as_str()),
            DeValue::Boolean(yes) => Ok(if *yes { "true" } else { "false" }),
            DeValue::String(text) => {
                Err(SceneError::Quoted { key: setting.key, value: text.as_ref().to_owned() })
            }
            DeValue::Integer(_) | DeValue::Datetime(_) => {
                Err(wrong_type(self.text.get(value.span()).unwrap_or_default().to_owned()))
            }
            DeValue::Array(_) => Err(wrong_type("an array".to_owned())),
            DeValue::Table(_) => Err(wrong_type("a table".to_owned())),
        }
    }

    fn refused(&self, span: Range<usize>, source: SceneError) -> SceneError {
        let (line, column) = line_and_column(self.text, span.start);
        SceneError::InFile { path: self.path.to_owned(), line, column, source: Box::new(source) }
    }

    fn malformed(&self, span: Option<Range<usize>>, message: &str) -> SceneError {
        let (line, column) = line_and_column(self.text, span.map_or(self.text.len(), |span| span.start));
        SceneError::Malformed { path: self.path.to_owned(), line, column, message: message.to_owned() }
    }
}

/// Line and column, in characters and from 1, of a byte offset in `text`.
pub(super) fn line_and_column(text: &str, offset: usize) -> (usize, usize) {
    let before = text.get(..offset).unwrap_or(text);
    let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
    (before.matches('\n').count() + 1, before[line_start..].chars().count() + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(text: &str) -> String {
        Scene::default().set_all(text, Path::new("FILE")).unwrap_err().one_line()
    }

    #[test]
    fn exact_line_and_column_of_a_refused_value() {
        assert_eq!(
            refused("seed = 2\n\n[motor.mode_b]\nfrequency_hz = -1\n"),
            "error: FILE:4:16: motor.mode_b.frequency_hz = -1 is outside its bounds 1 to 1e6 Hz"
        );
        assert_eq!(
            refused("[motor]\nfrictoin = 0.3\n"),
            "error: FILE:2:1: unknown key motor.frictoin; hint: did you mean motor.friction?"
        );
        assert_eq!(
            refused("motor.friction = nan"),
            "error: FILE:1:18: motor.friction = nan is not a number, bounds 0 to 1e6"
        );
    }

    #[test]
    fn exact_line_and_column_of_a_malformed_file() {
        assert!(refused("seed = 2\nmotor = [\n").starts_with("error: FILE:"));
        assert!(refused("seed = 2\n= 3\n").starts_with("error: FILE:2:1: "));
    }

    #[test]
    fn exact_place_of_a_wrong_type() {
        for (text, expected) in [
            ("motor.friction = true", "1:18: motor.friction = true is not a number, bounds 0 to 1e6"),
            (
                "[camera]\nmarks = \"3\"",
                "2:9: camera.marks = \"3\" is a word; hint: a number has no quotes: 3",
            ),
            ("[ldv]\ninstalled = true", "2:13: ldv.installed = true is none of yes, no"),
            ("seed = 0x1f", "1:8: seed is 0x1f; it takes a decimal number"),
            ("seed = [1, 2]", "1:8: seed is an array; it takes a decimal number"),
            ("simulate = { drive = [\"b\"] }", "1:22: simulate.drive is an array; it takes a word in quotes"),
            ("[seed]\nmotor = 3", "1:1: seed is a table; it takes a decimal number"),
        ] {
            assert_eq!(refused(text), format!("error: FILE:{expected}"));
        }
    }

    /// The word that is wrong is named, not the value that follows it, and of several mistakes the first.
    #[test]
    fn exact_place_of_an_unknown_name() {
        for (text, expected) in [
            (
                "seed = 2\n[positoin]\nto_deg = 3\n[camera]\nmark = 3",
                "2:2: unknown table positoin; hint: did you mean position?",
            ),
            ("[motor.mode_d]", "1:8: unknown table motor.mode_d; hint: did you mean motor.mode_a?"),
            (
                "motor.mode_b.frequncy_hz = 3",
                "1:14: unknown key motor.mode_b.frequncy_hz; hint: did you mean motor.mode_b.frequency_hz?",
            ),
            (
                "rate = 3",
                "1:8: rate is a table of keys; hint: its keys are rate.deg_s, rate.profile, rate.duration_s",
            ),
            ("\"\" = 3", "1:1: unknown key ; hint: `host-sim keys` lists every key"),
        ] {
            assert_eq!(refused(text), format!("error: FILE:{expected}"));
        }
    }
}

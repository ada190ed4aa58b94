//! Reading a scene from a TOML file, so that every refusal names line and column.

use std::io::{self, Read};
use std::ops::Range;
use std::path::Path;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::{Admission, Scene, SceneError};

/// Longest scene file; a scene is a page of text.
const LENGTH_MAX_BYTES: u64 = 1 << 20;

/// Sets in `scene` everything that the file at `path` sets, as far as `admit` takes it.
pub(super) fn read_into(scene: &mut Scene, path: &Path, admit: Admission) -> Result<(), SceneError> {
    let text = read(path).map_err(|source| SceneError::Unreadable { path: path.to_owned(), source })?;
    parse_into(scene, &text, path, admit)
}

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

pub(super) fn read(path: &Path) -> io::Result<String> {
    let mut text = String::new();
    let length = std::fs::File::open(path)?.take(LENGTH_MAX_BYTES + 1).read_to_string(&mut text)?;
    if u64::try_from(length).unwrap_or(u64::MAX) > LENGTH_MAX_BYTES {
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, "longer than 1 MiB"));
    }
    Ok(text)
}

/// The file being read: its name and text for messages, and the keys that it may set.
struct Place<'a> {
    path: &'a Path,
    text: &'a str,
    admit: Admission<'a>,
}

impl Place<'_> {
    fn set_table(&self, scene: &mut Scene, prefix: &str, table: &DeTable<'_>) -> Result<(), SceneError> {
        for (name, value) in table {
            let key = format!("{prefix}{}", name.get_ref());
            match value.get_ref() {
                DeValue::Table(inner) => self.set_table(scene, &format!("{key}."), inner)?,
                _ => self.set_value(scene, &key, value)?,
            }
        }
        Ok(())
    }

    fn set_value(
        &self,
        scene: &mut Scene,
        key: &str,
        value: &Spanned<DeValue<'_>>,
    ) -> Result<(), SceneError> {
        let text = match value.get_ref() {
            DeValue::Integer(integer) if integer.radix() == 10 => integer.as_str(),
            DeValue::Float(float) => float.as_str(),
            DeValue::String(text) => text,
            other => {
                let message =
                    format!("{key} is a {}; a setting is a decimal number or a word", other.type_str());
                return Err(self.malformed(Some(value.span()), &message));
            }
        };
        scene.set_admitted(key, text, self.admit).map_err(|source| {
            let (line, column) = line_and_column(self.text, value.span().start);
            SceneError::InFile { path: self.path.to_owned(), line, column, source: Box::new(source) }
        })
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
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), text).unwrap();
        let line = Scene::load(Some(file.path()), &[]).unwrap_err().one_line();
        line.replace(&file.path().display().to_string(), "FILE")
    }

    #[test]
    fn exact_line_and_column_of_a_refused_value() {
        assert_eq!(
            refused("seed = 2\n\n[motor.mode_b]\nfrequency_hz = -1\n"),
            "error: FILE:4:16: motor.mode_b.frequency_hz = -1 is outside its bounds 1 to 1e6 Hz"
        );
        assert_eq!(
            refused("[motor]\nfrictoin = 0.3\n"),
            "error: FILE:2:12: unknown key motor.frictoin; hint: did you mean motor.friction?"
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
        assert_eq!(
            refused("motor.friction = true"),
            "error: FILE:1:18: motor.friction is a boolean; a setting is a decimal number or a word"
        );
    }

    #[test]
    fn exact_missing_binary_and_endless_files() {
        let missing = Scene::load(Some(Path::new("/nonexistent/scene.toml")), &[]).unwrap_err().one_line();
        assert!(missing.starts_with("error: cannot read /nonexistent/scene.toml: "), "{missing}");
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), [0xff, 0xfe, 0]).unwrap();
        assert!(Scene::load(Some(file.path()), &[]).unwrap_err().one_line().contains("UTF-8"));
        std::fs::write(file.path(), vec![b'#'; 2 << 20]).unwrap();
        assert!(Scene::load(Some(file.path()), &[]).unwrap_err().one_line().contains("longer than 1 MiB"));
    }
}

//! A section of a file that a command writes, between two lines that mark it.

use std::io::Write as _;
use std::path::Path;

use crate::report::OutputError;
use crate::report::files::Output;

/// The markers of a section.
#[derive(Clone, Copy, Debug)]
pub struct Section {
    /// Where it begins.
    pub begin: &'static str,
    /// Where it ends.
    pub end: &'static str,
}

impl Section {
    /// Reads a file that has the section's markers.
    ///
    /// # Errors
    /// When it cannot be read or has no markers, each once and in order.
    pub fn read(self, path: &Path) -> Result<String, OutputError> {
        let text = std::fs::read_to_string(path)
            .map_err(|source| OutputError::Unreadable { path: path.to_owned(), source })?;
        if self.replaced(&text, "").is_some() {
            Ok(text)
        } else {
            Err(OutputError::NoMarkers { path: path.to_owned(), markers: [self.begin, self.end] })
        }
    }

    /// Puts `section` between the markers of the file at `path`.
    ///
    /// # Errors
    /// When the file has no markers (any more) or cannot be written.
    pub fn write(self, path: &Path, section: &str) -> Result<(), OutputError> {
        let text = self.read(path)?;
        let mut output = Output::create(path)?;
        let text = self.replaced(&text, section).unwrap_or(text);
        output.write_all(text.as_bytes()).map_err(|source| output.unwritable(source))?;
        output.publish()
    }

    /// `text` with `section` between its markers.
    fn replaced(self, text: &str, section: &str) -> Option<String> {
        let Self { begin, end } = self;
        let (before, rest) = text.split_once(begin)?;
        let (old, after) = rest.split_once(end)?;
        let twice = [before, old, after].iter().any(|part| part.contains(begin) || part.contains(end));
        (!twice).then(|| format!("{before}{begin}\n{}\n{end}{after}", section.trim_end()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BEGIN: &str = "<!-- it:begin -->";
    const END: &str = "<!-- it:end -->";
    const SECTION: Section = Section { begin: BEGIN, end: END };

    #[test]
    fn exact_only_what_is_between_the_markers_changes() {
        let text = format!("before\n{BEGIN}\nold\n{END}\nafter\n");
        assert_eq!(
            SECTION.replaced(&text, "new\n\n").unwrap(),
            format!("before\n{BEGIN}\nnew\n{END}\nafter\n")
        );
    }

    #[test]
    fn exact_missing_swapped_and_repeated_markers_are_refused() {
        for text in [
            String::new(),
            BEGIN.to_owned(),
            format!("{END}{BEGIN}"),
            format!("{BEGIN}{END}{BEGIN}{END}"),
            format!("{BEGIN}{BEGIN}{END}"),
        ] {
            assert_eq!(SECTION.replaced(&text, ""), None, "{text}");
        }
    }
}

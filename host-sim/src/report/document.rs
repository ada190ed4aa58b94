//! A document of headings, paragraphs, tables and pictures, in plain text and in Markdown.

use std::fmt::Write as _;

use textwrap::{Options, WordSplitter};

pub(crate) use super::table::Table;

/// A result in words and tables, ready to be written either way.
#[derive(Clone, Debug)]
pub struct Document {
    pub(crate) blocks: Vec<Block>,
}

#[derive(Clone, Debug)]
pub(crate) enum Block {
    Heading(String),
    Paragraph(String),
    Table(Table),
    /// Title and file.
    Picture(String, String),
}

/// Width of paragraphs on the terminal.
const LINE_WIDTH: usize = 110;

impl Document {
    /// A table of what is said of each thing.
    pub(crate) fn of_lines(lines: impl IntoIterator<Item = (impl Into<String>, impl Into<String>)>) -> Self {
        Self { blocks: vec![Block::Table(Table::of_lines(lines))] }
    }

    /// The same without its first block, if that is a heading: the title of what the document is part of.
    #[must_use]
    pub(crate) fn without_title(mut self) -> Self {
        if matches!(self.blocks.first(), Some(Block::Heading(_))) {
            self.blocks.remove(0);
        }
        self
    }

    /// Adds paragraphs.
    #[must_use]
    pub(crate) fn paragraphs(self, texts: impl IntoIterator<Item = String>) -> Self {
        texts.into_iter().fold(self, Self::paragraph)
    }

    /// Adds a paragraph.
    #[must_use]
    pub(crate) fn paragraph(mut self, text: impl Into<String>) -> Self {
        self.blocks.push(Block::Paragraph(text.into()));
        self
    }

    /// The document for the terminal, without its pictures.
    pub fn text(&self) -> String {
        let mut text = String::new();
        for block in &self.blocks {
            // Writing to a string cannot fail.
            let _ = match block {
                Block::Heading(heading) => {
                    writeln!(text, "{heading}\n{}\n", "-".repeat(heading.chars().count()))
                }
                Block::Paragraph(paragraph) => writeln!(text, "{}\n", wrapped(paragraph)),
                Block::Table(table) => writeln!(text, "{}", table.text()),
                Block::Picture(..) => Ok(()),
            };
        }
        text
    }

    /// The document in Markdown; its pictures are files in the same folder.
    pub fn markdown(&self) -> String {
        let mut text = String::new();
        for (index, block) in self.blocks.iter().enumerate() {
            let _ = match block {
                Block::Heading(heading) => {
                    writeln!(text, "{} {heading}\n", if index == 0 { "#" } else { "##" })
                }
                Block::Paragraph(paragraph) => writeln!(text, "{}\n", paragraph.replace('*', "\\*")),
                Block::Table(table) => writeln!(text, "{}", table.markdown()),
                Block::Picture(title, file) => writeln!(text, "![{title}]({file})\n"),
            };
        }
        text
    }
}

/// `paragraph` in lines of at most [`LINE_WIDTH`], broken at spaces.
fn wrapped(paragraph: &str) -> String {
    textwrap::fill(paragraph, Options::new(LINE_WIDTH).word_splitter(WordSplitter::NoHyphenation))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_text_and_markdown() {
        let mut table = Table::new(&["a", "b"]);
        table.push(vec!["1".to_owned(), "2".to_owned()]);
        let picture = Block::Picture("Rate".to_owned(), "rate.svg".to_owned());
        let blocks = vec![
            Block::Heading("Head".to_owned()),
            Block::Paragraph("x * y".to_owned()),
            Block::Table(table),
            picture,
        ];
        let document = Document { blocks };
        assert_eq!(document.text(), "Head\n----\n\nx * y\n\na  b\n-  -\n1  2\n\n");
        assert_eq!(
            document.markdown(),
            "# Head\n\nx \\* y\n\n| a | b |\n| - | - |\n| 1 | 2 |\n\n![Rate](rate.svg)\n\n"
        );
    }

    #[test]
    fn exact_wrapping_keeps_every_word() {
        let text = "word ".repeat(100);
        let wrapped = wrapped(&text);
        assert!(wrapped.lines().all(|line| line.len() <= LINE_WIDTH));
        assert_eq!(wrapped.split_whitespace().count(), 100);
    }
}

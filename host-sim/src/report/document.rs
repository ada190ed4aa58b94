//! A document of headings, paragraphs, tables and pictures, in plain text and in Markdown.

use std::fmt::Write as _;

/// A report, ready to be written either way.
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

/// A table of text.
#[derive(Clone, Debug)]
pub(crate) struct Table {
    header: Vec<String>,
    rows: Vec<Vec<String>>,
}

/// Width of paragraphs on the terminal.
const LINE_WIDTH: usize = 110;

impl Table {
    pub(crate) fn new(header: &[&str]) -> Self {
        Self { header: header.iter().map(|&cell| cell.to_owned()).collect(), rows: Vec::new() }
    }

    /// Adds a row of as many cells as the header has.
    pub(crate) fn push(&mut self, row: Vec<String>) {
        self.rows.push(row);
    }

    /// Lines with cells padded to their column's width.
    fn padded(&self) -> Vec<Vec<String>> {
        let all = || std::iter::once(&self.header).chain(&self.rows);
        let width =
            |column: usize| all().filter_map(|row| row.get(column)).map(|cell| cell.chars().count()).max();
        let widths: Vec<usize> = (0..self.header.len()).map(|column| width(column).unwrap_or(0)).collect();
        all()
            .map(|row| row.iter().zip(&widths).map(|(cell, &width)| format!("{cell:width$}")).collect())
            .collect()
    }
}

impl Document {
    /// For the terminal; pictures are left out.
    pub fn text(&self) -> String {
        let mut text = String::new();
        for block in &self.blocks {
            // Writing to a string cannot fail.
            let _ = match block {
                Block::Heading(heading) => {
                    writeln!(text, "{heading}\n{}\n", "-".repeat(heading.chars().count()))
                }
                Block::Paragraph(paragraph) => writeln!(text, "{}\n", wrapped(paragraph)),
                Block::Table(table) => {
                    for (index, line) in table.padded().iter().enumerate() {
                        let _ = writeln!(text, "{}", line.join("  ").trim_end());
                        if index == 0 {
                            let rule: Vec<String> =
                                line.iter().map(|cell| "-".repeat(cell.chars().count())).collect();
                            let _ = writeln!(text, "{}", rule.join("  "));
                        }
                    }
                    writeln!(text)
                }
                Block::Picture(..) => Ok(()),
            };
        }
        text
    }

    /// For keeping, with the pictures beside it.
    pub fn markdown(&self) -> String {
        let mut text = String::new();
        for (index, block) in self.blocks.iter().enumerate() {
            let _ = match block {
                Block::Heading(heading) => {
                    writeln!(text, "{} {heading}\n", if index == 0 { "#" } else { "##" })
                }
                Block::Paragraph(paragraph) => writeln!(text, "{}\n", paragraph.replace('*', "\\*")),
                Block::Table(table) => {
                    for (index, line) in table.padded().iter().enumerate() {
                        let _ = writeln!(text, "| {} |", line.join(" | ").replace('*', "\\*"));
                        if index == 0 {
                            let rule: Vec<String> =
                                line.iter().map(|cell| "-".repeat(cell.chars().count())).collect();
                            let _ = writeln!(text, "| {} |", rule.join(" | "));
                        }
                    }
                    writeln!(text)
                }
                Block::Picture(title, file) => writeln!(text, "![{title}]({file})\n"),
            };
        }
        text
    }
}

/// `text` in lines of at most [`LINE_WIDTH`], broken at spaces.
fn wrapped(text: &str) -> String {
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        let line = lines.last_mut().filter(|line| line.len() + 1 + word.len() <= LINE_WIDTH);
        match line {
            Some(line) if line.is_empty() => line.push_str(word),
            Some(line) => {
                line.push(' ');
                line.push_str(word);
            }
            None => lines.push(word.to_owned()),
        }
    }
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn document() -> Document {
        let mut table = Table::new(&["a", "bcd"]);
        table.push(vec!["1234*".to_owned(), "5".to_owned()]);
        let picture = Block::Picture("Rate".to_owned(), "rate.svg".to_owned());
        Document { blocks: vec![Block::Heading("Head".to_owned()), Block::Table(table), picture] }
    }

    #[test]
    fn exact_text_and_markdown() {
        assert_eq!(document().text(), "Head\n----\n\na      bcd\n-----  ---\n1234*  5\n\n");
        assert_eq!(
            document().markdown(),
            "# Head\n\n| a     | bcd |\n| ----- | --- |\n| 1234\\* | 5   |\n\n![Rate](rate.svg)\n\n"
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

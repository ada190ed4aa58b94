//! A table of text, its cells padded to their columns, in plain text and in Markdown.
//!
//! Every table that a command prints or writes is laid out here.

/// A header, and rows of as many cells.
#[derive(Clone, Debug)]
pub(crate) struct Table {
    header: Vec<String>,
    rows: Vec<Vec<String>>,
}

/// What stands before, between and after the cells of a line.
struct Separators {
    before: &'static str,
    between: &'static str,
    after: &'static str,
}

impl Table {
    /// A table without rows.
    pub(crate) fn new(header: &[&str]) -> Self {
        Self { header: header.iter().map(|&cell| cell.to_owned()).collect(), rows: Vec::new() }
    }

    /// Adds a row of as many cells as the header has.
    pub(crate) fn push(&mut self, row: Vec<String>) {
        self.rows.push(row);
    }

    /// The lines for the terminal.
    pub(crate) fn text(&self) -> String {
        self.lines(&Separators { before: "", between: "  ", after: "" })
    }

    /// The lines in Markdown.
    pub(crate) fn markdown(&self) -> String {
        self.lines(&Separators { before: "| ", between: " | ", after: " |" }).replace('*', "\\*")
    }

    /// The header, a rule and the rows, one a line.
    fn lines(&self, separators: &Separators) -> String {
        let Separators { before, between, after } = separators;
        let mut lines = self.padded();
        let rule = self.widths().map(|width| "-".repeat(width)).collect();
        lines.insert(1, rule);
        let line = |cells: &Vec<String>| {
            let cells = cells.join(between);
            format!("{before}{cells}{after}").trim_end().to_owned() + "\n"
        };
        lines.iter().map(line).collect()
    }

    /// The header and the rows, each cell as wide as its column.
    fn padded(&self) -> Vec<Vec<String>> {
        let pad = |(cell, width): (&String, usize)| format!("{cell:width$}");
        self.all().map(|row| row.iter().zip(self.widths()).map(pad).collect()).collect()
    }

    /// Characters of the longest cell of each column.
    fn widths(&self) -> impl Iterator<Item = usize> {
        let width = |column: usize| {
            self.all().filter_map(move |row| row.get(column)).map(|cell| cell.chars().count()).max()
        };
        (0..self.header.len()).map(move |column| width(column).unwrap_or(0))
    }

    fn all(&self) -> impl Iterator<Item = &Vec<String>> {
        std::iter::once(&self.header).chain(&self.rows)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_text_and_markdown() {
        let mut table = Table::new(&["a", "bcd"]);
        table.push(vec!["1234*".to_owned(), "5".to_owned()]);
        assert_eq!(table.text(), "a      bcd\n-----  ---\n1234*  5\n");
        assert_eq!(table.markdown(), "| a     | bcd |\n| ----- | --- |\n| 1234\\* | 5   |\n");
    }
}

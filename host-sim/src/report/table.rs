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

    /// A table without header of what is said of each thing.
    pub(crate) fn of_lines(lines: impl IntoIterator<Item = (impl Into<String>, impl Into<String>)>) -> Self {
        let mut table = Self::new(&["", ""]);
        lines.into_iter().for_each(|(what, said)| table.push(vec![what.into(), said.into()]));
        table
    }

    /// Adds a row of as many cells as the header has. What is no number is a dash.
    pub(crate) fn push(&mut self, row: Vec<String>) {
        let shown = |cell: String| {
            if cell.trim_start_matches(['+', '-']).starts_with("NaN") { "-".to_owned() } else { cell }
        };
        self.rows.push(row.into_iter().map(shown).collect());
    }

    /// The columns but the one with the heading `left_out`.
    pub(crate) fn without(self, left_out: &str) -> Self {
        let place = self.header.iter().position(|heading| heading == left_out);
        self.columns(|column| Some(column) != place)
    }

    /// Narrower tables of the same rows, each with the first `keys` columns: one begins at each of the headings `at`.
    pub(crate) fn cut(&self, keys: usize, at: &[&str]) -> Vec<Self> {
        let part_of = |column: usize| {
            let headings = self.header.iter().take(column + 1);
            headings.filter(|heading| at.contains(&heading.as_str())).count()
        };
        (0..=at.len()).map(|part| self.columns(|column| column < keys || part_of(column) == part)).collect()
    }

    /// The columns whose place, from 0, is `chosen`.
    fn columns(&self, chosen: impl Fn(usize) -> bool) -> Self {
        let of = |row: &Vec<String>| {
            let cells = row.iter().enumerate().filter(|(column, _)| chosen(*column));
            cells.map(|(_, cell)| cell.clone()).collect()
        };
        Self { header: of(&self.header), rows: self.rows.iter().map(of).collect() }
    }

    /// The cells of the header.
    pub(crate) fn header(&self) -> &[String] {
        &self.header
    }

    /// The rows.
    pub(crate) fn rows(&self) -> &[Vec<String>] {
        &self.rows
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
        table.push(vec!["1234*".to_owned(), "NaN".to_owned()]);
        assert_eq!(table.text(), "a      bcd\n-----  ---\n1234*  -\n");
        assert_eq!(table.markdown(), "| a     | bcd |\n| ----- | --- |\n| 1234\\* | -   |\n");
    }

    #[test]
    fn exact_columns_are_left_out_and_a_cut_keeps_the_keys_in_both_parts() {
        let mut table = Table::new(&["key", "a", "b", "c"]);
        table.push(["k", "1", "2", "3"].map(str::to_owned).to_vec());
        assert_eq!(table.clone().without("a").text(), "key  b  c\n---  -  -\nk    2  3\n");
        let parts: Vec<String> = table.cut(1, &["b"]).iter().map(Table::text).collect();
        assert_eq!(parts, ["key  a\n---  -\nk    1\n", "key  b  c\n---  -  -\nk    2  3\n"]);
    }
}

//! A table as plain data, which can be written as text and as CSV. The report's page turns the same table into HTML.

use std::fmt::Write as _;

/// The side of its column to which a cell is aligned in text.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Align {
    /// At the column's left side, as names do.
    Left,
    /// At the column's right side, as numbers do.
    #[default]
    Right,
}

/// A column: its heading, and how wide it is in text.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Column {
    /// The heading.
    pub heading: String,
    /// How many spaces stand before it in text.
    pub gap: usize,
    /// The least width in characters in text; a longer cell takes what it needs.
    pub width: usize,
    /// The side to which the cells are aligned in text.
    pub align: Align,
}

impl Column {
    /// Makes a column of names, which are aligned to the left.
    pub fn left(heading: impl Into<String>, width: usize) -> Column {
        Column { heading: heading.into(), gap: 0, width, align: Align::Left }
    }

    /// Makes a column of numbers, which are aligned to the right.
    pub fn right(heading: impl Into<String>, width: usize) -> Column {
        Column { heading: heading.into(), gap: 0, width, align: Align::Right }
    }

    /// Returns the same column with this many spaces before it.
    #[must_use]
    pub fn after_gap(self, gap: usize) -> Column {
        Column { gap, ..self }
    }
}

/// Headings, and rows of cells that are formatted already. The first column names the rows.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Table {
    /// What the table shows.
    pub caption: String,
    /// The columns, from left to right.
    pub columns: Vec<Column>,
    /// The rows, from top to bottom. A row may have fewer cells than there are columns.
    pub rows: Vec<Vec<String>>,
    /// Paragraphs of text that stand below the table.
    pub notes: Vec<String>,
}

impl Table {
    /// Makes a table without rows, a caption or notes.
    pub fn new(columns: impl IntoIterator<Item = Column>) -> Table {
        Table { columns: columns.into_iter().collect(), ..Table::default() }
    }

    /// Makes a table with these headings for a page or a CSV file, in which columns have no width.
    pub fn headed(headings: impl IntoIterator<Item = impl Into<String>>) -> Table {
        Table::new(headings.into_iter().map(|heading| Column::right(heading, 0)))
    }

    /// Returns the same table with this caption.
    #[must_use]
    pub fn captioned(self, caption: impl Into<String>) -> Table {
        Table { caption: caption.into(), ..self }
    }

    /// Returns the same table with these rows.
    #[must_use]
    pub fn filled(self, rows: impl IntoIterator<Item = Vec<String>>) -> Table {
        Table { rows: rows.into_iter().collect(), ..self }
    }

    /// Returns the same table with these notes.
    #[must_use]
    pub fn noted(self, notes: impl IntoIterator<Item = String>) -> Table {
        Table { notes: notes.into_iter().collect(), ..self }
    }

    /// Returns the same table with the heading `heading` replaced by `other`. A page may word a heading differently.
    #[must_use]
    pub fn renamed(mut self, heading: &str, other: &str) -> Table {
        self.columns.iter_mut().filter(|column| column.heading == heading).for_each(|column| {
            column.heading = other.into();
        });
        self
    }

    /// Returns the same table without the column that has this heading.
    #[must_use]
    pub fn without(mut self, heading: &str) -> Table {
        if let Some(left_out) = self.columns.iter().position(|column| column.heading == heading) {
            self.columns.remove(left_out);
            self.rows.iter_mut().filter(|row| row.len() > left_out).for_each(|row| {
                row.remove(left_out);
            });
        }
        self
    }

    /// Returns the headings and the rows as lines of text, in columns of at least the declared widths. The caller
    /// writes the caption and the notes.
    pub fn text(&self) -> String {
        let headings: Vec<&str> = self.columns.iter().map(|column| column.heading.as_str()).collect();
        self.line(&headings) + &self.body()
    }

    /// Returns the rows as lines of text, without the headings.
    pub fn body(&self) -> String {
        self.rows.iter().map(|row| self.line(&row.iter().map(String::as_str).collect::<Vec<_>>())).collect()
    }

    fn line(&self, cells: &[&str]) -> String {
        let mut line = String::new();
        for (cell, &Column { gap, width, align, .. }) in cells.iter().zip(&self.columns) {
            let _ = match align {
                Align::Left => write!(line, "{:gap$}{cell:<width$}", ""),
                Align::Right => write!(line, "{:gap$}{cell:>width$}", ""),
            };
        }
        line + "\n"
    }

    /// Returns the headings and the rows as comma-separated values. A cell with a comma, a quote or a line break is
    /// quoted.
    pub fn csv(&self) -> String {
        let quoted = |cell: &str| match cell {
            cell if cell.contains([',', '"', '\n', '\r']) => format!("\"{}\"", cell.replace('"', "\"\"")),
            cell => cell.into(),
        };
        let headings = self.columns.iter().map(|column| quoted(&column.heading)).collect::<Vec<_>>();
        let rows = self.rows.iter().map(|row| row.iter().map(|cell| quoted(cell)).collect::<Vec<_>>());
        [headings].into_iter().chain(rows).fold(String::new(), |text, line| text + &line.join(",") + "\n")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Table {
        let columns = [Column::left("name", 6), Column::right("ms", 6), Column::right("x, y", 7)];
        Table::new(columns).filled([vec!["a".into(), "1.50".into(), "say \"1\"".into()], vec!["long name".into()]])
    }

    #[test]
    fn text_keeps_the_columns_widths_and_gaps() {
        assert_eq!(table().text(), "name      ms   x, y\na       1.50say \"1\"\nlong name\n");
        let spaced = Table::new([Column::left("a", 2), Column::right("b", 3).after_gap(2)]);
        assert_eq!(spaced.filled([vec!["1".into(), "2".into()]]).text(), "a     b\n1     2\n");
    }

    #[test]
    fn csv_quotes_what_would_be_read_otherwise() {
        assert_eq!(table().csv(), "name,ms,\"x, y\"\na,1.50,\"say \"\"1\"\"\"\nlong name\n");
    }

    #[test]
    fn a_page_may_leave_out_a_column_and_word_another_differently() {
        let page = table().without("ms").renamed("x, y", "both");
        assert_eq!(page.text(), "name     both\na     say \"1\"\nlong name\n");
        assert_eq!(table().without("none such"), table());
    }
}

//! CSV tables of numbers with named columns.

use std::fmt::{Display, Write as _};
use std::path::Path;

use crate::error::{FormatError, read_text, unfinished_line};

/// Treatment of a damaged line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Damage {
    /// The table is refused.
    Refuse,
    /// The lines before the damage are kept, and a note says so.
    Truncate,
}

impl Damage {
    /// Returns the contents that were read; none after damage that is not refused, with a note that
    /// `what` was left out.
    ///
    /// # Errors
    /// The damage, if it is refused.
    pub fn accept<T, E: Display>(
        self,
        read: Result<T, E>,
        what: &str,
        notes: &mut Vec<String>,
    ) -> Result<Option<T>, E> {
        match read {
            Err(error) if self == Damage::Truncate => {
                notes.push(format!("{error}; {what} left out"));
                Ok(None)
            }
            read => read.map(Some),
        }
    }
}

/// Part of a table that is left out after a damaged line.
pub(crate) const REST: &str = "this line and all after it were";

/// Appends numbers to a line of a table, each after a comma; they are read back exactly.
pub(crate) fn append_cells(line: &mut String, numbers: impl IntoIterator<Item = f64>) {
    for number in numbers {
        // Writing to a string cannot fail.
        let _ = write!(line, ",{number:?}");
    }
}

/// Table of numbers; an empty cell is NaN.
#[derive(Clone, Debug, Default)]
pub struct Table {
    names: Vec<String>,
    columns: Vec<Vec<f64>>,
}

impl Table {
    /// Reads a table. An unfinished last line is left out and noted.
    ///
    /// # Errors
    /// [`FormatError`] with the first damaged line.
    pub fn read(file: &Path, notes: &mut Vec<String>) -> Result<Table, FormatError> {
        Table::read_with(file, notes, Damage::Refuse)
    }

    /// Reads a table with the given treatment of a damaged line.
    ///
    /// # Errors
    /// [`FormatError`] if the file or its header is unreadable, or with the first damaged line if
    /// damage is refused.
    pub fn read_with(
        file: &Path,
        notes: &mut Vec<String>,
        damage: Damage,
    ) -> Result<Table, FormatError> {
        let mut text = read_text(file)?;
        let complete = text.rfind('\n').map_or(0, |end| end + 1);
        let unfinished = !text[complete..].trim().is_empty() && complete > 0;
        if unfinished {
            notes.push(unfinished_line(file, text.lines().count()));
            text.truncate(complete);
        }
        Table::parse(file, &text, notes, damage)
    }

    /// Reads a table whose last line is whole, although it may lack its line break.
    ///
    /// # Errors
    /// [`FormatError`] with the first damaged line.
    pub fn read_whole(file: &Path) -> Result<Table, FormatError> {
        Table::parse(file, &read_text(file)?, &mut Vec::new(), Damage::Refuse)
    }

    fn parse(
        file: &Path,
        text: &str,
        notes: &mut Vec<String>,
        damage: Damage,
    ) -> Result<Table, FormatError> {
        let mut reader = csv::ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .trim(csv::Trim::All)
            .from_reader(text.as_bytes());
        let mut records = reader.records();
        let damaged = |record: &csv::StringRecord, what: String| {
            let line = record.position().map_or(1, csv::Position::line);
            FormatError::line(file, line as usize, what)
        };
        let broken = |error: csv::Error| {
            let line = error.position().map_or(1, csv::Position::line);
            FormatError::line(file, line as usize, error.to_string())
        };
        let header = records
            .next()
            .ok_or_else(|| FormatError::line(file, 1, "no header"))?
            .map_err(broken)?;
        let names: Vec<String> = header.iter().map(str::to_owned).collect();
        if names.iter().any(String::is_empty) {
            return Err(damaged(&header, "a column without a name".to_owned()));
        }
        if let Some(n) = (1..names.len()).find(|n| names[..*n].contains(&names[*n])) {
            return Err(damaged(&header, format!("two columns of the name '{}'", names[n])));
        }
        let mut columns = vec![Vec::new(); names.len()];
        for record in records {
            let row = record.map_err(broken).and_then(|record| {
                if record.len() != names.len() {
                    let what = format!("{} values under {} columns", record.len(), names.len());
                    return Err(damaged(&record, what));
                }
                let number = |(cell, name): (&str, &String)| match cell {
                    "" => Ok(f64::NAN),
                    number => number.parse().map_err(|_| {
                        damaged(&record, format!("'{cell}' under '{name}' is not a number"))
                    }),
                };
                record.iter().zip(&names).map(number).collect::<Result<Vec<f64>, _>>()
            });
            let Some(row) = damage.accept(row, REST, notes)? else { break };
            columns.iter_mut().zip(row).for_each(|(column, v)| column.push(v));
        }
        Ok(Table { names, columns })
    }

    /// Returns the names of the columns.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Returns the number of rows.
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, Vec::len)
    }

    /// Returns a column by name.
    pub fn column(&self, name: &str) -> Option<&[f64]> {
        let index = self.names.iter().position(|n| n == name)?;
        self.columns.get(index).map(Vec::as_slice)
    }
}

//! Standard output and standard error. Closing a pipe early (`| head -1`) neither stops a command
//! nor changes its exit code.

use std::io::{ErrorKind, Write};
use std::ops::Range;
use std::path::Path;

use comfy_table::{CellAlignment, Table, presets};

use crate::exit::Exit;

/// Prints a line on standard output.
pub fn print(text: &str) -> Result<(), Exit> {
    write(format!("{text}\n").as_bytes())
}

/// Writes bytes to standard output; a closed pipe is not an error.
pub fn write(bytes: &[u8]) -> Result<(), Exit> {
    let mut out = std::io::stdout().lock();
    match out.write_all(bytes).and_then(|()| out.flush()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        done => Ok(done?),
    }
}

/// Prints a line on standard error and ignores failures, on which `eprintln!` would panic.
pub fn say(text: std::fmt::Arguments) {
    let line = format!("{text}\n");
    let _ = std::io::stderr().write_all(line.as_bytes());
}

/// Returns a path as one word of a shell command.
pub fn shell_word(path: &Path) -> String {
    let text = path.display().to_string();
    let plain = |c: char| c.is_alphanumeric() || "/._-+=:,@%".contains(c);
    if text.chars().all(plain) { text } else { format!("'{}'", text.replace('\'', "'\\''")) }
}

#[cfg(test)]
#[test]
fn paths_are_one_word_of_a_shell() {
    let word = |path: &str| shell_word(Path::new(path));
    assert_eq!(word("runs/fall_2.a"), "runs/fall_2.a");
    assert_eq!(word("my runs/it's"), r"'my runs/it'\''s'");
}

/// Returns names and values as a text of two columns.
pub fn columns(rows: &[(&str, String)]) -> String {
    let width = rows.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
    let line = |(name, value): &(&str, String)| format!("{name:width$}  {value}");
    rows.iter().map(line).collect::<Vec<_>>().join("\n")
}

/// Returns rows of cells as a Markdown table, with the `numbers` among the columns at the right.
pub fn markdown<'a>(
    header: impl IntoIterator<Item = &'a str>,
    rows: impl IntoIterator<Item = Vec<String>>,
    numbers: Range<usize>,
) -> Table {
    let mut table = Table::new();
    table.load_style(presets::ASCII_MARKDOWN);
    table.set_header(header.into_iter().map(str::to_owned).collect::<Vec<_>>());
    table.add_rows(rows);
    for column in table.column_iter_mut().skip(numbers.start).take(numbers.len()) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}

/// Formats a line for [`say`].
macro_rules! tell {
    ($($arg:tt)*) => {
        $crate::out::say(format_args!($($arg)*))
    };
}
pub(crate) use tell;

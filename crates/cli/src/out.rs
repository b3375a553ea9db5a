//! Standard output and standard error. Closing a pipe early (`| head -1`) neither stops a command
//! nor changes its exit code.

use std::io::{ErrorKind, Write};

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

/// Returns names and values as a text of two columns.
pub fn columns(rows: &[(&str, String)]) -> String {
    let width = rows.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
    let line = |(name, value): &(&str, String)| format!("{name:width$}  {value}");
    rows.iter().map(line).collect::<Vec<_>>().join("\n")
}

/// Formats a line for [`say`].
macro_rules! tell {
    ($($arg:tt)*) => {
        $crate::out::say(format_args!($($arg)*))
    };
}
pub(crate) use tell;

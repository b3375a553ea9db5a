//! Standard output and standard error, which may be closed at any time (`| head -1`).

use std::io::{ErrorKind, Write};

use crate::exit::Exit;

/// One line (or more) on standard output.
pub fn print(text: &str) -> Result<(), Exit> {
    write(format!("{text}\n").as_bytes())
}

/// Bytes on standard output. A reader that has gone has what it wanted: the work goes on.
pub fn write(bytes: &[u8]) -> Result<(), Exit> {
    let mut out = std::io::stdout().lock();
    match out.write_all(bytes).and_then(|()| out.flush()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        done => Ok(done?),
    }
}

/// A line on standard error. The work goes on where it cannot be written; `eprintln!` panics there.
pub fn say(text: std::fmt::Arguments) {
    let line = format!("{text}\n");
    let _ = std::io::stderr().write_all(line.as_bytes());
}

/// Formats a line for [`say`].
macro_rules! tell {
    ($($arg:tt)*) => {
        $crate::out::say(format_args!($($arg)*))
    };
}
pub(crate) use tell;

//! `grainwake report`.

use grainwake_report::{ReportError, render};

use crate::args::ReportArgs;
use crate::exit::{BAD_INPUT, Exit, IO};
use crate::print;

/// Draws the figures and the page of a run folder.
pub fn report(args: &ReportArgs) -> Result<(), Exit> {
    let done = render(&args.run).map_err(|error| {
        let code = match &error {
            ReportError::NotARun(_) | ReportError::Line { .. } => BAD_INPUT,
            _ => IO,
        };
        Exit::new(code, error.to_string())
    })?;
    for note in &done.notes {
        eprintln!("note: {note}");
    }
    print(&format!(
        "{} ({} figures)",
        done.page.display(),
        done.png.len()
    ))
}

//! `grainwake report`.

use grainwake_report::{ReportError, render};
use grainwake_study::{Analysis, Plan};

use crate::args::ReportArgs;
use crate::exit::{BAD_INPUT, Exit, IO};
use crate::{print, tell};

impl From<ReportError> for Exit {
    fn from(error: ReportError) -> Exit {
        let code = if error.is_input_output() { IO } else { BAD_INPUT };
        Exit::new(code, error.to_string())
    }
}

/// Writes the figures and the page of a run folder or a study folder.
pub fn report(args: &ReportArgs) -> Result<(), Exit> {
    if Plan::exists_in(&args.run) {
        let done = grainwake_study::render(&args.run)?;
        for note in &done.notes {
            tell!("note: {note}");
        }
        let (plan, _) = Plan::read_or_rebuild(&args.run)?;
        if done.png.is_empty() && plan.analysis == Analysis::default() {
            tell!("note: no figures: no run has results to draw");
        }
        let (finished, all) = done.runs;
        return print(&format!(
            "{} ({} figures, {finished} of {all} runs finished)",
            done.page.display(),
            done.png.len()
        ));
    }
    let done = render(&args.run)?;
    for note in &done.notes {
        tell!("note: {note}");
    }
    print(&format!("{} ({} figures)", done.page.display(), done.png.len()))
}

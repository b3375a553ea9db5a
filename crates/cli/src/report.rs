//! `grainwake report`.

use grainwake_report::{ReportError, render, write_film};
use grainwake_run::number_format::{number, quantity, size};
use grainwake_study::{Analysis, Plan};

use crate::args::ReportArgs;
use crate::exit::{BAD_INPUT, Exit, IO};
use crate::out::shell_word;
use crate::progress::count;
use crate::{print, tell};

impl From<ReportError> for Exit {
    fn from(error: ReportError) -> Exit {
        let code = if error.is_input_output() { IO } else { BAD_INPUT };
        let remedy = "give a folder that `grainwake run` or `grainwake study` has written";
        let help = matches!(error, ReportError::NotARun(_)).then_some(remedy);
        Exit::with_hint(code, error, help)
    }
}

/// Writes the figures and the page of a run folder or a study folder, or the film of a run folder.
pub fn report(args: &ReportArgs) -> Result<(), Exit> {
    let study = Plan::exists_in(&args.run);
    if args.film && study {
        return Err(Exit::refused(
            format!("{} is a study folder; a film shows one run", args.run.display()),
            format!("give a run folder, for example {}", args.run.join("runs/NAME").display()),
        ));
    }
    if args.film {
        return film(args);
    }
    if study {
        let done = grainwake_study::render(&args.run)?;
        done.notes.iter().for_each(|note| tell!("note: {note}"));
        let (plan, _) = Plan::read_or_rebuild(&args.run)?;
        if done.png.is_empty() && plan.analysis == Analysis::default() {
            tell!("note: no figures: no run has results to draw");
        }
        let (finished, all) = done.runs;
        return print(&format!(
            "{} ({}, {finished} of {all} runs finished)",
            done.page.display(),
            count(done.png.len(), "figure")
        ));
    }
    let done = render(&args.run)?;
    done.notes.iter().for_each(|note| tell!("note: {note}"));
    print(&format!("{} ({})", done.page.display(), count(done.png.len(), "figure")))
}

/// Rounds a value to three significant digits.
fn three_digits(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}

/// Writes the film of a run folder.
fn film(args: &ReportArgs) -> Result<(), Exit> {
    let film = write_film(&args.run)?;
    film.notes.iter().for_each(|note| tell!("note: {note}"));
    let [width, height] = film.size;
    let interval = three_digits(film.interval);
    tell!(
        "{} pictures, {} s each, {} of the run apart ({} times slower than the run)",
        film.frames,
        film.delay,
        quantity(interval, "s"),
        number(three_digits(film.delay / film.interval))
    );
    tell!(
        "video: ffmpeg -framerate {:.4} -i {} -pix_fmt yuv420p film.mp4",
        1.0 / film.delay,
        shell_word(&film.folder.join("frame-%04d.png"))
    );
    print(&format!(
        "{} ({width} x {height} pixels, {})",
        film.file.display(),
        size(film.bytes as u64)
    ))
}

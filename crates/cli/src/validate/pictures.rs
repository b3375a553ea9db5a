//! Saved figures: `figures/SUITE-NAME.png` and `.svg`, and a page that lists them.

use std::path::Path;

use grainwake_formats::disk;
use grainwake_plot::{Figure, plain};
use grainwake_report::{write_figure, write_file};
use grainwake_validation::Suite;

use super::saved::Saved;
use crate::exit::Exit;
use crate::tell;

/// Draws the figures of `suites` into `folder/figures`, from the runs below `output` and the
/// `saved` results, and returns their number. Omissions are listed on standard error; an incomplete
/// figure does not replace an existing one.
pub fn add(folder: &Path, suites: &[Suite], output: &Path, saved: &Saved) -> Result<usize, Exit> {
    let place = folder.join("figures");
    disk::create_folder(&place).map_err(Exit::at(&place))?;
    let mut count = 0;
    for suite in suites {
        for figure in &suite.figures {
            let name = format!("{}-{}", suite.name, figure.name);
            let drawn = figure.draw(&output.join(&suite.name), |run, quantity| {
                saved.value(&suite.name, run, quantity)
            });
            if !drawn.notes.is_empty() && place.join(format!("{name}.png")).is_file() {
                tell!(
                    "figure {name}: not replaced, because the new one would lack: {}; delete it to draw it again",
                    drawn.notes.join("; ")
                );
                continue;
            }
            if !drawn.notes.is_empty() {
                tell!("figure {name}: left out: {}", drawn.notes.join("; "));
            }
            let Some(drawing) = drawn.drawing else {
                tell!("figure {name}: not drawn, no run has data for it");
                continue;
            };
            let title = figure.title.as_str();
            write_figure(&place, Figure::new(name, title, figure.description(), drawing))?;
            count += 1;
        }
    }
    Ok(count)
}

/// Writes `folder/figures/README.md` with the existing figures of `suites`.
pub fn list(folder: &Path, suites: &[Suite]) -> Result<(), Exit> {
    let place = folder.join("figures");
    let mut text = String::from("# Figures of the validations\n");
    for suite in suites {
        let there = |name: &str| place.join(name).is_file();
        for figure in &suite.figures {
            let file = format!("{}-{}.png", suite.name, figure.name);
            if there(&file) {
                let (title, caption) = (plain(&figure.title), plain(&figure.description()));
                text += &format!("\n## {title}\n\n![{title}]({file})\n\n{caption}\n");
            }
        }
    }
    let page = place.join("README.md");
    write_file(&page, text.as_bytes()).map_err(Exit::at(&page))
}

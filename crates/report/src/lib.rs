//! Figures and pages from run folders.
//!
//! [`render`] reads the files of one run folder (never the simulation) and writes into it
//! `figures/*.png`, `figures/*.svg` and one self-contained `report.html`. The same folder gives the
//! same bytes. Each figure is described once and written as SVG and, in an embedded font, as PNG.
//!
//! A run that was interrupted still gives a report of what is there, and says so. Damaged tables and
//! logs are errors that name the file and the line; pictures (`slices/`, `grains/`) that cannot be
//! read are left out and listed on the page.

mod error;
pub mod figure;
mod page;
pub mod phases;
pub mod run_folder;
pub mod story;
#[cfg(test)]
mod testing;

use std::path::{Path, PathBuf};

pub use error::ReportError;
pub use page::STYLE;

use figure::Figure;
use run_folder::RunFolder;
use story::Story;

/// What was written.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Rendered {
    /// The page.
    pub page: PathBuf,
    /// The figures as PNG, in the order of the page.
    pub png: Vec<PathBuf>,
    /// The figures as SVG, in the same order.
    pub svg: Vec<PathBuf>,
    /// What was missing or had to be left out; also on the page.
    pub notes: Vec<String>,
    /// Whether the run came to its end.
    pub finished: bool,
}

/// A run folder with what it tells and its figures; nothing is written.
pub struct Told {
    /// The run folder.
    pub run: RunFolder,
    /// What it tells.
    pub story: Story,
    /// Its figures, in the order of the page.
    pub figures: Vec<Figure>,
    /// What was missing or had to be left out.
    pub notes: Vec<String>,
}

/// Reads a run folder and draws its figures.
pub fn tell(run_dir: &Path) -> Result<Told, ReportError> {
    let mut run = RunFolder::open(run_dir)?;
    let mut notes = std::mem::take(&mut run.notes);
    let bodies = figure::bodies(&run, &mut notes);
    run.facts.add_diameters(
        bodies
            .iter()
            .filter_map(|(grain, body)| Some((*grain, body.diameter()?))),
    );
    let story = Story::of(&run);
    let figures = figure::all(&run, &story, bodies, &mut notes);
    Ok(Told {
        run,
        story,
        figures,
        notes,
    })
}

/// Draws the figures and the page of a run folder.
pub fn render(run_dir: &Path) -> Result<Rendered, ReportError> {
    let Told {
        run,
        story,
        figures,
        notes,
    } = tell(run_dir)?;
    let folder = run_dir.join("figures");
    std::fs::create_dir_all(&folder).map_err(|source| ReportError::Write {
        file: folder.clone(),
        source,
    })?;
    let mut out = Rendered {
        page: run_dir.join("report.html"),
        finished: run.finished(),
        ..Rendered::default()
    };
    let with_svg = |figure: Figure| {
        let svg = figure.svg();
        (figure, svg)
    };
    let figures: Vec<(Figure, String)> = figures.into_iter().map(with_svg).collect();
    for (figure, svg) in &figures {
        let draw = |what| ReportError::Draw {
            figure: figure.name.to_owned(),
            what,
        };
        let png = figure.drawing.to_png().map_err(draw)?;
        out.png
            .push(write(folder.join(format!("{}.png", figure.name)), &png)?);
        out.svg.push(write(
            folder.join(format!("{}.svg", figure.name)),
            svg.as_bytes(),
        )?);
    }
    let page = page::page(&run, &story, &figures, &notes);
    out.page = write(out.page, page.as_bytes())?;
    out.notes = notes;
    Ok(out)
}

/// Writes a file under a temporary name first, so that a reader never finds half of it.
pub fn write(file: PathBuf, bytes: &[u8]) -> Result<PathBuf, ReportError> {
    let mut name = file.clone().into_os_string();
    name.push(".tmp");
    let temporary = PathBuf::from(name);
    let written =
        std::fs::write(&temporary, bytes).and_then(|()| std::fs::rename(&temporary, &file));
    match written {
        Ok(()) => Ok(file),
        Err(source) => Err(ReportError::Write { file, source }),
    }
}

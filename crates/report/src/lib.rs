//! Figures and pages from run folders.
//!
//! [`render`] reads the files of one run folder (never the simulation) and writes into it
//! `figures/*.png`, `figures/*.svg` and one self-contained `report.html`. Equal folders result in
//! equal bytes. Each figure is described once and written as SVG and, in an embedded font, as PNG.
//!
//! The report of an interrupted run shows the results up to the interruption and states it. Damaged
//! tables and logs are errors that name the file and the line. Pictures (`slices/`, `grains/`) that
//! cannot be read are omitted and listed on the page.

mod error;
pub mod features;
pub mod figure;
mod files;
mod film;
pub mod grain_sheet;
pub mod html;
mod page;
pub mod phases;
pub mod run_folder;
#[cfg(test)]
mod testing;
pub mod thumbnail;

use std::path::{Path, PathBuf};

pub use error::ReportError;
pub use files::{WrittenFigure, remove_earlier_figures, write_figure, write_file};
pub use film::{Film, write_film};
use grainwake_formats::disk;
use grainwake_plot::Figure;

use error::Written as _;
use features::RunFeatures;
use figure::{GrainSurface, Surfaces};
use run_folder::RunFolder;

/// Files of a report.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ReportFiles {
    /// HTML page.
    pub page: PathBuf,
    /// Figures as PNG, in page order.
    pub png: Vec<PathBuf>,
    /// Figures as SVG, in page order.
    pub svg: Vec<PathBuf>,
    /// Missing or omitted parts; also listed on the page.
    pub notes: Vec<String>,
    /// Whether the run reached its end.
    pub finished: bool,
}

/// A run folder with its derived features and its figures.
pub struct RunReport {
    /// Run folder.
    pub run: RunFolder,
    /// Features derived from the tables.
    pub features: RunFeatures,
    /// Figures, in page order.
    pub figures: Vec<Figure>,
    /// Missing or omitted parts.
    pub notes: Vec<String>,
}

/// Reads a run folder and draws its figures, without writing.
///
/// # Errors
/// If the folder holds no run, or a table or log cannot be read.
pub fn read_report(run_dir: &Path) -> Result<RunReport, ReportError> {
    let (run, surfaces, mut notes) = read_with_surfaces(run_dir)?;
    let features = RunFeatures::of(&run);
    let figures = figure::all(&run, &features, surfaces, &mut notes);
    Ok(RunReport { run, features, figures, notes })
}

/// Reads a run folder with the surfaces of its grains, by index, and its notes.
fn read_with_surfaces(run_dir: &Path) -> Result<(RunFolder, Surfaces, Vec<String>), ReportError> {
    let mut run = RunFolder::open(run_dir)?;
    let mut notes = std::mem::take(&mut run.notes);
    let surfaces = figure::surfaces(&run, &mut notes);
    let diameter = |(grain, body): (&usize, &GrainSurface)| Some((*grain, body.diameter()?));
    run.facts.add_diameters(surfaces.iter().filter_map(diameter));
    Ok((run, surfaces, notes))
}

/// Writes the figures and the page of a run folder.
///
/// # Errors
/// If the folder holds no run, a table or log cannot be read, or a file cannot be written.
pub fn render(run_dir: &Path) -> Result<ReportFiles, ReportError> {
    let RunReport { run, features, figures, notes } = read_report(run_dir)?;
    let folder = run_dir.join("figures");
    disk::create_folder(&folder).written(&folder)?;
    let figures = figures.into_iter().zip(1..);
    let figures: Vec<WrittenFigure> = figures
        .map(|(figure, number)| write_figure(&folder, figure.numbered(number)))
        .collect::<Result<_, _>>()?;
    files::remove_earlier_figures(&folder, &figures)?;
    let page = run_dir.join("report.html");
    let text = page::page(&run, &features, &figures, &notes);
    write_file(&page, text.as_bytes()).written(&page)?;
    Ok(ReportFiles {
        page,
        png: figures.iter().map(|f| f.png_file.clone()).collect(),
        svg: figures.iter().map(|f| f.svg_file.clone()).collect(),
        notes,
        finished: run.finished(),
    })
}

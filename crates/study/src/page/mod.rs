//! The report of a study: figures, analysis, table, and one page.

pub mod figure;
mod html;
mod settling;

use std::path::{Path, PathBuf};

use grainwake_solver::case::Problem;
use rayon::prelude::*;

use crate::analysis::correlation::correlations;
use crate::analysis::verdict::evaluate;
use crate::error::{At, StudyError, write_whole};
use crate::measure::record::{RunRecord, records};
use crate::measure::table::write_tables;
use crate::measure::trajectory::{Trajectory, write_thinned_history};
use crate::page::figure::{FigureData, StudyFigure};
use crate::page::html::Content;
use crate::plan::file::Study;
use crate::plan::{Manifest, Run};

/// What was written.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Rendered {
    /// The page.
    pub page: PathBuf,
    /// The figures as PNG, in the order of the page; an SVG of the same name lies beside each.
    pub png: Vec<PathBuf>,
    /// What was missing or had to be left out; also on the page.
    pub notes: Vec<String>,
    /// Finished runs, and all runs.
    pub runs: (usize, usize),
}

/// Draws the figures, tests the claims and writes the page of a study folder, whatever part of its
/// runs is finished.
///
/// The analysis is that of the study file as it is now, if it is still where it was.
///
/// # Errors
/// If the folder holds no study, its analysis has become wrong, or a file cannot be written.
pub fn render(folder: &Path) -> Result<Rendered, StudyError> {
    let mut manifest = Manifest::read(folder)?;
    let stale = refresh(&mut manifest, folder)?;
    let manifest = manifest;
    let rows = records(&manifest, folder);
    write_tables(&rows, folder)?;
    let done: Vec<(&Run, &RunRecord)> = manifest
        .runs
        .iter()
        .zip(&rows)
        .filter(|(_, row)| row.finished())
        .collect();
    done.par_iter()
        .try_for_each(|(run, row)| write_thinned_history(run, row, folder).map(|_| ()))?;
    let plan = &manifest.analysis.figures;
    let compared = |run: &Run| {
        let here = plan
            .orientations
            .as_ref()
            .zip(plan.compare.as_ref())
            .is_some_and(|(axis, level)| run.levels.get(axis) == Some(level));
        run.member == 0 && (here || plan.reference.as_ref() == Some(&run.model))
    };
    let trajectories = done
        .par_iter()
        .filter(|(run, _)| compared(run))
        .filter_map(|(run, row)| Some((run.name.clone(), Trajectory::read(run, row, folder)?)))
        .collect();
    let findings = evaluate(&manifest.analysis, &rows);
    let correlations = correlations(&manifest.analysis, &rows);
    let text = serde_json::to_string_pretty(
        &serde_json::json!({ "claims": findings, "correlations": correlations }),
    );
    let file = folder.join("analysis.json");
    write_whole(
        &file,
        text.map_err(std::io::Error::from)
            .at("write", &file)?
            .as_bytes(),
    )?;
    let mut notes: Vec<String> = stale.into_iter().collect();
    let data = FigureData {
        manifest: &manifest,
        rows: &rows,
        folder,
        correlations: &correlations,
        trajectories,
    };
    let figures = figure::all(&data, &mut notes);
    let (png, figures) = write_figures(folder, figures)?;
    let out = Rendered {
        page: folder.join("report.html"),
        png,
        runs: (done.len(), rows.len()),
        notes,
    };
    let content = Content {
        manifest: &manifest,
        rows: &rows,
        findings: &findings,
        correlations: &correlations,
        figures: &figures,
        notes: &out.notes,
    };
    write_whole(&out.page, content.html().as_bytes())?;
    Ok(out)
}

/// Takes the analysis from the study file, which may have been changed since the study was run. A wrong
/// analysis is an error; a study file that is wrong otherwise, or whose cases are gone, leaves the analysis
/// as it was, which is returned as a note.
fn refresh(manifest: &mut Manifest, folder: &Path) -> Result<Option<String>, StudyError> {
    if !manifest.study.is_file() {
        return Ok(None);
    }
    let elsewhere = |problem: &Problem| {
        let file = manifest.study.display().to_string();
        problem.place().is_some_and(|(name, ..)| name != file)
    };
    match Study::read(&manifest.study) {
        Ok(now) if now.title == manifest.title && now.analysis != manifest.analysis => {
            manifest.analysis = now.analysis;
            manifest.write(folder)?;
            Ok(None)
        }
        Ok(_) => Ok(None),
        Err(StudyError::Invalid(problems)) if problems.iter().any(elsewhere) => {
            Err(StudyError::Invalid(problems))
        }
        Err(error) => Ok(Some(format!(
            "the analysis is that of the last `grainwake study`, as the study file cannot be used now: {}",
            error.to_string().lines().next().unwrap_or_default()
        ))),
    }
}

type Written = (Vec<PathBuf>, Vec<(StudyFigure, String)>);

fn write_figures(folder: &Path, figures: Vec<StudyFigure>) -> Result<Written, StudyError> {
    let place = folder.join("figures");
    std::fs::create_dir_all(&place).at("create", &place)?;
    let one = |figure: StudyFigure| -> Result<(PathBuf, (StudyFigure, String)), StudyError> {
        let file = place.join(format!("{}.png", figure.name));
        let png = figure
            .drawing
            .to_png()
            .map_err(std::io::Error::other)
            .at("draw", &file)?;
        write_whole(&file, &png)?;
        let svg = figure.svg();
        write_whole(&place.join(format!("{}.svg", figure.name)), svg.as_bytes())?;
        Ok((file, (figure, svg)))
    };
    let written: Vec<_> = figures.into_par_iter().map(one).collect::<Result<_, _>>()?;
    Ok(written.into_iter().unzip())
}

impl html::Content<'_> {
    /// Finished runs.
    pub(crate) fn done(&self) -> usize {
        self.rows.iter().filter(|row| row.finished()).count()
    }
}

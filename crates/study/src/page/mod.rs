//! The report of a study: tables, analysis, figures and one HTML page.

mod document;
pub mod figure;
mod kissing;
mod label;
mod pairs;
mod settling;
mod tables;

use std::path::{Path, PathBuf};

use grainwake_formats::disk;
use grainwake_report::{WrittenFigure, remove_earlier_figures, write_figure};
use grainwake_run::case::Problem;
use rayon::prelude::*;

use self::figure::FigureData;
use crate::analysis::correlation::{Correlation, correlations};
use crate::analysis::factor_mean::factor_means;
use crate::analysis::kissing::{KissingResults, kissing};
use crate::analysis::observation::meets;
use crate::analysis::verdict::{Finding, evaluate};
use crate::error::{At, StudyError, write_file, write_json};
use crate::measure::record::{RunRecord, records};
use crate::measure::table::write_tables;
use crate::measure::trajectory::{Trajectory, write_thinned_history};
use crate::plan::file::Study;
use crate::plan::{Plan, Run};

/// Files of a report.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct StudyReportFiles {
    /// HTML page.
    pub page: PathBuf,
    /// Figures as PNG, in page order; each has an SVG file of the same name.
    pub png: Vec<PathBuf>,
    /// Missing or omitted parts; also listed on the page.
    pub notes: Vec<String>,
    /// Number of finished runs, and of all runs.
    pub runs: (usize, usize),
}

/// Contents of the page.
pub(crate) struct Content<'a> {
    pub plan: &'a Plan,
    pub records: &'a [RunRecord],
    pub findings: &'a [Finding],
    pub correlations: &'a [Correlation],
    pub kissing: Option<&'a KissingResults>,
    pub figures: &'a [WrittenFigure],
    pub notes: &'a [String],
}

impl Content<'_> {
    /// Returns whether any run has measured values of settling grains.
    pub fn has_settling(&self) -> bool {
        self.records.iter().any(|r| r.settling.is_some())
    }

    /// Returns whether any run has measured values of a pair.
    pub fn has_pairs(&self) -> bool {
        self.records.iter().any(|r| r.pair.is_some())
    }

    /// Returns whether every model was run only once.
    pub fn without_ensemble(&self) -> bool {
        self.records.iter().all(|r| r.member == 0)
    }
}

/// Returns a paragraph with a heading in bold.
fn paragraph(heading: &str, text: &maud::Markup) -> maud::Markup {
    maud::html! { p { b { (heading) } ": " (text) } }
}

/// Writes tables, analysis, figures and page of a study folder from its finished runs.
///
/// The analysis is read again from the study file, if that still exists.
///
/// # Errors
/// If the folder holds no study, the analysis file is wrong, or a file cannot be written.
pub fn render(folder: &Path) -> Result<StudyReportFiles, StudyError> {
    let (mut plan, damage) = Plan::read_or_rebuild(folder)?;
    let mut notes: Vec<String> = damage.into_iter().collect();
    notes.extend(refresh_analysis(&mut plan, folder)?);
    let plan = plan;
    let records = records(&plan, folder)?;
    write_tables(&records, folder)?;
    let all = plan.runs.iter().zip(&records);
    let finished: Vec<(&Run, &RunRecord)> = all.filter(|(_, r)| r.finished()).collect();
    finished.par_iter().try_for_each(|(run, record)| write_thinned_history(run, record, folder))?;
    let count = finished.len();
    let (shown_plan, shown_records) = subset(&plan, &records);
    let all = shown_plan.runs.iter().zip(&shown_records);
    let finished: Vec<(&Run, &RunRecord)> = all.filter(|(_, r)| r.finished()).collect();
    let request = &plan.analysis.figures;
    let compared = |run: &Run| {
        let orientation = request.orientations.as_ref().zip(request.compare.as_ref());
        let matches = orientation.is_some_and(|(axis, l)| run.levels.get(axis) == Some(l));
        matches || run.member == 0 && request.reference.as_ref() == Some(&run.model)
    };
    let trajectory = |(run, record): &(&Run, &RunRecord)| {
        Some((run.name.clone(), Trajectory::read(run, record, folder)?))
    };
    let shown = finished.par_iter().filter(|(run, _)| compared(run));
    let trajectories = shown.filter_map(trajectory).collect();
    let findings = evaluate(&plan.analysis, &shown_records);
    let correlations = correlations(&plan.analysis, &shown_records);
    let factor_means = factor_means(&plan.analysis, &shown_records);
    let kissing = kissing(&plan.analysis, &records);
    let analysis = serde_json::json!({
        "where": plan.analysis.when,
        "claims": findings,
        "correlations": correlations,
        "factor_means": factor_means,
        "kissing": kissing,
    });
    write_json(&folder.join("analysis.json"), &analysis)?;
    let data = FigureData {
        plan: &shown_plan,
        whole: &plan,
        records: &shown_records,
        folder,
        findings: &findings,
        correlations: &correlations,
        factor_means: &factor_means,
        kissing: kissing.as_ref(),
        trajectories,
    };
    let figures = figure::all(&data, &mut notes);
    let figure_folder = folder.join("figures");
    disk::create_folder(&figure_folder).at("create", &figure_folder)?;
    let figures: Vec<WrittenFigure> = figures
        .into_par_iter()
        .map(|figure| write_figure(&figure_folder, figure))
        .collect::<Result<_, _>>()?;
    remove_earlier_figures(&figure_folder, &figures)?;
    let content = Content {
        plan: &plan,
        records: &records,
        findings: &findings,
        correlations: &correlations,
        kissing: kissing.as_ref(),
        figures: &figures,
        notes: &notes,
    };
    let page = folder.join("report.html");
    write_file(&page, content.html().as_bytes())?;
    // The page names the remarks with the runs.
    let damaged = records.iter().filter(|record| record.unmeasured());
    let remark = |r: &RunRecord| Some(format!("{}: {}", r.name, r.remark.as_ref()?));
    notes.extend(damaged.filter_map(remark));
    Ok(StudyReportFiles {
        page,
        png: figures.into_iter().map(|figure| figure.png_file).collect(),
        runs: (count, records.len()),
        notes,
    })
}

/// Returns the runs that claims, correlations and figures are about.
fn subset(plan: &Plan, records: &[RunRecord]) -> (Plan, Vec<RunRecord>) {
    let both = plan.runs.iter().zip(records);
    let shown = both.filter(|(_, record)| meets(record, &plan.analysis.when));
    let (runs, records) = shown.map(|(run, record)| (run.clone(), record.clone())).unzip();
    (Plan { runs, ..plan.clone() }, records)
}

/// Replaces title, factors and analysis of the plan by those of the study file, which may have
/// changed.
///
/// A wrong analysis file is an error. If the study file is wrong otherwise, or its cases no longer
/// exist, the analysis stays as it is, and a note is returned.
fn refresh_analysis(plan: &mut Plan, folder: &Path) -> Result<Option<String>, StudyError> {
    if !plan.study.is_file() {
        return Ok(None);
    }
    let in_analysis_file = |problem: &Problem| {
        let file = plan.study.display().to_string();
        problem.place().is_some_and(|(name, ..)| name != file)
    };
    match Study::read(&plan.study) {
        Ok(study) => {
            let old = plan.clone();
            for run in &mut plan.runs {
                if let Some(model) = study.models.iter().find(|model| model.name == run.model) {
                    run.factors.extend(model.factors.clone());
                }
            }
            (plan.title, plan.analysis) = (study.title, study.analysis);
            if *plan != old { plan.write(folder) } else { Ok(()) }.map(|()| None)
        }
        Err(StudyError::Invalid(problems)) if problems.iter().any(in_analysis_file) => {
            Err(StudyError::Invalid(problems))
        }
        Err(error) => Ok(Some(format!(
            "the analysis is that of the last `grainwake study`, because the study file cannot be \
             read: {}",
            error.to_string().lines().next().unwrap_or_default()
        ))),
    }
}

//! Figures of a study, each a drawing with its caption.

mod grains;
mod histories;
mod kissing_time;
mod legend;
mod overview;
mod setup;
mod snapshots;
mod trends;

use std::collections::BTreeMap;
use std::path::Path;

use grainwake_report::figure::svg::Drawing;
use grainwake_report::figure::text;
use grainwake_solver::case::Case;
use grainwake_solver::output::RESOLVED;

use crate::analysis::correlation::Correlation;
use crate::measure::record::RunRecord;
use crate::measure::trajectory::Trajectory;
use crate::plan::{Plan, Run};

/// A figure ready to be written.
pub struct StudyFigure {
    /// File name without its extension.
    pub name: String,
    /// Number of its counterpart in the paper, if it has one.
    pub number: String,
    /// Title.
    pub title: String,
    /// What is to be seen, in label markup.
    pub caption: String,
    /// The drawing.
    pub drawing: Drawing,
}

impl StudyFigure {
    /// As an SVG document that can also stand inside a page.
    pub fn svg(&self) -> String {
        self.drawing.to_svg(
            &self.name,
            &text::plain(&self.title),
            &text::plain(&self.caption),
        )
    }
}

/// What the figures are drawn from.
pub struct FigureData<'a> {
    /// The plan.
    pub plan: &'a Plan,
    /// The table.
    pub records: &'a [RunRecord],
    /// The study folder.
    pub folder: &'a Path,
    /// Correlations to be drawn.
    pub correlations: &'a [Correlation],
    /// Motions of the finished runs that are compared, by run.
    pub trajectories: BTreeMap<String, Trajectory>,
}

impl FigureData<'_> {
    /// The first run of a model.
    pub fn run(&self, model: &str) -> Option<&Run> {
        self.plan.runs.iter().find(|run| run.model == model)
    }

    /// The case of a run: as it was run, else as it is planned.
    pub fn case(&self, run: &Run) -> Option<Case> {
        let resolved = run.folder(self.folder).join(RESOLVED);
        Case::load(&resolved, &[]).or_else(|_| run.case()).ok()
    }

    /// Names of the values of an axis, in the order of the runs.
    pub fn levels(&self, axis: &str) -> Vec<String> {
        let mut out: Vec<String> = Vec::new();
        for level in self.plan.runs.iter().filter_map(|r| r.levels.get(axis)) {
            if !out.contains(level) {
                out.push(level.clone());
            }
        }
        out
    }

    /// The different values of a factor among the models on the axes, in order.
    pub fn factor_values(&self, factor: &str) -> Vec<f64> {
        let on_axes = self.plan.runs.iter().filter(|r| !r.levels.is_empty());
        let mut out: Vec<f64> = on_axes
            .filter_map(|r| r.factors.get(factor).copied())
            .collect();
        out.sort_by(f64::total_cmp);
        out.dedup();
        out
    }
}

/// Draws all figures that the study has data for; what had to be left out is added to `notes`.
pub fn all(data: &FigureData, notes: &mut Vec<String>) -> Vec<StudyFigure> {
    let mut out = Vec::new();
    out.extend(grains::family(data, notes));
    out.extend(grains::orientations(data, notes));
    out.extend(setup::figure(data, notes));
    out.extend(snapshots::figures(data, notes));
    out.extend(kissing_time::by_model(data));
    out.extend(kissing_time::boxes(data));
    out.extend(histories::figures(data, notes));
    out.extend(overview::figures(data));
    out.extend(trends::figure(data));
    if !as_in_the_paper(data) {
        renumber(&mut out);
    }
    out
}

/// Whether the study shows the grains, set-ups and orientations that the paper's first figures do.
fn as_in_the_paper(data: &FigureData) -> bool {
    let plan = &data.plan.analysis.figures;
    plan.grains.is_some() && plan.orientations.is_some() && plan.setup.is_some()
}

/// Counts figures from 1, in their names too.
fn renumber(figures: &mut [StudyFigure]) {
    for (i, figure) in figures.iter_mut().enumerate() {
        figure.number = (i + 1).to_string();
        let plain = |name: &str| -> Option<String> {
            let (number, rest) = name.strip_prefix("fig")?.split_once('-')?;
            number
                .starts_with(|c: char| c.is_ascii_digit())
                .then(|| rest.to_owned())
        };
        let name = plain(&figure.name).unwrap_or_else(|| figure.name.clone());
        figure.name = format!("fig{:02}-{name}", i + 1);
    }
}

/// A factor as axis labels have it: its first letter in italics.
pub fn symbol(factor: &str) -> String {
    match factor.chars().next() {
        Some(first) => format!("*{}*", first.to_uppercase()),
        None => String::new(),
    }
}

/// A factor's value, significant.
pub fn value_text(value: f64) -> String {
    let text = format!("{value:.3}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text.contains('.') && text.len() == 3 {
        format!("{text}0")
    } else {
        text.to_owned()
    }
}

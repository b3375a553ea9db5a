//! Data of the figures of a study, and the labels that several figures share.

use std::collections::BTreeMap;
use std::path::Path;

use grainwake_plot::frame::{Fill, Marker};
use grainwake_plot::legend::Entry;
use grainwake_plot::text;
use grainwake_run::RESOLVED;
use grainwake_run::case::Case;

use crate::analysis::correlation::Correlation;
use crate::analysis::factor_mean::FactorMean;
use crate::analysis::kissing::KissingResults;
use crate::analysis::verdict::Finding;
use crate::measure::record::RunRecord;
use crate::measure::trajectory::Trajectory;
use crate::plan::{Plan, Run};

/// Data of the figures.
pub struct FigureData<'a> {
    /// Plan.
    pub plan: &'a Plan,
    /// Records of the runs, in the order of the plan.
    pub records: &'a [RunRecord],
    /// Study folder.
    pub folder: &'a Path,
    /// Tested claims.
    pub findings: &'a [Finding],
    /// Correlations.
    pub correlations: &'a [Correlation],
    /// Means of quantities at the values of factors.
    pub factor_means: &'a [FactorMean],
    /// Results on the first contact.
    pub kissing: Option<&'a KissingResults>,
    /// Trajectories of the finished runs that are compared, by name of the run.
    pub trajectories: BTreeMap<String, Trajectory>,
}

impl FigureData<'_> {
    /// Returns the first run of a model.
    pub fn run(&self, model: &str) -> Option<&Run> {
        self.plan.runs.iter().find(|run| run.model == model)
    }

    /// Returns the first run at a level of an axis.
    pub fn run_at(&self, axis: &str, level: &String) -> Option<&Run> {
        self.plan.runs.iter().find(|run| run.levels.get(axis) == Some(level))
    }

    /// Reads the case of a run from its run folder, or else as planned.
    pub fn case(&self, run: &Run) -> Option<Case> {
        let resolved = run.folder(self.folder).join(RESOLVED);
        Case::load(&resolved, &[]).or_else(|_| run.case()).ok()
    }

    /// Returns the levels of an axis, in the order of the runs.
    pub fn levels(&self, axis: &str) -> Vec<String> {
        unique(self.plan.runs.iter().filter_map(|run| run.levels.get(axis)))
    }

    /// Returns the distinct values of a factor among the models on the axes, in ascending order.
    pub fn factor_values(&self, factor: &str) -> Vec<f64> {
        let on_axes = self.plan.runs.iter().filter(|run| !run.levels.is_empty());
        let known = on_axes.filter_map(|run| run.factors.get(factor).copied());
        let mut out: Vec<f64> = known.collect();
        out.sort_by(f64::total_cmp);
        out.dedup();
        out
    }
}

/// Returns the distinct names, in order of first appearance.
pub fn unique<'a>(names: impl Iterator<Item = &'a String>) -> Vec<String> {
    let mut out: Vec<String> = Vec::new();
    for name in names {
        if !out.contains(name) {
            out.push(name.clone());
        }
    }
    out
}

/// Returns whether the study shows grains, orientations and set-up as the paper's first figures.
pub fn numbered_as_in_paper(data: &FigureData) -> bool {
    let request = &data.plan.analysis.figures;
    request.grains.is_some() && request.orientations.is_some() && request.setup.is_some()
}

/// Symbol of a factor in labels: its first letter in italics.
fn symbol(factor: &str) -> String {
    let first = factor.chars().next();
    first.map_or(String::new(), |c| format!("*{}*", c.to_uppercase()))
}

/// Value with at most three decimals, without trailing zeros, but "0.40" with two.
pub fn value_text(value: f64) -> String {
    let text = format!("{value:.3}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text.contains('.') && text.len() == 3 { format!("{text}0") } else { text.to_owned() }
}

/// Label "S = 0.45" of a factor's value.
pub fn factor_label(factor: &str, value: f64) -> String {
    format!("{} = {}", symbol(factor), value_text(value))
}

/// Returns the entry of a legend with a symbol.
pub fn symbol_entry(name: &str, n: usize, colour: &'static str) -> Entry {
    Entry {
        name: text::literal(name),
        colour,
        line: None,
        symbol: Some((Marker::nth(n), Fill::Solid)),
    }
}

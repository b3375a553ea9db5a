//! Data of the figures of a study, and the labels that several figures share.

use std::collections::BTreeMap;
use std::path::Path;

use grainwake_plot::style::TEXT;
use grainwake_plot::{minus, text};
use grainwake_run::RESOLVED;
use grainwake_run::case::Case;

use super::factor_unit::label_with_unit;
use super::line_style::{LineStyle, OUTSIDE};
use crate::analysis::correlation::Correlation;
use crate::analysis::factor_mean::FactorMean;
use crate::analysis::kissing::KissingResults;
use crate::analysis::verdict::Finding;
use crate::measure::record::RunRecord;
use crate::measure::trajectory::Trajectory;
use crate::measure::unique;
use crate::page::label::name_of;
use crate::plan::{Plan, Run};

/// Smallest number of significant digits of a value with decimals.
const DIGITS: usize = 3;

/// Data of the figures.
pub struct FigureData<'a> {
    /// Plan of the shown runs.
    pub plan: &'a Plan,
    /// Plan of all runs of the study.
    pub whole: &'a Plan,
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

    /// Returns all levels of an axis of the study, shown or not, in the order of the study file.
    pub fn declared(&self, axis: &str) -> Vec<String> {
        unique(self.whole.runs.iter().filter_map(|run| run.levels.get(axis)))
    }

    /// Returns the style of a level of an axis, the same in all figures.
    pub fn level_style(&self, axis: &str, level: &str) -> LineStyle {
        let all = self.declared(axis);
        let n = all.iter().position(|l| l == level);
        n.map_or(OUTSIDE, |n| LineStyle::of_level(n, all.len()))
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

    /// Returns a factor's value with as many digits as distinguish it from the others.
    pub fn factor_value(&self, factor: &str, value: f64) -> String {
        let values = self.factor_values(factor);
        let distinct = |digits: &usize| {
            values.windows(2).all(|w| rounded_text(w[0], *digits) != rounded_text(w[1], *digits))
        };
        rounded_text(value, (DIGITS..16).find(distinct).unwrap_or(16))
    }

    /// Returns the label "S = 0.45" of a factor's value.
    pub fn factor_label(&self, factor: &str, value: f64) -> String {
        format!("{} = {}", self.symbol(factor), self.factor_value(factor, value))
    }

    /// Returns the label of a factor's value, or the value alone if the label is wider than `width`
    /// [pt].
    pub fn fitting_label(&self, factor: &str, value: f64, width: f64) -> String {
        let label = self.factor_label(factor, value);
        if text::width(&label, TEXT) <= width { label } else { self.factor_value(factor, value) }
    }

    /// Returns the label of the axis of a quantity or factor; of a factor with its unit, if a
    /// setting of the study file has it.
    pub fn axis_label(&self, name: &str) -> String {
        label_with_unit(&self.whole.runs, name)
    }

    /// Returns the symbol of a factor of rows or columns: its first letter in italics; its name if
    /// both factors begin with that letter.
    fn symbol(&self, factor: &str) -> String {
        let initial = |name: &str| name.chars().next().map(|c| c.to_uppercase().to_string());
        let request = &self.plan.analysis.figures;
        let mut others = [&request.rows, &request.columns].into_iter().flatten();
        match initial(factor) {
            Some(own) if !others.any(|o| o != factor && initial(o).as_ref() == Some(&own)) => {
                format!("*{own}*")
            }
            _ => name_of(factor),
        }
    }
}

/// Value with at most three decimals, or three significant digits if it is small.
pub fn value_text(value: f64) -> String {
    rounded_text(value, DIGITS)
}

/// Value with at most `digits` decimals, or as many significant digits below 0.1, without trailing
/// zeros, but "0.40" with two decimals. Very small and large values have a power of ten.
fn rounded_text(value: f64, digits: usize) -> String {
    let trimmed = |text: &str| match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text.to_owned(),
    };
    let size = value.abs();
    if size != 0.0 && !(1e-4..1e7).contains(&size) {
        let text = format!("{value:.*e}", digits - 1);
        let (factor, power) = text.split_once('e').unwrap_or((&text, "0"));
        return minus(&format!("{}·10^{{{power}}}", trimmed(factor)));
    }
    let leading_zeros =
        if size < 0.1 && size > 0.0 { -size.log10().floor() as usize - 1 } else { 0 };
    let text = trimmed(&format!("{value:.*}", digits + leading_zeros));
    minus(&if text.contains('.') && text.len() == 3 { format!("{text}0") } else { text })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_have_few_digits_but_enough() {
        let texts = [0.0, 0.4, 0.45, 2.0, 1400.0, 0.0123, 0.0001].map(value_text);
        assert_eq!(texts, ["0", "0.40", "0.45", "2", "1400", "0.0123", "0.0001"]);
        assert_eq!([-0.25, 1.5e-12, 2e9].map(value_text), ["−0.25", "1.5·10^{−12}", "2·10^{9}"]);
    }

    /// Data of a plan with models of the given values of two factors.
    fn with_data<T>(factors: [&str; 2], values: &[f64], check: impl Fn(&FigureData) -> T) -> T {
        let run = |value: &f64| {
            let factors: BTreeMap<&str, f64> = factors.map(|factor| (factor, *value)).into();
            serde_json::json!({
                "name": "m", "model": "m", "member": 0, "levels": { "grain": "g" },
                "factors": factors, "base": "case.toml", "set": [], "id": "0",
                "case_sha256": "0", "ending": "", "end_s": 1.0, "memory_bytes": 0,
                "wall_s": 0.0,
            })
        };
        let plan = serde_json::json!({
            "grainwake_study": 1, "study": "study.toml", "title": "t", "version": "0",
            "commit": null, "runs": values.iter().map(run).collect::<Vec<_>>(),
            "analysis": { "figures": { "rows": factors[0], "columns": factors[1] } },
        });
        let plan: Plan = serde_json::from_value(plan).unwrap();
        check(&FigureData {
            plan: &plan,
            whole: &plan,
            records: &[],
            folder: Path::new(""),
            findings: &[],
            correlations: &[],
            factor_means: &[],
            kissing: None,
            trajectories: BTreeMap::new(),
        })
    }

    #[test]
    fn labels_distinguish_close_values() {
        let labels = |values: &[f64]| {
            with_data(["sphericity", "roundness"], values, |data| {
                values.iter().map(|v| data.factor_label("roundness", *v)).collect::<Vec<_>>()
            })
        };
        assert_eq!(labels(&[0.0001, 0.0002]), ["*R* = 0.0001", "*R* = 0.0002"]);
        assert_eq!(labels(&[0.4, 0.45]), ["*R* = 0.40", "*R* = 0.45"]);
        assert_eq!(labels(&[1.00001, 1.00002, 3.0]), ["*R* = 1.00001", "*R* = 1.00002", "*R* = 3"]);
    }

    #[test]
    fn factors_with_the_same_initial_are_named() {
        with_data(["density", "Diameter_mm"], &[2.0], |data| {
            assert_eq!(data.factor_label("density", 2.0), "density = 2");
            assert_eq!(data.factor_label("Diameter_mm", 2.0), "Diameter mm = 2");
            assert_eq!(data.fitting_label("density", 2.0, 20.0), "2");
        });
    }
}

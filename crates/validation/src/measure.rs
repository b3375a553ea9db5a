//! Numbers from the tables of a run.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use exmex::prelude::*;
use serde::Deserialize;

use crate::signal;
use crate::suite::Check;
use crate::table::{Columns, From};

/// What is made of the expression `of` over the window.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Take {
    /// Mean.
    Mean,
    /// Root mean square distance from the mean.
    Deviation,
    /// Root mean square distance from a straight line, over the absolute mean.
    Noise,
    /// Slope of a straight line.
    Slope,
    /// Largest value.
    Max,
    /// Smallest value.
    Min,
    /// Half the distance from the largest to the smallest value.
    Amplitude,
    /// Oscillations about the mean in a unit of `against`.
    Frequency,
    /// Value in the last row.
    Last,
    /// Value at `at`.
    Value,
    /// Where it first goes through zero.
    FirstZero,
    /// Where it last goes through zero.
    LastZero,
    /// Largest distance from the curve y(x) of the file `data`.
    CurveMax,
    /// Root mean square distance from the curve y(x) of the file `data`.
    CurveRms,
    /// The number of `summary.json` that `of` names, "grains.0.landing_time_s".
    Summary,
}

/// Where a number comes from.
#[derive(Clone, Debug, Default)]
pub struct Window {
    /// Expression in the columns of the table.
    pub of: String,
    /// Grain whose columns have no number behind their names.
    pub grain: usize,
    /// The table.
    pub table: From,
    /// Expression that takes the part of time.
    pub against: Option<String>,
    /// Only where `against` is at least this.
    pub from: Option<f64>,
    /// Only where `against` is at most this.
    pub to: Option<f64>,
    /// Place of `value`.
    pub at: Option<f64>,
    /// Reference curve.
    pub data: Option<PathBuf>,
    /// Expression in the columns of `data` that is compared with `against`.
    pub x: String,
    /// Expression in the columns of `data` that is compared with `of`.
    pub y: String,
}

impl Window {
    /// What is missing for `take`.
    pub(crate) fn validate(&self, take: Take) -> Result<(), String> {
        let need = |present: bool, what: &str| {
            present
                .then_some(())
                .ok_or_else(|| format!("this measure needs `{what}`"))
        };
        need(!self.of.is_empty(), "of")?;
        if take == Take::Value {
            need(self.at.is_some(), "at")?;
        }
        if matches!(take, Take::CurveMax | Take::CurveRms) {
            need(self.data.is_some(), "data")?;
            need(!self.x.is_empty(), "x")?;
            need(!self.y.is_empty(), "y")?;
            let data = self.data.as_deref().unwrap_or(Path::new(""));
            Columns::of_data(data)?;
        }
        let texts = [Some(&self.of), self.against.as_ref()];
        if take != Take::Summary {
            for text in texts.into_iter().flatten() {
                exmex::parse::<f64>(text).map_err(|e| format!("'{text}': {e}"))?;
            }
        }
        Ok(())
    }
}

/// An expression row by row; its names are columns or constants.
pub(crate) fn evaluate(
    text: &str,
    columns: &Columns,
    constants: &BTreeMap<String, f64>,
) -> Result<Vec<f64>, String> {
    let parsed = exmex::parse::<f64>(text).map_err(|e| format!("'{text}': {e}"))?;
    let mut series: Vec<Result<&[f64], f64>> = Vec::new();
    for name in parsed.var_names() {
        match (columns.get(name), constants.get(name)) {
            (Some(column), _) => series.push(Ok(column)),
            (None, Some(constant)) => series.push(Err(*constant)),
            (None, None) => {
                return Err(format!(
                    "'{text}': there is no column or constant \"{name}\"; columns: {}",
                    columns.names.join(", ")
                ));
            }
        }
    }
    let mut row = vec![0.0; series.len()];
    (0..columns.rows())
        .map(|i| {
            for (slot, source) in row.iter_mut().zip(&series) {
                *slot = match source {
                    Ok(column) => column[i],
                    Err(constant) => *constant,
                };
            }
            parsed.eval(&row).map_err(|e| format!("'{text}': {e}"))
        })
        .collect()
}

/// An expression of constants alone.
pub(crate) fn constant(text: &str, constants: &BTreeMap<String, f64>) -> Result<f64, String> {
    let mut columns = Columns::default();
    columns.names.push(String::new());
    columns.values.push(vec![0.0]);
    evaluate(text, &columns, constants).map(|values| values[0])
}

impl Window {
    /// What takes the part of time, and the expression, row by row; the whole table.
    fn rows(
        &self,
        folder: &Path,
        constants: &BTreeMap<String, f64>,
    ) -> Result<(Vec<f64>, Vec<f64>, String), String> {
        let columns = Columns::of_run(folder, &self.table, self.grain)?;
        let along = match (&self.against, &self.table) {
            (Some(text), _) => text.clone(),
            (None, From::Slice(_)) => columns.names[0].clone(),
            (None, _) => "time".to_string(),
        };
        let x = evaluate(&along, &columns, constants)?;
        let y = evaluate(&self.of, &columns, constants)?;
        Ok((x, y, along))
    }

    /// The same rows inside the window.
    pub(crate) fn samples(
        &self,
        folder: &Path,
        constants: &BTreeMap<String, f64>,
    ) -> Result<(Vec<f64>, Vec<f64>), String> {
        let (x, y, along) = self.rows(folder, constants)?;
        self.inside(x, y, &along)
    }

    fn inside(
        &self,
        x: Vec<f64>,
        y: Vec<f64>,
        along: &str,
    ) -> Result<(Vec<f64>, Vec<f64>), String> {
        let low = self.from.unwrap_or(f64::NEG_INFINITY);
        let high = self.to.unwrap_or(f64::INFINITY);
        let rows = x.into_iter().zip(y);
        let (x, y): (Vec<f64>, Vec<f64>) = rows.filter(|(x, _)| (low..=high).contains(x)).unzip();
        if x.is_empty() {
            return Err(format!("no rows with {low} <= {along} <= {high}"));
        }
        Ok((x, y))
    }
}

impl Check {
    /// The number, from the run in `folder`.
    pub(crate) fn measure(&self, folder: &Path) -> Result<f64, String> {
        let w = &self.window;
        if self.take == Take::Summary {
            return summary(folder, &w.of);
        }
        let (x, y, along) = w.rows(folder, &self.constants)?;
        if matches!(self.take, Take::CurveMax | Take::CurveRms) {
            return self.distance_from_curve(&x, &y);
        }
        let (x, y) = w.inside(x, y, &along)?;
        let most = y.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let least = y.iter().copied().fold(f64::INFINITY, f64::min);
        let mean = signal::mean(&x, &y).unwrap_or(f64::NAN);
        let found = match self.take {
            Take::Mean => Some(mean),
            Take::Deviation => {
                let squares: Vec<f64> = y.iter().map(|v| (v - mean).powi(2)).collect();
                signal::mean(&x, &squares).map(f64::sqrt)
            }
            Take::Noise => signal::line_fit(&x, &y).map(|(_, rms)| rms / mean.abs()),
            Take::Slope => signal::line_fit(&x, &y).map(|(slope, _)| slope),
            Take::Max => Some(most),
            Take::Min => Some(least),
            Take::Amplitude => Some(0.5 * (most - least)),
            Take::Frequency => signal::frequency(&x, &y),
            Take::Last => y.last().copied(),
            Take::Value => w.at.and_then(|at| signal::interpolate(&x, &y, at)),
            Take::FirstZero => signal::crossings(&x, &y).first().map(|c| c.0),
            Take::LastZero => signal::crossings(&x, &y).last().map(|c| c.0),
            Take::CurveMax | Take::CurveRms | Take::Summary => None,
        };
        found.ok_or_else(|| format!("'{}' has no such value in this run", w.of))
    }

    fn distance_from_curve(&self, x: &[f64], y: &[f64]) -> Result<f64, String> {
        let w = &self.window;
        let data = Columns::of_data(w.data.as_deref().unwrap_or(Path::new("")))?;
        let at = evaluate(&w.x, &data, &self.constants)?;
        let expected = evaluate(&w.y, &data, &self.constants)?;
        // A profile is smooth on its grid; a history may hold an impact.
        let interpolate = match w.table {
            From::Slice(_) => signal::interpolate_smooth,
            _ => signal::interpolate,
        };
        let mut distances = Vec::new();
        for (at, expected) in at.iter().zip(&expected) {
            if w.from.is_some_and(|low| *at < low) || w.to.is_some_and(|high| *at > high) {
                continue;
            }
            let Some(value) = interpolate(x, y, *at) else {
                return Err(format!(
                    "the run has no value at {at}, where the reference has"
                ));
            };
            distances.push((value - expected).abs());
        }
        if distances.is_empty() {
            return Err("no point of the reference lies in the window".into());
        }
        Ok(match self.take {
            Take::CurveMax => distances.iter().copied().fold(0.0, f64::max),
            _ => {
                let squares: f64 = distances.iter().map(|d| d * d).sum();
                (squares / distances.len() as f64).sqrt()
            }
        })
    }
}

/// A number of `summary.json` by its dotted name.
fn summary(folder: &Path, key: &str) -> Result<f64, String> {
    let file = folder.join("summary.json");
    let text = std::fs::read_to_string(&file).map_err(|e| format!("{}: {e}", file.display()))?;
    let mut value: &serde_json::Value =
        &serde_json::from_str(&text).map_err(|e| format!("{}: {e}", file.display()))?;
    for part in key.split('.') {
        let next = match part.parse::<usize>() {
            Ok(index) => value.get(index),
            Err(_) => value.get(part),
        };
        value = next.ok_or_else(|| format!("summary.json has no \"{key}\""))?;
    }
    value
        .as_f64()
        .ok_or_else(|| format!("\"{key}\" is {value} in summary.json"))
}

//! Measurement of one value from the tables of a run.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use crate::columns::{Columns, TableSource};
use crate::{expression, signal};

/// Functional of the sampled expression over the window; the key `take`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Measure {
    /// Mean.
    Mean,
    /// Standard deviation.
    Deviation,
    /// Root-mean-square residual of a straight line, divided by the absolute mean.
    Noise,
    /// Slope of a straight line.
    Slope,
    /// Largest value.
    Max,
    /// Smallest value.
    Min,
    /// Half the difference of largest and smallest value.
    Amplitude,
    /// Oscillations about the mean per unit of `against`.
    Frequency,
    /// Value in the last row.
    Last,
    /// Value at `at`.
    Value,
    /// First zero crossing.
    FirstZero,
    /// Last zero crossing.
    LastZero,
    /// Largest distance from the curve y(x) of the file `data`.
    CurveMax,
    /// Root-mean-square distance from the curve y(x) of the file `data`.
    CurveRms,
    /// Value in `summary.json` under the dotted name `of`, "grains.0.landing_time_s".
    Summary,
}

impl Measure {
    fn compares_curves(self) -> bool {
        matches!(self, Measure::CurveMax | Measure::CurveRms)
    }
}

/// Sampled expression, its table and its window.
#[derive(Clone, Debug, Default)]
pub struct Sampling {
    /// Expression in the columns of the table.
    pub of: String,
    /// Grain whose columns have no numeric suffix.
    pub grain: usize,
    /// Table.
    pub table: TableSource,
    /// Expression of the independent variable; time or the coordinate by default.
    pub against: Option<String>,
    /// Lower end of the window in `against`.
    pub from: Option<f64>,
    /// Upper end of the window in `against`.
    pub to: Option<f64>,
    /// Coordinate of [`Measure::Value`].
    pub at: Option<f64>,
    /// File with the reference curve.
    pub data: Option<PathBuf>,
    /// Expression in the columns of `data` that corresponds to `against`.
    pub x: String,
    /// Expression in the columns of `data` that corresponds to `of`.
    pub y: String,
}

type Samples = (Vec<f64>, Vec<f64>);

impl Sampling {
    /// Checks that all keys needed by a measure are present and valid.
    pub(crate) fn validate(&self, measure: Measure) -> Result<(), String> {
        let need = |present: bool, key: &str| match present {
            true => Ok(()),
            false => Err(format!("this measure needs `{key}`")),
        };
        need(!self.of.is_empty(), "of")?;
        need(measure != Measure::Value || self.at.is_some(), "at")?;
        if measure.compares_curves() {
            need(self.data.is_some(), "data")?;
            need(!self.x.is_empty(), "x")?;
            need(!self.y.is_empty(), "y")?;
            Columns::read_reference(self.reference_file())?;
        }
        if measure != Measure::Summary {
            expression::check(&self.of)?;
            self.against.as_deref().map_or(Ok(()), expression::check)?;
        }
        Ok(())
    }

    fn reference_file(&self) -> &Path {
        self.data.as_deref().unwrap_or(Path::new(""))
    }

    /// Independent variable and expression in every row of the table that has both, and name of
    /// the former.
    fn rows(
        &self,
        folder: &Path,
        constants: &BTreeMap<String, f64>,
    ) -> Result<(Samples, String), String> {
        let columns = Columns::read_run(folder, &self.table, self.grain)?;
        let against = match (&self.against, &self.table) {
            (Some(text), _) => text.clone(),
            (None, TableSource::Slice(_)) => columns.names[0].clone(),
            (None, _) => "time".to_string(),
        };
        let mut x = expression::evaluate(&against, &columns, constants)?;
        let mut y = expression::evaluate(&self.of, &columns, constants)?;
        let rows = x.len().min(y.len());
        x.truncate(rows);
        y.truncate(rows);
        Ok(((x, y), against))
    }

    fn contains(&self, x: f64) -> bool {
        self.from.is_none_or(|low| x >= low) && self.to.is_none_or(|high| x <= high)
    }

    /// Returns the samples inside the window.
    pub(crate) fn samples(
        &self,
        folder: &Path,
        constants: &BTreeMap<String, f64>,
    ) -> Result<Samples, String> {
        let ((x, y), against) = self.rows(folder, constants)?;
        let (x, y): Samples =
            x.into_iter().zip(y).filter(|(x, _)| self.contains(*x) && !x.is_nan()).unzip();
        if x.is_empty() {
            let (low, high) =
                (self.from.unwrap_or(-f64::INFINITY), self.to.unwrap_or(f64::INFINITY));
            return Err(format!("no rows with {low} <= {against} <= {high}"));
        }
        Ok((x, y))
    }

    /// Measures a value in a run folder.
    pub(crate) fn measure(
        &self,
        measure: Measure,
        folder: &Path,
        constants: &BTreeMap<String, f64>,
    ) -> Result<f64, String> {
        if measure == Measure::Summary {
            return summary_value(folder, &self.of);
        }
        if measure.compares_curves() {
            let distances = self.distances_from_curve(folder, constants)?;
            return Ok(match measure {
                Measure::CurveMax => distances.iter().copied().fold(0.0, f64::max),
                _ => {
                    let squares: f64 = distances.iter().map(|d| d * d).sum();
                    (squares / distances.len() as f64).sqrt()
                }
            });
        }
        let (x, y) = self.samples(folder, constants)?;
        let largest = y.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let smallest = y.iter().copied().fold(f64::INFINITY, f64::min);
        let mean = signal::mean(&x, &y).unwrap_or(f64::NAN);
        let value = match measure {
            Measure::Mean => Some(mean),
            Measure::Deviation => {
                let squares: Vec<f64> = y.iter().map(|v| (v - mean).powi(2)).collect();
                signal::mean(&x, &squares).map(f64::sqrt)
            }
            Measure::Noise => signal::line_fit(&x, &y).map(|(_, rms)| rms / mean.abs()),
            Measure::Slope => signal::line_fit(&x, &y).map(|(slope, _)| slope),
            Measure::Max => Some(largest),
            Measure::Min => Some(smallest),
            Measure::Amplitude => Some(0.5 * (largest - smallest)),
            Measure::Frequency => signal::frequency(&x, &y),
            Measure::Last => y.last().copied(),
            Measure::Value => self.at.and_then(|at| signal::interpolate(&x, &y, at)),
            Measure::FirstZero => signal::crossings(&x, &y).first().map(|c| c.0),
            Measure::LastZero => signal::crossings(&x, &y).last().map(|c| c.0),
            Measure::CurveMax | Measure::CurveRms | Measure::Summary => None,
        };
        value.ok_or_else(|| format!("'{}' has no such value in this run", self.of))
    }

    /// Absolute distances from the reference curve at its points inside the window.
    fn distances_from_curve(
        &self,
        folder: &Path,
        constants: &BTreeMap<String, f64>,
    ) -> Result<Vec<f64>, String> {
        let ((x, y), _) = self.rows(folder, constants)?;
        let data = Columns::read_reference(self.reference_file())?;
        let positions = expression::evaluate(&self.x, &data, constants)?;
        let expected = expression::evaluate(&self.y, &data, constants)?;
        // A profile is smooth on its grid; a history may contain an impact.
        let interpolate = match self.table {
            TableSource::Slice(_) => signal::interpolate_smooth,
            _ => signal::interpolate,
        };
        let inside = positions.iter().zip(&expected).filter(|(at, _)| self.contains(**at));
        let distance = |(at, expected): (&f64, &f64)| {
            let value = interpolate(&x, &y, *at);
            let value = value
                .ok_or_else(|| format!("the run has no value at {at}, but the reference has"))?;
            Ok((value - expected).abs())
        };
        let distances: Vec<f64> = inside.map(distance).collect::<Result<_, String>>()?;
        match distances.is_empty() {
            true => Err("no point of the reference lies in the window".into()),
            false => Ok(distances),
        }
    }
}

/// Reads a value of `summary.json` by its dotted name.
fn summary_value(folder: &Path, key: &str) -> Result<f64, String> {
    let file = folder.join("summary.json");
    let problem = |what: &dyn std::fmt::Display| format!("{}: {what}", file.display());
    let text = std::fs::read_to_string(&file).map_err(|e| problem(&e))?;
    let summary: serde_json::Value = serde_json::from_str(&text).map_err(|e| problem(&e))?;
    let mut value = &summary;
    for part in key.split('.') {
        let next = match part.parse::<usize>() {
            Ok(index) => value.get(index),
            Err(_) => value.get(part),
        };
        value = next.ok_or_else(|| format!("summary.json has no \"{key}\""))?;
    }
    let number = value.as_f64();
    number.ok_or_else(|| format!("\"{key}\" is {value} in summary.json"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Grain 0 leaves after 1 s, grain 1 stays.
    #[test]
    fn a_grain_that_leaves_is_measured_while_it_is_in_the_box() {
        let folder = tempfile::tempdir().unwrap();
        let text = "time,grain,z\n0,0,1\n0,1,2\n1,0,0.5\n1,1,4\n2,1,8\n";
        std::fs::write(folder.path().join("grains.csv"), text).unwrap();
        let measured = |of: &str, grain: usize, measure: Measure| {
            let sampling = Sampling { of: of.into(), grain, ..Sampling::default() };
            sampling.measure(measure, folder.path(), &BTreeMap::new()).unwrap()
        };
        assert_eq!(measured("z0-z1", 0, Measure::Last), -3.5);
        assert_eq!(measured("z0-z1", 1, Measure::Slope), -2.5);
        assert_eq!(measured("z", 1, Measure::Last), 8.0);
        assert_eq!(measured("z1", 0, Measure::Mean), 4.5);
        assert_eq!(measured("z", 0, Measure::Min), 0.5);
    }
}

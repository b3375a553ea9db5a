//! Checks of a run: measured values, references and bounds.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use crate::measurement::{Measure, Sampling};

/// Effort level of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Level {
    /// Small enough for every commit.
    #[default]
    Ci,
    /// Published resolutions.
    Full,
}

/// Run of a case, and its checks.
#[derive(Clone, Debug)]
pub struct SuiteRun {
    /// Name within the suite.
    pub name: String,
    /// Case file.
    pub case: PathBuf,
    /// Overrides, "key=value".
    pub set: Vec<String>,
    /// Lowest level at which the run is executed.
    pub level: Level,
    /// Checks of the results.
    pub checks: Vec<Check>,
    /// Constants of the expressions.
    pub constants: BTreeMap<String, f64>,
}

/// Measured value with its reference and bounds.
#[derive(Clone, Debug)]
pub struct Check {
    /// Name of the quantity.
    pub quantity: String,
    /// Functional of the samples.
    pub measure: Measure,
    /// Samples.
    pub sampling: Sampling,
    /// Constants of the expressions.
    pub constants: BTreeMap<String, f64>,
    /// Expected value.
    pub reference: Option<Reference>,
    /// Accepted deviations.
    pub bounds: Bounds,
}

impl Check {
    /// Measures the value in a run folder.
    pub(crate) fn measure(&self, folder: &Path) -> Result<f64, String> {
        self.sampling.measure(self.measure, folder, &self.constants)
    }
}

/// Expected value of a check.
#[derive(Clone, Debug, PartialEq)]
pub enum Reference {
    /// Known value.
    Number(f64),
    /// Value of the same quantity in an earlier run of the suite.
    Run(String),
}

/// Accepted deviations from the reference, and accepted range. Missing bounds always hold.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Bounds {
    /// Largest absolute deviation.
    pub absolute: Option<f64>,
    /// Largest deviation relative to the reference.
    pub relative: Option<f64>,
    /// Smallest and largest value.
    pub range: [Option<f64>; 2],
}

impl Bounds {
    /// Returns the deviation from the reference, relative unless the bound is absolute.
    pub(crate) fn error(&self, value: f64, reference: f64) -> f64 {
        let difference = value - reference;
        if self.absolute.is_none() && reference != 0.0 {
            difference / reference.abs()
        } else {
            difference
        }
    }

    /// Returns whether a value and its error are within all bounds.
    pub(crate) fn hold(&self, value: Option<f64>, error: Option<f64>) -> bool {
        let close = [self.absolute, self.relative]
            .into_iter()
            .flatten()
            .all(|limit| error.is_some_and(|e| e.abs() <= limit));
        let [low, high] = self.range;
        let inside = value
            .is_some_and(|v| low.is_none_or(|low| v >= low) && high.is_none_or(|high| v <= high));
        close && inside
    }

    /// Returns the bounds as text, as in "± 2 %".
    pub(crate) fn text(&self) -> String {
        let relative = self.relative.map(|limit| format!("± {} %", rounded(100.0 * limit)));
        let absolute = self.absolute.map(|limit| format!("± {}", rounded(limit)));
        let range = match self.range {
            [Some(low), Some(high)] => Some(format!("{} ... {}", rounded(low), rounded(high))),
            [Some(low), None] => Some(format!(">= {}", rounded(low))),
            [None, Some(high)] => Some(format!("<= {}", rounded(high))),
            [None, None] => None,
        };
        let bounds: Vec<String> = [relative, absolute, range].into_iter().flatten().collect();
        bounds.join(", ")
    }
}

/// Value rounded to seven significant digits, which hides representation errors.
fn rounded(value: f64) -> f64 {
    format!("{value:.6e}").parse().unwrap_or(value)
}

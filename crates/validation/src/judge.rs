//! What was measured beside what it should be.

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::suite::{Check, Reference, Run, Suite};

/// One line of the result. The JSON names are stable.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Verdict {
    /// Name of the validation.
    pub name: String,
    /// Name of the run within it.
    pub run: String,
    /// What was measured.
    pub quantity: String,
    /// What came out; none if it could not be measured.
    pub value: Option<f64>,
    /// What it should be; none where only bounds are given.
    pub reference: Option<f64>,
    /// Difference from the reference, relative where the bound is.
    pub error: Option<f64>,
    /// The bound in words.
    pub bound: String,
    /// Whether it holds; context without a bound always does.
    pub pass: bool,
    /// Why it could not be measured.
    pub problem: Option<String>,
}

impl Suite {
    /// Measures the run in `folder`; `known` holds the values of earlier runs by run and quantity.
    pub fn judge(
        &self,
        run: &Run,
        folder: &Path,
        known: &mut BTreeMap<(String, String), f64>,
    ) -> Vec<Verdict> {
        run.checks
            .iter()
            .map(|check| {
                let measured = check.measure(folder);
                if let Ok(value) = measured {
                    known.insert((run.name.clone(), check.quantity.clone()), value);
                }
                let reference = match &check.reference {
                    None => None,
                    Some(Reference::Number(number)) => Some(*number),
                    Some(Reference::Run(other)) => {
                        known.get(&(other.clone(), check.quantity.clone())).copied()
                    }
                };
                check.verdict(self, run, measured, reference)
            })
            .collect()
    }

    /// Verdicts of a run that did not come to its end.
    pub fn failed(&self, run: &Run, why: &str) -> Vec<Verdict> {
        run.checks
            .iter()
            .map(|check| check.verdict(self, run, Err(why.into()), None))
            .collect()
    }
}

impl Check {
    fn verdict(
        &self,
        suite: &Suite,
        run: &Run,
        measured: Result<f64, String>,
        reference: Option<f64>,
    ) -> Verdict {
        let (value, problem) = match measured {
            Ok(value) if value.is_finite() => (Some(value), None),
            Ok(value) => (None, Some(format!("the measure gave {value}"))),
            Err(why) => (None, Some(why)),
        };
        let difference = value.zip(reference).map(|(v, r)| v - r);
        let error = match (self.absolute, reference) {
            (None, Some(r)) if r != 0.0 => difference.map(|d| d / r.abs()),
            _ => difference,
        };
        let missing = self.reference.is_some() && reference.is_none();
        let near = match (self.absolute, self.relative) {
            (None, None) => true,
            (absolute, relative) => error.is_some_and(|e| {
                absolute.is_none_or(|limit| e.abs() <= limit)
                    && relative.is_none_or(|limit| e.abs() <= limit)
            }),
        };
        let inside = value.is_some_and(|v| {
            self.range[0].is_none_or(|low| v >= low) && self.range[1].is_none_or(|high| v <= high)
        });
        let problem = problem
            .or_else(|| missing.then(|| "the run it is compared with gave no value".to_string()));
        Verdict {
            name: suite.name.clone(),
            run: run.name.clone(),
            quantity: self.quantity.clone(),
            value,
            reference,
            error,
            bound: self.bound(),
            pass: inside && near && !missing,
            problem,
        }
    }

    /// The bound in words.
    fn bound(&self) -> String {
        let mut words = Vec::new();
        if let Some(limit) = self.relative {
            words.push(format!("± {} %", short(100.0 * limit)));
        }
        if let Some(limit) = self.absolute {
            words.push(format!("± {}", short(limit)));
        }
        match self.range {
            [Some(low), Some(high)] => words.push(format!("{} ... {}", short(low), short(high))),
            [Some(low), None] => words.push(format!(">= {}", short(low))),
            [None, Some(high)] => words.push(format!("<= {}", short(high))),
            [None, None] => {}
        }
        words.join(", ")
    }
}

/// A number without noise digits.
fn short(value: f64) -> String {
    let rounded: f64 = format!("{value:.6e}").parse().unwrap_or(value);
    rounded.to_string()
}

//! Comparison of measured values with references and bounds.

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::check::{Check, Reference, SuiteRun};
use crate::suite::Suite;

/// Result of one check. The JSON names are stable.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CheckResult {
    /// Name of the suite.
    pub name: String,
    /// Name of the run.
    pub run: String,
    /// Quantity.
    pub quantity: String,
    /// Measured value; none if the measurement failed.
    pub value: Option<f64>,
    /// Expected value; none if there are only bounds.
    pub reference: Option<f64>,
    /// Deviation from the reference, relative unless the bound is absolute.
    pub error: Option<f64>,
    /// Bounds as text; empty for context.
    pub bound: String,
    /// Whether the bounds hold; always true for context.
    pub pass: bool,
    /// Reason why the measurement failed.
    pub problem: Option<String>,
}

impl Suite {
    /// Evaluates the checks of a run in its folder.
    ///
    /// `known` holds the values of earlier runs, by run and quantity; the values of this run are
    /// added.
    pub fn evaluate(
        &self,
        run: &SuiteRun,
        folder: &Path,
        known: &mut BTreeMap<(String, String), f64>,
    ) -> Vec<CheckResult> {
        let evaluate = |check: &Check| {
            let measured = check.measure(folder);
            let key = |run: &String| (run.clone(), check.quantity.clone());
            if let Ok(value) = measured {
                known.insert(key(&run.name), value);
            }
            let reference = check.reference.as_ref().and_then(|reference| match reference {
                Reference::Number(number) => Some(*number),
                Reference::Run(other) => known.get(&key(other)).copied(),
            });
            self.result(run, check, measured, reference)
        };
        run.checks.iter().map(evaluate).collect()
    }

    /// Returns the results of a run that did not reach its end.
    pub fn results_of_failed_run(&self, run: &SuiteRun, reason: &str) -> Vec<CheckResult> {
        let failed = |check: &Check| self.result(run, check, Err(reason.into()), None);
        run.checks.iter().map(failed).collect()
    }

    fn result(
        &self,
        run: &SuiteRun,
        check: &Check,
        measured: Result<f64, String>,
        reference: Option<f64>,
    ) -> CheckResult {
        let (value, problem) = match measured {
            Ok(value) if value.is_finite() => (Some(value), None),
            Ok(value) => (None, Some(format!("the measured value is {value}"))),
            Err(reason) => (None, Some(reason)),
        };
        let error = value.zip(reference).map(|(v, r)| check.bounds.error(v, r));
        let missing = check.reference.is_some() && reference.is_none();
        let no_reference = || missing.then(|| "the reference run has no value".to_string());
        CheckResult {
            name: self.name.clone(),
            run: run.name.clone(),
            quantity: check.quantity.clone(),
            value,
            reference,
            error,
            bound: check.bounds.text(),
            pass: check.bounds.hold(value, error) && !missing,
            problem: problem.or_else(no_reference),
        }
    }
}

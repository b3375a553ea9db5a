//! Measured values of one run folder, and the table of all runs.

pub mod cost;
pub mod pair;
pub mod record;
pub mod settling;
pub mod table;
pub mod trajectory;

/// Returns the arithmetic mean; none of an empty sample.
pub(crate) fn mean(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let values: Vec<f64> = values.into_iter().collect();
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// Returns the distinct names, in order of first appearance.
pub(crate) fn unique<'a>(names: impl Iterator<Item = &'a String>) -> Vec<String> {
    let mut out: Vec<String> = Vec::new();
    for name in names {
        if !out.contains(name) {
            out.push(name.clone());
        }
    }
    out
}

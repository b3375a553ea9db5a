//! Text form of the results of checks.

use comfy_table::Table;
use grainwake_validation::CheckResult;

use crate::out::markdown;

fn number(value: Option<f64>) -> String {
    match value {
        None => "-".into(),
        Some(v) if v == 0.0 || (1e-3..1e5).contains(&v.abs()) => {
            let digits = (4 - v.abs().max(1e-3).log10().floor() as i32).clamp(0, 6) as usize;
            format!("{v:.digits$}")
        }
        Some(v) => format!("{v:.3e}"),
    }
}

fn error(v: &CheckResult) -> String {
    match v.error {
        Some(e) if v.bound.contains('%') || v.bound.is_empty() => format!("{:+.2} %", 100.0 * e),
        e => number(e),
    }
}

fn verdict(v: &CheckResult) -> &'static str {
    match (v.pass, v.bound.is_empty()) {
        (false, _) => "missed",
        (true, true) => "context",
        (true, false) => "holds",
    }
}

/// Returns a result on one line.
pub fn line(v: &CheckResult) -> String {
    let mut text = format!("{}/{} {}: {}", v.name, v.run, v.quantity, number(v.value));
    if v.reference.is_some() {
        text += &format!(", reference {}, error {}", number(v.reference), error(v));
    }
    if !v.bound.is_empty() {
        text += &format!(", bound {}", v.bound);
    }
    text += &format!(": {}", verdict(v));
    match &v.problem {
        Some(problem) => format!("{text} ({problem})"),
        None => text,
    }
}

/// Returns results as a Markdown table.
pub fn table(results: &[CheckResult]) -> Table {
    let header = "validation,run,quantity,value,reference,error,bound,verdict".split(',');
    let row = |v: &CheckResult| {
        vec![
            v.name.clone(),
            v.run.clone(),
            v.quantity.clone(),
            number(v.value),
            number(v.reference),
            error(v),
            v.bound.clone(),
            verdict(v).to_string(),
        ]
    };
    markdown(header, results.iter().map(row), 3..6)
}

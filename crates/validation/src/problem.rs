//! Problems of `validation.toml`, located in the file.

use grainwake_run::case::{Located, Problem, Source};

/// Returns a problem at a value of the file; `label` marks the value.
pub(crate) fn at<T>(
    source: &Source,
    value: &Located<T>,
    message: impl Into<String>,
    help: impl Into<String>,
    label: &str,
) -> Problem {
    source.locate(Problem::new(message).help(help), value.span.as_ref(), label)
}

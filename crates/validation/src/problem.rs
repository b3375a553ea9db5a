//! Problems of `validation.toml`, located in the file.

use grainwake_run::case::{Located, Problem, Source, nearest};

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

/// Returns the question after the nearest known name; empty if none is near.
pub(crate) fn did_you_mean<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> String {
    nearest(name, known).map_or(String::new(), |n| format!("did you mean \"{n}\"? "))
}

//! `validation.toml`: what is run, what is measured, and what it should be.

use std::collections::{BTreeMap, HashSet};

use std::path::{Path, PathBuf};

use grainwake_solver::case::{Loc, Problem, Source, nearest};
use serde::Deserialize;

use crate::figure::{self, Figure, RawFigure};
use crate::measure::{Take, Window};
use crate::table::From;

/// How much of a validation is run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Level {
    /// Small enough for every commit.
    #[default]
    Ci,
    /// Published resolutions.
    Full,
}

/// A validation: its folder, runs and checks.
#[derive(Clone, Debug)]
pub struct Suite {
    /// Name of its folder.
    pub name: String,
    /// Its folder.
    pub folder: PathBuf,
    /// One line that says what it is.
    pub title: String,
    /// What is run.
    pub runs: Vec<Run>,
    /// What is drawn from the runs.
    pub figures: Vec<Figure>,
}

/// A run of a case.
#[derive(Clone, Debug)]
pub struct Run {
    /// Name within the suite.
    pub name: String,
    /// Case file.
    pub case: PathBuf,
    /// Overrides, "key=value".
    pub set: Vec<String>,
    /// From which level on it is run.
    pub level: Level,
    /// What is measured.
    pub checks: Vec<Check>,
    /// Named numbers of the expressions.
    pub constants: BTreeMap<String, f64>,
}

/// A number and what it should be.
#[derive(Clone, Debug)]
pub struct Check {
    /// What it is called.
    pub quantity: String,
    /// How it is measured.
    pub take: Take,
    /// Where in the tables.
    pub window: Window,
    /// Named numbers of the expressions.
    pub constants: BTreeMap<String, f64>,
    /// What it should be.
    pub reference: Option<Reference>,
    /// Accepted distance from the reference, absolute.
    pub absolute: Option<f64>,
    /// Accepted distance from the reference, relative to it.
    pub relative: Option<f64>,
    /// Accepted range.
    pub range: [Option<f64>; 2],
}

/// What a number is compared with.
#[derive(Clone, Debug, PartialEq)]
pub enum Reference {
    /// A known number.
    Number(f64),
    /// The same quantity of another run of the suite.
    Run(String),
}

/// Why a suite could not be read.
#[derive(Debug, thiserror::Error)]
pub enum SuiteError {
    /// The file could not be read.
    #[error("cannot read {}: {source}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The contents are wrong.
    #[error("{0}")]
    Invalid(Box<Problem>),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawSuite {
    title: String,
    #[serde(default)]
    constants: BTreeMap<String, f64>,
    run: Vec<RawRun>,
    #[serde(default)]
    figure: Vec<RawFigure>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawRun {
    name: Loc<String>,
    #[serde(default = "default_case")]
    case: Loc<PathBuf>,
    #[serde(default)]
    set: Vec<String>,
    #[serde(default)]
    level: Level,
    #[serde(default)]
    constants: BTreeMap<String, f64>,
    check: Vec<RawCheck>,
}

fn default_case() -> Loc<PathBuf> {
    Loc::none("case.toml".into())
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawCheck {
    quantity: Loc<String>,
    take: Loc<Take>,
    of: Option<String>,
    #[serde(default)]
    grain: usize,
    #[serde(default)]
    table: From,
    against: Option<String>,
    from: Option<f64>,
    to: Option<f64>,
    at: Option<f64>,
    data: Option<PathBuf>,
    x: Option<String>,
    y: Option<String>,
    reference: Option<Loc<RawReference>>,
    tolerance: Option<Loc<Tolerance>>,
    at_least: Option<f64>,
    at_most: Option<f64>,
    /// Where the reference is from; for readers of the file.
    #[allow(dead_code)]
    source: Option<String>,
}

#[derive(Clone, Deserialize)]
#[serde(untagged)]
enum RawReference {
    Number(f64),
    Run { run: String },
}

#[derive(Clone, Deserialize)]
#[serde(untagged)]
enum Tolerance {
    Absolute(f64),
    Relative(String),
}

impl Suite {
    /// Reads `validation.toml` in `folder`.
    ///
    /// # Errors
    /// [`SuiteError`] with file, line, key and remedy.
    pub fn read(folder: &Path) -> Result<Suite, SuiteError> {
        let path = folder.join("validation.toml");
        let text = std::fs::read_to_string(&path).map_err(|source| SuiteError::Unreadable {
            path: path.clone(),
            source,
        })?;
        let (source, raw): (Source, RawSuite) =
            Source::parse(&path.display().to_string(), &text, &[])
                .map_err(|p| SuiteError::Invalid(Box::new(p)))?;
        let name = folder
            .file_name()
            .map_or_else(String::new, |n| n.to_string_lossy().into_owned());
        build(&source, raw, folder, name).map_err(|p| SuiteError::Invalid(Box::new(p)))
    }

    /// The suite with the runs whose names are `wanted`, those that their checks compare with, and so
    /// on.
    pub fn only(mut self, wanted: impl Fn(&str) -> bool) -> Suite {
        // A run compares with earlier ones.
        let mut needed = HashSet::new();
        for run in self.runs.iter().rev() {
            if wanted(&run.name) || needed.contains(&run.name) {
                needed.insert(run.name.clone());
                needed.extend(
                    run.checks
                        .iter()
                        .filter_map(|check| match &check.reference {
                            Some(Reference::Run(name)) => Some(name.clone()),
                            _ => None,
                        }),
                );
            }
        }
        self.runs.retain(|run| needed.contains(&run.name));
        self
    }

    /// The validations below `root`, in order of name.
    ///
    /// # Errors
    /// An unreadable folder, or the first wrong suite.
    pub fn all(root: &Path) -> Result<Vec<Suite>, SuiteError> {
        let entries = std::fs::read_dir(root).map_err(|source| SuiteError::Unreadable {
            path: root.into(),
            source,
        })?;
        let mut folders: Vec<PathBuf> = entries
            .flatten()
            .map(|entry| entry.path())
            .filter(|path| path.join("validation.toml").is_file())
            .collect();
        folders.sort();
        folders.iter().map(|folder| Suite::read(folder)).collect()
    }
}

fn build(source: &Source, raw: RawSuite, folder: &Path, name: String) -> Result<Suite, Problem> {
    let mut runs: Vec<Run> = Vec::new();
    for run in raw.run {
        if runs.iter().any(|other| other.name == run.name.value) {
            let problem = Problem::new(format!("there are two runs called \"{}\"", run.name.value))
                .help("give each run a name of its own");
            return Err(source.locate(problem, run.name.span.as_ref(), "again"));
        }
        let case = folder.join(&run.case.value);
        if !case.is_file() {
            let problem = Problem::new(format!("there is no case file {}", case.display()))
                .help("paths are relative to validation.toml");
            return Err(source.locate(problem, run.case.span.as_ref(), "not found"));
        }
        let mut constants = raw.constants.clone();
        constants.extend(run.constants.clone());
        let checks = run
            .check
            .into_iter()
            .map(|check| build_check(source, check, folder, &constants))
            .collect::<Result<_, _>>()?;
        runs.push(Run {
            name: run.name.value,
            case,
            set: run.set,
            level: run.level,
            checks,
            constants,
        });
    }
    let figures = figure::build(source, raw.figure, &runs, folder, &raw.constants)?;
    let suite = Suite {
        name,
        folder: folder.into(),
        title: raw.title,
        runs,
        figures,
    };
    for (i, run) in suite.runs.iter().enumerate() {
        for check in &run.checks {
            let Some(Reference::Run(other)) = &check.reference else {
                continue;
            };
            let known = suite.runs[..i].iter().find(|r| r.name == *other);
            if !known.is_some_and(|r| r.checks.iter().any(|c| c.quantity == check.quantity)) {
                let names = suite.runs[..i].iter().map(|r| r.name.as_str());
                let hint = nearest(other, names)
                    .map_or(String::new(), |n| format!("; did you mean \"{n}\"?"));
                return Err(Problem::new(format!(
                    "{}: run \"{}\" compares \"{}\" with that of \"{other}\", which has none",
                    suite.name, run.name, check.quantity
                ))
                .help(format!(
                    "name an earlier run that measures the same quantity{hint}"
                )));
            }
        }
    }
    Ok(suite)
}

fn build_check(
    source: &Source,
    raw: RawCheck,
    folder: &Path,
    constants: &BTreeMap<String, f64>,
) -> Result<Check, Problem> {
    let window = Window {
        of: raw.of.unwrap_or_default(),
        grain: raw.grain,
        table: raw.table,
        against: raw.against,
        from: raw.from,
        to: raw.to,
        at: raw.at,
        data: raw.data.map(|file| folder.join(file)),
        x: raw.x.unwrap_or_default(),
        y: raw.y.unwrap_or_default(),
    };
    window.validate(raw.take.value).map_err(|message| {
        let problem = Problem::new(format!("\"{}\": {message}", raw.quantity.value))
            .help("validation/README.md lists what each `take` needs");
        source.locate(problem, raw.take.span.as_ref(), "this measure")
    })?;
    let (mut absolute, mut relative) = (None, None);
    if let Some(tolerance) = &raw.tolerance {
        match &tolerance.value {
            Tolerance::Absolute(value) => absolute = Some(*value),
            Tolerance::Relative(text) => {
                let number = text.strip_suffix('%').map(str::trim);
                let Some(Ok(percent)) = number.map(str::parse::<f64>) else {
                    let problem = Problem::new(format!("tolerance \"{text}\" is not a percentage"))
                        .help("write a number, or a percentage such as \"2 %\"");
                    return Err(source.locate(problem, tolerance.span.as_ref(), "here"));
                };
                relative = Some(percent / 100.0);
            }
        }
        if raw.reference.is_none() {
            let problem = Problem::new("a tolerance needs a reference")
                .help("add `reference = ...`, or use `at_least` and `at_most`");
            return Err(source.locate(problem, tolerance.span.as_ref(), "of what?"));
        }
    }
    Ok(Check {
        quantity: raw.quantity.value,
        take: raw.take.value,
        window,
        constants: constants.clone(),
        reference: raw.reference.map(|r| match r.value {
            RawReference::Number(value) => Reference::Number(value),
            RawReference::Run { run } => Reference::Run(run),
        }),
        absolute,
        relative,
        range: [raw.at_least, raw.at_most],
    })
}

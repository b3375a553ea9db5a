//! The file `validation.toml`: runs, checks and figures of a suite.

use std::collections::{BTreeMap, HashSet};
use std::path::{Path, PathBuf};

use grainwake_formats::bounded_file::{SETTINGS, read_text};
use grainwake_run::case::{Located, Problem, Source, did_you_mean};
use serde::Deserialize;

use crate::check::{Bounds, Check, Level, Reference, SuiteRun};
use crate::columns::TableSource;
use crate::figure::{self, FigureSpec, RawFigure};
use crate::measurement::{Measure, Sampling};
use crate::problem;

/// File of a suite in its folder.
const FILE: &str = "validation.toml";

/// A suite: its runs, checks and figures.
#[derive(Clone, Debug)]
pub struct Suite {
    /// Name of the folder.
    pub name: String,
    /// Folder.
    pub folder: PathBuf,
    /// Title, one line.
    pub title: String,
    /// Runs with their checks.
    pub runs: Vec<SuiteRun>,
    /// Figures of the results.
    pub figures: Vec<FigureSpec>,
}

/// Reason why a suite cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum SuiteError {
    /// A file or folder cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Unreadable {
        /// File or folder.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The contents are wrong.
    #[error("{0}")]
    Invalid(Box<Problem>),
}

impl From<Problem> for SuiteError {
    fn from(problem: Problem) -> SuiteError {
        SuiteError::Invalid(Box::new(problem))
    }
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
    name: Located<String>,
    #[serde(default = "default_case")]
    case: Located<PathBuf>,
    #[serde(default)]
    set: Vec<String>,
    #[serde(default)]
    level: Level,
    #[serde(default)]
    constants: BTreeMap<String, f64>,
    check: Vec<RawCheck>,
}

fn default_case() -> Located<PathBuf> {
    PathBuf::from("case.toml").into()
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawCheck {
    quantity: Located<String>,
    take: Located<Measure>,
    #[serde(default)]
    of: String,
    #[serde(default)]
    grain: usize,
    #[serde(default)]
    table: TableSource,
    against: Option<String>,
    from: Option<f64>,
    to: Option<f64>,
    at: Option<f64>,
    data: Option<PathBuf>,
    #[serde(default)]
    x: String,
    #[serde(default)]
    y: String,
    reference: Option<Located<RawReference>>,
    tolerance: Option<Located<Tolerance>>,
    at_least: Option<f64>,
    at_most: Option<f64>,
    /// Publication of the reference, for readers of the file.
    #[serde(rename = "source")]
    _source: Option<String>,
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
    /// Reads `validation.toml` in a folder.
    ///
    /// # Errors
    /// [`SuiteError`] with file, line, key and remedy.
    pub fn read(folder: &Path) -> Result<Suite, SuiteError> {
        let path = folder.join(FILE);
        let text = read_text(&path, SETTINGS)
            .map_err(|source| SuiteError::Unreadable { path: path.clone(), source })?;
        let (source, raw) = Source::parse(&path.display().to_string(), &text, &[])?;
        let builder = Builder { source: &source, folder };
        Ok(builder.suite(raw)?)
    }

    /// Keeps the wanted runs and, recursively, the runs that their checks refer to.
    pub fn restricted_to(mut self, wanted: impl Fn(&str) -> bool) -> Suite {
        let mut needed = HashSet::new();
        // References are to earlier runs.
        for run in self.runs.iter().rev() {
            if wanted(&run.name) || needed.contains(&run.name) {
                needed.insert(run.name.clone());
                let references = run.checks.iter().filter_map(|check| check.reference.as_ref());
                needed.extend(references.filter_map(|reference| match reference {
                    Reference::Run(name) => Some(name.clone()),
                    Reference::Number(_) => None,
                }));
            }
        }
        self.runs.retain(|run| needed.contains(&run.name));
        self
    }

    /// Reads all suites below `root`, in order of name.
    ///
    /// # Errors
    /// An unreadable folder, or the first invalid suite.
    pub fn read_all(root: &Path) -> Result<Vec<Suite>, SuiteError> {
        let entries = std::fs::read_dir(root)
            .map_err(|source| SuiteError::Unreadable { path: root.into(), source })?;
        let folders = entries.flatten().map(|entry| entry.path());
        let mut folders: Vec<PathBuf> = folders.filter(|path| path.join(FILE).is_file()).collect();
        folders.sort();
        folders.iter().map(|folder| Suite::read(folder)).collect()
    }
}

/// Converts the raw file to a suite.
struct Builder<'a> {
    source: &'a Source,
    folder: &'a Path,
}

impl Builder<'_> {
    fn suite(&self, raw: RawSuite) -> Result<Suite, Problem> {
        let mut runs: Vec<SuiteRun> = Vec::new();
        for run in raw.run {
            let run = self.run(run, &raw.constants, &runs)?;
            runs.push(run);
        }
        let figures = figure::build(self.source, raw.figure, &runs, self.folder, &raw.constants)?;
        let name = self.folder.file_name();
        let suite = Suite {
            name: name.map_or_else(String::new, |n| n.to_string_lossy().into_owned()),
            folder: self.folder.into(),
            title: raw.title,
            runs,
            figures,
        };
        check_references(&suite)?;
        Ok(suite)
    }

    fn run(
        &self,
        raw: RawRun,
        constants: &BTreeMap<String, f64>,
        earlier: &[SuiteRun],
    ) -> Result<SuiteRun, Problem> {
        let name = raw.name.value.clone();
        if earlier.iter().any(|other| other.name == name) {
            let message = format!("there are two runs called \"{name}\"");
            let help = "give each run a unique name";
            return Err(problem::at(self.source, &raw.name, message, help, "again"));
        }
        let case = self.folder.join(&raw.case.value);
        if !case.is_file() {
            let message = format!("there is no case file {}", case.display());
            let help = "paths are relative to validation.toml";
            return Err(problem::at(self.source, &raw.case, message, help, "not found"));
        }
        let mut constants = constants.clone();
        constants.extend(raw.constants);
        let checks = raw.check.into_iter().map(|check| self.check(check, &constants));
        Ok(SuiteRun {
            name,
            case,
            set: raw.set,
            level: raw.level,
            checks: checks.collect::<Result<_, _>>()?,
            constants,
        })
    }

    fn check(&self, raw: RawCheck, constants: &BTreeMap<String, f64>) -> Result<Check, Problem> {
        let sampling = Sampling {
            of: raw.of,
            grain: raw.grain,
            table: raw.table,
            against: raw.against,
            from: raw.from,
            to: raw.to,
            at: raw.at,
            data: raw.data.map(|file| self.folder.join(file)),
            x: raw.x,
            y: raw.y,
        };
        if raw.at_least.zip(raw.at_most).is_some_and(|(least, most)| least > most) {
            let message = format!("\"{}\": at_least exceeds at_most", raw.quantity.value);
            let help = "no value lies between them: exchange them";
            return Err(problem::at(self.source, &raw.quantity, message, help, "this check"));
        }
        if sampling.from.zip(sampling.to).is_some_and(|(from, to)| from > to) {
            let message = format!("\"{}\": from exceeds to", raw.quantity.value);
            let help = "from is the begin of the range, to its end";
            return Err(problem::at(self.source, &raw.quantity, message, help, "this check"));
        }
        let quantity = raw.quantity.value;
        sampling.validate(raw.take.value).map_err(|message| {
            let help = "docs/reference/validation-file.md lists the keys that each `take` needs";
            let message = format!("\"{quantity}\": {message}");
            problem::at(self.source, &raw.take, message, help, "this measure")
        })?;
        let mut bounds = Bounds { range: [raw.at_least, raw.at_most], ..Bounds::default() };
        if let Some(tolerance) = &raw.tolerance {
            match &tolerance.value {
                Tolerance::Absolute(value) => bounds.absolute = Some(*value),
                Tolerance::Relative(text) => {
                    let number = text.strip_suffix('%').and_then(|n| n.trim().parse::<f64>().ok());
                    let percent = number.ok_or_else(|| {
                        let message = format!("tolerance \"{text}\" is not a percentage");
                        let help = "write a number, or a percentage such as \"2 %\"";
                        problem::at(self.source, tolerance, message, help, "here")
                    })?;
                    bounds.relative = Some(percent / 100.0);
                }
            }
            if bounds
                .absolute
                .or(bounds.relative)
                .is_some_and(|bound| bound.is_nan() || bound < 0.0)
            {
                let message = "no value lies within a negative tolerance";
                let help = "write the tolerance without a sign";
                return Err(problem::at(self.source, tolerance, message, help, "here"));
            }
            if raw.reference.is_none() {
                let help = "add `reference = ...`, or use `at_least` and `at_most`";
                let message = "a tolerance needs a reference";
                let label = "without a reference";
                return Err(problem::at(self.source, tolerance, message, help, label));
            }
        }
        Ok(Check {
            quantity,
            measure: raw.take.value,
            sampling,
            constants: constants.clone(),
            reference: raw.reference.map(|r| match r.value {
                RawReference::Number(value) => Reference::Number(value),
                RawReference::Run { run } => Reference::Run(run),
            }),
            bounds,
        })
    }
}

/// Checks that every reference is to an earlier run that measures the same quantity.
fn check_references(suite: &Suite) -> Result<(), Problem> {
    for (i, run) in suite.runs.iter().enumerate() {
        let earlier = &suite.runs[..i];
        for check in &run.checks {
            let Some(Reference::Run(other)) = &check.reference else {
                continue;
            };
            let mut known = earlier.iter().filter(|r| r.name == *other);
            if !known.any(|r| r.checks.iter().any(|c| c.quantity == check.quantity)) {
                let names = earlier.iter().map(|r| r.name.as_str());
                let hint = did_you_mean(other, names);
                let message = format!(
                    "{}: run \"{}\" compares \"{}\" with that of \"{other}\", which has none",
                    suite.name, run.name, check.quantity
                );
                let help = format!("{hint}name an earlier run that measures this quantity");
                return Err(Problem::new(message).help(help));
            }
        }
    }
    Ok(())
}

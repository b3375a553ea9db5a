//! What is wrong with a case file, and where.

use std::fmt;
use std::ops::Range;
use std::path::PathBuf;

use miette::{Diagnostic, LabeledSpan, NamedSource, SourceCode};

/// One thing wrong with a case file.
#[derive(Clone, Debug)]
pub struct Problem {
    /// Dotted key, "fluid.density".
    pub key: Option<String>,
    /// What was found and what is wrong with it.
    pub message: String,
    /// What to do.
    pub help: Option<String>,
    place: Option<Box<Place>>,
}

/// A range of a named text, and a few words about it.
#[derive(Clone, Debug)]
struct Place {
    source: NamedSource<String>,
    label: String,
    span: Range<usize>,
}

impl Problem {
    /// A problem without a place.
    pub fn new(message: impl Into<String>) -> Problem {
        Problem {
            key: None,
            message: message.into(),
            help: None,
            place: None,
        }
    }
    /// With the dotted key it concerns.
    #[must_use]
    pub fn key(mut self, key: impl Into<String>) -> Problem {
        self.key = Some(key.into());
        self
    }
    /// With what to do about it.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Problem {
        self.help = Some(help.into());
        self
    }
    /// With its place: a name and text, a range of its bytes, and a few words about that range.
    #[must_use]
    pub fn at(
        mut self,
        name: &str,
        text: &str,
        span: Range<usize>,
        label: impl Into<String>,
    ) -> Problem {
        let source = NamedSource::new(name, text.to_string());
        self.place = Some(Box::new(Place {
            source,
            label: label.into(),
            span,
        }));
        self
    }
    /// File, line and column (both from 1) of the place.
    pub fn place(&self) -> Option<(&str, usize, usize)> {
        let Place { source, span, .. } = self.place.as_deref()?;
        let before = source.inner().get(..span.start)?;
        let line = before.matches('\n').count() + 1;
        let column = before.rsplit('\n').next().map_or(0, |l| l.chars().count()) + 1;
        Some((source.name(), line, column))
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.key {
            Some(key) => write!(f, "{key}: {}", self.message),
            None => f.write_str(&self.message),
        }
    }
}

impl std::error::Error for Problem {}

impl Diagnostic for Problem {
    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        self.help
            .as_ref()
            .map(|h| Box::new(h) as Box<dyn fmt::Display>)
    }
    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.place
            .as_deref()
            .map(|place| &place.source as &dyn SourceCode)
    }
    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let Place { label, span, .. } = self.place.as_deref()?;
        let label = (!label.is_empty()).then(|| label.clone());
        Some(Box::new(std::iter::once(LabeledSpan::new(
            label,
            span.start,
            span.len().max(1),
        ))))
    }
}

/// Why a case could not be loaded.
#[derive(Debug, thiserror::Error)]
pub enum CaseError {
    /// The file could not be read.
    #[error("cannot read the case file {}: {source}", path.display())]
    Unreadable {
        /// Path of the case file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The contents are wrong.
    #[error("{}", list(.0))]
    Invalid(Vec<Problem>),
}

fn list(problems: &[Problem]) -> String {
    problems
        .iter()
        .map(Problem::to_string)
        .collect::<Vec<_>>()
        .join("\n")
}

impl CaseError {
    /// The problems, for a reporter that shows them one by one.
    pub fn problems(&self) -> &[Problem] {
        match self {
            CaseError::Unreadable { .. } => &[],
            CaseError::Invalid(problems) => problems,
        }
    }
}

impl From<Problem> for CaseError {
    fn from(problem: Problem) -> Self {
        CaseError::Invalid(vec![problem])
    }
}

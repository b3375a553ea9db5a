//! Problems of case files with their positions.

use std::fmt;
use std::ops::Range;
use std::path::PathBuf;

use miette::{Diagnostic, LabeledSpan, NamedSource, SourceCode};

/// Problem of a case file.
#[derive(Clone, Debug)]
pub struct Problem {
    /// Dotted key, "fluid.density".
    pub key: Option<String>,
    /// Value found and the rule it breaks.
    pub message: String,
    /// Remedy.
    pub help: Option<String>,
    excerpt: Option<Box<Excerpt>>,
}

/// Range of a named text with a label.
#[derive(Clone, Debug)]
struct Excerpt {
    source: NamedSource<String>,
    label: String,
    span: Range<usize>,
}

impl Problem {
    /// Returns a problem without a position.
    pub fn new(message: impl Into<String>) -> Problem {
        Problem { key: None, message: message.into(), help: None, excerpt: None }
    }
    /// Adds the dotted key.
    #[must_use]
    pub fn key(mut self, key: impl Into<String>) -> Problem {
        self.key = Some(key.into());
        self
    }
    /// Adds the remedy.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Problem {
        self.help = Some(help.into());
        self
    }
    /// Adds the position: name and text of the source, range of its bytes, and a label.
    #[must_use]
    pub fn at(
        mut self,
        name: &str,
        text: &str,
        span: Range<usize>,
        label: impl Into<String>,
    ) -> Problem {
        let source = NamedSource::new(name, text.to_string());
        self.excerpt = Some(Box::new(Excerpt { source, label: label.into(), span }));
        self
    }
    /// Returns the problem with other words in its message, its remedy and the name of its source.
    #[must_use]
    pub fn reworded(mut self, words: impl Fn(&str) -> String) -> Problem {
        self.message = words(&self.message);
        self.help = self.help.as_deref().map(&words);
        if let Some(excerpt) = &mut self.excerpt {
            let text = excerpt.source.inner().clone();
            excerpt.source = NamedSource::new(words(excerpt.source.name()), text);
        }
        self
    }
    /// Returns one line per problem.
    pub fn list(problems: &[Problem]) -> String {
        problems.iter().map(Problem::to_string).collect::<Vec<_>>().join("\n")
    }
    /// Returns file, line and column of the position; lines and columns count from 1.
    pub fn place(&self) -> Option<(&str, usize, usize)> {
        let Excerpt { source, span, .. } = self.excerpt.as_deref()?;
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
        Some(Box::new(self.help.as_ref()?))
    }
    fn source_code(&self) -> Option<&dyn SourceCode> {
        Some(&self.excerpt.as_deref()?.source)
    }
    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let Excerpt { label, span, .. } = self.excerpt.as_deref()?;
        let label = (!label.is_empty()).then(|| label.clone());
        let label = LabeledSpan::new(label, span.start, span.len().max(1));
        Some(Box::new(std::iter::once(label)))
    }
}

/// Error of loading a case.
#[derive(Debug, thiserror::Error)]
pub enum CaseError {
    /// The file could not be read.
    #[error("cannot read the case file {}: {source}", path.display())]
    Unreadable {
        /// Path of the case file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The contents are wrong.
    #[error("{}", Problem::list(.0))]
    Invalid(Vec<Problem>),
    /// The flag of the caller ended the work.
    #[error("interrupted")]
    Interrupted,
}

impl CaseError {
    /// Returns the problems of an invalid case.
    pub fn problems(&self) -> &[Problem] {
        match self {
            CaseError::Unreadable { .. } | CaseError::Interrupted => &[],
            CaseError::Invalid(problems) => problems,
        }
    }
}

impl From<Problem> for CaseError {
    fn from(problem: Problem) -> Self {
        CaseError::Invalid(vec![problem])
    }
}

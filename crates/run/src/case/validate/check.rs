//! Collects the problems of a case, each with its place.

use std::ops::Range;

use crate::case::error::Problem;
use crate::case::loc::Loc;
use crate::case::quantity::{Kind, Quantity};
use crate::case::readable::{number, quantity};
use crate::case::source::Source;

/// Collects problems; a case is good when there are none.
pub(super) struct Checker<'a> {
    source: &'a Source,
    pub problems: Vec<Problem>,
}

impl<'a> Checker<'a> {
    pub fn new(source: &'a Source) -> Checker<'a> {
        Checker {
            source,
            problems: Vec::new(),
        }
    }

    /// Notes a problem of `key`, written at `span` unless it is a default.
    pub fn fail(
        &mut self,
        span: Option<&Range<usize>>,
        key: &str,
        message: impl Into<String>,
        help: impl Into<String>,
    ) {
        let problem = Problem::new(message).key(key).help(help);
        self.problems
            .push(self.source.locate(problem, span, "here"));
    }

    /// Whether a value at `key` or under it is written as a number without a unit.
    pub fn is_bare(&self, key: &str) -> bool {
        self.source.is_bare(key)
    }

    /// Whether an override set what stands at `span`, or a part of it.
    pub fn is_overridden(&self, span: &Range<usize>) -> bool {
        self.source.is_overridden(span)
    }

    /// The value if it is above zero.
    pub fn positive<K: Kind>(
        &mut self,
        value: &Loc<Quantity<K>>,
        key: &str,
        what: &str,
    ) -> Option<f64> {
        if value.si > 0.0 {
            return Some(value.si);
        }
        self.fail(
            value.span.as_ref(),
            key,
            format!(
                "{what} must be greater than zero, found {}",
                quantity(value.si, K::SI)
            ),
            format!("give a positive `{key}`"),
        );
        None
    }

    /// The value if it lies in `low..=high`.
    pub fn within<K: Kind>(
        &mut self,
        value: &Loc<Quantity<K>>,
        key: &str,
        low: f64,
        high: f64,
    ) -> Option<f64> {
        if (low..=high).contains(&value.si) {
            return Some(value.si);
        }
        let range = if high.is_finite() {
            format!("between {} and {}", number(low), number(high))
        } else {
            format!("at least {}", number(low))
        };
        self.fail(
            value.span.as_ref(),
            key,
            format!("found {}, which is out of range", quantity(value.si, K::SI)),
            format!("`{key}` must be {range}"),
        );
        None
    }
}

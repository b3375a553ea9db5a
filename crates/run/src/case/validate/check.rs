//! Collector of the problems of a case.

use std::sync::atomic::{AtomicBool, Ordering};

use glam::DVec3;

use crate::case::error::Problem;
use crate::case::located::{Located, Span};
use crate::case::quantity::{Kind, Length, Quantity};
use crate::case::source::Source;
use crate::number_format::{AXES, length, number, quantity};
use grainwake_solver::grid::Mesh;

/// Collector of problems; a case without problems is valid.
pub(super) struct Checker<'a> {
    source: &'a Source,
    /// Flag that ends the work.
    pub stop: &'a AtomicBool,
    pub problems: Vec<Problem>,
}

impl<'a> Checker<'a> {
    pub fn new(source: &'a Source, stop: &'a AtomicBool) -> Checker<'a> {
        let problems = Vec::new();
        Checker { source, stop, problems }
    }

    /// Returns whether the work was ended.
    pub fn stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Reports a problem of the value at `span`; its key follows from the position.
    pub fn fail(&mut self, span: &Span, message: impl Into<String>, help: impl Into<String>) {
        self.problems.push(self.source.problem(message, help, span.as_ref(), "here"));
    }

    /// Reports a problem like [`Checker::fail`]; there is no value.
    pub fn refuse<T>(
        &mut self,
        span: &Span,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> Option<T> {
        self.fail(span, message, help);
        None
    }

    /// Reports a problem of `key`, which is not written in the file.
    pub fn fail_key(&mut self, key: &str, message: impl Into<String>, help: impl Into<String>) {
        self.problems.push(Problem::new(message).key(key).help(help));
    }

    /// Returns the position of the value of `key`; none if the file does not give it.
    pub fn span_of(&self, key: &str) -> Span {
        self.source.value_of(key).cloned()
    }

    /// Returns the dotted key of the value at `span`; empty for a default.
    pub fn key(&self, span: &Span) -> &str {
        let key = span.as_ref().and_then(|span| self.source.key_at(span));
        key.unwrap_or_default()
    }

    /// Returns whether a value at `key` or below it is written as a number without a unit.
    pub fn is_bare(&self, key: &str) -> bool {
        self.source.is_bare(key)
    }

    /// Returns whether an override set the value at `span` or a part of it.
    pub fn is_overridden(&self, span: &Span) -> bool {
        (span.as_ref()).is_some_and(|span| self.source.is_overridden(span))
    }

    /// Returns the value if it is above zero.
    pub fn positive<K: Kind>(&mut self, value: &Located<Quantity<K>>, name: &str) -> Option<f64> {
        if value.si > 0.0 {
            return Some(value.si);
        }
        let found = quantity(value.si, K::SI);
        let message = format!("{name} must be greater than zero, found {found}");
        let help = format!("give a positive `{}`", self.key(&value.span));
        self.refuse(&value.span, message, help)
    }

    /// Returns the value if it lies in `low..=high`.
    pub fn within<K: Kind>(
        &mut self,
        value: &Located<Quantity<K>>,
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
        let message = format!("found {}, which is out of range", quantity(value.si, K::SI));
        let help = format!("`{}` must be {range}", self.key(&value.span));
        self.refuse(&value.span, message, help)
    }

    /// Returns the value if it is zero or more.
    pub fn not_negative<K: Kind>(&mut self, value: &Located<Quantity<K>>) -> Option<f64> {
        self.within(value, 0.0, f64::INFINITY)
    }

    /// Returns the number of the axis of this name.
    pub fn axis(&mut self, name: &Located<String>) -> Option<usize> {
        let axis = AXES.iter().position(|axis| *axis == name.value);
        axis.or_else(|| {
            let message = format!("found \"{}\"", name.value);
            self.refuse(&name.span, message, "accepted: \"x\", \"y\", \"z\"")
        })
    }

    /// Returns a coordinate [m] of the box along an axis, like [`into_box`].
    pub fn coordinate(
        &mut self,
        at: &Located<Quantity<Length>>,
        axis: usize,
        mesh: &Mesh,
    ) -> Option<f64> {
        let (lower, upper) = (mesh.origin[axis], mesh.upper()[axis]);
        into_box(at.si, lower, upper).or_else(|| {
            let message = format!("{} lies outside the box", length(at.si));
            let help = format!("between {} and {}", length(lower), length(upper));
            self.refuse(&at.span, message, help)
        })
    }
}

/// Returns a coordinate [m] of the box, at the side if it lies beyond it by rounding only; none
/// outside the box.
fn into_box(at: f64, lower: f64, upper: f64) -> Option<f64> {
    let rounding = 1e-9 * (upper - lower);
    (lower - rounding..=upper + rounding).contains(&at).then(|| at.clamp(lower, upper))
}

/// Returns a point of the box like [`into_box`].
pub(super) fn point_into_box(at: DVec3, lower: DVec3, upper: DVec3) -> Option<DVec3> {
    let along = |axis: usize| into_box(at[axis], lower[axis], upper[axis]);
    Some(DVec3::new(along(0)?, along(1)?, along(2)?))
}

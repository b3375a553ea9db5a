//! Ranges of materials and of parameters.

use super::grain::Material;

impl Material {
    /// Checks the elastic constants and the restitution.
    ///
    /// # Errors
    /// A message with the constant, its value and its range.
    pub fn validate(&self) -> Result<(), String> {
        check("Young's modulus", self.youngs_modulus, ("positive", |x| x > 0.0))?;
        let range: Range = ("above -1 and at most 0.5", |x| x > -1.0 && x <= 0.5);
        check("Poisson ratio", self.poisson_ratio, range)?;
        check("restitution", self.restitution, FRACTION)
    }
}

/// Range of a parameter: its words in a message, and the test of a value.
pub(super) type Range = (&'static str, fn(f64) -> bool);

pub(super) const POSITIVE: Range = ("positive and finite", |x| x > 0.0 && x.is_finite());
pub(super) const NOT_NEGATIVE: Range = ("at least 0 and finite", |x| x >= 0.0 && x.is_finite());
pub(super) const FRACTION: Range = ("from 0 to 1", |x| (0.0..=1.0).contains(&x));

/// Checks that a parameter is in its range.
pub(super) fn check(name: &str, value: f64, (range, holds): Range) -> Result<(), String> {
    if holds(value) { Ok(()) } else { Err(format!("the {name} must be {range}, not {value}")) }
}

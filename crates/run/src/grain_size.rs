//! Plausible sizes of grains.

use std::ops::RangeInclusive;

use grainwake_shape::Shape;

use crate::number_format::length;

/// Accepted equivalent diameters [m].
const ACCEPTED: RangeInclusive<f64> = 1e-6..=1.0;

/// Refuses a shape of implausible size, which indicates a wrong unit.
///
/// # Errors
/// A message for the user, without the remedy.
pub fn check_grain_size(shape: &Shape) -> Result<(), String> {
    let diameter = shape.equivalent_diameter();
    if ACCEPTED.contains(&diameter) {
        return Ok(());
    }
    Err(format!(
        "the grain has an equivalent diameter of {}; accepted are 1 um to 1 m",
        length(diameter)
    ))
}

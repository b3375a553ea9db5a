//! Generated grains of given sphericity and roundness.
//!
//! A generated grain (`Stone`) is a random convex polytope with slightly bulging faces (an
//! intersection of balls), eroded by r and dilated by a ball of radius r. Every edge and corner
//! then has the radius r, and the largest inscribed sphere keeps its radius R_in, so that Wadell's
//! roundness (Eq. 39) is r / R_in by construction. The proportions are iterated until the extents
//! along the principal axes have the target ratios, which set Krumbein's sphericity (Eq. 38). The
//! distance is exact.

mod ball_intersection;
mod stone;

use crate::assemble::{Body, assemble};
use crate::error::{Defect, Result, ShapeError, check_length, within};
use crate::provenance::Provenance;
use crate::random::Random;
use crate::roundness::Surface;
use crate::{Shape, ShapeOptions};
use glam::DVec3;
use rand::SeedableRng;

/// Target measures of a generated grain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FamilyTarget {
    /// Krumbein sphericity S (Eq. 38), 0.3 to 0.97.
    pub sphericity: f64,
    /// Wadell roundness R (Eq. 39), 0.05 to 0.95.
    pub roundness: f64,
    /// Flatness c / b: 1 for rods and balls, small for plates, and at least S^3.
    pub flatness: f64,
    /// Diameter of the sphere of equal volume [m].
    pub equivalent_diameter: f64,
}

impl FamilyTarget {
    /// Returns a target of this sphericity, roundness and equivalent diameter [m] with c / b = 0.8,
    /// or more if the sphericity requires it.
    pub fn new(sphericity: f64, roundness: f64, equivalent_diameter: f64) -> FamilyTarget {
        FamilyTarget {
            sphericity,
            roundness,
            flatness: sphericity.powi(3).max(0.8),
            equivalent_diameter,
        }
    }

    fn check(&self) -> Result<()> {
        let reason = "must lie between 0.3 and 0.97";
        within("sphericity", self.sphericity, 0.3..=0.97, reason)?;
        let reason = "must lie between 0.05 and 0.95";
        within("roundness", self.roundness, 0.05..=0.95, reason)?;
        let reason = "must lie between 0.2 and 1";
        within("flatness", self.flatness, 0.2..=1.0, reason)?;
        // S^3 = (b/a) (c/a) with b <= a; the tolerance admits decimal rounding.
        let least = self.sphericity.powi(3) - 1e-6;
        let reason = "must be no less than the cube of the sphericity";
        within("flatness", self.flatness, least..=1.0, reason)?;
        check_length("equivalent diameter", self.equivalent_diameter)
    }
}

/// Returns the resolution that resolves edges of low roundness: 22 cells across the shortest
/// extent.
pub fn family_options() -> ShapeOptions {
    ShapeOptions { cells: Some(48), least_cells: 22, ..ShapeOptions::default() }
}

/// Attempts with other random faces before the search fails.
const ATTEMPTS: u64 = 50;

/// Generates one grain. Equal targets and seeds give equal grains.
///
/// # Errors
/// A target out of its range, or one that no attempt from this seed reaches.
pub fn family_grain(target: &FamilyTarget, seed: u64, options: &ShapeOptions) -> Result<Shape> {
    target.check()?;
    let cube = target.sphericity.powi(3);
    let flatness = target.flatness.max(cube);
    // S^3 = (b/a) (c/a) with c = flatness * b.
    let b = (cube / flatness).sqrt();
    let ratios = DVec3::new(1.0, b, flatness * b);
    let key = seed
        ^ target.sphericity.to_bits().rotate_left(17)
        ^ target.roundness.to_bits().rotate_left(41);
    for attempt in 0..ATTEMPTS {
        let mut random =
            Random::seed_from_u64(key.wrapping_add(attempt.wrapping_mul(0xd134_2543_de82_ef95)));
        let Some(stone) = stone::stone(ratios, target.roundness, &mut random) else {
            continue;
        };
        let size = target.equivalent_diameter / (6.0 * stone.volume / std::f64::consts::PI).cbrt();
        let body = Body {
            distance: |x: DVec3, _: &mut u32| {
                size * (stone.core.distance(x / size).0 - stone.radius)
            },
            lower: stone.lower * size,
            upper: stone.upper * size,
            volume: Some(stone.volume * size.powi(3)),
            area: None,
            corners: None,
            surface: Surface::Family,
        };
        let provenance = Provenance::new("family")
            .with("sphericity", target.sphericity)
            .with("roundness", target.roundness)
            .with("flatness", flatness)
            .with("seed", seed)
            .with("attempt", attempt)
            .with("faces", stone.faces)
            .with("edge_radius_m", stone.radius * size)
            .with("inscribed_radius_m", stone.inscribed * size);
        let shape = assemble(&body, provenance, options)?;
        return shape.scaled_to_equivalent_diameter(target.equivalent_diameter);
    }
    let reason = format!(
        "no stone of sphericity {} and roundness {} in {ATTEMPTS} attempts; try another seed or \
         flatness",
        target.sphericity, target.roundness
    );
    Err(ShapeError::quality(Defect::Target, reason))
}

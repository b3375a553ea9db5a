//! Lubrication across the gap of a pair, as far as the grid does not resolve its film
//! (`docs/decisions/0030-lubrication.md`).

use std::f64::consts::PI;

use super::PairLoads;
use super::law::PairProperties;
use super::model::{ContactModel, Film, PairKinematics};
use crate::dem::search::ContactPoint;

/// s of the film that the grid resolves, and the thickness of the film over the gap.
///
/// A slip wall is a plane of symmetry. The film there is that between the grain and its mirror
/// image: twice as thick as the gap.
fn share_and_thickness(film: Film) -> (f64, f64) {
    match film {
        Film::BetweenGrains => (0.07, 1.0),
        Film::AtWall => (0.35, 1.0),
        Film::AtSlipWall => (0.35, 2.0),
    }
}

impl ContactModel {
    /// Resistance 6 pi mu R*^2 / h [N s/m] of a film between the equal-volume spheres.
    pub fn film_resistance(&self, pair: &PairProperties, film: f64) -> f64 {
        6.0 * PI * self.params.lubrication_viscosity * pair.reduced_radius.powi(2) / film
    }

    /// Force of a film h, at least as thick as the asperities are high, less that of a film
    /// h_g = h + s (h_0 - h), which the grid resolves.
    pub(super) fn lubrication(
        &self,
        closest: &ContactPoint,
        properties: &PairProperties,
        pair: &PairKinematics,
    ) -> PairLoads {
        let (params, range) = (&self.params, self.range());
        let ContactPoint { overlap, lever_arm, normal, .. } = *closest;
        let (share, thickness) = share_and_thickness(pair.film);
        let film = thickness * params.roughness.max(-overlap);
        if film >= range {
            return PairLoads::default();
        }
        let grid_film = film + share * (range - film);
        // Grain and mirror image have half the radius R* and close their film twice as fast.
        let [thin, resolved] =
            [film, grid_film].map(|h| self.film_resistance(properties, h) / thickness);
        let resistance = pair.stable_damping(thin - resolved, lever_arm, normal);
        let approach = pair.relative_velocity(lever_arm, |v| v.end).dot(normal);
        let [on_grain, on_partner] = pair.loads(-resistance * approach * normal, lever_arm);
        PairLoads { overlap, on_grain, on_partner, lever_arm, normal, elastic_energy: 0.0 }
    }
}

//! Stiffness that keeps an impact within a given overlap.

use super::law::{BodyProperties, ContactMaterial, PairProperties};
use super::parameters::{ContactLawKind, ContactParams};
use crate::dem::grain::Grain;

impl ContactParams {
    /// Returns the factor on the stiffness (linear law) or on Young's modulus (Hertz-Mindlin) at
    /// which a pair that is closing at `speed` [m/s] with the overlap `now` [m] would overlap by at
    /// most `wanted` [m].
    ///
    /// The energy of the spring and of the approach is that of an impact at a higher speed. A
    /// partner of `None` is a wall.
    pub fn stiffening(
        &self,
        grain: &Grain,
        partner: Option<&Grain>,
        speed: f64,
        now: f64,
        wanted: f64,
    ) -> f64 {
        let body = |grain: &Grain| BodyProperties {
            inverse_mass: grain.inverse_mass(self.added_density),
            ..BodyProperties::of(grain)
        };
        let wall = ContactMaterial::new(&self.wall_material);
        let pair = PairProperties::new(&body(grain), partner.map(body).as_ref(), &wall);
        // Overlap ~ speed^n and stiffness^(-n / 2).
        let n = match self.law {
            ContactLawKind::Linear => 1.0,
            ContactLawKind::HertzMindlin => 0.8,
        };
        let law = self.force_law();
        let of_speed = |speed: f64| law.impact_overlap(&pair, speed);
        let stored = (now / of_speed(1.0)).powf(1.0 / n);
        let overlap = of_speed(stored.hypot(speed));
        (overlap / wanted).powf(2.0 / n)
    }
}

#[cfg(test)]
mod tests {
    use grainwake_shape::ShapeOptions;
    use grainwake_shape::analytic::sphere;

    use super::*;
    use crate::dem::material::Material;

    #[test]
    fn the_stiffened_contact_has_the_wanted_overlap() {
        let material = Material { youngs_modulus: 1e6, poisson_ratio: 0.3, restitution: 1.0 };
        let shape = sphere(1e-3, &ShapeOptions::default()).unwrap();
        let grain = Grain::new(shape, 2500.0).with_material(material);
        for law in [ContactLawKind::Linear, ContactLawKind::HertzMindlin] {
            let soft = ContactParams { law, normal_stiffness: 10.0, ..Default::default() };
            let full = soft.impact_overlap(&grain, 0.1);
            // All energy is that of the approach, then all is that of the spring.
            for (speed, now) in [(0.1, 0.0), (0.0, full)] {
                let factor = soft.stiffening(&grain, None, speed, now, 0.1 * full);
                let mut stiff = (soft, grain.clone());
                stiff.0.normal_stiffness *= factor;
                stiff.1.material.youngs_modulus *= factor;
                let reached = stiff.0.impact_overlap(&stiff.1, 0.1) / full;
                assert!((reached - 0.1).abs() < 1e-9, "{law:?}, {speed} m/s: {reached}");
            }
        }
    }
}

//! Distances from a grain near it, at a few nanoseconds each wherever the point lies.
//!
//! The grid of a sampled shape ends closer to the surface than the flow asks for, and distances off
//! it are searched for. Here a second, coarser grid about the first holds them.

use std::collections::HashMap;
use std::sync::Arc;

use glam::DVec3;
use grainwake_shape::{Field, SampledField, Shape};

use crate::dem::Grain;

/// Samples of the coarse grid in half the band, and across a grain: what counts more.
const SAMPLES: f64 = 3.0;
const ACROSS: f64 = 12.0;

/// The shapes of all grains with what lies about them.
pub struct NearShapes {
    /// Of each grain.
    shapes: Vec<NearShape>,
}

/// A shape and the distances about it.
#[derive(Clone)]
pub struct NearShape {
    shape: Arc<Shape>,
    /// None where the shape answers by itself: a sphere, or a grid that reaches as far.
    about: Option<Arc<SampledField>>,
    /// How far distances are asked for [m].
    reach: f64,
}

impl NearShapes {
    /// For distances up to `reach` [m] about the grains, in a flow with the band `eps` [m].
    pub fn new(grains: &[Grain], eps: f64, reach: f64) -> NearShapes {
        let mut known: HashMap<*const Shape, NearShape> = HashMap::new();
        let of = |grain: &Grain| {
            let near = known.entry(Arc::as_ptr(&grain.shape));
            near.or_insert_with(|| NearShape::new(&grain.shape, eps, reach))
                .clone()
        };
        NearShapes {
            shapes: grains.iter().map(of).collect(),
        }
    }

    /// That of grain `index`.
    pub fn of(&self, index: usize) -> &NearShape {
        &self.shapes[index]
    }

    /// Memory held beside the shapes [bytes].
    pub fn bytes(&self) -> usize {
        let mut fields: Vec<_> = self
            .shapes
            .iter()
            .filter_map(|n| n.about.as_ref())
            .collect();
        fields.sort_by_key(|field| Arc::as_ptr(field));
        fields.dedup_by_key(|field| Arc::as_ptr(field));
        let levels = fields.iter().map(|field| field.levels().len());
        size_of::<f32>() * levels.sum::<usize>()
    }
}

/// Does the grid of a field hold this box?
fn holds(field: &SampledField, lower: DVec3, upper: DVec3) -> bool {
    field.lower().cmple(lower).all() && field.upper().cmpge(upper).all()
}

impl NearShape {
    fn new(shape: &Arc<Shape>, eps: f64, reach: f64) -> NearShape {
        let about = if let Field::Sampled(field) = shape.field()
            && !holds(field, shape.lower() - reach, shape.upper() + reach)
        {
            // No finer than the shape itself, so that large grains cost no more than that.
            let thickness = (shape.upper() - shape.lower()).min_element();
            let spacing = (eps / SAMPLES).min(thickness / ACROSS);
            let spacing = spacing.max(field.spacing());
            let margin = reach + spacing;
            shape.resampled(spacing, margin).ok().map(Arc::new)
        } else {
            None
        };
        NearShape {
            shape: shape.clone(),
            about,
            reach,
        }
    }

    /// Signed distance [m] and its gradient at `x`, both in the frame of the grain; the distance may
    /// be infinite where it is more than the reach.
    #[inline]
    pub fn distance_and_gradient(&self, x: DVec3) -> (f64, DVec3) {
        const FAR: (f64, DVec3) = (f64::INFINITY, DVec3::ZERO);
        let Field::Sampled(field) = self.shape.field() else {
            return self.shape.distance_and_gradient(x);
        };
        if let Some(found) = field.distance_and_gradient_on_grid(x) {
            return found;
        }
        match &self.about {
            Some(about) => about.distance_and_gradient_on_grid(x).unwrap_or(FAR),
            None if field.distance_within(x, self.reach) > self.reach => FAR,
            None => field.distance_and_gradient(x),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use grainwake_shape::{ShapeOptions, analytic};

    /// An ellipsoid of half-axes 1, .8 and .7.
    fn ellipsoid() -> Arc<Shape> {
        Arc::new(analytic::ellipsoid(1.0, 0.8, 0.7, &ShapeOptions::default()).unwrap())
    }

    #[test]
    fn distances_about_a_shape_go_on_where_its_grid_ends() {
        let shape = ellipsoid();
        let Field::Sampled(field) = shape.field() else {
            unreachable!("ellipsoids are sampled")
        };
        // 8 and 3 cells of the flow across.
        for (eps, tolerance) in [(0.25, 0.01), (0.67, 0.03)] {
            let reach = 2.5 * eps;
            let near = NearShape::new(&shape, eps, reach);
            let mut beyond = 0;
            for i in 0..20_000 {
                let u = DVec3::new(0.8191725134, 0.6710436067, 0.5497004779) * f64::from(i);
                let x = (1.1 + reach) * (2.0 * u.fract() - DVec3::ONE);
                let (exact, gradient) = shape.distance_and_gradient(x);
                let (distance, slope) = near.distance_and_gradient(x);
                if exact > reach {
                    assert!(distance > 0.97 * reach, "at {x}");
                } else if field.distance_and_gradient_on_grid(x).is_some() {
                    assert_eq!(distance, exact, "at {x}");
                } else {
                    beyond += 1;
                    let off = (distance - exact).abs() / eps;
                    assert!(off < tolerance, "{off} of the band at {x}");
                    assert!(slope.normalize().dot(gradient) > 0.99, "at {x}");
                }
            }
            assert!(beyond > 1000, "{beyond}");
        }
    }

    #[test]
    fn a_grid_that_reaches_far_enough_is_not_doubled() {
        let near = |eps| NearShape::new(&ellipsoid(), eps, 2.5 * eps);
        assert!(near(0.25).about.is_some());
        let near = near(0.05);
        assert!(near.about.is_none());
        let distance = |z: f64| near.distance_and_gradient(DVec3::new(0.0, 0.0, z)).0;
        assert!(distance(5.0) > 0.125);
        assert!((distance(0.8) - 0.1).abs() < 1e-3);
    }
}

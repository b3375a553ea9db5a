//! The grain shape.

use crate::error::{Result, check_length, positive};
use crate::field::SampledField;
use crate::morphology::Morphology;
use crate::nodes::SurfaceNode;
use crate::provenance::Provenance;
use crate::quality::Quality;
use crate::surface;
use crate::triangles::cube_sphere;
use glam::{DMat3, DQuat, DVec3};

/// Representation of the distance.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Field {
    /// Exact sphere of this radius [m].
    Sphere(f64),
    /// Samples on a grid.
    Sampled(SampledField),
}

/// An immutable grain shape.
#[derive(Clone, Debug, PartialEq)]
pub struct Shape {
    pub(crate) field: Field,
    pub(crate) nodes: Vec<SurfaceNode>,
    pub(crate) volume: f64,
    pub(crate) inertia: DVec3,
    pub(crate) lower: DVec3,
    pub(crate) upper: DVec3,
    pub(crate) bounding_radius: f64,
    pub(crate) morphology: Morphology,
    pub(crate) quality: Option<Quality>,
    pub(crate) provenance: Provenance,
}

impl Shape {
    /// Returns the signed distance [m] at `x` (principal frame), negative inside.
    #[inline]
    pub fn distance(&self, x: DVec3) -> f64 {
        match &self.field {
            Field::Sphere(radius) => x.length() - radius,
            Field::Sampled(field) => field.distance(x),
        }
    }

    /// Returns the signed distance [m] at `x` if it is at most `limit`; a larger one may be
    /// infinite.
    #[inline]
    pub fn distance_within(&self, x: DVec3, limit: f64) -> f64 {
        match &self.field {
            Field::Sphere(radius) => x.length() - radius,
            Field::Sampled(field) => field.distance_within(x, limit),
        }
    }

    /// Returns signed distance [m] and gradient (outward normal where |gradient| = 1) at `x`. On
    /// the grid of a sampled field the gradient is that of the trilinear interpolant and its length
    /// is 1 to the accuracy of the field; off the grid it is a unit vector.
    #[inline]
    pub fn distance_and_gradient(&self, x: DVec3) -> (f64, DVec3) {
        match &self.field {
            Field::Sphere(radius) => {
                let length = x.length();
                let normal = if length > 0.0 { x / length } else { DVec3::ZERO };
                (length - radius, normal)
            }
            Field::Sampled(field) => field.distance_and_gradient(x),
        }
    }

    /// Samples the distance on a grid that exceeds the bounding box by `margin` [m]. The grid has
    /// the spacing `spacing` [m], or the shape's own samples unless those are finer by more than a
    /// tenth.
    ///
    /// # Errors
    /// The grid needs more samples than single precision can index.
    pub fn distances(&self, spacing: f64, margin: f64) -> Result<SampledField> {
        match &self.field {
            Field::Sampled(own) if own.spacing() >= 0.9 * spacing => {
                own.extended(|x| self.distance(x), self.lower, self.upper, margin)
            }
            _ => {
                let distance = |x: DVec3, _: &mut u32| self.distance(x);
                SampledField::sample(&distance, self.lower, self.upper, spacing, margin)
            }
        }
    }

    /// Representation of the distance.
    pub fn field(&self) -> &Field {
        &self.field
    }
    /// Memory of distances and nodes [bytes].
    pub fn bytes(&self) -> usize {
        let field = match &self.field {
            Field::Sphere(_) => 0,
            Field::Sampled(field) => size_of_val(field.levels()),
        };
        field + size_of_val(self.nodes.as_slice())
    }
    /// Surface nodes, evenly spread.
    pub fn nodes(&self) -> &[SurfaceNode] {
        &self.nodes
    }
    /// Volume [m^3].
    pub fn volume(&self) -> f64 {
        self.volume
    }
    /// Principal second moments per unit density [m^5], so that I = rho * inertia.
    pub fn inertia(&self) -> DVec3 {
        self.inertia
    }
    /// Lower corner of the bounding box in the principal frame [m].
    pub fn lower(&self) -> DVec3 {
        self.lower
    }
    /// Upper corner of the bounding box in the principal frame [m].
    pub fn upper(&self) -> DVec3 {
        self.upper
    }
    /// Middle and half edges [m] of the box along the axes around the bounding box turned by
    /// `orientation`; from the centroid.
    pub fn turned_box(&self, orientation: DQuat) -> [DVec3; 2] {
        let turn = DMat3::from_quat(orientation);
        let middle = turn * (0.5 * (self.lower + self.upper));
        let half = 0.5 * (self.upper - self.lower);
        let [x, y, z] = [turn.x_axis, turn.y_axis, turn.z_axis].map(DVec3::abs);
        [middle, x * half.x + y * half.y + z * half.z]
    }
    /// Ends of the range of n for which `first` + n `step` lies in the bounding box, extended by
    /// `margin`; all in the principal frame [m]. The first end is the larger one if there are none.
    pub fn box_crossing(&self, margin: f64, first: DVec3, step: DVec3) -> [f64; 2] {
        let ends = [self.lower - margin, self.upper + margin].map(|end| (end - first) / step);
        [ends[0].min(ends[1]).max_element(), ends[0].max(ends[1]).min_element()]
    }
    /// Radius of the smallest sphere about the centroid that contains the shape [m].
    pub fn bounding_radius(&self) -> f64 {
        self.bounding_radius
    }
    /// Distances [m] along the axes from the centroid to the ends of the shape turned by
    /// `orientation`, below and above. Those of a sampled field reach beyond its surface nodes by
    /// half of their spacing.
    pub fn extents(&self, orientation: DQuat) -> [DVec3; 2] {
        if let Field::Sphere(radius) = self.field {
            return [DVec3::splat(radius); 2];
        }
        let turn = DMat3::from_quat(orientation);
        let to_nodes = self.nodes.iter().fold([DVec3::ZERO; 2], |[below, above], node| {
            let x = turn * node.position;
            [below.max(-x), above.max(x)]
        });
        let between = 0.5 * (self.surface_area() / self.nodes.len().max(1) as f64).sqrt();
        to_nodes.map(|extent| extent + between)
    }
    /// Diameter of the sphere of equal volume [m].
    pub fn equivalent_diameter(&self) -> f64 {
        (6.0 * self.volume / std::f64::consts::PI).cbrt()
    }
    /// Surface area [m^2].
    pub fn surface_area(&self) -> f64 {
        self.morphology.area
    }
    /// Morphology.
    pub fn morphology(&self) -> &Morphology {
        &self.morphology
    }
    /// Measured quality; `None` for the exact sphere.
    pub fn quality(&self) -> Option<&Quality> {
        self.quality.as_ref()
    }
    /// Origin of the shape.
    pub fn provenance(&self) -> &Provenance {
        &self.provenance
    }

    /// Returns the surface as a closed mesh in the principal frame [m]: positions and
    /// outward-facing triangles.
    pub fn surface_mesh(&self) -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let mesh = match &self.field {
            Field::Sphere(radius) => cube_sphere(24, |u| *radius * u),
            Field::Sampled(field) => surface::of_field(field),
        };
        (mesh.vertices, mesh.triangles)
    }

    /// Returns the shape scaled by `factor`.
    ///
    /// # Errors
    /// A factor that is not positive, or gives a size that no grain has.
    pub fn scaled(&self, factor: f64) -> Result<Shape> {
        positive("factor", factor)?;
        check_length("bounding radius of the scaled shape", self.bounding_radius * factor)?;
        let field = match &self.field {
            Field::Sphere(radius) => Field::Sphere(radius * factor),
            Field::Sampled(field) => Field::Sampled(field.scaled(factor)),
        };
        let node = |n: &SurfaceNode| SurfaceNode {
            position: n.position * factor,
            area: n.area * factor * factor,
        };
        let mut provenance = self.provenance.clone();
        provenance.scale *= factor;
        Ok(Shape {
            field,
            nodes: self.nodes.iter().map(node).collect(),
            volume: self.volume * factor.powi(3),
            inertia: self.inertia * factor.powi(5),
            lower: self.lower * factor,
            upper: self.upper * factor,
            bounding_radius: self.bounding_radius * factor,
            morphology: self.morphology.scaled(factor),
            quality: self.quality,
            provenance,
        })
    }

    /// Returns the shape scaled to the equivalent diameter `diameter` [m].
    ///
    /// # Errors
    /// A diameter that no grain has.
    pub fn scaled_to_equivalent_diameter(&self, diameter: f64) -> Result<Shape> {
        check_length("equivalent diameter", diameter)?;
        self.scaled(diameter / self.equivalent_diameter())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ShapeOptions, analytic};

    /// Along a unit vector n, an ellipsoid extends to the length of (a n_1, b n_2, c n_3).
    #[test]
    fn a_turned_ellipsoid_has_its_extents() {
        let semi_axes = DVec3::new(1.2, 0.4, 0.3);
        let ellipsoid = analytic::ellipsoid(1.2, 0.4, 0.3, &ShapeOptions::default()).unwrap();
        for n in 0..20 {
            let axis = DVec3::new(1.0, f64::from(n % 7) - 3.0, 0.3).normalize();
            let orientation = DQuat::from_axis_angle(axis, 0.2 * f64::from(n));
            let [below, above] = ellipsoid.extents(orientation);
            for x in ellipsoid.nodes().iter().map(|node| orientation * node.position) {
                assert!((x + below).min_element() > 0.0 && (above - x).min_element() > 0.0);
            }
            let to_body = DMat3::from_quat(orientation.inverse());
            for along in 0..3 {
                let expected = (semi_axes * (to_body * DVec3::AXES[along])).length();
                for found in [below[along], above[along]] {
                    let beyond = found - expected;
                    assert!((0.0..0.04).contains(&beyond), "{beyond} beyond {expected}");
                }
            }
        }
        let [from, to] = ellipsoid.box_crossing(0.1, DVec3::X, DVec3::X);
        assert!((from + 2.3).abs() < 0.02 && (to - 0.3).abs() < 0.02, "{from} {to}");
        let [from, to] = ellipsoid.box_crossing(0.1, DVec3::Y, DVec3::X);
        assert!(from > to, "{from} {to}");
        assert_eq!(Shape::sphere(0.5, 100).extents(DQuat::IDENTITY), [DVec3::splat(0.5); 2]);
    }
}

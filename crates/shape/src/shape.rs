//! The grain shape.

use crate::error::{Result, positive};
use crate::field::SampledField;
use crate::mesh::cube_sphere;
use crate::morphology::{Morphology, Record};
use crate::nodes::golden_spiral;
use crate::provenance::Provenance;
use crate::quality::Quality;
use crate::{assemble, grain_file, roundness};
use glam::DVec3;

/// A surface point with the area that it represents.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceNode {
    /// Position in the principal frame [m].
    pub position: DVec3,
    /// Area represented by the node [m^2]; the areas add up to the surface area.
    pub area: f64,
}

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
    /// Builds a sphere of `radius` [m] with about `nodes` evenly spread surface nodes and exact
    /// distances. [`analytic::sphere`](crate::analytic::sphere) checks its arguments.
    pub fn sphere(radius: f64, nodes: usize) -> Shape {
        let volume = 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3);
        let area = 4.0 * std::f64::consts::PI * radius * radius;
        let share = area / nodes as f64;
        let provenance = Provenance::new("analytic")
            .with("body", "sphere")
            .with("radius_m", radius);
        let nodes = (0..nodes)
            .map(|i| {
                let z = 1.0 - (2.0 * i as f64 + 1.0) / nodes as f64;
                SurfaceNode {
                    position: radius * golden_spiral(i, z),
                    area: share,
                }
            })
            .collect();
        let mut morphology = Morphology::new(DVec3::splat(2.0 * radius), area, volume, Some(1.0));
        morphology.wadell_roundness = Some(1.0);
        morphology.inscribed_radius = Some(radius);
        morphology.feret = Some([2.0 * radius; 3]);
        Shape {
            field: Field::Sphere(radius),
            nodes,
            volume,
            inertia: DVec3::splat(0.4 * volume * radius * radius),
            lower: DVec3::splat(-radius),
            upper: DVec3::splat(radius),
            bounding_radius: radius,
            morphology,
            quality: None,
            provenance,
        }
    }

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
                let normal = if length > 0.0 {
                    x / length
                } else {
                    DVec3::ZERO
                };
                (length - radius, normal)
            }
            Field::Sampled(field) => field.distance_and_gradient(x),
        }
    }

    /// Samples the distance on a grid that exceeds the bounding box by `margin` [m]. The grid has
    /// the spacing `spacing` [m], or the shape's own samples unless those are finer by more than a
    /// tenth.
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
    /// Radius of the smallest sphere about the centroid that contains the shape [m].
    pub fn bounding_radius(&self) -> f64 {
        self.bounding_radius
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
            Field::Sampled(field) => assemble::surface_of(field),
        };
        (mesh.vertices, mesh.triangles)
    }

    /// Returns the shape scaled by `factor`.
    pub fn scaled(&self, factor: f64) -> Result<Shape> {
        positive("factor", factor)?;
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
    pub fn scaled_to_equivalent_diameter(&self, diameter: f64) -> Result<Shape> {
        positive("equivalent diameter", diameter)?;
        self.scaled(diameter / self.equivalent_diameter())
    }

    /// Returns the hash of the geometry (field, nodes, mass properties) in hexadecimal: equal for
    /// equal shapes, independent of their provenance.
    pub fn digest(&self) -> String {
        grain_file::digest(self)
    }

    /// Returns the morphology record printed by the command line.
    pub fn record(&self) -> Record {
        let m = &self.morphology;
        let field = match &self.field {
            Field::Sphere(_) => None,
            Field::Sampled(field) => Some(field),
        };
        Record {
            volume_m3: self.volume,
            equivalent_diameter_m: self.equivalent_diameter(),
            a_m: m.a,
            b_m: m.b,
            c_m: m.c,
            elongation: m.elongation(),
            flatness: m.flatness(),
            feret_m: m.feret,
            krumbein_sphericity_feret: m.feret.map(|[l, w, t]| (w * t / (l * l)).cbrt()),
            krumbein_sphericity: m.krumbein_sphericity,
            wadell_sphericity: m.wadell_sphericity,
            wadell_roundness: m.wadell_roundness,
            roundness_cutoff_m: m
                .inscribed_radius
                .map(|r| roundness::cutoff(&self.provenance.method) * r),
            inscribed_radius_m: m.inscribed_radius,
            convexity: m.convexity,
            surface_area_m2: m.area,
            inertia_m5: self.inertia.to_array(),
            bounding_radius_m: self.bounding_radius,
            surface_nodes: self.nodes.len(),
            field_samples: field.map(SampledField::dims),
            field_spacing_m: field.map(SampledField::spacing),
            gradient_error: self.quality.map(|q| q.gradient_error),
            volume_error: self.quality.and_then(|q| q.volume_error),
            method: self.provenance.method.clone(),
            source: self.provenance.source.clone(),
            source_sha256: self.provenance.source_sha256.clone(),
            digest: self.digest(),
        }
    }
}

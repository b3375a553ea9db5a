//! Morphology record of a shape, as printed by the command line.

use crate::field::SampledField;
use crate::roundness;
use crate::shape::{Field, Shape};
use serde::Serialize;

/// Morphology record, printed by `grain info --json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Record {
    /// Volume [m^3].
    pub volume_m3: f64,
    /// Diameter of the sphere of equal volume [m].
    pub equivalent_diameter_m: f64,
    /// Longest extent [m].
    pub a_m: f64,
    /// Intermediate extent [m].
    pub b_m: f64,
    /// Shortest extent [m].
    pub c_m: f64,
    /// Elongation b / a.
    pub elongation: f64,
    /// Flatness c / b.
    pub flatness: f64,
    /// Feret diameters [m]: the longest, the longest perpendicular to it, the one perpendicular to
    /// both.
    pub feret_m: Option<[f64; 3]>,
    /// Krumbein sphericity (Eq. 38).
    pub krumbein_sphericity: f64,
    /// Krumbein sphericity (Eq. 38) from the Feret diameters.
    pub krumbein_sphericity_feret: Option<f64>,
    /// Wadell's true sphericity.
    pub wadell_sphericity: f64,
    /// Wadell roundness (Eq. 39); null if not measured.
    pub wadell_roundness: Option<f64>,
    /// Size of the smallest detail that the roundness resolves [m].
    pub roundness_cutoff_m: Option<f64>,
    /// Radius of the largest inscribed sphere [m].
    pub inscribed_radius_m: Option<f64>,
    /// Volume divided by that of the convex hull; null if not measured.
    pub convexity: Option<f64>,
    /// Surface area [m^2].
    pub surface_area_m2: f64,
    /// Principal second moments per unit density [m^5].
    pub inertia_m5: [f64; 3],
    /// Radius of the smallest sphere about the centroid that contains the grain [m].
    pub bounding_radius_m: f64,
    /// Number of surface nodes.
    pub surface_nodes: usize,
    /// Samples of the distance field along x, y and z; null for an exact sphere.
    pub field_samples: Option<[usize; 3]>,
    /// Spacing of the samples [m]; null for an exact sphere.
    pub field_spacing_m: Option<f64>,
    /// 0.9 quantile of | |grad phi| - 1 | at the surface; null for an exact sphere.
    pub gradient_error: Option<f64>,
    /// Relative difference of the volume from that of the source; null without a source volume.
    pub volume_error: Option<f64>,
    /// Origin of the shape: `analytic`, `mesh` or `scan`.
    pub method: String,
    /// Source file.
    pub source: String,
    /// SHA-256 of the source file.
    pub source_sha256: String,
    /// Hash of the geometry.
    pub digest: String,
}

impl Shape {
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

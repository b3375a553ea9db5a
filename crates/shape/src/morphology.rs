//! Morphology of a grain.

use crate::mesh::TriangleMesh;
use crate::{feret, hull};
use glam::DVec3;
use serde::Serialize;
use std::f64::consts::PI;

/// Morphology, measured on the surface of the shape.
///
/// The lengths a >= b >= c are the full extents along the principal axes of inertia, sorted. The
/// Feret diameters ([`feret`](Self::feret)) differ by up to a few percent, most for near-equant
/// grains with ill-defined inertia axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Morphology {
    /// Longest extent [m].
    pub a: f64,
    /// Intermediate extent [m].
    pub b: f64,
    /// Shortest extent [m].
    pub c: f64,
    /// Surface area [m^2].
    pub area: f64,
    /// Krumbein sphericity, the cube root of b c / a^2 (Eq. 38).
    pub krumbein_sphericity: f64,
    /// Wadell's true sphericity: area of the sphere of equal volume divided by the surface area.
    pub wadell_sphericity: f64,
    /// Wadell roundness (Eq. 39); `None` if the body is too slender to measure it, and in files of
    /// version 1.
    pub wadell_roundness: Option<f64>,
    /// Radius of the largest inscribed sphere [m]; `None` in files of version 1.
    pub inscribed_radius: Option<f64>,
    /// Feret diameters [m]: the longest, the longest perpendicular to it, and the one perpendicular
    /// to both; `None` in files of version 1.
    pub feret: Option<[f64; 3]>,
    /// Volume divided by that of the convex hull.
    pub convexity: Option<f64>,
}

impl Morphology {
    pub(crate) fn measure(
        mesh: &TriangleMesh,
        extents: DVec3,
        volume: f64,
        area: f64,
    ) -> Morphology {
        // The mesh is inscribed where the surface is convex: use mesh volumes for the ratio.
        let own = mesh.signed_volume();
        let hull = hull::measure(&mesh.vertices);
        let convexity = hull.as_ref().map(|(hull, _)| (own / hull).min(1.0));
        let mut morphology = Self::new(extents, area, volume, convexity);
        // Feret diameters depend on the hull only.
        let touched = hull.map_or_else(|| mesh.vertices.clone(), |(_, corners)| corners);
        morphology.feret = Some(feret::lengths(&touched));
        morphology
    }

    pub(crate) fn new(extents: DVec3, area: f64, volume: f64, convexity: Option<f64>) -> Self {
        let mut sorted = extents.to_array();
        sorted.sort_by(|p, q| q.total_cmp(p));
        let [a, b, c] = sorted;
        Morphology {
            a,
            b,
            c,
            area,
            krumbein_sphericity: (b * c / (a * a)).cbrt(),
            wadell_sphericity: wadell_sphericity(area, volume),
            wadell_roundness: None,
            inscribed_radius: None,
            feret: None,
            convexity,
        }
    }

    pub(crate) fn set_area(&mut self, area: f64, volume: f64) {
        self.area = area;
        self.wadell_sphericity = wadell_sphericity(area, volume);
    }

    /// Elongation b / a.
    pub fn elongation(&self) -> f64 {
        self.b / self.a
    }
    /// Flatness c / b.
    pub fn flatness(&self) -> f64 {
        self.c / self.b
    }

    pub(crate) fn scaled(&self, factor: f64) -> Morphology {
        Morphology {
            a: self.a * factor,
            b: self.b * factor,
            c: self.c * factor,
            area: self.area * factor * factor,
            inscribed_radius: self.inscribed_radius.map(|r| r * factor),
            feret: self.feret.map(|lengths| lengths.map(|l| l * factor)),
            ..*self
        }
    }
}

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

/// Returns the area of the sphere of this volume [m^3] divided by this area [m^2].
fn wadell_sphericity(area: f64, volume: f64) -> f64 {
    PI.cbrt() * (6.0 * volume).powf(2.0 / 3.0) / area
}

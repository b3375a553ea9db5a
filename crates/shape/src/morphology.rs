//! Morphology of a grain.

use crate::triangles::TriangleMesh;
use crate::{feret, hull};
use glam::DVec3;
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

    /// Measures the Feret diameters of these points.
    pub(crate) fn set_feret(&mut self, points: &[DVec3]) {
        let hull = hull::measure(points).map(|(_, corners)| corners);
        self.feret = Some(feret::lengths(hull.as_deref().unwrap_or(points)));
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

/// Returns the area of the sphere of this volume [m^3] divided by this area [m^2].
fn wadell_sphericity(area: f64, volume: f64) -> f64 {
    PI.cbrt() * (6.0 * volume).powf(2.0 / 3.0) / area
}

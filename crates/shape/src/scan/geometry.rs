//! Edge length of a voxel and direction of the axes, as files state them.

use super::volume::{Volume, Voxels};
use crate::error::{Result, ShapeError};
use glam::DVec3;
use std::fmt::{Display, Formatter};
use std::path::Path;

/// Accepted relative difference of voxel edges, and cosine of the angle between two axes.
const TOLERANCE: f64 = 0.01;

/// Units that a bare number may have [m].
const UNITS: [f64; 5] = [1.0, 1e-2, 1e-3, 1e-6, 1e-9];

/// Edge length of a voxel as a file states it.
#[derive(Clone, Debug, PartialEq)]
pub struct StatedVoxel {
    /// Length in the unit of the file.
    pub edge: f64,
    /// Unit as written in the file; empty if there is none.
    pub unit: String,
}

impl StatedVoxel {
    /// Returns whether a voxel edge [m] differs by more than 1 %. Without a known unit, a length in
    /// m, cm, mm, um or nm agrees, and so does the bare number 1, which uncalibrated images have.
    pub fn contradicts(&self, voxel: f64) -> bool {
        let differs = |unit: &f64| (self.edge * unit / voxel - 1.0).abs() > TOLERANCE;
        match unit(&self.unit) {
            Some(unit) => differs(&unit),
            None => self.edge != 1.0 && UNITS.iter().all(differs),
        }
    }
}

impl Display for StatedVoxel {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        // Single precision hides the rounding errors of means and norms.
        write!(f, "{}", self.edge as f32)?;
        if self.unit.is_empty() { write!(f, " (no unit)") } else { write!(f, " {}", self.unit) }
    }
}

/// Returns the length of a unit by its name in a file [m].
fn unit(name: &str) -> Option<f64> {
    Some(match name {
        "m" | "meter" | "metre" => 1.0,
        "cm" | "centimeter" => 1e-2,
        "mm" | "millimeter" | "millimetre" => 1e-3,
        // Micro sign, Greek mu, and the micro sign as ImageJ escapes it.
        "um" | "µm" | "μm" | "\\u00B5m" | "micron" | "microns" | "micrometer" => 1e-6,
        "nm" | "nanometer" => 1e-9,
        "in" | "inch" => 0.0254,
        _ => return None,
    })
}

/// Geometry of the voxels of a file.
pub(super) struct Geometry {
    /// Key or keys of the file, for messages.
    pub key: &'static str,
    /// Vectors from a voxel to the next along x, y and z of the array.
    pub steps: [DVec3; 3],
    /// Unit as written in the file; empty if there is none.
    pub unit: String,
    /// Whether the vectors refer to a left-handed coordinate system.
    pub left_handed: bool,
}

impl Geometry {
    /// Creates the geometry of axes along the coordinates.
    pub(super) fn of_edges(key: &'static str, edges: [f64; 3], unit: String) -> Geometry {
        let [x, y, z] = edges;
        let steps = [DVec3::X * x, DVec3::Y * y, DVec3::Z * z];
        Geometry { key, steps, unit, left_handed: false }
    }

    /// Returns the edge length of the voxels; refuses voxels that are not cubes.
    pub(super) fn voxel(&self, path: &Path) -> Result<StatedVoxel> {
        let refused = |reason: String| Err(ShapeError::unsupported(path, reason));
        let (key, edges) = (self.key, self.steps.map(DVec3::length));
        let stated = edges.map(|edge| (edge as f32).to_string()).join(" x ");
        let stated = format!("{stated} {}", self.unit);
        let stated = stated.trim_end();
        if !edges.iter().all(|edge| edge.is_finite() && *edge > 0.0) {
            return refused(format!(
                "{key}: the voxel is {stated}; correct it to positive lengths, or remove it"
            ));
        }
        let [smallest, largest] = [
            edges.into_iter().fold(f64::INFINITY, f64::min),
            edges.into_iter().fold(0.0, f64::max),
        ];
        if largest > (1.0 + TOLERANCE) * smallest {
            return refused(format!(
                "{key}: the voxel is {stated}, and voxels must be cubes within 1 %; resample the \
                 image to cubic voxels, or correct the header if it is wrong"
            ));
        }
        let [x, y, z] = self.steps.map(DVec3::normalize);
        if [x.dot(y), y.dot(z), z.dot(x)].iter().any(|cosine| cosine.abs() > TOLERANCE) {
            return refused(format!(
                "{key}: the axes are not perpendicular; resample the image to perpendicular axes"
            ));
        }
        Ok(StatedVoxel { edge: edges.iter().product::<f64>().cbrt(), unit: self.unit.clone() })
    }

    /// Returns whether the array holds the mirror image of the object.
    pub(super) fn mirrored(&self) -> bool {
        let [x, y, z] = self.steps;
        (x.cross(y).dot(z) < 0.0) != self.left_handed
    }
}

/// Reverses the x axis.
pub(super) fn mirror(volume: &mut Volume) {
    let nx = volume.dims[0];
    match &mut volume.voxels {
        Voxels::Labels(labels) => labels.chunks_mut(nx).for_each(<[u32]>::reverse),
        Voxels::Grey(values) => values.chunks_mut(nx).for_each(<[f32]>::reverse),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn voxels_must_be_cubes_with_perpendicular_axes() {
        let path = Path::new("a.nrrd");
        let voxel = |steps: [[f64; 3]; 3]| {
            let (key, steps, unit) = ("key", steps.map(DVec3::from_array), "mm".to_owned());
            let geometry = Geometry { key, steps, unit, left_handed: false };
            geometry.voxel(path).map_err(|e| e.to_string())
        };
        let nearly = voxel([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.009]]).unwrap();
        assert!((nearly.edge - 1.003).abs() < 1e-3 && nearly.unit == "mm");
        // Turned axes are accepted: a grain has no orientation.
        let turned = voxel([[0.6, 0.8, 0.0], [-0.8, 0.6, 0.0], [0.0, 0.0, 1.0]]).unwrap();
        assert_eq!(turned.to_string(), "1 mm");
        let squashed = voxel([[0.01, 0.0, 0.0], [0.0, 0.01, 0.0], [0.0, 0.0, 0.025]]);
        let squashed = squashed.unwrap_err();
        for words in ["a.nrrd: key: the voxel is 0.01 x 0.01 x 0.025 mm", "resample the image"] {
            assert!(squashed.contains(words), "{squashed}");
        }
        let sheared = voxel([[1.0, 0.0, 0.0], [0.05, 1.0, 0.0], [0.0, 0.0, 1.0]]).unwrap_err();
        assert!(sheared.contains("not perpendicular"), "{sheared}");
        for bad in [0.0, f64::NAN, f64::INFINITY] {
            let refused = voxel([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, bad]]).unwrap_err();
            assert!(refused.contains("positive lengths"), "{refused}");
        }
    }

    #[test]
    fn a_stated_edge_is_compared_in_its_unit() {
        let stated = |edge, unit: &str| StatedVoxel { edge, unit: unit.to_owned() };
        assert!(!stated(10.0, "micron").contradicts(10.05e-6));
        assert!(stated(10.0, "micron").contradicts(10.2e-6));
        assert!(stated(10.0, "mm").contradicts(10e-6));
        assert!(stated(1.0, "mm").contradicts(10e-6));
        // Without a unit.
        assert!(!stated(10.0, "").contradicts(10e-6) && !stated(0.01, "").contradicts(10e-6));
        assert!(stated(0.02, "").contradicts(10e-6) && !stated(1.0, "pixel").contradicts(10e-6));
    }
}

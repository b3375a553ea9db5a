//! Quality check of sampled shapes.

use crate::error::{Defect, Result, ShapeError};
use crate::field::SampledField;
use crate::triangles::TriangleMesh;
use glam::{DMat3, DVec3};

/// Measured quality of a sampled shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quality {
    /// 0.9 quantile, by area, of the deviation of the gradient length from 1 at the surface.
    pub gradient_error: f64,
    /// Relative difference between the volumes of the field and of its source; `None` if the exact
    /// source volume is unknown.
    pub volume_error: Option<f64>,
}

/// Bounds of the quality check.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QualityBounds {
    /// Largest [`Quality::gradient_error`].
    pub gradient_error: f64,
    /// Largest [`Quality::volume_error`].
    pub volume_error: f64,
}

impl Default for QualityBounds {
    fn default() -> QualityBounds {
        QualityBounds { gradient_error: 0.15, volume_error: 0.01 }
    }
}

impl QualityBounds {
    pub(crate) fn check(&self, quality: &Quality) -> Result<()> {
        let gradient = "the error of the distance gradient at the surface (0.9 quantile)";
        let volume = "the relative difference of volume from the source";
        let measured = [
            (Defect::Gradient, gradient, Some(quality.gradient_error), self.gradient_error),
            (Defect::Volume, volume, quality.volume_error, self.volume_error),
        ];
        for (defect, what, value, bound) in measured {
            if let Some(value) = value.filter(|v| v.is_nan() || v.abs() > bound) {
                let reason = format!(
                    "{what} is {value:.4}, the bound is {bound}; ask for more cells across the \
                     grain, or smooth the source"
                );
                return Err(ShapeError::quality(defect, reason));
            }
        }
        Ok(())
    }
}

/// Distance of the points of a face at which the gradient is measured from its middle, relative to
/// that of its corners, which lie on the boundaries of cells.
const TOWARDS_CORNERS: f64 = 0.9;

/// Measures the gradient error at three points of every face of the surface of `field`, and one
/// cell to either side. Nodes would not do: a rounding error, and thus the unit of length, may move
/// all of them.
pub(crate) fn gradient_error(field: &SampledField, surface: &TriangleMesh) -> f64 {
    let error = |x: DVec3| (field.distance_and_gradient(x).1.length() - 1.0).abs();
    let mut errors: Vec<(f64, f64)> = (0..surface.triangles.len())
        .flat_map(|face| {
            let corners = surface.corners(face);
            let middle = corners.iter().sum::<DVec3>() / 3.0;
            let area = surface.twice_area(face).length();
            corners.map(|corner| (middle.lerp(corner, TOWARDS_CORNERS), area))
        })
        .flat_map(|(x, area)| {
            let normal = field.distance_and_gradient(x).1.normalize_or_zero();
            [-1.0, 0.0, 1.0].map(|s| (error(x + s * field.spacing() * normal), area))
        })
        .collect();
    errors.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut rest = 0.9 * errors.iter().map(|(_, area)| area).sum::<f64>();
    let quantile = errors.iter().find(|(_, area)| {
        rest -= area;
        rest <= 0.0
    });
    quantile.map_or(f64::NAN, |(error, _)| *error)
}

/// Refuses a frame with off-diagonal second moments, hence not the principal frame.
pub(crate) fn check_axes(second: &DMat3) -> Result<()> {
    let off = second.y_axis.x.abs().max(second.z_axis.x.abs()).max(second.z_axis.y.abs());
    let share = off / second.x_axis.x;
    if share < 5e-3 {
        return Ok(());
    }
    let reason = format!(
        "the products of inertia of the sampled body are {share:.4} of its largest moment; ask for \
         more cells across the grain"
    );
    Err(ShapeError::quality(Defect::Axes, reason))
}

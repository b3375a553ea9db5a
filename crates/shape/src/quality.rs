//! Quality check of sampled shapes.

use crate::error::{Result, ShapeError};
use crate::field::SampledField;
use crate::shape::SurfaceNode;
use glam::{DMat3, DVec3};

/// Measured quality of a sampled shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quality {
    /// 0.9 quantile of the deviation of the gradient length from 1 at the surface.
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
        QualityBounds {
            gradient_error: 0.15,
            volume_error: 0.01,
        }
    }
}

impl QualityBounds {
    pub(crate) fn check(&self, quality: &Quality) -> Result<()> {
        let refuse = |what: &str, value: f64, bound: f64| {
            Err(ShapeError::Quality {
                reason: format!(
                    "{what} is {value:.4}, allowed is {bound}; \
                     ask for more cells across the grain, or smooth the source"
                ),
            })
        };
        let within = |value: f64, bound: f64| value.is_finite() && value <= bound;
        if !within(quality.gradient_error, self.gradient_error) {
            let what = "the 0.9 quantile of | |grad phi| - 1 | at the surface";
            return refuse(what, quality.gradient_error, self.gradient_error);
        }
        match quality.volume_error {
            Some(error) if !within(error.abs(), self.volume_error) => refuse(
                "the relative difference of volume from the source",
                error,
                self.volume_error,
            ),
            _ => Ok(()),
        }
    }
}

/// Measures the gradient error at the nodes and one cell to either side of the surface.
pub(crate) fn gradient_error(field: &SampledField, nodes: &[SurfaceNode]) -> f64 {
    let mut errors: Vec<f64> = nodes
        .iter()
        .flat_map(|node| {
            let normal = field
                .distance_and_gradient(node.position)
                .1
                .normalize_or_zero();
            [-1.0, 0.0, 1.0].map(|s| {
                let x: DVec3 = node.position + s * field.spacing() * normal;
                (field.distance_and_gradient(x).1.length() - 1.0).abs()
            })
        })
        .collect();
    errors.sort_by(f64::total_cmp);
    errors
        .get(errors.len() * 9 / 10)
        .copied()
        .unwrap_or(f64::NAN)
}

/// Refuses a frame with off-diagonal second moments, hence not the principal frame.
pub(crate) fn check_axes(second: &DMat3) -> Result<()> {
    let off = second
        .y_axis
        .x
        .abs()
        .max(second.z_axis.x.abs())
        .max(second.z_axis.y.abs());
    let share = off / second.x_axis.x;
    if share < 5e-3 {
        return Ok(());
    }
    Err(ShapeError::Quality {
        reason: format!(
            "the products of inertia of the sampled body are {share:.4} of its largest moment; \
             ask for more cells across the grain"
        ),
    })
}

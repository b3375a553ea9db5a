//! Signed-distance functions from which shapes are sampled [m]; negative inside.

use crate::grid::coordinates;
use glam::DVec3;
use rayon::prelude::*;

/// Range of required distances that includes all of them.
pub(crate) const EVERYWHERE: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

/// A signed distance [m] defined everywhere.
pub(crate) trait Distance: Sync {
    /// Returns the distance at `x`. The hint (from a query nearby, or 0) may accelerate the search.
    fn near(&self, x: DVec3, hint: &mut u32) -> f64;

    /// Returns a function for the distance and its gradient at a converging sequence of points. The
    /// default differentiates numerically with `step` [m].
    fn closing_in(&self, step: f64) -> impl FnMut(DVec3) -> (f64, DVec3)
    where
        Self: Sized,
    {
        move |x| {
            let value = |x: DVec3| self.near(x, &mut 0);
            let along = |a: DVec3| (value(x + step * a) - value(x - step * a)) / (2.0 * step);
            (value(x), DVec3::from_array(DVec3::AXES.map(along)))
        }
    }

    /// Returns the distances at the samples of a grid, x fastest, with the first sample at `first`.
    /// Farther than `band` [cells] from the surface an approximation may be used, and values
    /// outside the range `needed` [m] may be NaN.
    fn on_grid(
        &self,
        first: DVec3,
        spacing: f64,
        dims: [usize; 3],
        _band: f64,
        _needed: [f64; 2],
    ) -> Vec<f64> {
        let mut values = vec![0.0; dims.iter().product()];
        let rows = values.par_chunks_mut(dims[0]).enumerate();
        rows.for_each(|(row, line)| {
            let (j, k) = (row % dims[1], row / dims[1]);
            let mut hint = 0;
            for (i, value) in line.iter_mut().enumerate() {
                let x = first + spacing * coordinates([i, j, k]);
                *value = self.near(x, &mut hint);
            }
        });
        values
    }
}

impl<F: Fn(DVec3, &mut u32) -> f64 + Sync> Distance for F {
    fn near(&self, x: DVec3, hint: &mut u32) -> f64 {
        self(x, hint)
    }
}

//! What shapes are sampled from: a signed distance [m], negative inside.

use glam::DVec3;
use rayon::prelude::*;

/// Least and most of the distances that are needed: all of them.
pub(crate) const EVERYWHERE: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

/// A signed distance [m] that can be asked anywhere.
pub(crate) trait Distance: Sync {
    /// Distance at `x`; the hint, left by a query nearby or 0, may speed a search.
    fn near(&self, x: DVec3, hint: &mut u32) -> f64;

    /// Tells distance and gradient at places that draw together, by differences over `step` [m] unless
    /// known better.
    fn closing_in(&self, step: f64) -> impl FnMut(DVec3) -> (f64, DVec3) {
        move |x| {
            let value = |x: DVec3| self.near(x, &mut 0);
            let along = |a: DVec3| (value(x + step * a) - value(x - step * a)) / (2.0 * step);
            (value(x), DVec3::from_array(DVec3::AXES.map(along)))
        }
    }

    /// Distances at the samples of a grid, x fastest; the first lies at `first`. Farther than `band`
    /// [samples] from the surface they may be found by a way that is not exact everywhere, and what is
    /// not between the least and the most that are `needed` [m] may be NaN.
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
                let x = first + spacing * DVec3::new(i as f64, j as f64, k as f64);
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

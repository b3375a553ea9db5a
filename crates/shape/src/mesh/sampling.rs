//! Signed distances of a mesh at points, along converging sequences and on grids.

use super::MeshDistance;
use super::nearest_cache::About;
use super::propagate;
use crate::distance::Distance;
use glam::DVec3;

impl Distance for MeshDistance {
    fn near(&self, x: DVec3, hint: &mut u32) -> f64 {
        self.signed(x, &self.nearest(x, hint))
    }

    fn closing_in(&self, _: f64) -> impl FnMut(DVec3) -> (f64, DVec3) {
        let mut about = About::new(self);
        move |x| {
            let nearest = about.nearest(x);
            let distance = self.signed(x, &nearest);
            (distance, (x - nearest.point) / distance)
        }
    }

    fn on_grid(
        &self,
        first: DVec3,
        spacing: f64,
        dims: [usize; 3],
        band: f64,
        needed: [f64; 2],
    ) -> Vec<f64> {
        propagate::on_grid(self, first, spacing, dims, band, needed)
    }
}

//! Cells near a coordinate.

use super::Mesh;

impl Mesh {
    /// Cells along `axis` within `reach` [m] of the coordinate `centre` [m], counted from 0, each
    /// with the distance of its centre from it [m]; across the sides of a `periodic` axis too. A
    /// flat axis has one such cell.
    pub(crate) fn cells_near(
        &self,
        axis: usize,
        periodic: bool,
        centre: f64,
        reach: f64,
    ) -> impl Iterator<Item = (usize, f64)> + Clone + use<> {
        let (n, h, origin) = (self.cells[axis] as i64, self.spacing[axis], self.origin[axis]);
        let index = |x: f64| ((x - origin) / h).floor() as i64;
        let cells = match (n, periodic) {
            (1, _) => 0..=0,
            (_, true) => index(centre - reach)..=index(centre + reach),
            (_, false) => index(centre - reach).max(0)..=index(centre + reach).min(n - 1),
        };
        let distance = move |i: i64| origin + (i as f64 + 0.5) * h - centre;
        cells.map(move |i| (i.rem_euclid(n) as usize, distance(i)))
    }
}

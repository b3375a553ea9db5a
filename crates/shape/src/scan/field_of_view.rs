//! Field of view of a scan. Reconstructions fill the exterior of their cylinder with one value, and
//! users mask regions with one. That value is neither void nor solid, and grains cut by the edge of
//! the view are incomplete.

use super::threshold::Threshold;
use crate::grid::index;
use std::collections::BTreeSet;

/// Minimum fraction of the image outside the field of view.
const OUTSIDE: f64 = 0.01;
/// Fraction of interior voxels with the exterior value above which that value counts as background.
const ALIKE: f64 = 0.02;
/// Depth at which the edge is probed [voxels].
const DEPTH: usize = 5;
/// Maximum solid fraction of the edge: a higher one indicates a grain in a black image.
const SOLID: f64 = 0.8;
/// Solid fraction of the edge below which it is void. In between, void and solid must be distinct.
const VOID: f64 = 0.05;
/// Minimum fraction of the variance of the edge between void and solid. Splitting one phase by its
/// noise explains less: 2 / pi of a normal distribution.
const DISTINCT: f64 = 0.7;
/// Minimum step at the edge relative to that at the depth. The surface of a blurred grain is less
/// steep.
const STEEP: f64 = 0.6;
/// Distance from the edge within which a grain counts as cut [voxels]; the median filter removes
/// one voxel at the edge.
const NEAR: usize = 2;

/// Extent of the image rows within the field of view.
pub(super) struct FieldOfView {
    dims: [usize; 3],
    /// First voxel of each row, and one past the last.
    rows: Vec<[usize; 2]>,
    /// Exterior value.
    pub outside: f32,
    /// Fraction of the image outside.
    pub share: f64,
}

/// Probes of the voxels at the edge.
#[derive(Default)]
struct Edge {
    /// Local mean at the depth of each probe.
    means: Vec<f64>,
    /// Sums of the steps from the exterior value to the second voxel, and to the local mean.
    steps: [f64; 2],
}

impl Edge {
    /// Returns whether the edge cuts through void or through void and solid, which `cut` separates.
    fn is_cut(&self, cut: f64) -> bool {
        let count = self.means.len() as f64;
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let (solid, void): (Vec<f64>, Vec<f64>) = self.means.iter().partition(|m| **m >= cut);
        let share = solid.len() as f64 / count;
        if self.means.is_empty() || share > SOLID || self.steps[0] < STEEP * self.steps[1] {
            return false;
        }
        if share < VOID {
            return true;
        }
        let all = mean(&self.means);
        let variance = self.means.iter().map(|m| (m - all).powi(2)).sum::<f64>() / count;
        let between = share * (1.0 - share) * (mean(&solid) - mean(&void)).powi(2);
        between > DISTINCT * variance
    }
}

impl FieldOfView {
    /// Detects the field of view of an image; `None` if it fills the image or cannot be determined.
    pub fn of(values: &[f32], dims: [usize; 3], threshold: Threshold) -> Option<FieldOfView> {
        let [nx, ny, nz] = dims;
        let outside = values[0];
        let corner = |n: usize| {
            let [i, j, k] = [(n & 1) * (nx - 1), (n >> 1 & 1) * (ny - 1), (n >> 2) * (nz - 1)];
            values[i + nx * (j + ny * k)]
        };
        if (0..8).any(|n| corner(n) != outside) {
            return None;
        }
        let (mut inside, mut alike) = (0, 0);
        let mut rows = Vec::with_capacity(ny * nz);
        for row in values.chunks(nx) {
            let from = row.iter().take_while(|v| **v == outside).count();
            let behind = row[from..].iter().rev().take_while(|v| **v == outside).count();
            let to = nx - behind;
            rows.push([from, to]);
            inside += to - from;
            alike += row[from..to].iter().filter(|v| **v == outside).count();
        }
        let all = values.len() as f64;
        let share = 1.0 - inside as f64 / all;
        if share <= OUTSIDE || alike as f64 >= ALIKE * inside as f64 {
            return None;
        }
        // The exterior value would pull a threshold of the whole image below the void.
        let cut = threshold.of(values, Some(outside))?;
        let view = FieldOfView { dims, rows, outside, share };
        view.edge(values).is_cut(cut).then_some(view)
    }

    /// Probes both ends of each row that lie inside the image.
    fn edge(&self, values: &[f32]) -> Edge {
        let [nx, ny, nz] = self.dims;
        let step = |value: f64| (value - f64::from(self.outside)).abs();
        let mut edge = Edge::default();
        for (row, [from, to]) in self.rows.iter().copied().enumerate() {
            let (j, k) = (row % ny, row / ny);
            let inner = |i: usize, n: usize| i > 0 && i + 1 < n;
            if to < from + 4 * DEPTH || from == 0 || to == nx || !inner(j, ny) || !inner(k, nz) {
                continue;
            }
            for (second, deep) in [(from + 1, from + DEPTH), (to - 2, to - 1 - DEPTH)] {
                let around = (0..27).map(|n| [deep + n % 3 - 1, j + n / 3 % 3 - 1, k + n / 9 - 1]);
                let near = around.map(|at| values[index(self.dims, at)]);
                let near: Vec<f64> = near.filter(|v| *v != self.outside).map(f64::from).collect();
                if near.is_empty() {
                    continue;
                }
                let mean = near.iter().sum::<f64>() / near.len() as f64;
                edge.means.push(mean);
                edge.steps[0] += step(f64::from(values[nx * row + second]));
                edge.steps[1] += step(mean);
            }
        }
        edge
    }

    /// Sets all voxels outside to 0.
    pub fn clear_outside(&self, labels: &mut [u32]) {
        for (line, [from, to]) in labels.chunks_mut(self.dims[0]).zip(&self.rows) {
            line[..*from].fill(0);
            line[*to..].fill(0);
        }
    }

    /// Returns the labels at its edge.
    pub fn cuts(&self, labels: &[u32]) -> BTreeSet<u32> {
        let [nx, ny, nz] = self.dims;
        let mut truncated = BTreeSet::new();
        for (row, line) in labels.chunks(nx).enumerate() {
            let (j, k) = (row % ny, row / ny);
            let [from, to] = self.rows[row];
            // Voxels excluded by adjacent rows are equally close to the edge.
            let mut adjacent = Vec::new();
            if j >= NEAR && j + NEAR < ny {
                adjacent.extend([row - NEAR, row + NEAR]);
            }
            if k >= NEAR && k + NEAR < nz {
                adjacent.extend([row - NEAR * ny, row + NEAR * ny]);
            }
            let mut cut = |part: std::ops::Range<usize>| {
                truncated.extend(line[part].iter().filter(|label| **label != 0));
            };
            let mut within = [from, to];
            for row in adjacent {
                let [a, b] = self.rows[row];
                within = [within[0].max(a.min(nx)), within[1].min(b)];
            }
            let low = if within[0] > 0 { within[0] + NEAR } else { 0 };
            let high = if within[1] < nx { within[1].saturating_sub(NEAR) } else { nx };
            cut(0..low.min(nx));
            cut(high.max(low.min(nx))..nx);
        }
        truncated
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const N: usize = 40;

    /// Three balls in a noisy disc, the last one on its edge; `noise` is that of the void,
    /// `outside` the exterior value.
    fn image(noise: f32, outside: f32, radius: f64) -> (Vec<f32>, Vec<u32>) {
        let balls = [[14.0, 20.0, 12.0], [26.0, 18.0, 26.0], [32.5, 28.0, 20.0]];
        let (mut values, mut labels) = (Vec::new(), Vec::new());
        for n in 0..N * N * N {
            let x = [n % N, n / N % N, n / N / N].map(|i| i as f64 + 0.5);
            let near = balls.iter().position(|ball| {
                let square: f64 = (0..3).map(|a| (x[a] - ball[a]).powi(2)).sum();
                square < 25.0
            });
            let in_view = (x[0] - 20.0).hypot(x[1] - 20.0) < radius;
            let hash = (n as f32 * 0.618_034).fract();
            let value = near.map_or(50.0 + noise * hash, |_| 200.0 + hash);
            values.push(if in_view { value } else { outside });
            labels.push(near.filter(|_| in_view).map_or(0, |ball| ball as u32 + 1));
        }
        (values, labels)
    }

    #[test]
    fn grains_at_the_edge_of_the_view_are_cut() {
        for outside in [0.0, -1000.0, 50.0] {
            let (values, labels) = image(20.0, outside, 18.0);
            let view = FieldOfView::of(&values, [N; 3], Threshold::Otsu).expect("a disc");
            assert_eq!(view.cuts(&labels), BTreeSet::from([3]), "{outside}");
        }
    }

    #[test]
    fn plain_background_is_no_field_of_view() {
        // Complete image in view; void without noise; a single grain in a black image.
        let (values, _) = image(20.0, 0.0, 100.0);
        assert!(FieldOfView::of(&values, [N; 3], Threshold::Otsu).is_none());
        let (values, _) = image(0.0, 50.0, 18.0);
        assert!(FieldOfView::of(&values, [N; 3], Threshold::Otsu).is_none());
        let ball: Vec<f32> = (0..N * N * N)
            .map(|n| {
                let x = [n % N, n / N % N, n / N / N].map(|i| i as f64 + 0.5 - 20.0);
                let depth = 16.0 - x.iter().map(|x| x * x).sum::<f64>().sqrt();
                (200.0 * (0.5 + 0.5 * depth).clamp(0.0, 1.0)) as f32
            })
            .collect();
        assert!(FieldOfView::of(&ball, [N; 3], Threshold::Otsu).is_none());
    }
}

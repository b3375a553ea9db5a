//! Field of view of a scan. Reconstructions fill the exterior of their cylinder with one value, and
//! grains cut by its edge are incomplete.

use std::collections::BTreeSet;

/// Minimum fraction of the image outside the field of view.
const OUTSIDE: f64 = 0.01;
/// Fraction of interior voxels with the exterior value above which that value counts as background.
const ALIKE: f64 = 0.02;
/// Depth at which the edge is probed [voxels], and the maximum solid fraction there: a higher one
/// indicates the surface of a grain in a black image.
const DEPTH: usize = 4;
const SOLID: f64 = 0.8;
/// Distance from the edge within which a grain counts as cut [voxels]; the median filter removes
/// one voxel at the edge.
const NEAR: usize = 2;

/// Extent of the image rows within the field of view.
pub(super) struct FieldOfView {
    dims: [usize; 3],
    /// First voxel of each row, and one past the last.
    rows: Vec<[usize; 2]>,
}

impl FieldOfView {
    /// Detects the field of view of an image; `None` if it fills the image or cannot be determined.
    /// Voxels with values of at least `cut` are solid.
    pub fn of(values: &[f32], dims: [usize; 3], cut: f64) -> Option<FieldOfView> {
        let [nx, ny, nz] = dims;
        let outside = values[0];
        let corner = |n: usize| {
            let [i, j, k] = [(n & 1) * (nx - 1), (n >> 1 & 1) * (ny - 1), (n >> 2) * (nz - 1)];
            values[i + nx * (j + ny * k)]
        };
        if (0..8).any(|n| corner(n) != outside) {
            return None;
        }
        let (mut inside, mut alike, mut edge, mut solid) = (0, 0, 0, 0);
        let mut rows = Vec::with_capacity(ny * nz);
        for row in values.chunks(nx) {
            let from = row.iter().take_while(|v| **v == outside).count();
            let behind = row[from..].iter().rev().take_while(|v| **v == outside).count();
            let to = nx - behind;
            rows.push([from, to]);
            inside += to - from;
            alike += row[from..to].iter().filter(|v| **v == outside).count();
            if to - from > 4 * DEPTH && from > 0 && to < nx {
                edge += 2;
                let probes = [row[from + DEPTH], row[to - 1 - DEPTH]];
                solid += probes.iter().filter(|v| f64::from(**v) >= cut).count();
            }
        }
        let all = values.len();
        let is_one = (all - inside) as f64 > OUTSIDE * all as f64
            && (alike as f64) < ALIKE * inside as f64
            && (solid as f64) < SOLID * edge as f64;
        is_one.then_some(FieldOfView { dims, rows })
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
            let view = FieldOfView::of(&values, [N; 3], 125.0).expect("a disc");
            assert_eq!(view.cuts(&labels), BTreeSet::from([3]), "{outside}");
        }
    }

    #[test]
    fn plain_background_is_no_field_of_view() {
        // Complete image in view; void without noise; a single grain in a black image.
        let (values, _) = image(20.0, 0.0, 100.0);
        assert!(FieldOfView::of(&values, [N; 3], 125.0).is_none());
        let (values, _) = image(0.0, 50.0, 18.0);
        assert!(FieldOfView::of(&values, [N; 3], 125.0).is_none());
        let ball: Vec<f32> = (0..N * N * N)
            .map(|n| {
                let x = [n % N, n / N % N, n / N / N].map(|i| i as f64 + 0.5 - 20.0);
                let depth = 16.0 - x.iter().map(|x| x * x).sum::<f64>().sqrt();
                (200.0 * (0.5 + 0.5 * depth).clamp(0.0, 1.0)) as f32
            })
            .collect();
        assert!(FieldOfView::of(&ball, [N; 3], 100.0).is_none());
    }
}

//! Separation of touching grains by a watershed of the distance from the void.
//!
//! Every grain is a basin of the inverted distance. The maximum distance is the radius of its
//! largest ball, and two basins meet at a saddle, at the radius of the neck between them. They are
//! two grains if the neck is narrow relative to the smaller grain, and otherwise one grain with two
//! maxima.

use crate::grid::{neighbours, place, root};
use rayon::prelude::*;

/// Union-find forest of merged basins with the highest maximum of each.
struct Hills {
    parent: Vec<u32>,
    top: Vec<f32>,
}

impl Hills {
    /// Merges two basins that meet at this height if the saddle is not a neck.
    fn join(&mut self, p: u32, q: u32, height: f32, neck: f64) {
        if p == q {
            return;
        }
        let (high, low) =
            if self.top[p as usize] >= self.top[q as usize] { (p, q) } else { (q, p) };
        let top = self.top[low as usize];
        if f64::from(height) >= neck * f64::from(top) || top - height < 1.0 {
            self.parent[low as usize] = high;
        }
    }
}

/// Labels the solid voxels (squared distance from the void above 0) from 1, in the order of first
/// voxels. Two basins are one grain if the saddle between them is at least `neck` times the lower
/// maximum, or less than a voxel below it.
pub(crate) fn separate(squared: &[f32], dims: [usize; 3], neck: f64) -> Vec<u32> {
    let (mut labels, top) = basins(squared, dims);
    let mut hills = Hills { parent: (0..top.len() as u32).collect(), top };
    let around = Around::new(dims);
    // Voxels at which basins meet, in descending order of height.
    for at in borders(squared, dims, &labels) {
        let at = at as usize;
        let height = squared[at].sqrt();
        let mut last = 0;
        around.each(at, |n| {
            if labels[n] == last || !earlier(squared, n, at) {
                return;
            }
            if last != 0 {
                let [p, q] = [last, labels[n]].map(|n| root(&mut hills.parent, n));
                hills.join(p, q, height, neck);
            }
            last = labels[n];
        });
    }
    let roots: Vec<u32> =
        (0..hills.parent.len() as u32).map(|n| root(&mut hills.parent, n)).collect();
    let mut names = vec![0u32; roots.len()];
    let mut next = 0;
    for label in labels.iter_mut().filter(|l| **l != 0) {
        let name = &mut names[roots[*label as usize] as usize];
        if *name == 0 {
            next += 1;
            *name = next;
        }
        *label = *name;
    }
    labels
}

/// Returns the offsets of the neighbours of an interior voxel, in index order.
fn offsets([nx, ny, _]: [usize; 3]) -> [isize; 26] {
    let mut offsets = [0; 26];
    let steps = (0..27).filter(|n| *n != 13);
    for (offset, n) in offsets.iter_mut().zip(steps) {
        let (a, b, c) = (n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
        *offset = a + nx as isize * (b + ny as isize * c);
    }
    offsets
}

/// The neighbourhood of a voxel.
struct Around {
    dims: [usize; 3],
    offsets: [isize; 26],
}

impl Around {
    fn new(dims: [usize; 3]) -> Around {
        Around { dims, offsets: offsets(dims) }
    }

    /// Calls `see` for every neighbour of voxel `at`, in index order.
    #[inline]
    fn each(&self, at: usize, mut see: impl FnMut(usize)) {
        let [nx, ny, nz] = self.dims;
        let [i, j, k] = place(self.dims, at);
        let inside = |i: usize, n: usize| i > 0 && i + 1 < n;
        if inside(i, nx) && inside(j, ny) && inside(k, nz) {
            for offset in self.offsets {
                see(at.wrapping_add_signed(offset));
            }
            return;
        }
        let range = |i: usize, n: usize| i.saturating_sub(1)..(i + 2).min(n);
        for c in range(k, nz) {
            for b in range(j, ny) {
                for a in range(i, nx) {
                    let n = a + nx * (b + ny * c);
                    if n != at {
                        see(n);
                    }
                }
            }
        }
    }
}

/// Returns whether voxel `n` precedes voxel `at` in descending order of height, then in ascending
/// order of index. Void voxels never do.
#[inline]
fn earlier(squared: &[f32], n: usize, at: usize) -> bool {
    squared[n] > squared[at] || (squared[n] == squared[at] && n < at)
}

/// Returns the basin (from 1) of every solid voxel, where the steepest ascent from voxel to voxel
/// ends, and the maximum of each basin, with a leading 0 for the void.
fn basins(squared: &[f32], dims: [usize; 3]) -> (Vec<u32>, Vec<f32>) {
    /// Marks the index of the uphill neighbour until the basin is known.
    const UPHILL: u32 = 1 << 31;
    let around = Around::new(dims);
    let mut labels = vec![0u32; squared.len()];
    let rows = labels.par_chunks_mut(dims[0]).enumerate();
    rows.for_each(|(row, line)| {
        for (i, label) in line.iter_mut().enumerate() {
            let at = row * dims[0] + i;
            if squared[at] > 0.0 {
                // The first of the highest neighbours.
                let mut uphill = at;
                around.each(at, |n| {
                    if squared[n] > squared[uphill] || (uphill == at && earlier(squared, n, at)) {
                        uphill = n;
                    }
                });
                *label = UPHILL | uphill as u32;
            }
        }
    });
    let mut tops = vec![0.0];
    let mut path = Vec::new();
    for start in 0..labels.len() {
        let mut at = start;
        while labels[at] & UPHILL != 0 {
            path.push(at);
            let next = (labels[at] ^ UPHILL) as usize;
            if next == at {
                labels[at] = tops.len() as u32;
                tops.push(squared[at].sqrt());
            }
            at = next;
        }
        let label = labels[at];
        path.drain(..).for_each(|n| labels[n] = label);
    }
    (labels, tops)
}

/// Returns the voxels at which basins meet, the highest first.
fn borders(squared: &[f32], dims: [usize; 3], labels: &[u32]) -> Vec<u32> {
    let around = Around::new(dims);
    let meet = |at: &u32| {
        let (own, at) = (labels[*at as usize], *at as usize);
        let mut met = false;
        if own != 0 {
            around.each(at, |n| {
                met |= labels[n] != own && earlier(squared, n, at);
            });
        }
        met
    };
    let mut borders: Vec<u32> = (0..labels.len() as u32).into_par_iter().filter(meet).collect();
    borders.par_sort_unstable_by(|p, q| {
        let [a, b] = [p, q].map(|n| squared[*n as usize]);
        b.total_cmp(&a).then(p.cmp(q))
    });
    borders
}

/// Flag of a void voxel near a grain: the top bit of the grain's label.
pub(crate) const HALO: u32 = 1 << 31;

/// Assigns every void voxel within `layers` voxels of a grain to the nearest one: its label with
/// [`HALO`] set.
pub(crate) fn add_halo(labels: &mut [u32], dims: [usize; 3], layers: usize) {
    let mut front: Vec<u32> = (0..labels.len() as u32)
        .into_par_iter()
        .filter(|n| {
            labels[*n as usize] != 0 && neighbours(dims, *n as usize).any(|m| labels[m] == 0)
        })
        .collect();
    for _ in 0..layers {
        let mut next = Vec::new();
        for at in front {
            let label = labels[at as usize] | HALO;
            for to in neighbours(dims, at as usize) {
                if labels[to] == 0 {
                    labels[to] = label;
                    next.push(to as u32);
                }
            }
        }
        front = next;
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Mask, transform};
    use super::*;
    use glam::DVec3;

    fn balls(balls: &[([f64; 3], f64)], dims: [usize; 3]) -> Vec<f32> {
        let solid = (0..dims.iter().product())
            .map(|n: usize| {
                let x = DVec3::new(
                    (n % dims[0]) as f64,
                    (n / dims[0] % dims[1]) as f64,
                    (n / dims[0] / dims[1]) as f64,
                );
                balls.iter().any(|(c, r)| x.distance(DVec3::from_array(*c)) < *r)
            })
            .collect();
        transform::to_void(&Mask { dims, solid })
    }

    #[test]
    fn two_balls_that_touch_are_two_and_a_peanut_is_one() {
        let dims = [60, 30, 30];
        let count = |apart: f64| {
            let field =
                balls(&[([15.0, 15.0, 15.0], 10.0), ([15.0 + apart, 15.3, 14.8], 10.0)], dims);
            let labels = separate(&field, dims, 0.8);
            *labels.iter().max().unwrap()
        };
        // Necks of half the radius and of 0.9 times the radius.
        assert_eq!(count(17.5), 2);
        assert_eq!(count(8.0), 1);
    }

    #[test]
    fn labels_are_numbered_by_their_first_voxels_and_the_halo_goes_to_the_nearest() {
        let dims = [50, 20, 20];
        let field = balls(&[([12.0, 10.0, 11.0], 6.0), ([36.0, 9.0, 9.0], 8.0)], dims);
        let mut labels = separate(&field, dims, 0.8);
        let at = |i: usize| i + 50 * (9 + 20 * 10);
        assert_eq!((labels[at(12)], labels[at(36)], labels[at(22)]), (2, 1, 0));
        add_halo(&mut labels, dims, 3);
        assert_eq!(labels[at(20)], 2 | HALO);
        assert_eq!(labels[at(26)], 1 | HALO);
        assert_eq!(labels[at(23)], 0);
    }
}

//! Separating grains that touch.
//!
//! A watershed on the distance from the void: every grain is a hill whose top is the radius of
//! its largest ball, and two hills meet at a saddle, the radius of the neck between them. They are
//! two grains where the neck is narrow against the smaller of them, and one grain with two tops
//! otherwise.

use rayon::prelude::*;

/// Voxels by falling squared distance, which is a whole number.
fn order(squared: &[f32]) -> Vec<u32> {
    let highest = squared.par_iter().copied().reduce(|| 0.0, f32::max) as usize;
    let mut starts = vec![0usize; highest + 2];
    for s in squared.iter().filter(|s| **s > 0.0) {
        // Highest first.
        starts[highest - *s as usize + 1] += 1;
    }
    for n in 1..starts.len() {
        starts[n] += starts[n - 1];
    }
    let mut out = vec![0u32; starts[highest + 1]];
    for (n, s) in squared.iter().enumerate().filter(|(_, s)| **s > 0.0) {
        let slot = &mut starts[highest - *s as usize];
        out[*slot] = n as u32;
        *slot += 1;
    }
    out
}

/// Hills that have been joined, with the height of the highest top.
struct Hills {
    parent: Vec<u32>,
    top: Vec<f32>,
}

impl Hills {
    fn root(&mut self, mut n: u32) -> u32 {
        while self.parent[n as usize] != n {
            let above = self.parent[self.parent[n as usize] as usize];
            self.parent[n as usize] = above;
            n = above;
        }
        n
    }

    /// Joins two hills that meet at this height if the saddle is no neck.
    fn join(&mut self, p: u32, q: u32, height: f32, neck: f64) {
        if p == q {
            return;
        }
        let (high, low) = if self.top[p as usize] >= self.top[q as usize] {
            (p, q)
        } else {
            (q, p)
        };
        let top = self.top[low as usize];
        if f64::from(height) >= neck * f64::from(top) || top - height < 1.0 {
            self.parent[low as usize] = high;
        }
    }
}

/// Labels from 1 of the solid voxels (squared distance from the void above 0), numbered by their
/// first voxels. Two hills are one grain if the saddle between them is at least `neck` times the
/// lower top, or less than a voxel below it.
pub(crate) fn separate(squared: &[f32], dims: [usize; 3], neck: f64) -> Vec<u32> {
    let [nx, ny, nz] = dims;
    let mut labels = vec![0u32; squared.len()];
    let mut hills = Hills {
        parent: vec![0],
        top: vec![0.0],
    };
    for at in order(squared) {
        let at = at as usize;
        let (i, j, k) = (at % nx, at / nx % ny, at / nx / ny);
        let height = squared[at].sqrt();
        // The hills around, and the highest voxel among them: uphill is where this one belongs.
        let mut around = [0u32; 26];
        let mut count = 0;
        let mut uphill = (0.0f32, 0u32);
        for c in k.saturating_sub(1)..=(k + 1).min(nz - 1) {
            for b in j.saturating_sub(1)..=(j + 1).min(ny - 1) {
                for a in i.saturating_sub(1)..=(i + 1).min(nx - 1) {
                    let n = a + nx * (b + ny * c);
                    let label = labels[n];
                    if label != 0 {
                        around[count] = label;
                        count += 1;
                        if squared[n] > uphill.0 {
                            uphill = (squared[n], label);
                        }
                    }
                }
            }
        }
        for n in 1..count {
            let (p, q) = (hills.root(around[n - 1]), hills.root(around[n]));
            hills.join(p, q, height, neck);
        }
        let mut own = uphill.1;
        if own == 0 {
            own = hills.parent.len() as u32;
            hills.parent.push(own);
            hills.top.push(height);
        }
        labels[at] = own;
    }
    let mut names = vec![0u32; hills.parent.len()];
    let mut next = 0;
    for label in labels.iter_mut().filter(|l| **l != 0) {
        let root = hills.root(*label) as usize;
        if names[root] == 0 {
            next += 1;
            names[root] = next;
        }
        *label = names[root];
    }
    labels
}

/// Marks a void voxel that lies near a grain: the bit on top of the grain's label.
pub(crate) const HALO: u32 = 1 << 31;

/// Gives every void voxel within `layers` voxels of a grain to the nearest one, as its label with
/// [`HALO`] set.
pub(crate) fn add_halo(labels: &mut [u32], dims: [usize; 3], layers: usize) {
    let [nx, ny, nz] = dims;
    let strides = [1, nx, nx * ny];
    let around = move |at: usize| {
        let place = [at % nx, at / nx % ny, at / nx / ny];
        (0..3).flat_map(move |axis| {
            let below = (place[axis] > 0).then(|| at - strides[axis]);
            let above = (place[axis] + 1 < [nx, ny, nz][axis]).then(|| at + strides[axis]);
            below.into_iter().chain(above)
        })
    };
    let mut front: Vec<u32> = (0..labels.len())
        .filter(|n| labels[*n] != 0 && around(*n).any(|m| labels[m] == 0))
        .map(|n| n as u32)
        .collect();
    for _ in 0..layers {
        let mut next = Vec::new();
        for at in front {
            let label = labels[at as usize] | HALO;
            for to in around(at as usize) {
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
                balls
                    .iter()
                    .any(|(c, r)| x.distance(DVec3::from_array(*c)) < *r)
            })
            .collect();
        transform::to_void(&Mask { dims, solid })
    }

    #[test]
    fn two_balls_that_touch_are_two_and_a_peanut_is_one() {
        let dims = [60, 30, 30];
        let count = |apart: f64| {
            let field = balls(
                &[
                    ([15.0, 15.0, 15.0], 10.0),
                    ([15.0 + apart, 15.3, 14.8], 10.0),
                ],
                dims,
            );
            let labels = separate(&field, dims, 0.8);
            *labels.iter().max().unwrap()
        };
        // Necks of half the radius and of nine tenths.
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

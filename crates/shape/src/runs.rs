//! Connected components of a volume, computed from runs: sequences of voxels of one label along x.

use crate::grid::root;
use rayon::prelude::*;

/// Voxels `begin..end` along x.
type Run = [u32; 2];

/// Runs of the labelled voxels, with a union-find forest of their connectivity.
struct Runs {
    dims: [usize; 3],
    runs: Vec<Run>,
    /// Label of each run.
    labels: Vec<u32>,
    /// First run of every row, and the total number at the end.
    rows: Vec<usize>,
    /// Parent run in the same component; a root is its own parent.
    parent: Vec<u32>,
}

impl Runs {
    /// Creates the runs of the voxels with a label other than 0. Voxels of one label are connected
    /// through faces, or with `corners`, which needs a single label, through edges and corners too.
    fn new<L: Into<u32>>(
        dims: [usize; 3],
        corners: bool,
        label: impl Fn(usize) -> L + Sync,
    ) -> Runs {
        let [nx, ny, nz] = dims;
        let by_row: Vec<(Vec<Run>, Vec<u32>)> = (0..ny * nz)
            .into_par_iter()
            .map(|row| {
                let (mut runs, mut labels): (Vec<Run>, Vec<u32>) = Default::default();
                for i in 0..nx {
                    let label = label(nx * row + i).into();
                    match runs.last_mut() {
                        _ if label == 0 => {}
                        Some([_, end]) if *end as usize == i && labels.last() == Some(&label) => {
                            *end += 1;
                        }
                        _ => {
                            runs.push([i as u32, i as u32 + 1]);
                            labels.push(label);
                        }
                    }
                }
                (runs, labels)
            })
            .collect();
        let mut rows = vec![0];
        rows.extend(by_row.iter().scan(0, |sum, (runs, _)| {
            *sum += runs.len();
            Some(*sum)
        }));
        let (runs, labels): (Vec<_>, Vec<_>) = by_row.into_iter().unzip();
        let (runs, labels) = (runs.concat(), labels.concat());
        let parent = (0..runs.len() as u32).collect();
        let mut all = Runs { dims, runs, labels, rows, parent };
        for row in 0..ny * nz {
            let (j, k) = (row % ny, row / ny);
            if j > 0 {
                all.join(row, row - 1, corners);
            }
            if k > 0 {
                all.join(row, row - ny, corners);
            }
            if k > 0 && corners {
                if j > 0 {
                    all.join(row, row - ny - 1, corners);
                }
                if j + 1 < ny {
                    all.join(row, row - ny + 1, corners);
                }
            }
        }
        for n in 0..all.parent.len() {
            all.parent[n] = root(&mut all.parent, n as u32);
        }
        all
    }

    /// Joins the connected runs of two adjacent rows.
    fn join(&mut self, row: usize, other: usize, corners: bool) {
        let slack = u32::from(corners);
        let (mut p, mut q) = (self.rows[row], self.rows[other]);
        while p < self.rows[row + 1] && q < self.rows[other + 1] {
            let ([a, b], [c, d]) = (self.runs[p], self.runs[q]);
            if a < d + slack && c < b + slack && self.labels[p] == self.labels[q] {
                let [r, s] = [p, q].map(|n| root(&mut self.parent, n as u32));
                self.parent[r.max(s) as usize] = r.min(s);
            }
            if b < d {
                p += 1;
            } else {
                q += 1;
            }
        }
    }

    /// Iterates over the runs with the index of their first voxel.
    fn each(&self) -> impl Iterator<Item = (usize, Run, usize)> {
        let row_of = |row: usize| self.rows[row]..self.rows[row + 1];
        (0..self.rows.len() - 1).flat_map(move |row| {
            row_of(row).map(move |n| {
                let run = self.runs[n];
                (n, run, self.dims[0] * row + run[0] as usize)
            })
        })
    }
}

/// Numbers the connected components (through voxel faces) of each label, or of the voxels that
/// `label` selects, from 1 in the order of their first voxels, with 0 elsewhere. Also returns their
/// sizes.
pub(crate) fn pieces<L: Into<u32>>(
    dims: [usize; 3],
    label: impl Fn(usize) -> L + Sync,
) -> (Vec<u32>, Vec<u64>) {
    let runs = Runs::new(dims, false, label);
    let mut number = vec![0u32; dims.iter().product()];
    let mut names = vec![0u32; runs.runs.len()];
    let mut sizes = Vec::new();
    for (n, [begin, end], first) in runs.each() {
        let root = runs.parent[n] as usize;
        if root == n {
            sizes.push(0);
            names[n] = sizes.len() as u32;
        }
        let length = (end - begin) as usize;
        sizes[names[root] as usize - 1] += length as u64;
        number[first..first + length].fill(names[root]);
    }
    (number, sizes)
}

/// Fills cavities (background without connection to the border of the volume, even through voxel
/// edges and corners); returns the number of filled voxels.
pub(crate) fn fill_cavities(dims: [usize; 3], solid: &mut [bool]) -> u64 {
    let [nx, ny, nz] = dims;
    let runs = Runs::new(dims, true, |n| !solid[n]);
    let mut open = vec![false; runs.runs.len()];
    for (n, [begin, end], first) in runs.each() {
        let (j, k) = (first / nx % ny, first / nx / ny);
        let border = [begin == 0, end as usize == nx, j == 0, j + 1 == ny, k == 0];
        if k + 1 == nz || border.contains(&true) {
            open[runs.parent[n] as usize] = true;
        }
    }
    let mut filled = 0;
    for (n, [begin, end], first) in runs.each() {
        if !open[runs.parent[n] as usize] {
            let length = (end - begin) as usize;
            solid[first..first + length].fill(true);
            filled += length as u64;
        }
    }
    filled
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::place;
    use crate::random::Random;
    use rand::{RngExt, SeedableRng};
    use std::collections::BTreeSet;

    fn noise(count: usize, share: f64) -> Vec<bool> {
        let mut random = Random::seed_from_u64(5);
        (0..count).map(|_| random.random_bool(share)).collect()
    }

    /// Reference by flood fill; neighbours differ by at most one along every axis, and along at
    /// most `axes` axes.
    fn flood(dims: [usize; 3], chosen: &[bool], axes: usize) -> Vec<u32> {
        let at = |n: usize| place(dims, n);
        let near = |p: usize, q: usize| {
            let (p, q) = (at(p), at(q));
            let off: Vec<usize> = (0..3).map(|a| p[a].abs_diff(q[a])).collect();
            off.iter().all(|d| *d <= 1) && off.iter().sum::<usize>() <= axes
        };
        let mut number = vec![0; chosen.len()];
        let mut last = 0;
        for start in 0..chosen.len() {
            if !chosen[start] || number[start] != 0 {
                continue;
            }
            last += 1;
            number[start] = last;
            let mut stack = vec![start];
            while let Some(p) = stack.pop() {
                for q in 0..chosen.len() {
                    if chosen[q] && number[q] == 0 && near(p, q) {
                        number[q] = last;
                        stack.push(q);
                    }
                }
            }
        }
        number
    }

    #[test]
    fn touching_labels_are_separate_pieces() {
        let dims = [9, 8, 7];
        let (solid, other) = (noise(504, 0.7), noise(600, 0.5)[96..].to_vec());
        let label = |n: usize| u32::from(solid[n]) * (1 + u32::from(other[n]));
        let (number, sizes) = pieces(dims, label);
        let mut count = 0;
        for name in [1, 2] {
            let chosen: Vec<bool> = (0..504).map(|n| label(n) == name).collect();
            let alone = flood(dims, &chosen, 1);
            count += alone.iter().max().unwrap();
            // Equal up to the numbering: pieces and pairs of numbers are as many.
            let pairs: BTreeSet<_> =
                (0..504).filter(|n| chosen[*n]).map(|n| (alone[n], number[n])).collect();
            assert_eq!(pairs.len(), *alone.iter().max().unwrap() as usize);
        }
        assert_eq!(sizes.len(), count as usize);
    }

    #[test]
    fn runs_find_what_flooding_finds() {
        let dims = [9, 8, 7];
        for share in [0.2, 0.4, 0.6, 0.8] {
            let solid = noise(504, share);
            let (number, sizes) = pieces(dims, |n| solid[n]);
            assert_eq!(number, flood(dims, &solid, 1));
            for (n, size) in sizes.iter().enumerate() {
                let count = number.iter().filter(|p| **p == n as u32 + 1).count();
                assert_eq!(count as u64, *size);
            }
            let void: Vec<bool> = solid.iter().map(|s| !s).collect();
            let regions = flood(dims, &void, 3);
            let reaches_border = |name: u32| {
                (0..504).filter(|n| regions[*n] == name).any(|n| {
                    let at = [n % 9, n / 9 % 8, n / 72];
                    (0..3).any(|a| at[a] == 0 || at[a] + 1 == dims[a])
                })
            };
            let expected: Vec<bool> =
                (0..504).map(|n| solid[n] || !reaches_border(regions[n])).collect();
            let mut filled_up = solid.clone();
            let before = solid.iter().filter(|s| **s).count() as u64;
            let filled = fill_cavities(dims, &mut filled_up);
            assert_eq!(filled_up, expected);
            let after = filled_up.iter().filter(|s| **s).count() as u64;
            assert_eq!(filled, after - before);
        }
    }
}

//! Regions of a labelled volume: extents, border contact, crops and shared faces.

use super::Mask;
use glam::DVec3;
use std::collections::{BTreeMap, HashMap};

/// Extent of one label.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Region {
    pub voxels: u64,
    pub lower: [usize; 3],
    pub upper: [usize; 3],
}

impl Region {
    /// Returns the names of the image faces that the region touches; empty if none.
    pub(crate) fn faces(&self, dims: [usize; 3]) -> String {
        let mut names = Vec::new();
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            if self.lower[axis] == 0 {
                names.push(format!("low {name}"));
            }
            if self.upper[axis] + 1 == dims[axis] {
                names.push(format!("high {name}"));
            }
        }
        names.join(", ")
    }
}

/// Returns the regions by label, without the background (0).
pub(crate) fn regions(dims: [usize; 3], labels: &[u32]) -> BTreeMap<u32, Region> {
    let mut regions: BTreeMap<u32, Region> = BTreeMap::new();
    for (row, line) in labels.chunks(dims[0]).enumerate() {
        let (j, k) = (row % dims[1], row / dims[1]);
        let mut i = 0;
        // Processing runs of equal labels keeps the map out of the inner loop.
        while i < line.len() {
            let label = line[i];
            let end = i + line[i..].iter().take_while(|l| **l == label).count();
            if label != 0 {
                let region = regions.entry(label).or_insert(Region {
                    voxels: 0,
                    lower: [i, j, k],
                    upper: [i, j, k],
                });
                region.voxels += (end - i) as u64;
                for (axis, (low, high)) in [(i, end - 1), (j, j), (k, k)].into_iter().enumerate() {
                    region.lower[axis] = region.lower[axis].min(low);
                    region.upper[axis] = region.upper[axis].max(high);
                }
            }
            i = end;
        }
    }
    regions
}

/// Returns the mask of one label with `pad` voxels of background on every side.
pub(crate) fn crop(
    dims: [usize; 3],
    labels: &[u32],
    label: u32,
    region: &Region,
    pad: usize,
) -> Mask {
    let size: [usize; 3] = std::array::from_fn(|a| region.upper[a] - region.lower[a] + 1);
    let out = size.map(|n| n + 2 * pad);
    let mut solid = vec![false; out.iter().product()];
    for k in 0..size[2] {
        for j in 0..size[1] {
            let from =
                region.lower[0] + dims[0] * (region.lower[1] + j + dims[1] * (region.lower[2] + k));
            let to = pad + out[0] * (pad + j + out[1] * (pad + k));
            for i in 0..size[0] {
                solid[to + i] = labels[from + i] == label;
            }
        }
    }
    Mask { dims: out, solid }
}

/// Returns the centres [voxels from the image corner] of the voxel faces between this label, which
/// lies in this region, and other labels.
pub(crate) fn cuts(dims: [usize; 3], labels: &[u32], label: u32, region: &Region) -> Vec<DVec3> {
    let strides = [1, dims[0], dims[0] * dims[1]];
    let (low, high) = (region.lower, region.upper);
    let mut centres = Vec::new();
    for (k, j) in (low[2]..=high[2]).flat_map(|k| (low[1]..=high[1]).map(move |j| (k, j))) {
        for i in low[0]..=high[0] {
            let (place, at) = ([i, j, k], i + strides[1] * j + strides[2] * k);
            if labels[at] != label {
                continue;
            }
            let other = |n: usize| labels[n] != label && labels[n] != 0;
            let middle = DVec3::new(i as f64, j as f64, k as f64) + 0.5;
            for (axis, step) in DVec3::AXES.into_iter().enumerate() {
                if place[axis] > 0 && other(at - strides[axis]) {
                    centres.push(middle - 0.5 * step);
                }
                if place[axis] + 1 < dims[axis] && other(at + strides[axis]) {
                    centres.push(middle + 0.5 * step);
                }
            }
        }
    }
    centres
}

/// Returns for each label the fraction of its voxel faces shared with another label.
pub(crate) fn shared_surfaces(dims: [usize; 3], labels: &[u32]) -> HashMap<u32, f64> {
    let strides = [1, dims[0], dims[0] * dims[1]];
    let mut faces: HashMap<u32, [u64; 2]> = HashMap::new();
    for (axis, stride) in strides.into_iter().enumerate() {
        for (at, (&here, &there)) in labels.iter().zip(&labels[stride..]).enumerate() {
            if here == there || at / stride % dims[axis] + 1 == dims[axis] {
                continue;
            }
            for label in [here, there].into_iter().filter(|label| *label != 0) {
                let [all, shared] = faces.entry(label).or_default();
                *all += 1;
                *shared += u64::from(here != 0 && there != 0);
            }
        }
    }
    let part = |[all, shared]: [u64; 2]| shared as f64 / all as f64;
    faces.into_iter().map(|(label, n)| (label, part(n))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::runs::{fill_cavities, pieces};

    #[test]
    fn regions_pieces_and_cavities() {
        let dims = [6, 5, 5];
        let mut labels = vec![0u32; 150];
        let at = |i: usize, j: usize, k: usize| i + 6 * (j + 5 * k);
        for k in 1..4 {
            for j in 1..4 {
                for i in 1..4 {
                    labels[at(i, j, k)] = 7;
                }
            }
        }
        labels[at(2, 2, 2)] = 0;
        labels[at(5, 0, 4)] = 9;
        let found = regions(dims, &labels);
        assert_eq!(found.len(), 2);
        assert_eq!(found[&7], Region { voxels: 26, lower: [1; 3], upper: [3; 3] });
        assert_eq!(found[&7].faces(dims), "");
        assert_eq!(found[&9].faces(dims), "high x, low y, high z");
        let mut mask = crop(dims, &labels, 7, &found[&7], 2);
        assert_eq!(mask.dims, [7, 7, 7]);
        assert_eq!(fill_cavities(mask.dims, &mut mask.solid), 1);
        assert_eq!(mask.solid.iter().filter(|s| **s).count(), 27);
        let (number, sizes) = pieces(dims, |n| labels[n] != 0);
        assert_eq!(sizes, [26, 1]);
        assert_eq!(number[at(5, 0, 4)], 2);
    }

    #[test]
    fn cut_faces_are_shared() {
        // Two adjacent cubes of two voxels along y, and a separate one; faces on the image border
        // do not count.
        let dims = [6, 4, 2];
        let labels: Vec<u32> = (0..48)
            .map(|at| match (at % 6, at / 6 % 4) {
                (1..=2, 0..=1) => 1,
                (1..=2, 2..=3) => 2,
                (4..=5, 1..=2) => 7,
                _ => 0,
            })
            .collect();
        let found = shared_surfaces(dims, &labels);
        assert_eq!(found[&1], 4.0 / 12.0);
        assert_eq!(found[&2], 4.0 / 12.0);
        assert_eq!(found[&7], 0.0);
        assert_eq!(found.len(), 3);
        let places = |label| cuts(dims, &labels, label, &regions(dims, &labels)[&label]);
        // The plane between the two cubes, and none at the third.
        assert_eq!(places(1).len(), 4);
        assert!(places(1).iter().all(|x| x.y == 2.0));
        assert_eq!(places(1), places(2));
        assert!(places(7).is_empty());
    }
}

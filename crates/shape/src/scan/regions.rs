//! Regions of a labelled volume: where they lie, whether they are whole.

use super::Mask;
use std::collections::BTreeMap;

/// Extent of one label.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Region {
    pub voxels: u64,
    pub lower: [usize; 3],
    pub upper: [usize; 3],
}

impl Region {
    /// Names of the image faces that the region touches; empty for none.
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

/// The regions by label; background (0) is left out.
pub(crate) fn regions(dims: [usize; 3], labels: &[u32]) -> BTreeMap<u32, Region> {
    let mut found: BTreeMap<u32, Region> = BTreeMap::new();
    for (row, line) in labels.chunks(dims[0]).enumerate() {
        let (j, k) = (row % dims[1], row / dims[1]);
        let mut i = 0;
        // Runs of equal labels keep the map out of the inner loop.
        while i < line.len() {
            let label = line[i];
            let end = i + line[i..].iter().take_while(|l| **l == label).count();
            if label != 0 {
                let region = found.entry(label).or_insert(Region {
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
    found
}

/// Mask of one label with `pad` voxels of background on every side.
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

/// Numbers the connected pieces (sharing voxel faces) of the voxels that `solid` selects, from 1
/// in the order of their first voxels; 0 elsewhere. Also their sizes.
pub(crate) fn pieces(dims: [usize; 3], solid: impl Fn(usize) -> bool) -> (Vec<u32>, Vec<u64>) {
    let count = dims.iter().product();
    let mut number = vec![0u32; count];
    let mut sizes = Vec::new();
    let mut stack = Vec::new();
    for start in 0..count {
        if number[start] != 0 || !solid(start) {
            continue;
        }
        let name = sizes.len() as u32 + 1;
        number[start] = name;
        stack.push(start);
        let mut size = 0u64;
        while let Some(at) = stack.pop() {
            size += 1;
            for next in neighbours(dims, at) {
                if number[next] == 0 && solid(next) {
                    number[next] = name;
                    stack.push(next);
                }
            }
        }
        sizes.push(size);
    }
    (number, sizes)
}

/// Voxels that share a face with voxel `at`.
fn neighbours(dims: [usize; 3], at: usize) -> impl Iterator<Item = usize> {
    let strides = [1, dims[0], dims[0] * dims[1]];
    (0..3).flat_map(move |axis| {
        let place = at / strides[axis] % dims[axis];
        let below = (place > 0).then(|| at - strides[axis]);
        let above = (place + 1 < dims[axis]).then(|| at + strides[axis]);
        below.into_iter().chain(above)
    })
}

/// Makes cavities solid (background that cannot reach the mask's border, not even through
/// voxel edges and corners); returns how many voxels that took.
pub(crate) fn fill_cavities(mask: &mut Mask) -> u64 {
    let [nx, ny, nz] = mask.dims;
    let mut open = vec![false; mask.solid.len()];
    // All of the border is outside.
    let mut stack = Vec::new();
    for row in 0..ny * nz {
        let inner = row % ny > 0 && row % ny < ny - 1 && row / ny > 0 && row / ny < nz - 1;
        for i in (0..nx).step_by(if inner { (nx - 1).max(1) } else { 1 }) {
            let at = i + nx * row;
            if !mask.solid[at] {
                open[at] = true;
                stack.push(at);
            }
        }
    }
    while let Some(at) = stack.pop() {
        let (i, j, k) = (at % nx, at / nx % ny, at / nx / ny);
        for c in k.saturating_sub(1)..=(k + 1).min(nz - 1) {
            for b in j.saturating_sub(1)..=(j + 1).min(ny - 1) {
                for a in i.saturating_sub(1)..=(i + 1).min(nx - 1) {
                    let next = a + nx * (b + ny * c);
                    if !open[next] && !mask.solid[next] {
                        open[next] = true;
                        stack.push(next);
                    }
                }
            }
        }
    }
    let mut filled = 0;
    for (solid, open) in mask.solid.iter_mut().zip(open) {
        if !*solid && !open {
            *solid = true;
            filled += 1;
        }
    }
    filled
}

#[cfg(test)]
mod tests {
    use super::*;

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
        assert_eq!(
            found[&7],
            Region {
                voxels: 26,
                lower: [1; 3],
                upper: [3; 3]
            }
        );
        assert_eq!(found[&7].faces(dims), "");
        assert_eq!(found[&9].faces(dims), "high x, low y, high z");
        let mut mask = crop(dims, &labels, 7, &found[&7], 2);
        assert_eq!(mask.dims, [7, 7, 7]);
        assert_eq!(fill_cavities(&mut mask), 1);
        assert_eq!(mask.solid.iter().filter(|s| **s).count(), 27);
        let (number, sizes) = pieces(dims, |n| labels[n] != 0);
        assert_eq!(sizes, [26, 1]);
        assert_eq!(number[at(5, 0, 4)], 2);
    }
}

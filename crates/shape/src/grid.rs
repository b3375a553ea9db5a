//! Index arithmetic of regular grids, x fastest, and union-find forests of their samples.

use glam::DVec3;

/// Returns the indices (i, j, k) of sample `n`.
pub(crate) fn place(dims: [usize; 3], n: usize) -> [usize; 3] {
    [n % dims[0], n / dims[0] % dims[1], n / dims[0] / dims[1]]
}

/// Returns the index of sample (i, j, k).
pub(crate) fn index(dims: [usize; 3], [i, j, k]: [usize; 3]) -> usize {
    i + dims[0] * (j + dims[1] * k)
}

/// Returns the indices as coordinates, in units of the spacing.
pub(crate) fn coordinates(place: [usize; 3]) -> DVec3 {
    DVec3::from_array(place.map(|n| n as f64))
}

/// Returns the root of `n` in a forest of parent indices, in which a root is its own parent, and
/// shortens the path to it.
pub(crate) fn root(parent: &mut [u32], mut n: u32) -> u32 {
    while parent[n as usize] != n {
        let above = parent[parent[n as usize] as usize];
        parent[n as usize] = above;
        n = above;
    }
    n
}

/// Iterates over the neighbours of sample `n` along the axes; six, fewer on the border.
pub(crate) fn neighbours(dims: [usize; 3], n: usize) -> impl Iterator<Item = usize> {
    let strides = [1, dims[0], dims[0] * dims[1]];
    let place = place(dims, n);
    (0..3).flat_map(move |axis| {
        let below = (place[axis] > 0).then(|| n - strides[axis]);
        let above = (place[axis] + 1 < dims[axis]).then(|| n + strides[axis]);
        below.into_iter().chain(above)
    })
}

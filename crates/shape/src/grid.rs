//! Index arithmetic of regular grids, x fastest.

/// Returns the indices (i, j, k) of sample `n`.
pub(crate) fn place(dims: [usize; 3], n: usize) -> [usize; 3] {
    [n % dims[0], n / dims[0] % dims[1], n / dims[0] / dims[1]]
}

/// Iterates over the neighbours of sample `n` along the axes; six, fewer on the border.
pub(crate) fn beside(dims: [usize; 3], n: usize) -> impl Iterator<Item = usize> {
    let strides = [1, dims[0], dims[0] * dims[1]];
    let place = place(dims, n);
    (0..3).flat_map(move |axis| {
        let below = (place[axis] > 0).then(|| n - strides[axis]);
        let above = (place[axis] + 1 < dims[axis]).then(|| n + strides[axis]);
        below.into_iter().chain(above)
    })
}

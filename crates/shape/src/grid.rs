//! Samples of a regular grid by their index, x fastest.

/// Number of sample `n` along x, y and z.
pub(crate) fn place(dims: [usize; 3], n: usize) -> [usize; 3] {
    [n % dims[0], n / dims[0] % dims[1], n / dims[0] / dims[1]]
}

/// The samples beside sample `n` along the axes, six but on the border.
pub(crate) fn beside(dims: [usize; 3], n: usize) -> impl Iterator<Item = usize> {
    let strides = [1, dims[0], dims[0] * dims[1]];
    let place = place(dims, n);
    (0..3).flat_map(move |axis| {
        let below = (place[axis] > 0).then(|| n - strides[axis]);
        let above = (place[axis] + 1 < dims[axis]).then(|| n + strides[axis]);
        below.into_iter().chain(above)
    })
}

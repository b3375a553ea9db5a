//! Memory layout of the fields.

/// Memory layout shared by all fields of a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    /// Interior cells along x, y, z.
    pub cells: [usize; 3],
}

impl Layout {
    /// Length of a row in memory: entries, ghosts and padding to a multiple of eight.
    #[inline]
    pub fn row(&self) -> usize {
        (self.cells[0] + 2).next_multiple_of(8)
    }
    /// Length of a plane in memory, ghosts and padding included.
    #[inline]
    pub fn plane(&self) -> usize {
        self.row() * (self.cells[1] + 2)
    }
    /// Length of a field in memory, ghosts and padding included.
    #[inline]
    pub fn len(&self) -> usize {
        self.plane() * (self.cells[2] + 2)
    }
    /// Entries of a field, ghosts included, padding excluded.
    pub fn entries(&self) -> usize {
        self.cells.iter().map(|n| n + 2).product()
    }
    /// Rows of a field, ghosts included, padding excluded.
    pub fn rows<'a, T>(
        &self,
        values: &'a [T],
    ) -> impl ExactSizeIterator<Item = &'a [T]> + use<'a, T> {
        let entries = self.cells[0] + 2;
        values.chunks_exact(self.row()).map(move |row| &row[..entries])
    }
    /// Mutable rows of a field, ghosts included, padding excluded.
    pub fn rows_mut<'a, T>(
        &self,
        values: &'a mut [T],
    ) -> impl ExactSizeIterator<Item = &'a mut [T]> + use<'a, T> {
        let entries = self.cells[0] + 2;
        values.chunks_exact_mut(self.row()).map(move |row| &mut row[..entries])
    }
    /// Position of (i, j, k) in memory.
    #[inline]
    pub fn index(&self, i: usize, j: usize, k: usize) -> usize {
        i + self.row() * (j + (self.cells[1] + 2) * k)
    }
    /// Plane `k` of a field, ghosts included.
    #[inline(always)]
    pub fn plane_of<'a, T>(&self, values: &'a [T], k: usize) -> &'a [T] {
        &values[k * self.plane()..][..self.plane()]
    }
    /// Row `j` of a plane: its entries 0 to n + 1.
    #[inline(always)]
    pub fn row_of<'a, T>(&self, plane: &'a [T], j: usize) -> &'a [T] {
        &plane[j * self.row()..][..self.cells[0] + 2]
    }
    /// Mutable row `j` of a plane.
    #[inline(always)]
    pub fn row_of_mut<'a, T>(&self, plane: &'a mut [T], j: usize) -> &'a mut [T] {
        &mut plane[j * self.row()..][..self.cells[0] + 2]
    }
    /// Distance in memory between neighbours along each axis.
    #[inline]
    pub fn strides(&self) -> [usize; 3] {
        [1, self.row(), self.plane()]
    }
    /// Copies both outermost interior layers of a periodic axis onto the ghosts across the box.
    pub fn wrap<T: Copy>(&self, values: &mut [T], axis: usize) {
        let n = self.cells[axis];
        self.map_layer(values, axis, n, 0, |value| value);
        self.map_layer(values, axis, 1, n + 1, |value| value);
    }
    /// Calls `f` with the memory position of every entry of a layer, ghosts included.
    pub fn each_of_layer(&self, axis: usize, layer: usize, mut f: impl FnMut(usize)) {
        let (row, plane) = (self.row(), self.plane());
        let (outer, middle) = (self.len() / plane, plane / row);
        match axis {
            0 => (0..outer * middle).for_each(|line| f(line * row + layer)),
            1 => (0..outer).for_each(|k| (0..row).for_each(|i| f(k * plane + layer * row + i))),
            _ => (0..plane).for_each(|at| f(layer * plane + at)),
        }
    }
    /// Sets layer `to` to `f` of layer `from`, both of `axis`, ghosts of the other axes included.
    pub fn map_layer<T: Copy>(
        &self,
        values: &mut [T],
        axis: usize,
        from: usize,
        to: usize,
        f: impl Fn(T) -> T,
    ) {
        self.map_layers(values, axis, [from; 2], to, |[value, _]| f(value));
    }
    /// Sets layer `to` to `f` of two layers `from` of `axis`, ghosts of the other axes included.
    pub fn map_layers<T: Copy>(
        &self,
        values: &mut [T],
        axis: usize,
        from: [usize; 2],
        to: usize,
        f: impl Fn([T; 2]) -> T,
    ) {
        let stride = self.strides()[axis] as isize;
        let shift = from.map(|layer| (layer as isize - to as isize) * stride);
        self.each_of_layer(axis, to, |at| {
            values[at] = f(shift.map(|s| values[at.wrapping_add_signed(s)]));
        });
    }
}

//! Transforms of one xy plane: cells to modes and back.
//!
//! Lines are transformed in blocks of two cache lines (a full register of pairs) or one (half a
//! register); the first half of a block are the real parts. Lines along y are adjacent in the
//! plane. Lines along x are transposed in registers before the transform, and their modes stay
//! adjacent: a plane of modes is a row of blocks, each [mode along x][line]. The pairs, hence the
//! rounding, do not depend on the width of the registers.
//!
//! Legend: L count of numbers in a cache line.

use super::axis::{AxisTransform, Buffers};
use crate::math::{Aligned, Real};
use grainwake_simd::{Complex, Kernel, MAX_LANES, Vector};

/// Memory layout of a plane of cells and of a plane of modes.
#[derive(Clone, Copy, Debug)]
pub struct PlaneLayout {
    nx: usize,
    ny: usize,
    /// Count of numbers in a cache line, and position of i = 1 in a row of a [`Plane`]: rows start
    /// on cache lines, and a ghost precedes i = 1.
    line: usize,
    pitch: usize,
}

impl PlaneLayout {
    /// Layout of `nx` x `ny` cells.
    pub fn new<R: Real>(nx: usize, ny: usize) -> PlaneLayout {
        let line = R::LANES;
        PlaneLayout { nx, ny, line, pitch: line + nx.next_multiple_of(line) + line }
    }
    /// Number of lines along x, padded to a multiple of L.
    fn lines(&self) -> usize {
        self.ny.next_multiple_of(self.line)
    }
    /// Number of modes of a plane, padding lines included.
    pub fn modes(&self) -> usize {
        self.nx * self.lines()
    }
    /// Distance of two planes of modes: an odd number of cache lines, so that a column of modes is
    /// spread over all sets of the cache.
    pub fn stride(&self) -> usize {
        self.line * ((self.modes() / self.line) | 1)
    }
    /// Calls `f` with the position of each mode in its plane, the index of the mode along x and the
    /// line along x, both from 0; lines from `ny` on are padding.
    pub fn each_mode(&self, mut f: impl FnMut(usize, usize, usize)) {
        for (first, width) in self.blocks(self.lines()) {
            for m in 0..self.nx {
                for line in 0..width {
                    let at = first * self.nx + m * width + line;
                    f(at, m, first + line);
                }
            }
        }
    }
    /// Lines along y in a plane of cells, from line `first` on and `second` lines further.
    #[inline(always)]
    fn along_y(&self, first: usize, second: usize) -> Lines {
        Lines { at: self.pitch + self.line + first, step: self.pitch, second }
    }
    /// Rows of a plane of cells, `lane` rows and `lane + second` rows from the start of the block
    /// of 2 `second` lines that begins with line `first`, and their modes.
    #[inline(always)]
    fn along_x(&self, first: usize, lane: usize, second: usize) -> (Rows, Lines) {
        let at = (first + 1 + lane) * self.pitch + self.line;
        let modes = Lines { at: first * self.nx + lane, step: 2 * second, second };
        (Rows { at, pitch: self.pitch, second }, modes)
    }
    /// First line and number of lines, 2 L or L, of each block.
    #[inline(always)]
    fn blocks(&self, lines: usize) -> impl Iterator<Item = (usize, usize)> + use<> {
        let (line, whole) = (self.line, 2 * self.line);
        let lines = lines.next_multiple_of(line);
        (0..lines).step_by(whole).map(move |first| {
            let rest = lines - first;
            (first, if rest >= whole { whole } else { line })
        })
    }
}

/// Plane of cells with one layer of ghosts, rows aligned to cache lines.
pub struct Plane<R> {
    layout: PlaneLayout,
    values: Aligned<R>,
}

impl<R: Real> Plane<R> {
    /// Plane of zeros.
    pub(super) fn new(layout: PlaneLayout) -> Plane<R> {
        Plane { layout, values: Aligned::zeros(layout.pitch * (layout.lines() + 2)) }
    }
    /// Memory held [bytes].
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&*self.values)
    }
    /// Row j, ghosts included: entries 0 to nx + 1.
    #[inline(always)]
    pub fn row(&self, j: usize) -> &[R] {
        &self.values[j * self.layout.pitch + R::LANES - 1..][..self.layout.nx + 2]
    }
    /// Mutable row j, ghosts included.
    #[inline(always)]
    pub fn row_mut(&mut self, j: usize) -> &mut [R] {
        &mut self.values[j * self.layout.pitch + R::LANES - 1..][..self.layout.nx + 2]
    }
    /// Sets the ghosts: periodic, or equal to the adjacent cells.
    #[inline(always)]
    fn fill_ghosts(&mut self, [periodic_x, periodic_y]: [bool; 2]) {
        let PlaneLayout { nx, ny, pitch, .. } = self.layout;
        for j in 1..=ny {
            let row = self.row_mut(j);
            let ends = [row[1], row[nx]];
            [row[0], row[nx + 1]] = if periodic_x { [ends[1], ends[0]] } else { ends };
        }
        let [below, above] = if periodic_y { [ny, 1] } else { [1, ny] };
        self.values.copy_within(below * pitch..(below + 1) * pitch, 0);
        self.values.copy_within(above * pitch..(above + 1) * pitch, (ny + 1) * pitch);
    }
    /// Clears the padding lines along y, whose old values would change the rounding of their
    /// partners.
    #[inline(always)]
    fn clear_columns(&mut self) {
        let PlaneLayout { nx, pitch, .. } = self.layout;
        for row in self.values.chunks_exact_mut(pitch) {
            row[R::LANES + nx..R::LANES + nx.next_multiple_of(R::LANES)].fill(R::default());
        }
    }
    /// Clears the padding lines along x.
    #[inline(always)]
    fn clear_rows(&mut self) {
        let PlaneLayout { ny, pitch, .. } = self.layout;
        self.values[(ny + 1) * pitch..(self.layout.lines() + 1) * pitch].fill(R::default());
    }
}

/// Forward transform: cells of `plane` to `modes`; the plane is overwritten.
pub struct Forward<'a, R> {
    /// Transforms along x and y.
    pub axes: [&'a AxisTransform<R>; 2],
    /// Cells, overwritten by modes along y.
    pub plane: &'a mut Plane<R>,
    /// Plane of modes, overwritten.
    pub modes: &'a mut [R],
    /// Buffers of the thread.
    pub buffers: &'a mut Buffers<R>,
    /// Whether the modes are written with non-temporal stores.
    pub non_temporal: bool,
}

impl<R: Real> Kernel for Forward<'_, R> {
    type Number = R;
    #[inline(always)]
    fn run<V: Vector<Number = R>>(self) {
        let Forward { axes: [along_x, along_y], plane, modes, buffers, non_temporal } = self;
        let layout = plane.layout;
        plane.clear_columns();
        plane.clear_rows();
        let values = &mut plane.values[..];
        for (first, width) in layout.blocks(layout.nx) {
            if width == 2 * R::LANES {
                for lane in (0..R::LANES).step_by(V::WIDTH) {
                    let lines = layout.along_y(first + lane, R::LANES);
                    lines.forward::<V>(along_y, values, buffers);
                }
            } else {
                layout.along_y(first, R::LANES / 2).forward::<V::Half>(along_y, values, buffers);
            }
        }
        for (first, width) in layout.blocks(layout.ny) {
            if width == 2 * R::LANES {
                for lane in (0..R::LANES).step_by(V::WIDTH) {
                    let (rows, lines) = layout.along_x(first, lane, R::LANES);
                    rows.load(&along_x.order, values, buffers.lines::<V>(along_x));
                    let found = buffers.transform::<V>(along_x, false);
                    // A narrower register writes part of a cache line.
                    if non_temporal && V::WIDTH == R::LANES {
                        lines.store_non_temporal(found, modes);
                    } else {
                        lines.store(found, modes);
                    }
                }
            } else {
                let (rows, lines) = layout.along_x(first, 0, R::LANES / 2);
                rows.load(&along_x.order, values, buffers.lines::<V::Half>(along_x));
                lines.store(buffers.transform::<V::Half>(along_x, false), modes);
            }
        }
        V::fence();
    }
}

/// Inverse transform: `modes` to cells of `plane` and its ghosts.
pub struct Inverse<'a, R> {
    /// Transforms along x and y.
    pub axes: [&'a AxisTransform<R>; 2],
    /// Whether x and y are periodic.
    pub periodic: [bool; 2],
    /// Cells and ghosts, overwritten.
    pub plane: &'a mut Plane<R>,
    /// Plane of modes.
    pub modes: &'a [R],
    /// Buffers of the thread.
    pub buffers: &'a mut Buffers<R>,
}

impl<R: Real> Kernel for Inverse<'_, R> {
    type Number = R;
    #[inline(always)]
    fn run<V: Vector<Number = R>>(self) {
        let Inverse { axes: [along_x, along_y], periodic, plane, modes, buffers } = self;
        let layout = plane.layout;
        let values = &mut plane.values[..];
        for (first, width) in layout.blocks(layout.ny) {
            if width == 2 * R::LANES {
                for lane in (0..R::LANES).step_by(V::WIDTH) {
                    let (rows, lines) = layout.along_x(first, lane, R::LANES);
                    lines.load(modes, buffers.lines::<V>(along_x));
                    rows.store(&along_x.order, buffers.transform::<V>(along_x, true), values);
                }
            } else {
                let (rows, lines) = layout.along_x(first, 0, R::LANES / 2);
                lines.load(modes, buffers.lines::<V::Half>(along_x));
                rows.store(&along_x.order, buffers.transform::<V::Half>(along_x, true), values);
            }
        }
        plane.clear_columns();
        let values = &mut plane.values[..];
        for (first, width) in layout.blocks(layout.nx) {
            if width == 2 * R::LANES {
                for lane in (0..R::LANES).step_by(V::WIDTH) {
                    let lines = layout.along_y(first + lane, R::LANES);
                    lines.inverse::<V>(along_y, values, buffers);
                }
            } else {
                layout.along_y(first, R::LANES / 2).inverse::<V::Half>(along_y, values, buffers);
            }
        }
        plane.fill_ghosts(periodic);
    }
}

/// Pairs of adjacent lines: entry i of the first lines at `at + i step`, of the second lines
/// `second` further.
#[derive(Clone, Copy)]
struct Lines {
    /// Position of entry 0 of the first lines.
    at: usize,
    /// Distance of successive entries of a line.
    step: usize,
    /// Distance of the second lines from the first.
    second: usize,
}

impl Lines {
    /// Loads entry i of the lines.
    #[inline(always)]
    fn entry<V: Vector>(&self, values: &[V::Number], i: usize) -> Complex<V> {
        let both = &values[self.at + i * self.step..][..self.second + V::WIDTH];
        Complex { re: V::load(both), im: V::load(&both[self.second..]) }
    }
    /// Mutable entry i of the first lines, and of the second lines.
    #[inline(always)]
    fn entry_mut<'a, V: Vector>(
        &self,
        values: &'a mut [V::Number],
        i: usize,
    ) -> (&'a mut [V::Number], &'a mut [V::Number]) {
        values[self.at + i * self.step..][..self.second + V::WIDTH].split_at_mut(self.second)
    }
    /// Loads all entries of the lines.
    #[inline(always)]
    fn load<V: Vector>(&self, values: &[V::Number], a: &mut [Complex<V>]) {
        for (i, x) in a.iter_mut().enumerate() {
            *x = self.entry(values, i);
        }
    }
    /// Stores all entries of the lines.
    #[inline(always)]
    fn store<V: Vector>(&self, a: &[Complex<V>], values: &mut [V::Number]) {
        for (i, x) in a.iter().enumerate() {
            let (first, second) = self.entry_mut::<V>(values, i);
            x.re.store(first);
            x.im.store(second);
        }
    }
    /// Stores all entries of the lines with non-temporal stores.
    #[inline(always)]
    fn store_non_temporal<V: Vector>(&self, a: &[Complex<V>], values: &mut [V::Number]) {
        for (i, x) in a.iter().enumerate() {
            let (first, second) = self.entry_mut::<V>(values, i);
            x.re.store_non_temporal(first);
            x.im.store_non_temporal(second);
        }
    }
    /// Replaces the lines by their modes along `axis`.
    #[inline(always)]
    fn forward<V: Vector>(
        &self,
        axis: &AxisTransform<V::Number>,
        values: &mut [V::Number],
        buffers: &mut Buffers<V::Number>,
    ) {
        let lines = buffers.lines::<V>(axis);
        for (i, &to) in axis.order.iter().enumerate() {
            lines[to] = self.entry(values, i);
        }
        self.store(buffers.transform::<V>(axis, false), values);
    }
    /// Replaces modes along `axis` by the lines, unnormalised.
    #[inline(always)]
    fn inverse<V: Vector>(
        &self,
        axis: &AxisTransform<V::Number>,
        values: &mut [V::Number],
        buffers: &mut Buffers<V::Number>,
    ) {
        self.load(values, buffers.lines::<V>(axis));
        let lines = buffers.transform::<V>(axis, true);
        for (i, &from) in axis.order.iter().enumerate() {
            let (first, second) = self.entry_mut::<V>(values, i);
            let line = &lines[from];
            line.im.store(first);
            line.re.store(second);
        }
    }
}

/// Pairs of rows of a plane: the first rows start at `at`, the second rows `second` rows further.
#[derive(Clone, Copy)]
struct Rows {
    /// Position of entry 0 of the first row.
    at: usize,
    /// Distance of successive rows.
    pitch: usize,
    /// Number of rows from the first rows to the second rows.
    second: usize,
}

impl Rows {
    /// Loads the rows transposed, entry i at `order[i]`.
    #[inline(always)]
    fn load<V: Vector>(&self, order: &[usize], values: &[V::Number], a: &mut [Complex<V>]) {
        for (group, order) in order.chunks(V::WIDTH).enumerate() {
            let at = self.at + group * V::WIDTH;
            let (mut re, mut im) = ([V::constant(0.0); MAX_LANES], [V::constant(0.0); MAX_LANES]);
            for row in 0..V::WIDTH {
                re[row] = V::load(&values[at + row * self.pitch..]);
                im[row] = V::load(&values[at + (row + self.second) * self.pitch..]);
            }
            V::transpose(&mut re);
            V::transpose(&mut im);
            for ((re, im), &to) in re.into_iter().zip(im).zip(order) {
                a[to] = Complex { re, im };
            }
        }
    }
    /// Stores the rows from their transpose, entry i from `order[i]`; real and imaginary parts are
    /// swapped.
    #[inline(always)]
    fn store<V: Vector>(&self, order: &[usize], a: &[Complex<V>], values: &mut [V::Number]) {
        let groups = order.chunks_exact(V::WIDTH);
        let rest = groups.remainder();
        let mut at = self.at;
        for order in groups {
            let mut block = [[V::constant(0.0); MAX_LANES]; 2];
            for n in 0..V::WIDTH {
                let line = &a[order[n]];
                (block[0][n], block[1][n]) = (line.im, line.re);
            }
            self.store_block(block, at, values);
            at += V::WIDTH;
        }
        if !rest.is_empty() {
            let mut block = [[V::constant(0.0); MAX_LANES]; 2];
            for (n, &from) in rest.iter().enumerate() {
                (block[0][n], block[1][n]) = (a[from].im, a[from].re);
            }
            self.store_block(block, at, values);
        }
    }
    /// Transposes two blocks into the entries from `at` on of `V::WIDTH` first and second rows.
    #[inline(always)]
    fn store_block<V: Vector>(
        &self,
        [mut first, mut second]: [[V; MAX_LANES]; 2],
        at: usize,
        values: &mut [V::Number],
    ) {
        V::transpose(&mut first);
        V::transpose(&mut second);
        for row in 0..V::WIDTH {
            first[row].store(&mut values[at + row * self.pitch..]);
            second[row].store(&mut values[at + (row + self.second) * self.pitch..]);
        }
    }
}

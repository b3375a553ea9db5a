//! Transforms of one xy plane: cells to modes and back.
//!
//! Lines are transformed in blocks of two cache lines (a full register of pairs) or one (half a
//! register); the first half of a block are the real parts. Lines along y are adjacent in the
//! plane. Lines along x are transposed in registers before the transform, and their modes stay
//! adjacent: a plane of modes is a row of blocks, each [mode along x][line]. The pairs, hence the
//! rounding, do not depend on the width of the registers.
//!
//! Legend: L count of numbers in a cache line.

use super::axis::{AxisTransform, transform_lines};
use crate::math::{Aligned, Real};
use grainwake_simd::{Complex, Kernel, MAX_LANES, Vector, as_complex, dispatch};

/// Memory layout of a plane of cells and of a plane of modes.
#[derive(Clone, Copy, Debug)]
pub struct PlaneLayout {
    /// Cells along x.
    pub nx: usize,
    /// Cells along y.
    pub ny: usize,
    /// Count L of numbers in a cache line, and position of i = 1 in a row of a [`Plane`]: rows
    /// start on cache lines, and a ghost precedes i = 1.
    pub line: usize,
    /// Distance of two rows of a [`Plane`].
    pub pitch: usize,
}

impl PlaneLayout {
    /// Number of lines along x, padded to a multiple of L.
    pub fn lines(&self) -> usize {
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
    /// First line and half the number of lines, L or L/2, of each block of `lines` lines.
    pub fn blocks(&self, lines: usize) -> impl Iterator<Item = (usize, usize)> + use<> {
        let (line, lines) = (self.line, lines.next_multiple_of(self.line));
        (0..lines)
            .step_by(2 * line)
            .map(move |first| (first, if first + line < lines { line } else { line / 2 }))
    }
}

/// Plane of cells with one layer of ghosts, rows aligned to cache lines.
pub struct Plane<R> {
    pub(super) layout: PlaneLayout,
    pub(super) values: Aligned<R>,
}

impl<R: Real> Plane<R> {
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

    /// Transforms the cells to `modes`, which are written with non-temporal stores if
    /// `non_temporal`; the cells are overwritten.
    pub(super) fn forward(
        &mut self,
        [along_x, along_y]: &[AxisTransform<R>; 2],
        modes: &mut [R],
        non_temporal: bool,
        buffers: &mut Aligned<R>,
    ) {
        let PlaneLayout { nx, ny, pitch, .. } = self.layout;
        self.clear_padding_columns();
        self.values[(ny + 1) * pitch..(self.layout.lines() + 1) * pitch].fill(R::default());
        for block in self.layout.blocks(nx) {
            self.transform(along_y, block, Direction::ForwardY, buffers);
        }
        for block in self.layout.blocks(ny) {
            let direction = Direction::ForwardX { modes, non_temporal };
            self.transform(along_x, block, direction, buffers);
        }
        if non_temporal {
            // The modes are complete before another thread reads them.
            R::Baseline::fence();
        }
    }

    /// Transforms `modes` to cells, unnormalised, and sets the ghosts: periodic, or equal to the
    /// adjacent cells.
    pub(super) fn inverse(
        &mut self,
        [along_x, along_y]: &[AxisTransform<R>; 2],
        [periodic_x, periodic_y]: [bool; 2],
        modes: &[R],
        buffers: &mut Aligned<R>,
    ) {
        let PlaneLayout { nx, ny, pitch, .. } = self.layout;
        for block in self.layout.blocks(ny) {
            self.transform(along_x, block, Direction::InverseX(modes), buffers);
        }
        self.clear_padding_columns();
        for block in self.layout.blocks(nx) {
            self.transform(along_y, block, Direction::InverseY, buffers);
        }
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
    fn clear_padding_columns(&mut self) {
        let PlaneLayout { nx, pitch, .. } = self.layout;
        for row in self.values.chunks_exact_mut(pitch) {
            row[R::LANES + nx..R::LANES + nx.next_multiple_of(R::LANES)].fill(R::default());
        }
    }

    fn transform(
        &mut self,
        axis: &AxisTransform<R>,
        (first, second): (usize, usize),
        direction: Direction<R>,
        buffers: &mut [R],
    ) {
        dispatch(TransformBlock { axis, plane: self, first, second, direction, buffers });
    }
}

/// Direction of a transform, and the modes along x that it writes or reads.
enum Direction<'a, R> {
    /// Cells to modes along y, in place.
    ForwardY,
    /// Rows of modes along y to modes along both axes.
    ForwardX { modes: &'a mut [R], non_temporal: bool },
    /// Modes along both axes to rows of modes along y.
    InverseX(&'a [R]),
    /// Modes along y to cells, in place.
    InverseY,
}

/// Transform of one block of lines.
struct TransformBlock<'a, R> {
    axis: &'a AxisTransform<R>,
    plane: &'a mut Plane<R>,
    /// First line of the block.
    first: usize,
    /// Number of lines from each first line to its second line, half of the block.
    second: usize,
    direction: Direction<'a, R>,
    /// Both buffers of the transform, one after the other.
    buffers: &'a mut [R],
}

impl<R: Real> Kernel for TransformBlock<'_, R> {
    type Number = R;
    #[inline(always)]
    fn run<V: Vector<Number = R>>(self) {
        if self.second == R::LANES {
            self.transform::<V>();
        } else {
            self.transform::<V::Half>();
        }
    }
}

impl<R: Real> TransformBlock<'_, R> {
    #[inline(always)]
    fn transform<V: Vector<Number = R>>(mut self) {
        let TransformBlock { axis, first, second, .. } = self;
        let PlaneLayout { nx, line, pitch, .. } = self.plane.layout;
        let values = &mut *self.plane.values;
        let len = axis.fourier.fft.len;
        let buffers = &mut self.buffers[..4 * V::WIDTH * len];
        for lane in (0..second).step_by(V::WIDTH) {
            let cells = Lines { at: pitch + line + first + lane, step: pitch, second };
            let rows = Rows { at: (first + 1 + lane) * pitch + line, pitch, second };
            let modes = Lines { at: first * nx + lane, step: 2 * second, second };
            let a = as_complex::<V>(buffers);
            match &self.direction {
                Direction::ForwardY => {
                    for (i, &to) in axis.order.iter().enumerate() {
                        a[to] = cells.entry(values, i);
                    }
                }
                Direction::ForwardX { .. } => rows.load(&axis.order, values, a),
                Direction::InverseX(from) => modes.load(from, &mut a[..axis.n]),
                Direction::InverseY => cells.load(values, &mut a[..axis.n]),
            }
            let inverse = matches!(self.direction, Direction::InverseX(_) | Direction::InverseY);
            let found = transform_lines::<V>(axis, buffers, inverse);
            match &mut self.direction {
                Direction::ForwardY => cells.store(found, values, false),
                Direction::ForwardX { modes: to, non_temporal } => {
                    // A narrower register would write part of a cache line.
                    modes.store(found, to, *non_temporal && V::WIDTH == R::LANES);
                }
                Direction::InverseX(_) => rows.store(&axis.order, found, values),
                Direction::InverseY => {
                    for (i, &from) in axis.order.iter().enumerate() {
                        cells.set_entry(values, i, found[from].swap_parts());
                    }
                }
            }
        }
    }
}

/// Pairs of adjacent lines: entry i of the first lines at `at + i step`, of the second lines
/// `second` further.
struct Lines {
    at: usize,
    step: usize,
    second: usize,
}

impl Lines {
    /// Loads entry i of the lines.
    #[inline(always)]
    fn entry<V: Vector>(&self, values: &[V::Number], i: usize) -> Complex<V> {
        let both = &values[self.at + i * self.step..][..self.second + V::WIDTH];
        Complex { re: V::load(both), im: V::load(&both[self.second..]) }
    }
    /// Stores entry i of the lines.
    #[inline(always)]
    fn set_entry<V: Vector>(&self, values: &mut [V::Number], i: usize, x: Complex<V>) {
        let both = &mut values[self.at + i * self.step..][..self.second + V::WIDTH];
        x.re.store(both);
        x.im.store(&mut both[self.second..]);
    }
    /// Loads all entries of the lines.
    #[inline(always)]
    fn load<V: Vector>(&self, values: &[V::Number], a: &mut [Complex<V>]) {
        for (i, x) in a.iter_mut().enumerate() {
            *x = self.entry(values, i);
        }
    }
    /// Stores all entries of the lines, with non-temporal stores if `non_temporal`.
    #[inline(always)]
    fn store<V: Vector>(&self, a: &[Complex<V>], values: &mut [V::Number], non_temporal: bool) {
        for (i, x) in a.iter().enumerate() {
            if non_temporal {
                let both = &mut values[self.at + i * self.step..][..self.second + V::WIDTH];
                x.re.store_non_temporal(both);
                x.im.store_non_temporal(&mut both[self.second..]);
            } else {
                self.set_entry(values, i, *x);
            }
        }
    }
}

/// Pairs of rows of a plane: the first rows start at `at`, `pitch` apart; the second rows lie
/// `second` rows further.
struct Rows {
    at: usize,
    pitch: usize,
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
            for (n, &to) in order.iter().enumerate() {
                a[to] = Complex { re: re[n], im: im[n] };
            }
        }
    }
    /// Stores the rows from their transpose, entry i from `order[i]`; real and imaginary parts are
    /// swapped.
    #[inline(always)]
    fn store<V: Vector>(&self, order: &[usize], a: &[Complex<V>], values: &mut [V::Number]) {
        for (group, order) in order.chunks(V::WIDTH).enumerate() {
            let at = self.at + group * V::WIDTH;
            let (mut re, mut im) = ([V::constant(0.0); MAX_LANES], [V::constant(0.0); MAX_LANES]);
            for n in 0..V::WIDTH {
                // Columns beyond the last entry are padding.
                let line = &a[*order.get(n).unwrap_or(&0)];
                (re[n], im[n]) = (line.im, line.re);
            }
            V::transpose(&mut re);
            V::transpose(&mut im);
            for row in 0..V::WIDTH {
                re[row].store(&mut values[at + row * self.pitch..]);
                im[row].store(&mut values[at + (row + self.second) * self.pitch..]);
            }
        }
    }
}

//! Transforms of one xy plane: cells to modes and back.
//!
//! Lines are transformed in blocks of two cache lines (a full register of pairs) or one (half a
//! register); the first half of a block are the real parts. Lines along y are adjacent in the
//! plane. Lines along x are transposed in registers before the transform, and their modes stay
//! adjacent: a plane of modes is a row of blocks, each [mode along x][line]. The pairs, hence the
//! bits, do not depend on the width of the registers.
//!
//! Legend: L count of numbers in a cache line.

use super::axis::AxisTransform;
use super::lines::{Buffers, Lines, Rows};
use crate::math::{Aligned, Real};
use grainwake_simd::{Kernel, Vector};

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
            let at = layout.pitch + R::LANES + first;
            if width == 2 * R::LANES {
                for lane in (0..R::LANES).step_by(V::WIDTH) {
                    let lines = Lines { at: at + lane, step: layout.pitch, second: R::LANES };
                    lines.forward::<V>(along_y, values, buffers);
                }
            } else {
                let lines = Lines { at, step: layout.pitch, second: R::LANES / 2 };
                lines.forward::<V::Half>(along_y, values, buffers);
            }
        }
        for (first, width) in layout.blocks(layout.ny) {
            let at = (first + 1) * layout.pitch + R::LANES;
            let to = first * layout.nx;
            if width == 2 * R::LANES {
                for lane in (0..R::LANES).step_by(V::WIDTH) {
                    let rows = Rows {
                        at: at + lane * layout.pitch,
                        pitch: layout.pitch,
                        second: R::LANES,
                    };
                    let lines = Lines { at: to + lane, step: 2 * R::LANES, second: R::LANES };
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
                let rows = Rows { at, pitch: layout.pitch, second: R::LANES / 2 };
                let lines = Lines { at: to, step: R::LANES, second: R::LANES / 2 };
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
            let at = (first + 1) * layout.pitch + R::LANES;
            let from = first * layout.nx;
            if width == 2 * R::LANES {
                for lane in (0..R::LANES).step_by(V::WIDTH) {
                    let rows = Rows {
                        at: at + lane * layout.pitch,
                        pitch: layout.pitch,
                        second: R::LANES,
                    };
                    let lines = Lines { at: from + lane, step: 2 * R::LANES, second: R::LANES };
                    lines.load(modes, buffers.lines::<V>(along_x));
                    rows.store(&along_x.order, buffers.transform::<V>(along_x, true), values);
                }
            } else {
                let rows = Rows { at, pitch: layout.pitch, second: R::LANES / 2 };
                let lines = Lines { at: from, step: R::LANES, second: R::LANES / 2 };
                lines.load(modes, buffers.lines::<V::Half>(along_x));
                rows.store(&along_x.order, buffers.transform::<V::Half>(along_x, true), values);
            }
        }
        plane.clear_columns();
        let values = &mut plane.values[..];
        for (first, width) in layout.blocks(layout.nx) {
            let at = layout.pitch + R::LANES + first;
            if width == 2 * R::LANES {
                for lane in (0..R::LANES).step_by(V::WIDTH) {
                    let lines = Lines { at: at + lane, step: layout.pitch, second: R::LANES };
                    lines.inverse::<V>(along_y, values, buffers);
                }
            } else {
                let lines = Lines { at, step: layout.pitch, second: R::LANES / 2 };
                lines.inverse::<V::Half>(along_y, values, buffers);
            }
        }
        plane.fill_ghosts(periodic);
    }
}

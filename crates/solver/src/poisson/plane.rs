//! The transforms of one xy plane, in cache: cells to modes and back.
//!
//! Lines go through the transforms in blocks of sixteen (eight pairs) or eight (four pairs); the
//! first half of a block are the real parts. Lines along y lie side by side in the plane; lines
//! along x are turned over in registers on their way in, and their modes stay side by side, so
//! that a plane of modes is a row of blocks, each [mode along x][line]. The pairs do not depend on
//! the width of the registers, so neither do the bits.

use super::axis::Axis;
use super::lines::{Buffers, Lines, Rows};
use crate::math::Aligned;
use crate::math::lanes::{Kernel, Vector};

/// Place of i = 1 in a row of a [`Plane`]: rows start on cache lines, with room for a ghost before.
const FIRST: usize = 8;

/// Sizes of a plane of cells and of a plane of modes.
#[derive(Clone, Copy, Debug)]
pub struct Shape {
    nx: usize,
    ny: usize,
    pitch: usize,
}

impl Shape {
    pub fn new(nx: usize, ny: usize) -> Shape {
        Shape {
            nx,
            ny,
            pitch: FIRST + nx.next_multiple_of(8) + 8,
        }
    }
    /// Lines along x, a multiple of eight.
    fn lines(&self) -> usize {
        self.ny.next_multiple_of(8)
    }
    /// Modes of a plane, those of the lines beyond the last included.
    pub fn modes(&self) -> usize {
        self.nx * self.lines()
    }
    /// Distance of two planes of modes: an odd number of cache lines, so that a column of modes
    /// does not crowd into a few sets of the cache.
    pub fn stride(&self) -> usize {
        8 * ((self.modes() / 8) | 1)
    }
    /// Calls `f` with the place of each mode in its plane, its index along x and its line along x,
    /// both from 0; lines from `ny` on fill up the last block.
    pub fn each_mode(&self, mut f: impl FnMut(usize, usize, usize)) {
        for (first, width) in blocks(self.lines()) {
            for m in 0..self.nx {
                for line in 0..width {
                    let at = first * self.nx + m * width + line;
                    f(at, m, first + line);
                }
            }
        }
    }
}

/// First line and number of lines of each block.
#[inline(always)]
fn blocks(lines: usize) -> impl Iterator<Item = (usize, usize)> {
    let lines = lines.next_multiple_of(8);
    (0..lines)
        .step_by(16)
        .map(move |first| (first, if first + 16 <= lines { 16 } else { 8 }))
}

/// A plane of cells with one layer of ghosts, rows on cache lines.
pub struct Plane {
    shape: Shape,
    values: Aligned,
}

impl Plane {
    pub(super) fn new(shape: Shape) -> Plane {
        Plane {
            shape,
            values: Aligned::zeros(shape.pitch * (shape.lines() + 2)),
        }
    }
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&*self.values)
    }
    /// Row j, ghosts included: entries 0 to nx + 1.
    #[inline(always)]
    pub fn row(&self, j: usize) -> &[f64] {
        &self.values[j * self.shape.pitch + FIRST - 1..][..self.shape.nx + 2]
    }
    /// Row j to write.
    #[inline(always)]
    pub fn row_mut(&mut self, j: usize) -> &mut [f64] {
        &mut self.values[j * self.shape.pitch + FIRST - 1..][..self.shape.nx + 2]
    }
    /// Sets the ghosts: the neighbours across a periodic axis, else the cells next to them.
    #[inline(always)]
    fn fill_ghosts(&mut self, [periodic_x, periodic_y]: [bool; 2]) {
        let Shape { nx, ny, pitch } = self.shape;
        for j in 1..=ny {
            let row = self.row_mut(j);
            let ends = [row[1], row[nx]];
            [row[0], row[nx + 1]] = if periodic_x { [ends[1], ends[0]] } else { ends };
        }
        let [below, above] = if periodic_y { [ny, 1] } else { [1, ny] };
        self.values
            .copy_within(below * pitch..(below + 1) * pitch, 0);
        self.values
            .copy_within(above * pitch..(above + 1) * pitch, (ny + 1) * pitch);
    }
    /// Clears what shares a block with lines along y: a stale partner would leave its rounding.
    #[inline(always)]
    fn clear_columns(&mut self) {
        let Shape { nx, pitch, .. } = self.shape;
        for row in self.values.chunks_exact_mut(pitch) {
            row[FIRST + nx..FIRST + nx.next_multiple_of(8)].fill(0.0);
        }
    }
    /// Clears what shares a block with lines along x.
    #[inline(always)]
    fn clear_rows(&mut self) {
        let Shape { ny, pitch, .. } = self.shape;
        self.values[(ny + 1) * pitch..(self.shape.lines() + 1) * pitch].fill(0.0);
    }
}

/// Cells of `plane` -> `modes`; uses up the plane.
pub struct Forward<'a> {
    pub axes: [&'a Axis; 2],
    pub plane: &'a mut Plane,
    pub modes: &'a mut [f64],
    pub buffers: &'a mut Buffers,
}

impl Kernel for Forward<'_> {
    #[inline(always)]
    fn run<V: Vector>(self) {
        let Forward {
            axes: [along_x, along_y],
            plane,
            modes,
            buffers,
        } = self;
        let shape = plane.shape;
        plane.clear_columns();
        plane.clear_rows();
        let values = &mut plane.values[..];
        for (first, width) in blocks(shape.nx) {
            let at = shape.pitch + FIRST + first;
            if width == 16 {
                for lane in (0..8).step_by(V::WIDTH) {
                    let lines = Lines {
                        at: at + lane,
                        step: shape.pitch,
                        second: 8,
                    };
                    lines.forward::<V>(along_y, values, buffers);
                }
            } else {
                let lines = Lines {
                    at,
                    step: shape.pitch,
                    second: 4,
                };
                lines.forward::<V::Four>(along_y, values, buffers);
            }
        }
        for (first, width) in blocks(shape.ny) {
            let at = (first + 1) * shape.pitch + FIRST;
            let to = first * shape.nx;
            if width == 16 {
                for lane in (0..8).step_by(V::WIDTH) {
                    let rows = Rows {
                        at: at + lane * shape.pitch,
                        pitch: shape.pitch,
                        second: 8,
                    };
                    let lines = Lines {
                        at: to + lane,
                        step: 16,
                        second: 8,
                    };
                    rows.load(&along_x.order, values, buffers.lines::<V>(along_x));
                    lines.store(buffers.transform::<V>(along_x, false), modes);
                }
            } else {
                let rows = Rows {
                    at,
                    pitch: shape.pitch,
                    second: 4,
                };
                let lines = Lines {
                    at: to,
                    step: 8,
                    second: 4,
                };
                rows.load(&along_x.order, values, buffers.lines::<V::Four>(along_x));
                lines.store(buffers.transform::<V::Four>(along_x, false), modes);
            }
        }
    }
}

/// `modes` -> cells of `plane` and its ghosts.
pub struct Inverse<'a> {
    pub axes: [&'a Axis; 2],
    pub periodic: [bool; 2],
    pub plane: &'a mut Plane,
    pub modes: &'a [f64],
    pub buffers: &'a mut Buffers,
}

impl Kernel for Inverse<'_> {
    #[inline(always)]
    fn run<V: Vector>(self) {
        let Inverse {
            axes: [along_x, along_y],
            periodic,
            plane,
            modes,
            buffers,
        } = self;
        let shape = plane.shape;
        let values = &mut plane.values[..];
        for (first, width) in blocks(shape.ny) {
            let at = (first + 1) * shape.pitch + FIRST;
            let from = first * shape.nx;
            if width == 16 {
                for lane in (0..8).step_by(V::WIDTH) {
                    let rows = Rows {
                        at: at + lane * shape.pitch,
                        pitch: shape.pitch,
                        second: 8,
                    };
                    let lines = Lines {
                        at: from + lane,
                        step: 16,
                        second: 8,
                    };
                    lines.load(modes, buffers.lines::<V>(along_x));
                    rows.store(
                        &along_x.order,
                        buffers.transform::<V>(along_x, true),
                        values,
                    );
                }
            } else {
                let rows = Rows {
                    at,
                    pitch: shape.pitch,
                    second: 4,
                };
                let lines = Lines {
                    at: from,
                    step: 8,
                    second: 4,
                };
                lines.load(modes, buffers.lines::<V::Four>(along_x));
                rows.store(
                    &along_x.order,
                    buffers.transform::<V::Four>(along_x, true),
                    values,
                );
            }
        }
        plane.clear_columns();
        let values = &mut plane.values[..];
        for (first, width) in blocks(shape.nx) {
            let at = shape.pitch + FIRST + first;
            if width == 16 {
                for lane in (0..8).step_by(V::WIDTH) {
                    let lines = Lines {
                        at: at + lane,
                        step: shape.pitch,
                        second: 8,
                    };
                    lines.inverse::<V>(along_y, values, buffers);
                }
            } else {
                let lines = Lines {
                    at,
                    step: shape.pitch,
                    second: 4,
                };
                lines.inverse::<V::Four>(along_y, values, buffers);
            }
        }
        plane.fill_ghosts(periodic);
    }
}

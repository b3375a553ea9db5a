//! Direct solver for the constant-coefficient Poisson equation on cell centres.
//!
//! Along x and y the second difference is diagonalised (cosine modes between impermeable faces,
//! Fourier modes on a periodic axis); along z a tridiagonal system is left for each pair of modes.
//! All scalings of the transforms are internal.
//!
//! Memory bandwidth limits the speed, so the solver stores the modes alone: the caller computes the
//! right-hand side of a plane when its transform begins, and uses the solution of a plane and its
//! neighbours while they are in the cache.

mod axis;
mod fft;
mod plan;
mod plane;
mod tridiagonal;

use std::ops::Add;

use rayon::prelude::*;

use crate::grid::{Mesh, columns_of, planes_of};
use crate::math::{Aligned, Real, Stopwatch, TimeSpent};
use axis::AxisTransform;
use grainwake_simd::dispatch;
use plane::PlaneLayout;
use tridiagonal::{ColumnScratch, Solve, Tridiagonal};

pub use plane::Plane;

/// Conditions at the two ends of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ends {
    /// Periodic axis.
    Periodic,
    /// Zero normal derivative at both ends.
    Neumann,
}

/// Time spent in the stages of all solves.
#[derive(Clone, Copy, Debug, Default)]
pub struct PoissonTimes {
    /// Right-hand side and its transforms.
    pub forward: TimeSpent,
    /// Tridiagonal systems.
    pub columns: TimeSpent,
    /// Inverse transforms and the caller's use of the solution.
    pub inverse: TimeSpent,
}

impl Add for PoissonTimes {
    type Output = PoissonTimes;
    fn add(self, other: PoissonTimes) -> PoissonTimes {
        PoissonTimes {
            forward: self.forward + other.forward,
            columns: self.columns + other.columns,
            inverse: self.inverse + other.inverse,
        }
    }
}

/// One plane of the solution and its neighbours, ghosts included. Beyond an end of the box the
/// neighbour is the plane at the other end if z is periodic, else the plane itself.
pub struct Solution<'a, R> {
    /// Plane k.
    pub here: &'a Plane<R>,
    /// Plane k - 1.
    pub below: &'a Plane<R>,
    /// Plane k + 1.
    pub above: &'a Plane<R>,
}

/// Solver for lap(phi) = f, planned once for a mesh (`plan.rs`).
pub struct Poisson<R = f64> {
    mesh: Mesh,
    ends: [Ends; 3],
    axes: [AxisTransform<R>; 2],
    along_z: Tridiagonal,
    layout: PlaneLayout,
    modes: Aligned<R>,
    /// Eigenvalue along x and y of each mode of a plane.
    eigenvalues: Vec<f64>,
    slots: Vec<Slot<R>>,
    columns: Vec<ColumnScratch>,
    /// Time spent in each stage of all solves.
    pub times: PoissonTimes,
}

/// Scratch of one range of planes.
struct Slot<R> {
    planes: [Plane<R>; 3],
    /// Both buffers of the transforms, one after the other.
    buffers: Aligned<R>,
}

impl<R: Real> Poisson<R> {
    /// Solves for the right-hand side whose plane k = 1..=nz `source` writes (rows 1..=ny, entries
    /// 1..=nx), and hands each plane of the solution to `sink` with the same plane of `fields` and
    /// its `partial` result. Where the solution is defined up to a constant, the mean of the
    /// right-hand side must be zero, and so is that of the solution. The modes are written with
    /// non-temporal stores if `non_temporal`.
    pub fn solve<const N: usize, T: Send>(
        &mut self,
        non_temporal: bool,
        source: impl Fn(usize, &mut Plane<R>) + Sync,
        fields: [&mut [R]; N],
        partial: &mut [T],
        sink: impl Fn(usize, Solution<R>, [&mut [R]; N], &mut T) + Sync,
    ) {
        let (axes, stride, nz) = (&self.axes, self.layout.stride(), self.mesh.cells[2]);
        let range = nz.div_ceil(self.slots.len());

        let start = Stopwatch::start();
        let ranges = self.modes.par_chunks_mut(range * stride).enumerate();
        self.slots.par_iter_mut().zip(ranges).for_each(|(slot, (n, modes))| {
            let Slot { planes: [plane, ..], buffers } = slot;
            for (k, modes) in (1 + n * range..).zip(modes.chunks_exact_mut(stride)) {
                source(k, plane);
                plane.forward(axes, modes, non_temporal, buffers);
            }
        });

        let forward = Stopwatch::start();
        let (system, eigenvalues) = (self.along_z, &self.eigenvalues);
        let width = self.columns[0].carry.len();
        let blocks = columns_of(&mut self.modes, stride, eigenvalues.len(), width);
        let blocks_of_slot = blocks.len().div_ceil(self.columns.len());
        let blocks = blocks.into_par_iter().chunks(blocks_of_slot);
        self.columns.par_iter_mut().zip(blocks).for_each(|(scratch, blocks)| {
            for mut columns in blocks {
                let singular = columns.range().start == 0 && eigenvalues[0] == 0.0;
                let lambda = &eigenvalues[columns.range()];
                dispatch(Solve { system, columns: &mut columns, lambda, singular, scratch });
            }
        });

        let columns = Stopwatch::start();
        let [periodic_x, periodic_y, periodic_z] = self.ends.map(|ends| ends == Ends::Periodic);
        let modes = &self.modes;
        // Plane k, wrapped on a periodic axis; none beyond another end.
        let inside = |k: usize| match k {
            0 => periodic_z.then_some(nz),
            k if k > nz => periodic_z.then_some(1),
            k => Some(k),
        };
        let invert = |k: usize, plane: &mut Plane<R>, buffers: &mut Aligned<R>| {
            if let Some(k) = inside(k) {
                let modes = &modes[(k - 1) * stride..];
                plane.inverse(axes, [periodic_x, periodic_y], modes, buffers);
            }
        };
        let ranges = planes_of(self.mesh.layout(), fields, partial).chunks(range);
        self.slots.par_iter_mut().zip(ranges).for_each(|(slot, range)| {
            let Slot { planes, buffers } = slot;
            let first = range[0].0;
            invert(first - 1, &mut planes[0], buffers);
            invert(first, &mut planes[1], buffers);
            for (k, fields, partial) in range {
                invert(k + 1, &mut planes[2], buffers);
                let [below, here, above] = &*planes;
                let solution = Solution {
                    here,
                    below: if inside(k - 1).is_some() { below } else { here },
                    above: if inside(k + 1).is_some() { above } else { here },
                };
                sink(k, solution, fields, partial);
                planes.rotate_left(1);
            }
        });
        self.times.forward += start.until(&forward);
        self.times.columns += forward.until(&columns);
        self.times.inverse += columns.elapsed();
    }
}

#[cfg(test)]
mod tests;

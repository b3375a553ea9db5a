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
mod plane;
mod tridiagonal;

#[cfg(test)]
use crate::grid::{Centre, Field};
use crate::grid::{Mesh, PlaneRange, for_chunks, for_columns, for_plane_ranges};
use crate::math::{Aligned, Real, Stopwatch, TimeSpent};
use axis::{AxisTransform, Buffers};
use grainwake_simd::dispatch;
use plane::{Forward, Inverse, PlaneLayout};
use tridiagonal::{ColumnScratch, Solve, Tridiagonal, block_width};

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

/// Solver for lap(phi) = f, planned once for a mesh; solving allocates no memory.
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
    times: PoissonTimes,
    /// Whether the forward transform writes the modes with non-temporal stores.
    pub non_temporal: bool,
}

/// Scratch of one range of planes.
struct Slot<R> {
    planes: [Plane<R>; 3],
    buffers: Buffers<R>,
}

/// Largest number of ranges of planes and of ranges of columns, enough for many threads.
const SLOTS: usize = 32;
/// Smallest number of planes of a range: the planes below and above each range are transformed
/// twice.
const MIN_PLANES_PER_SLOT: usize = 16;

impl<R: Real> Poisson<R> {
    /// Plans the solver for `mesh` with the given ends along x, y, z.
    pub fn new(mesh: &Mesh, ends: [Ends; 3]) -> Poisson<R> {
        let [nx, ny, nz] = mesh.cells;
        let axes = [0, 1].map(|a| AxisTransform::new(mesh.cells[a], ends[a], mesh.spacing[a]));
        // A forward and an inverse transform multiply by the number of cells.
        let scale = 1.0 / (nx as f64 * ny as f64);
        let layout = PlaneLayout::new::<R>(nx, ny);
        let mut eigenvalues = vec![0.0; layout.modes()];
        // Padding lines of a block hold round-off of their partners; a singular system would turn
        // it into infinities that return to the partners.
        let filler = mesh.spacing.y.powi(-2);
        layout.each_mode(|at, i, j| {
            let along_y = axes[1].eigenvalues.get(j).unwrap_or(&filler);
            eigenvalues[at] = axes[0].eigenvalues[i] + along_y;
        });
        let slot = || Slot {
            planes: [(); 3].map(|()| Plane::new(layout)),
            buffers: Buffers::new([&axes[0], &axes[1]]),
        };
        let width = block_width::<R>(nz).min(layout.modes());
        let blocks = layout.modes().div_ceil(width);
        Poisson {
            mesh: *mesh,
            ends,
            along_z: Tridiagonal::new(nz, ends[2], mesh.spacing.z, scale),
            layout,
            modes: Aligned::zeros(layout.stride() * nz),
            eigenvalues,
            slots: (0..(nz / MIN_PLANES_PER_SLOT).clamp(1, SLOTS)).map(|_| slot()).collect(),
            columns: (0..SLOTS.min(blocks))
                .map(|_| ColumnScratch::new(width, nz, ends[2]))
                .collect(),
            axes,
            times: PoissonTimes::default(),
            non_temporal: false,
        }
    }

    /// Solves for the right-hand side whose plane k = 1..=nz `source` writes (rows 1..=ny, entries
    /// 1..=nx), and hands each plane of the solution to `sink` with the same plane of `fields` and
    /// its `partial` result. Where the solution is defined up to a constant, the mean of the
    /// right-hand side must be zero, and one value of the mean mode is set to zero.
    pub fn solve<const N: usize, T: Send>(
        &mut self,
        source: impl Fn(usize, &mut Plane<R>) + Sync,
        fields: [&mut [R]; N],
        partial: &mut [T],
        sink: impl Fn(usize, Solution<R>, &mut PlaneRange<N, R, T>) + Sync,
    ) {
        let start = Stopwatch::start();
        let non_temporal = self.non_temporal;
        let (axes, stride) = ([&self.axes[0], &self.axes[1]], self.layout.stride());
        for_chunks(&mut self.modes, stride, &mut self.slots, |k, modes, slot| {
            let Slot { planes: [plane, ..], buffers } = slot;
            source(k + 1, plane);
            dispatch(Forward { axes, plane, modes, buffers, non_temporal });
        });
        let forward = Stopwatch::start();
        let (system, eigenvalues) = (self.along_z, &self.eigenvalues);
        let nz = self.mesh.cells[2];
        for_columns(
            &mut self.modes,
            stride,
            eigenvalues.len(),
            block_width::<R>(nz),
            &mut self.columns,
            |at, columns, scratch| {
                let lambda = &eigenvalues[at..at + columns.width()];
                let singular = at == 0 && lambda[0] == 0.0;
                dispatch(Solve { system, columns, lambda, singular, scratch });
            },
        );
        let columns = Stopwatch::start();
        let periodic = self.ends.map(|ends| ends == Ends::Periodic);
        let modes = &self.modes;
        let invert = |k: usize, plane: &mut Plane<R>, buffers: &mut Buffers<R>| {
            dispatch(Inverse {
                axes,
                periodic: [periodic[0], periodic[1]],
                plane,
                modes: &modes[(k - 1) * stride..][..self.layout.modes()],
                buffers,
            });
        };
        for_plane_ranges(self.mesh.layout(), fields, partial, &mut self.slots, |range, slot| {
            let Slot { planes, buffers } = slot;
            // Plane k, wrapped on a periodic axis; none beyond another end.
            let across = |k: usize| match k {
                0 => periodic[2].then_some(nz),
                k if k > nz => periodic[2].then_some(1),
                k => Some(k),
            };
            let start = range.range().start;
            let [below, here, _] = planes;
            if let Some(k) = across(start - 1) {
                invert(k, below, buffers);
            }
            invert(start, here, buffers);
            for k in range.range() {
                let [below, here, above] = planes;
                if let Some(k) = across(k + 1) {
                    invert(k, above, buffers);
                }
                let (here, end) = (&*here, |k: usize| across(k).is_none());
                let solution = Solution {
                    here,
                    below: if end(k - 1) { here } else { below },
                    above: if end(k + 1) { here } else { above },
                };
                sink(k, solution, range);
                planes.rotate_left(1);
            }
        });
        self.times.forward += start.until(&forward);
        self.times.columns += forward.until(&columns);
        self.times.inverse += columns.elapsed();
    }

    /// Replaces the right-hand side in the interior of `field` by the solution; ghosts keep
    /// their values.
    #[cfg(test)]
    pub fn solve_field(&mut self, field: &mut Field<Centre, R>) {
        let layout = self.mesh.layout();
        let [nx, ny, nz] = layout.cells;
        let given = field.clone();
        let source = |k: usize, plane: &mut Plane<R>| {
            for j in 1..=ny {
                plane.row_mut(j)[1..=nx].copy_from_slice(&given.row(j, k)[1..=nx]);
            }
        };
        self.solve(source, [field], &mut vec![(); nz], |k, solution, range| {
            let ([plane], ()) = range.plane(k);
            for j in 1..=ny {
                let at = layout.row() * j;
                plane[at + 1..=at + nx].copy_from_slice(&solution.here.row(j)[1..=nx]);
            }
        });
    }

    /// Time spent in each stage.
    pub fn times(&self) -> PoissonTimes {
        self.times
    }

    /// Memory held [bytes].
    pub fn bytes(&self) -> usize {
        let slots: usize = self
            .slots
            .iter()
            .map(|slot| slot.buffers.bytes() + slot.planes.iter().map(Plane::bytes).sum::<usize>())
            .sum();
        let columns: usize = self.columns.iter().map(ColumnScratch::bytes).sum();
        R::BYTES * self.modes.len() + 8 * self.eigenvalues.len() + slots + columns
    }
}

#[cfg(test)]
mod tests;

//! Trilinear interpolation in a grid of distance samples, several points at a time. Locating the points
//! and reading the samples are separate steps, so that each can run in a loop of its own.

use std::ops::Deref;

use glam::DVec3;
use grainwake_shape::SampledField;

use grainwake_simd::{Scalar, Vector};

/// Stands for infinity in single precision [m].
pub const FAR: f64 = 1e30;

/// Loads a vector from each list. (Kernels use no closures on vectors: these would not be inlined.)
#[inline(always)]
pub fn load_all<V: Vector>([x, y, z]: &[impl Deref<Target = [V::Number]>; 3], at: usize) -> [V; 3] {
    [V::load(&x[at..]), V::load(&y[at..]), V::load(&z[at..])]
}

/// Stores a vector in each list.
#[inline(always)]
pub fn store_all<V: Vector>(values: [V; 3], [x, y, z]: &mut [&mut [V::Number]; 3], at: usize) {
    values[0].store(&mut x[at..]);
    values[1].store(&mut y[at..]);
    values[2].store(&mut z[at..]);
}

/// Signed distances on a uniform grid as 16-bit levels, so that those of a grain fit the cache.
pub struct DistanceSamples {
    lower: DVec3,
    spacing: f64,
    dims: [usize; 3],
    /// Distance per level [m].
    quantum: f64,
    /// Distances in levels, x fastest.
    levels: Vec<i16>,
}

impl DistanceSamples {
    /// Converts a sampled field; distances are limited to `most` [m] on both sides.
    pub fn new(field: &SampledField, most: f64) -> DistanceSamples {
        let quantum = most / f64::from(i16::MAX);
        let ratio = field.quantum() / quantum;
        // The conversion saturates.
        let level = |level: &f32| (f64::from(*level) * ratio).round() as i16;
        DistanceSamples {
            lower: field.lower(),
            spacing: field.spacing(),
            dims: field.dims(),
            quantum,
            levels: field.levels().iter().map(level).collect(),
        }
    }

    /// Signed distance [m] and gradient at a point; `None` off the grid.
    #[inline(always)]
    pub fn distance_and_gradient(&self, x: DVec3) -> Option<(f64, DVec3)> {
        let grid = SampleGrid::new(self);
        let location = grid.locate([Scalar(x.x), Scalar(x.y), Scalar(x.z)]);
        let on_grid = location.off_grid.0 <= 0.0;
        let (distance, [x, y, z]) = grid.interpolate(location);
        on_grid.then_some((distance.0, DVec3::new(x.0, y.0, z.0)))
    }

    /// Memory held [bytes].
    pub fn bytes(&self) -> usize {
        size_of::<i16>() * self.levels.capacity()
    }
}

/// Constants of a sample grid in vector registers.
pub struct SampleGrid<'a, V> {
    lower: [V; 3],
    inverse: V,
    /// Index of the last sample along each axis.
    last: [V; 3],
    /// Positions from one row and one plane of samples to the next.
    strides: [V; 2],
    /// Distance per level [m].
    quantum: V,
    /// Gradient per level and spacing.
    slope: V,
    levels: &'a [i16],
}

/// Location of points in the sample grid.
pub struct SampleLocation<V> {
    /// Position of the lowest corner of the cell in the list of levels.
    pub cell: V,
    /// Position within the cell along each axis, 0 to 1.
    pub fraction: [V; 3],
    /// Distance off the grid, in spacings (sum over the axes).
    pub off_grid: V,
}

impl<'a, V: Vector> SampleGrid<'a, V> {
    #[inline(always)]
    pub fn new(samples: &'a DistanceSamples) -> SampleGrid<'a, V> {
        let (dims, inverse) = (samples.dims, 1.0 / samples.spacing);
        let mut lower = [V::constant(0.0); 3];
        let mut last = lower;
        for axis in 0..3 {
            lower[axis] = V::constant(samples.lower[axis]);
            last[axis] = V::constant(dims[axis] as f64 - 1.0);
        }
        let (row, plane) = (dims[0], dims[0] * dims[1]);
        SampleGrid {
            lower,
            inverse: V::constant(inverse),
            last,
            strides: [V::constant(row as f64), V::constant(plane as f64)],
            quantum: V::constant(samples.quantum),
            slope: V::constant(samples.quantum * inverse),
            levels: &samples.levels,
        }
    }

    /// Locates points; those off the grid at the nearest point on it.
    #[inline(always)]
    pub fn locate(&self, x: [V; 3]) -> SampleLocation<V> {
        let (zero, one) = (V::constant(0.0), V::constant(1.0));
        let mut cell = [zero; 3];
        let mut fraction = [zero; 3];
        let mut off_grid = zero;
        for axis in 0..3 {
            let s = (x[axis] - self.lower[axis]) * self.inverse;
            let nearest = s.max(zero).min(self.last[axis]);
            off_grid = off_grid + (s - nearest).abs();
            cell[axis] = nearest.floor().min(self.last[axis] - one);
            fraction[axis] = nearest - cell[axis];
        }
        let [row, plane] = self.strides;
        SampleLocation {
            cell: cell[0] + row * cell[1] + plane * cell[2],
            fraction,
            off_grid,
        }
    }

    /// Interpolates distance [m] and gradient.
    #[inline(always)]
    pub fn interpolate(&self, location: SampleLocation<V>) -> (V, [V; 3]) {
        let [fx, fy, fz] = location.fraction;
        let [row, plane] = self.strides;
        // Value and slope on the four edges along x.
        let (at, levels) = (location.cell, self.levels);
        let [a, s] = edge(levels, at, fx);
        let [b, t] = edge(levels, at + row, fx);
        let [c, u] = edge(levels, at + plane, fx);
        let [d, v] = edge(levels, at + plane + row, fx);
        let (low, high) = (a + fy * (b - a), c + fy * (d - c));
        let (slope_low, slope_high) = (s + fy * (t - s), u + fy * (v - u));
        let gradient = [
            self.slope * (slope_low + fz * (slope_high - slope_low)),
            self.slope * ((b - a) + fz * ((d - c) - (b - a))),
            self.slope * (high - low),
        ];
        // Points off the grid are so by more than rounding.
        let distance = self.quantum * (low + fz * (high - low));
        let distance = V::constant(0.0).select_below(location.off_grid, V::constant(FAR), distance);
        (distance, gradient)
    }
}

/// Value between the sample `at` and the next along x, and their difference.
#[inline(always)]
fn edge<V: Vector>(levels: &[i16], at: V, x: V) -> [V; 2] {
    let [low, high] = V::gather_pairs(levels, at);
    let slope = high - low;
    [low + x * slope, slope]
}

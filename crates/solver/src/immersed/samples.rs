//! Samples of a field read for the lanes of vectors. Finding the samples and reading them are two steps, for
//! a loop of its own each.

use std::ops::Deref;

use glam::DVec3;
use grainwake_shape::SampledField;

use super::near::FAR;
use grainwake_simd::{One, Vector};

/// A vector from each list. (No closure in a kernel touches vectors: it would not be inlined.)
#[inline(always)]
pub fn load_all<V: Vector>([x, y, z]: &[impl Deref<Target = [V::Number]>; 3], at: usize) -> [V; 3] {
    [V::load(&x[at..]), V::load(&y[at..]), V::load(&z[at..])]
}

/// Stores vectors in as many lists.
#[inline(always)]
pub fn store_all<V: Vector>(values: [V; 3], [x, y, z]: &mut [&mut [V::Number]; 3], at: usize) {
    values[0].store(&mut x[at..]);
    values[1].store(&mut y[at..]);
    values[2].store(&mut z[at..]);
}

/// Signed distances on a grid, to a hundred thousandth or so of what they reach: those of a grain should stay near
/// the processor.
pub struct Samples {
    lower: DVec3,
    spacing: f64,
    dims: [usize; 3],
    /// What a level is [m].
    quantum: f64,
    /// Integer levels, x fastest.
    levels: Vec<i16>,
}

impl Samples {
    /// Those of a field; what is farther than `most` [m] inside or outside is given as so far.
    pub fn of(field: &SampledField, most: f64) -> Samples {
        let quantum = most / f64::from(i16::MAX);
        let part = field.quantum() / quantum;
        // Beyond the range it is cut off.
        let level = |level: &f32| (f64::from(*level) * part).round() as i16;
        Samples {
            lower: field.lower(),
            spacing: field.spacing(),
            dims: field.dims(),
            quantum,
            levels: field.levels().iter().map(level).collect(),
        }
    }

    /// Signed distance [m] and gradient at a point of the grid.
    #[inline(always)]
    pub fn distance_and_gradient(&self, x: DVec3) -> Option<(f64, DVec3)> {
        let grid = Grid::of(self);
        let spot = grid.find([One(x.x), One(x.y), One(x.z)]);
        let on_grid = spot.off.0 <= 0.0;
        let (distance, [x, y, z]) = grid.read(spot);
        on_grid.then_some((distance.0, DVec3::new(x.0, y.0, z.0)))
    }

    /// Memory held [bytes].
    pub fn bytes(&self) -> usize {
        size_of::<i16>() * self.levels.capacity()
    }
}

/// The grid of samples.
pub struct Grid<'a, V> {
    lower: [V; 3],
    inverse: V,
    /// Number of the last sample along each axis.
    last: [V; 3],
    /// From one row and one plane of samples to the next in the list of levels.
    strides: [V; 2],
    /// What a level is [m], and that over the spacing.
    quantum: V,
    slope: V,
    levels: &'a [i16],
}

/// Where points are among the samples.
pub struct Spot<V> {
    /// Place of the first corner of the cell in the list of levels.
    pub cell: V,
    /// Of the cell, along each axis.
    pub fraction: [V; 3],
    /// How far off the grid, in spacings.
    pub off: V,
}

impl<'a, V: Vector> Grid<'a, V> {
    #[inline(always)]
    pub fn of(samples: &'a Samples) -> Grid<'a, V> {
        let (dims, inverse) = (samples.dims, 1.0 / samples.spacing);
        let mut lower = [V::constant(0.0); 3];
        let mut last = lower;
        for axis in 0..3 {
            lower[axis] = V::constant(samples.lower[axis]);
            last[axis] = V::constant(dims[axis] as f64 - 1.0);
        }
        let (row, plane) = (dims[0], dims[0] * dims[1]);
        Grid {
            lower,
            inverse: V::constant(inverse),
            last,
            strides: [V::constant(row as f64), V::constant(plane as f64)],
            quantum: V::constant(samples.quantum),
            slope: V::constant(samples.quantum * inverse),
            levels: &samples.levels,
        }
    }

    /// Where points are; those off the grid, at the nearest point on it.
    #[inline(always)]
    pub fn find(&self, x: [V; 3]) -> Spot<V> {
        let (zero, one) = (V::constant(0.0), V::constant(1.0));
        let mut cell = [zero; 3];
        let mut fraction = [zero; 3];
        let mut off = zero;
        for axis in 0..3 {
            let s = (x[axis] - self.lower[axis]) * self.inverse;
            let place = s.larger(zero).smaller(self.last[axis]);
            off = off + (s - place).magnitude();
            cell[axis] = place.floor().smaller(self.last[axis] - one);
            fraction[axis] = place - cell[axis];
        }
        let [row, plane] = self.strides;
        Spot {
            cell: cell[0] + row * cell[1] + plane * cell[2],
            fraction,
            off,
        }
    }

    /// Distance and gradient.
    #[inline(always)]
    pub fn read(&self, spot: Spot<V>) -> (V, [V; 3]) {
        let [fx, fy, fz] = spot.fraction;
        let [row, plane] = self.strides;
        // Value and slope on the four edges along x.
        let (at, levels) = (spot.cell, self.levels);
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
        // Whatever is off the grid is so by more than a rounding.
        let distance = self.quantum * (low + fz * (high - low));
        let distance = V::constant(0.0).where_below(spot.off, V::constant(FAR), distance);
        (distance, gradient)
    }
}

/// Value between the samples at `at` and the next along x, and the slope from one to the other.
#[inline(always)]
fn edge<V: Vector>(levels: &[i16], at: V, x: V) -> [V; 2] {
    let [low, high] = V::pairs(levels, at);
    let slope = high - low;
    [low + x * slope, slope]
}

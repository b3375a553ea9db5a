//! Samples of a field, and of a coarser one about it, read for the lanes of vectors: each lane finds its
//! own grid. Finding the samples and reading them are two steps, for a loop of its own each.

use grainwake_shape::SampledField;

use super::near::{About, FAR};
use crate::math::lanes::Vector;

/// A vector from each list. (No closure in a kernel touches vectors: it would not be inlined.)
#[inline(always)]
pub fn load_all<V: Vector<Number = f64>>([x, y, z]: &[Vec<f64>; 3], at: usize) -> [V; 3] {
    [V::load(&x[at..]), V::load(&y[at..]), V::load(&z[at..])]
}

/// Stores vectors in as many lists.
#[inline(always)]
pub fn store_all<V: Vector<Number = f64>>(
    values: [V; 3],
    [x, y, z]: &mut [Vec<f64>; 3],
    at: usize,
) {
    values[0].store(&mut x[at..]);
    values[1].store(&mut y[at..]);
    values[2].store(&mut z[at..]);
}

/// The grid of a field.
struct Grid<V> {
    lower: [V; 3],
    inverse: V,
    /// Number of the last sample along each axis.
    last: [V; 3],
    /// From one row and one plane of samples to the next.
    strides: [V; 2],
    /// Place of the first sample in the list of levels.
    first: V,
    /// What a level is [m], and that over the spacing.
    quantum: V,
    slope: V,
}

impl<V: Vector<Number = f64>> Grid<V> {
    #[inline(always)]
    fn of(field: &SampledField, first: usize) -> Grid<V> {
        let (dims, inverse) = (field.dims(), 1.0 / field.spacing());
        let mut lower = [V::constant(0.0); 3];
        let mut last = lower;
        for axis in 0..3 {
            lower[axis] = V::constant(field.lower()[axis]);
            last[axis] = V::constant(dims[axis] as f64 - 1.0);
        }
        let (row, plane) = (dims[0] as f64, (dims[0] * dims[1]) as f64);
        Grid {
            lower,
            inverse: V::constant(inverse),
            last,
            strides: [V::constant(row), V::constant(plane)],
            first: V::constant(first as f64),
            quantum: V::constant(field.quantum()),
            slope: V::constant(field.quantum() * inverse),
        }
    }

    /// Where points are on it, those off it at the nearest point on it; and 1 for those, else 0.
    #[inline(always)]
    fn find(&self, x: [V; 3]) -> (Spot<V>, V) {
        let (zero, one) = (V::constant(0.0), V::constant(1.0));
        let mut cell = [zero; 3];
        let mut fraction = [zero; 3];
        let mut outside = zero;
        for axis in 0..3 {
            let s = (x[axis] - self.lower[axis]) * self.inverse;
            let place = s.larger(zero).smaller(self.last[axis]);
            outside = outside + (s - place).magnitude();
            cell[axis] = place.floor().smaller(self.last[axis] - one);
            fraction[axis] = place - cell[axis];
        }
        let [row, plane] = self.strides;
        let spot = Spot {
            cell: self.first + cell[0] + row * cell[1] + plane * cell[2],
            which: zero,
            fraction,
        };
        // Whatever is off the grid is so by more than a rounding.
        (spot, zero.is_below(outside))
    }
}

/// Where points are among the samples.
pub struct Spot<V> {
    /// Place of the first corner of the cell in the list of levels.
    pub cell: V,
    /// Of the cell, along each axis.
    pub fraction: [V; 3],
    /// On the grid of the shape 0, on the one about it 1, off both 2.
    pub which: V,
}

/// The grid of a shape and the one about it.
pub struct Grids<'a, V> {
    own: Grid<V>,
    about: Option<Grid<V>>,
    levels: &'a [f32],
}

impl<'a, V: Vector<Number = f64>> Grids<'a, V> {
    #[inline(always)]
    pub fn of(field: &'a SampledField, about: Option<&'a About>) -> Grids<'a, V> {
        Grids {
            own: Grid::of(field, 0),
            about: about.map(|about| Grid::of(&about.field, field.levels().len())),
            levels: about.map_or(field.levels(), |about| &about.levels),
        }
    }

    #[inline(always)]
    /// Where points are; those off both grids, at the nearest point on the outer one.
    pub fn find(&self, x: [V; 3]) -> Spot<V> {
        let (mut spot, off) = self.own.find(x);
        if off.is_zero() {
            return spot;
        }
        let Some(about) = &self.about else {
            spot.which = off + off;
            return spot;
        };
        let half = V::constant(0.5);
        let (other, off_both) = about.find(x);
        spot.cell = off.where_below(half, spot.cell, other.cell);
        for axis in 0..3 {
            let fraction = &mut spot.fraction[axis];
            *fraction = off.where_below(half, *fraction, other.fraction[axis]);
        }
        spot.which = off + off * off_both;
        spot
    }

    /// Distance and gradient.
    #[inline(always)]
    pub fn read(&self, spot: Spot<V>) -> (V, [V; 3]) {
        let [fx, fy, fz] = spot.fraction;
        let Grid {
            strides: [mut row, mut plane],
            mut quantum,
            slope: mut unit,
            ..
        } = self.own;
        if let Some(about) = &self.about
            && !spot.which.is_zero()
        {
            let (which, half) = (spot.which, V::constant(0.5));
            row = which.where_below(half, row, about.strides[0]);
            plane = which.where_below(half, plane, about.strides[1]);
            quantum = which.where_below(half, quantum, about.quantum);
            unit = which.where_below(half, unit, about.slope);
        }
        // Value and slope on the four edges along x.
        let (at, levels) = (spot.cell, self.levels);
        let (a, s) = edge(levels, at, fx);
        let (b, t) = edge(levels, at + row, fx);
        let (c, u) = edge(levels, at + plane, fx);
        let (d, v) = edge(levels, at + plane + row, fx);
        let (low, high) = (a + fy * (b - a), c + fy * (d - c));
        let (slope_low, slope_high) = (s + fy * (t - s), u + fy * (v - u));
        let gradient = [
            unit * (slope_low + fz * (slope_high - slope_low)),
            unit * ((b - a) + fz * ((d - c) - (b - a))),
            unit * (high - low),
        ];
        let far = V::constant(1.5).is_below(spot.which) * V::constant(FAR);
        (quantum * (low + fz * (high - low)) + far, gradient)
    }
}

/// Value between the samples at `at` and the next along x, and the slope from one to the other.
#[inline(always)]
fn edge<V: Vector<Number = f64>>(levels: &[f32], at: V, x: V) -> (V, V) {
    let [low, high] = V::pairs(levels, at);
    let slope = high - low;
    (low + x * slope, slope)
}

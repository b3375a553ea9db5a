//! Work on rows of numbers, and sums in an order that no width of a register changes.

use super::{MOST, One, Real, Vector};

/// Work on the neighbouring entries of a row.
pub trait RowWork {
    /// What rows are made of.
    type Number: Real;
    /// Treats the `V::WIDTH` entries from `i` on.
    fn at<V: Vector<Number = Self::Number>>(&mut self, i: usize);
}

/// Treats the entries 1..=n of a row, as many at a time as possible. Entry i always falls on lane
/// (i - 1) % LANES of a sum kept in as many lanes, whatever the width.
#[inline(always)]
pub fn along_row<V: Vector>(n: usize, work: &mut impl RowWork<Number = V::Number>) {
    let mut i = 1;
    while i + V::WIDTH <= n + 1 {
        work.at::<V>(i);
        i += V::WIDTH;
    }
    let half = V::Number::LANES / 2;
    if i + half <= n + 1 {
        work.at::<V::Half>(i);
        i += half;
    }
    if half > 4 && i + 4 <= n + 1 {
        work.at::<V::Tail>(i);
        i += 4;
    }
    while i <= n {
        work.at::<One<V::Number>>(i);
        i += 1;
    }
}

/// The `V::WIDTH` entries from `at` on and one neighbour on each side.
///
/// Windows at one place of lists of one length share one bounds check.
#[inline(always)]
pub fn window<V: Vector>(list: &[V::Number], at: usize) -> &[V::Number] {
    &list[at - 1..][..V::WIDTH + 2]
}

/// The `V::WIDTH` entries from `at` on, to be overwritten; checked like [`window`].
#[inline(always)]
pub fn window_mut<V: Vector>(list: &mut [V::Number], at: usize) -> &mut [V::Number] {
    &mut list[at - 1..][..V::WIDTH + 2][1..][..V::WIDTH]
}

/// Partial results of a row in doubles: a sum or a maximum in an order that no width changes.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(64))]
pub struct Partial([f64; MOST]);

impl Partial {
    /// Adds to the lanes of entry `i` and its neighbours.
    #[inline(always)]
    pub fn add<V: Vector>(&mut self, i: usize, value: V) {
        value.add_to(&mut self.0[(i - 1) % V::Number::LANES..]);
    }
    /// Keeps the larger in the lanes of entry `i` and its neighbours.
    #[inline(always)]
    pub fn keep_larger<V: Vector>(&mut self, i: usize, value: V) {
        value.raise(&mut self.0[(i - 1) % V::Number::LANES..]);
    }
    /// Sum of the lanes.
    pub fn sum(&self) -> f64 {
        let mut lanes = self.0;
        let mut half = MOST / 2;
        while half > 0 {
            for i in 0..half {
                lanes[i] += lanes[i + half];
            }
            half /= 2;
        }
        lanes[0]
    }
    /// Largest of the lanes.
    pub fn largest(&self) -> f64 {
        self.0.into_iter().fold(0.0, f64::max)
    }
}

//! Loops along rows, and sums in an order that does not depend on the width of the registers.

use super::{MAX_LANES, Real, Scalar, Vector};

/// Computation along a row, one vector of neighbouring entries at a time.
pub trait RowWork {
    /// Type of the entries.
    type Number: Real;
    /// Computes the `V::WIDTH` entries from `i` on.
    fn at<V: Vector<Number = Self::Number>>(&mut self, i: usize);
}

/// Computes entries 1..=n of a row with the widest vectors that fit. Entry i adds to lane
/// (i - 1) % LANES of a [`Partial`] for every width.
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
        work.at::<Scalar<V::Number>>(i);
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

/// Partial sum or maximum of a row in doubles, in an order that does not depend on the width.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(64))]
pub struct Partial([f64; MAX_LANES]);

impl Partial {
    /// Adds entries `i` to `i + V::WIDTH` to their lanes.
    #[inline(always)]
    pub fn add<V: Vector>(&mut self, i: usize, value: V) {
        value.add_into(&mut self.0[(i - 1) % V::Number::LANES..]);
    }
    /// Replaces the lanes of entries `i` to `i + V::WIDTH` by their maxima with `value`.
    #[inline(always)]
    pub fn max<V: Vector>(&mut self, i: usize, value: V) {
        value.max_into(&mut self.0[(i - 1) % V::Number::LANES..]);
    }
    /// Sum of the lanes.
    pub fn sum(&self) -> f64 {
        let mut lanes = self.0;
        let mut half = MAX_LANES / 2;
        while half > 0 {
            for i in 0..half {
                lanes[i] += lanes[i + half];
            }
            half /= 2;
        }
        lanes[0]
    }
    /// Maximum of the lanes, at least 0.
    pub fn largest(&self) -> f64 {
        self.0.into_iter().fold(0.0, f64::max)
    }
}

//! Loops along rows, windows and stores of rows, and sums in an order that does not depend on the
//! width of the registers.

use std::ops::Range;

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

/// Whole cache lines of a row among entries 2 to n - 1, if the widest vectors of [`along_row`] tile
/// them; entry 0 of `row` is the ghost below entry 1.
///
/// Non-temporal stores are for whole lines: a line that also gets an ordinary store is written to
/// memory in part and read back, which makes a step up to three times as long.
#[inline]
pub fn inner_lines<V: Vector>(row: &[V::Number], n: usize) -> Range<usize> {
    let line = V::Number::LANES;
    let offset = row[1..].as_ptr().align_offset(line * V::Number::BYTES);
    if !offset.is_multiple_of(V::WIDTH) {
        return 0..0;
    }
    let first = 1 + if offset > 0 { offset } else { line };
    first..first + n.saturating_sub(first) / line * line
}

/// Slice of the `V::WIDTH` entries from `at` on and one neighbour on each side.
///
/// Windows at one place of lists of one length share one bounds check.
#[inline(always)]
pub fn window<V: Vector>(list: &[V::Number], at: usize) -> &[V::Number] {
    &list[at - 1..at + V::WIDTH + 1]
}

/// Mutable slice of the `V::WIDTH` entries from `at` on; checked like [`window`].
#[inline(always)]
pub fn window_mut<V: Vector>(list: &mut [V::Number], at: usize) -> &mut [V::Number] {
    &mut list[at - 1..at + V::WIDTH + 1][1..][..V::WIDTH]
}

/// Stores entries `i` to `i + V::WIDTH` of each of three rows, with non-temporal stores if they lie
/// in `lines`. The ends of a row, which boundary conditions read, stay in the cache.
#[inline(always)]
pub fn store_in_rows<V: Vector>(
    lines: &Range<usize>,
    i: usize,
    values: [V; 3],
    rows: &mut [&mut [V::Number]; 3],
) {
    let [x, y, z] = rows;
    let [x, y, z] = [window_mut::<V>(x, i), window_mut::<V>(y, i), window_mut::<V>(z, i)];
    // `lines.contains(&i)` by one comparison.
    if i.wrapping_sub(lines.start) < lines.end - lines.start {
        values[0].store_non_temporal(x);
        values[1].store_non_temporal(y);
        values[2].store_non_temporal(z);
    } else {
        values[0].store(x);
        values[1].store(y);
        values[2].store(z);
    }
}

/// Sum over rows in doubles, lane by lane, in an order that does not depend on the width.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(64))]
pub struct Partial([f64; MAX_LANES]);

impl Partial {
    /// Adds entries `i` to `i + V::WIDTH` to their lanes.
    #[inline(always)]
    pub fn add<V: Vector>(&mut self, i: usize, value: V) {
        value.add_into(&mut self.0[(i - 1) % V::Number::LANES..]);
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
}

/// Maximum over rows of numbers that are not negative, lane by lane.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(64))]
pub struct Maximum<R>([R; MAX_LANES]);

impl<R: Real> Maximum<R> {
    /// Includes entries `i` to `i + V::WIDTH`.
    #[inline(always)]
    pub fn include<V: Vector<Number = R>>(&mut self, i: usize, value: V) {
        let lanes = &mut self.0[(i - 1) % R::LANES..];
        V::load(lanes).max(value).store(lanes);
    }
    /// Maximum of the lanes in double precision.
    pub fn get(&self) -> f64 {
        self.0.into_iter().map(R::wide).fold(0.0, f64::max)
    }
}

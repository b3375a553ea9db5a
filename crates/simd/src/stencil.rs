//! Loads at fixed offsets from a position of a list, with one bounds check.

use super::{Real, Vector};

/// Fixed offsets from a position of a list.
#[derive(Clone, Copy)]
pub struct Stencil<const N: usize> {
    offsets: [isize; N],
    /// Lowest and highest offset.
    low: isize,
    high: isize,
}

impl<const N: usize> Stencil<N> {
    /// Stencil with the given offsets [entries].
    #[inline(always)]
    pub fn new(offsets: [isize; N]) -> Stencil<N> {
        let (mut low, mut high) = (offsets[0], offsets[0]);
        for offset in offsets {
            (low, high) = (low.min(offset), high.max(offset));
        }
        Stencil { offsets, low, high }
    }

    /// Vectors of `V::WIDTH` numbers that start at each offset from `at`. Panics beyond the list.
    #[inline(always)]
    pub fn load<V: Vector, R: Real>(&self, list: &[R], at: usize) -> [V; N] {
        assert!(self.fits::<V, R>(list, at), "the list goes on");
        let mut found = [V::constant(0.0); N];
        for n in 0..N {
            let at = at.wrapping_add_signed(self.offsets[n]);
            // SAFETY: `fits` found all entries from the lowest offset to a width beyond the highest
            // one in the list.
            found[n] = V::load_from(unsafe { list.get_unchecked(at..at + V::WIDTH) });
        }
        found
    }

    /// Vectors that start at each offset from `at`, with zeros beyond the end of the list.
    #[inline(always)]
    pub fn load_within<V: Vector, R: Real>(&self, list: &[R], at: usize) -> [V; N] {
        if self.fits::<V, R>(list, at) {
            return self.load(list, at);
        }
        let mut found = [V::constant(0.0); N];
        for n in 0..N {
            let at = at.wrapping_add_signed(self.offsets[n]);
            found[n] = V::load_partial(list.get(at..).unwrap_or(&[]));
        }
        found
    }

    #[inline(always)]
    fn fits<V: Vector, R: Real>(&self, list: &[R], at: usize) -> bool {
        let first = at.wrapping_add_signed(self.low);
        let span = self.high.abs_diff(self.low).saturating_add(V::WIDTH);
        first <= list.len() && span <= list.len() - first
    }
}

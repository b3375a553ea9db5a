//! Entries of a list at fixed offsets from a place, found in it by one comparison.

use super::{Real, Vector};

/// Offsets from a place of a list.
#[derive(Clone, Copy)]
pub struct Stencil<const N: usize> {
    offsets: [isize; N],
    /// The lowest and the highest of them.
    low: isize,
    high: isize,
}

impl<const N: usize> Stencil<N> {
    /// The stencil with the given offsets [entries].
    #[inline(always)]
    pub fn new(offsets: [isize; N]) -> Stencil<N> {
        let (mut low, mut high) = (offsets[0], offsets[0]);
        for offset in offsets {
            (low, high) = (low.min(offset), high.max(offset));
        }
        Stencil { offsets, low, high }
    }

    /// The `V::WIDTH` numbers of a list from each of the places on. Panics where the list does not have them.
    #[inline(always)]
    pub fn load<V: Vector, R: Real>(&self, list: &[R], at: usize) -> [V; N] {
        assert!(self.fits::<V, R>(list, at), "the list goes on");
        let mut found = [V::constant(0.0); N];
        for n in 0..N {
            let at = at.wrapping_add_signed(self.offsets[n]);
            // SAFETY: no offset is below the lowest or above the highest, between which, and a width
            // beyond, all entries were found to be in the list.
            found[n] = V::load_from(unsafe { list.get_unchecked(at..at + V::WIDTH) });
        }
        found
    }

    /// The same with zeros where the list has ended.
    #[inline(always)]
    pub fn load_within<V: Vector, R: Real>(&self, list: &[R], at: usize) -> [V; N] {
        if self.fits::<V, R>(list, at) {
            return self.load(list, at);
        }
        let mut found = [V::constant(0.0); N];
        for n in 0..N {
            let at = at.wrapping_add_signed(self.offsets[n]);
            found[n] = V::load_some(list.get(at..).unwrap_or(&[]));
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

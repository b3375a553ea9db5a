//! Numbers that start on a cache line.

use std::ops::{Deref, DerefMut};

use super::Real;

/// A fixed number of numbers whose first lies at the start of a cache line. Nothing is touched
/// when it is made: a page belongs to the thread that first writes to it.
#[derive(Debug)]
pub struct Aligned<R> {
    values: Vec<R>,
    start: usize,
    len: usize,
}

impl<R: Real> Aligned<R> {
    /// `len` zeros.
    pub fn zeros(len: usize) -> Aligned<R> {
        let values = vec![R::default(); len + R::LANES - 1];
        // The buffer is never reallocated, so the start stays where it is.
        let start = values.as_ptr().align_offset(R::LANES * R::BYTES);
        Aligned { values, start, len }
    }
}

impl<R> Deref for Aligned<R> {
    type Target = [R];
    #[inline]
    fn deref(&self) -> &[R] {
        &self.values[self.start..self.start + self.len]
    }
}
impl<R> DerefMut for Aligned<R> {
    #[inline]
    fn deref_mut(&mut self) -> &mut [R] {
        &mut self.values[self.start..self.start + self.len]
    }
}

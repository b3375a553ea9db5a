//! Numbers that start on a cache line.

use std::ops::{Deref, DerefMut};

/// Doubles of a cache line.
const LINE: usize = 8;

/// A fixed number of doubles whose first lies at the start of a cache line. Nothing is touched
/// when it is made: a page belongs to the thread that first writes to it.
#[derive(Debug)]
pub struct Aligned {
    values: Vec<f64>,
    start: usize,
    len: usize,
}

impl Aligned {
    /// `len` zeros.
    pub fn zeros(len: usize) -> Aligned {
        let values = vec![0.0; len + LINE - 1];
        // The buffer is never reallocated, so the start stays where it is.
        let start = values.as_ptr().align_offset(LINE * size_of::<f64>());
        Aligned { values, start, len }
    }
}

impl Deref for Aligned {
    type Target = [f64];
    #[inline]
    fn deref(&self) -> &[f64] {
        &self.values[self.start..self.start + self.len]
    }
}
impl DerefMut for Aligned {
    #[inline]
    fn deref_mut(&mut self) -> &mut [f64] {
        &mut self.values[self.start..self.start + self.len]
    }
}

//! Pool of buffers for threads, kept from one step to the next.

use std::ops::{Deref, DerefMut};
use std::sync::Mutex;

/// Pool of idle buffers. It grows to the largest number of threads that have worked at once.
#[derive(Default)]
pub struct ScratchPool<T>(Mutex<Vec<T>>);

impl<T: Default> ScratchPool<T> {
    /// Borrows an idle buffer, or a new one if there is none.
    pub fn borrow(&self) -> Scratch<'_, T> {
        let buffer = self.0.lock().expect("no thread panicked").pop();
        Scratch { pool: self, buffer: buffer.unwrap_or_default() }
    }
}

/// A borrowed buffer, returned to the pool when dropped.
pub struct Scratch<'a, T: Default> {
    pool: &'a ScratchPool<T>,
    buffer: T,
}

impl<T: Default> Deref for Scratch<'_, T> {
    type Target = T;
    fn deref(&self) -> &T {
        &self.buffer
    }
}
impl<T: Default> DerefMut for Scratch<'_, T> {
    fn deref_mut(&mut self) -> &mut T {
        &mut self.buffer
    }
}
impl<T: Default> Drop for Scratch<'_, T> {
    fn drop(&mut self) {
        if let Ok(mut buffers) = self.pool.0.lock() {
            buffers.push(std::mem::take(&mut self.buffer));
        }
    }
}

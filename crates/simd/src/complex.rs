//! Vectors of complex numbers.

use std::ops::{Add, Sub};

use super::Vector;

/// `WIDTH` complex numbers.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct Complex<V> {
    /// Real parts.
    pub re: V,
    /// Imaginary parts.
    pub im: V,
}

impl<V: Vector> Complex<V> {
    /// Zero in every lane.
    #[inline(always)]
    pub fn zero() -> Self {
        Complex { re: V::constant(0.0), im: V::constant(0.0) }
    }
    /// Product with one complex number.
    #[inline(always)]
    pub fn times(self, [re, im]: [V::Number; 2]) -> Self {
        let (re, im) = (V::splat(re), V::splat(im));
        Complex { re: self.re * re - self.im * im, im: self.re * im + self.im * re }
    }
    /// Number with real and imaginary part swapped.
    #[inline(always)]
    pub fn swap_parts(self) -> Self {
        Complex { re: self.im, im: self.re }
    }
    /// Product with one real number.
    #[inline(always)]
    pub fn scale(self, factor: V::Number) -> Self {
        let factor = V::splat(factor);
        Complex { re: self.re * factor, im: self.im * factor }
    }
}

impl<V: Vector> Add for Complex<V> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Complex { re: self.re + other.re, im: self.im + other.im }
    }
}
impl<V: Vector> Sub for Complex<V> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Complex { re: self.re - other.re, im: self.im - other.im }
    }
}

/// Butterfly of `a` and of `b` rotated by a quarter turn: a - i b and a + i b.
#[inline(always)]
pub fn rotated_butterfly<V: Vector>(a: Complex<V>, b: Complex<V>) -> [Complex<V>; 2] {
    [Complex { re: a.re + b.im, im: a.im - b.re }, Complex { re: a.re - b.im, im: a.im + b.re }]
}

/// View of `values`, aligned to a cache line, as complex vectors.
#[inline(always)]
pub fn as_complex<V: Vector>(values: &mut [V::Number]) -> &mut [Complex<V>] {
    // SAFETY: `Vector` is sealed, and every implementation is `repr(C)` or `repr(transparent)`,
    // `WIDTH` numbers without padding. `Complex` is two such vectors. All bits are valid numbers.
    let (head, lanes, _) = unsafe { values.align_to_mut::<Complex<V>>() };
    assert!(head.is_empty(), "lanes start on a cache line");
    lanes
}

//! One lane, for the ends of rows.

use std::ops::{Add, Mul, Sub};

use super::Vector;

/// One number.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub struct Single(f64);

impl Add for Single {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Single(self.0 + other.0)
    }
}
impl Sub for Single {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Single(self.0 - other.0)
    }
}
impl Mul for Single {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Single(self.0 * other.0)
    }
}
impl Vector for Single {
    const WIDTH: usize = 1;
    type Four = Single;
    #[inline(always)]
    fn splat(value: f64) -> Self {
        Single(value)
    }
    #[inline(always)]
    fn load(from: &[f64]) -> Self {
        Single(from[0])
    }
    #[inline(always)]
    fn store(self, to: &mut [f64]) {
        to[0] = self.0;
    }
    #[inline(always)]
    fn over(self, divisor: Self) -> Self {
        Single(self.0 / divisor.0)
    }
    #[inline(always)]
    fn larger(self, other: Self) -> Self {
        Single(if self.0 > other.0 { self.0 } else { other.0 })
    }
    #[inline(always)]
    fn transpose(_: &mut [Self]) {}
}

//! Vector of one lane, for the ends of rows and for scalar references.

use std::ops::{Add, Mul, Sub};

use super::vector::Sealed;
use super::{Real, Vector};

/// Vector of one number.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub struct Scalar<R>(pub R);

macro_rules! operator {
    ($trait:ident, $method:ident, $symbol:tt) => {
        impl<R: Real> $trait for Scalar<R> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Scalar(self.0 $symbol other.0)
            }
        }
    };
}
operator!(Add, add, +);
operator!(Sub, sub, -);
operator!(Mul, mul, *);
impl<R: Real> Sealed for Scalar<R> {}
impl<R: Real> Vector for Scalar<R> {
    const WIDTH: usize = 1;
    type Number = R;
    type Half = Self;
    type Tail = Self;
    #[inline(always)]
    fn splat(value: R) -> Self {
        Scalar(value)
    }
    #[inline(always)]
    fn load(from: &[R]) -> Self {
        Scalar(from[0])
    }
    #[inline(always)]
    fn store(self, to: &mut [R]) {
        to[0] = self.0;
    }
    #[inline(always)]
    fn div(self, divisor: Self) -> Self {
        Scalar(self.0 / divisor.0)
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Scalar(if self.0 > other.0 { self.0 } else { other.0 })
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Scalar(if self.0 < other.0 { self.0 } else { other.0 })
    }
    #[inline(always)]
    fn select_below(self, limit: Self, yes: Self, no: Self) -> Self {
        if self.0 < limit.0 { yes } else { no }
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        Scalar(self.0.mul_add(factor.0, term.0))
    }
    #[inline(always)]
    fn transpose(_: &mut [Self]) {}
    #[inline(always)]
    fn add_into(self, sums: &mut [f64]) {
        sums[0] += self.0.wide();
    }
}

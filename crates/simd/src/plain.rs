//! Vectors without intrinsics, for any machine.

use std::ops::{Add, Mul, Sub};

use super::vector::Sealed;
use super::{Real, Vector};

/// Vector of `N` numbers whose registers the compiler chooses.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub struct Plain<R, const N: usize>([R; N]);

impl<R: Copy, const N: usize> Plain<R, N> {
    #[inline(always)]
    fn zip(mut self, other: Self, f: impl Fn(R, R) -> R) -> Self {
        for i in 0..N {
            self.0[i] = f(self.0[i], other.0[i]);
        }
        self
    }
}

impl<R: Real, const N: usize> Add for Plain<R, N> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
}
impl<R: Real, const N: usize> Sub for Plain<R, N> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }
}
impl<R: Real, const N: usize> Mul for Plain<R, N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }
}
impl<R: Real, const N: usize> Sealed for Plain<R, N> {}
impl<R: Real, const N: usize> Vector for Plain<R, N> {
    const WIDTH: usize = N;
    type Number = R;
    type Half = Self;
    type Tail = Plain<R, 4>;
    #[inline(always)]
    fn splat(value: R) -> Self {
        Plain([value; N])
    }
    #[inline(always)]
    fn load(from: &[R]) -> Self {
        let mut numbers = [R::default(); N];
        numbers.copy_from_slice(&from[..N]);
        Plain(numbers)
    }
    #[inline(always)]
    fn store(self, to: &mut [R]) {
        to[..N].copy_from_slice(&self.0);
    }
    #[inline(always)]
    fn div(self, divisor: Self) -> Self {
        self.zip(divisor, |a, b| a / b)
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.zip(other, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.zip(other, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn select_below(self, limit: Self, yes: Self, mut no: Self) -> Self {
        for i in 0..N {
            if self.0[i] < limit.0[i] {
                no.0[i] = yes.0[i];
            }
        }
        no
    }
    #[inline(always)]
    fn mul_add(mut self, factor: Self, term: Self) -> Self {
        for i in 0..N {
            self.0[i] = self.0[i].mul_add(factor.0[i], term.0[i]);
        }
        self
    }
    #[inline(always)]
    fn transpose(block: &mut [Self]) {
        for i in 0..N {
            for j in 0..i {
                (block[i].0[j], block[j].0[i]) = (block[j].0[i], block[i].0[j]);
            }
        }
    }
    #[inline(always)]
    fn add_into(self, sums: &mut [f64]) {
        for (sum, lane) in sums[..N].iter_mut().zip(self.0) {
            *sum += lane.wide();
        }
    }
}

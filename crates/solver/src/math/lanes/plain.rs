//! Four lanes without intrinsics, for any machine.

use std::ops::{Add, Mul, Sub};

use super::Vector;

/// Four numbers that the compiler may put into registers as it likes.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub struct Plain([f64; 4]);

impl Plain {
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        let (a, b) = (self.0, other.0);
        Plain([f(a[0], b[0]), f(a[1], b[1]), f(a[2], b[2]), f(a[3], b[3])])
    }
}
impl Add for Plain {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
}
impl Sub for Plain {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }
}
impl Mul for Plain {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }
}
impl Vector for Plain {
    const WIDTH: usize = 4;
    type Four = Plain;
    #[inline(always)]
    fn splat(value: f64) -> Self {
        Plain([value; 4])
    }
    #[inline(always)]
    fn load(from: &[f64]) -> Self {
        Plain([from[0], from[1], from[2], from[3]])
    }
    #[inline(always)]
    fn store(self, to: &mut [f64]) {
        to[..4].copy_from_slice(&self.0);
    }
    #[inline(always)]
    fn over(self, divisor: Self) -> Self {
        self.zip(divisor, |a, b| a / b)
    }
    #[inline(always)]
    fn larger(self, other: Self) -> Self {
        self.zip(other, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn transpose(block: &mut [Self]) {
        let [a, b, c, d] = [block[0].0, block[1].0, block[2].0, block[3].0];
        for i in 0..4 {
            block[i] = Plain([a[i], b[i], c[i], d[i]]);
        }
    }
}

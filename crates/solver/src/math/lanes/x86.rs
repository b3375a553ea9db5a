//! Lanes of x86-64: two pairs of doubles (SSE2, on every machine), four (AVX2) and eight (AVX-512).
//!
//! SAFETY of every block here: the vectors are made by nothing but kernels that [`super::dispatch`]
//! runs after it has found the instruction set on the machine, and every load and store cuts its
//! slice to the width first.

use std::arch::x86_64::*;
use std::ops::{Add, Mul, Sub};

use super::Vector;

/// Two pairs of doubles.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct Pairs(__m128d, __m128d);
/// Four doubles.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub struct Four(__m256d);
/// Eight doubles.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub struct Eight(__m512d);

macro_rules! pair_wise {
    ($operator:ident, $function:ident, $intrinsic:ident) => {
        impl $operator for Pairs {
            type Output = Self;
            #[inline(always)]
            fn $function(self, other: Self) -> Self {
                // SAFETY: see the head of this file.
                unsafe { Pairs($intrinsic(self.0, other.0), $intrinsic(self.1, other.1)) }
            }
        }
    };
}
pair_wise!(Add, add, _mm_add_pd);
pair_wise!(Sub, sub, _mm_sub_pd);
pair_wise!(Mul, mul, _mm_mul_pd);

macro_rules! lane_wise {
    ($vector:ident, $operator:ident, $function:ident, $intrinsic:ident) => {
        impl $operator for $vector {
            type Output = Self;
            #[inline(always)]
            fn $function(self, other: Self) -> Self {
                // SAFETY: see the head of this file.
                unsafe { $vector($intrinsic(self.0, other.0)) }
            }
        }
    };
}
lane_wise!(Four, Add, add, _mm256_add_pd);
lane_wise!(Four, Sub, sub, _mm256_sub_pd);
lane_wise!(Four, Mul, mul, _mm256_mul_pd);
lane_wise!(Eight, Add, add, _mm512_add_pd);
lane_wise!(Eight, Sub, sub, _mm512_sub_pd);
lane_wise!(Eight, Mul, mul, _mm512_mul_pd);

impl Vector for Pairs {
    const WIDTH: usize = 4;
    type Four = Pairs;
    #[inline(always)]
    fn splat(value: f64) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Pairs(_mm_set1_pd(value), _mm_set1_pd(value)) }
    }
    #[inline(always)]
    fn load(from: &[f64]) -> Self {
        let from = from[..4].as_ptr();
        // SAFETY: see the head of this file.
        unsafe { Pairs(_mm_loadu_pd(from), _mm_loadu_pd(from.add(2))) }
    }
    #[inline(always)]
    fn store(self, to: &mut [f64]) {
        let to = to[..4].as_mut_ptr();
        // SAFETY: see the head of this file.
        unsafe {
            _mm_storeu_pd(to, self.0);
            _mm_storeu_pd(to.add(2), self.1);
        }
    }
    #[inline(always)]
    fn over(self, divisor: Self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Pairs(_mm_div_pd(self.0, divisor.0), _mm_div_pd(self.1, divisor.1)) }
    }
    #[inline(always)]
    fn larger(self, other: Self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Pairs(_mm_max_pd(self.0, other.0), _mm_max_pd(self.1, other.1)) }
    }
    #[inline(always)]
    fn transpose(block: &mut [Self]) {
        let block = &mut block[..4];
        let [a, b, c, d] = [block[0], block[1], block[2], block[3]];
        // SAFETY: see the head of this file.
        unsafe {
            block[0] = Pairs(_mm_unpacklo_pd(a.0, b.0), _mm_unpacklo_pd(c.0, d.0));
            block[1] = Pairs(_mm_unpackhi_pd(a.0, b.0), _mm_unpackhi_pd(c.0, d.0));
            block[2] = Pairs(_mm_unpacklo_pd(a.1, b.1), _mm_unpacklo_pd(c.1, d.1));
            block[3] = Pairs(_mm_unpackhi_pd(a.1, b.1), _mm_unpackhi_pd(c.1, d.1));
        }
    }
}

impl Vector for Four {
    const WIDTH: usize = 4;
    type Four = Four;
    #[inline(always)]
    fn splat(value: f64) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Four(_mm256_set1_pd(value)) }
    }
    #[inline(always)]
    fn load(from: &[f64]) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Four(_mm256_loadu_pd(from[..4].as_ptr())) }
    }
    #[inline(always)]
    fn store(self, to: &mut [f64]) {
        // SAFETY: see the head of this file.
        unsafe { _mm256_storeu_pd(to[..4].as_mut_ptr(), self.0) }
    }
    #[inline(always)]
    fn over(self, divisor: Self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Four(_mm256_div_pd(self.0, divisor.0)) }
    }
    #[inline(always)]
    fn larger(self, other: Self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Four(_mm256_max_pd(self.0, other.0)) }
    }
    #[inline(always)]
    fn transpose(block: &mut [Self]) {
        let block = &mut block[..4];
        let [a, b, c, d] = [block[0].0, block[1].0, block[2].0, block[3].0];
        // SAFETY: see the head of this file.
        unsafe {
            let (e, f) = (_mm256_unpacklo_pd(a, b), _mm256_unpackhi_pd(a, b));
            let (g, h) = (_mm256_unpacklo_pd(c, d), _mm256_unpackhi_pd(c, d));
            block[0] = Four(_mm256_permute2f128_pd::<0x20>(e, g));
            block[1] = Four(_mm256_permute2f128_pd::<0x20>(f, h));
            block[2] = Four(_mm256_permute2f128_pd::<0x31>(e, g));
            block[3] = Four(_mm256_permute2f128_pd::<0x31>(f, h));
        }
    }
}

impl Vector for Eight {
    const WIDTH: usize = 8;
    type Four = Four;
    #[inline(always)]
    fn splat(value: f64) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Eight(_mm512_set1_pd(value)) }
    }
    #[inline(always)]
    fn load(from: &[f64]) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Eight(_mm512_loadu_pd(from[..8].as_ptr())) }
    }
    #[inline(always)]
    fn store(self, to: &mut [f64]) {
        // SAFETY: see the head of this file.
        unsafe { _mm512_storeu_pd(to[..8].as_mut_ptr(), self.0) }
    }
    #[inline(always)]
    fn over(self, divisor: Self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Eight(_mm512_div_pd(self.0, divisor.0)) }
    }
    #[inline(always)]
    fn larger(self, other: Self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Eight(_mm512_max_pd(self.0, other.0)) }
    }
    /// Pairs of numbers are exchanged first, then pairs of pairs, twice.
    #[inline(always)]
    fn transpose(block: &mut [Self]) {
        let block = &mut block[..8];
        // SAFETY: see the head of this file.
        unsafe {
            let mut pairs = [block[0].0; 8];
            for i in 0..4 {
                let (a, b) = (block[2 * i].0, block[2 * i + 1].0);
                pairs[i] = _mm512_unpacklo_pd(a, b);
                pairs[4 + i] = _mm512_unpackhi_pd(a, b);
            }
            for i in 0..2 {
                let [a, b, c, d] = [
                    pairs[4 * i],
                    pairs[4 * i + 1],
                    pairs[4 * i + 2],
                    pairs[4 * i + 3],
                ];
                let (even_ab, odd_ab) = (
                    _mm512_shuffle_f64x2::<0x88>(a, b),
                    _mm512_shuffle_f64x2::<0xdd>(a, b),
                );
                let (even_cd, odd_cd) = (
                    _mm512_shuffle_f64x2::<0x88>(c, d),
                    _mm512_shuffle_f64x2::<0xdd>(c, d),
                );
                block[i] = Eight(_mm512_shuffle_f64x2::<0x88>(even_ab, even_cd));
                block[2 + i] = Eight(_mm512_shuffle_f64x2::<0x88>(odd_ab, odd_cd));
                block[4 + i] = Eight(_mm512_shuffle_f64x2::<0xdd>(even_ab, even_cd));
                block[6 + i] = Eight(_mm512_shuffle_f64x2::<0xdd>(odd_ab, odd_cd));
            }
        }
    }
}

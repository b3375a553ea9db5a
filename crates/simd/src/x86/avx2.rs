//! Vectors of AVX2: one register of 32 bytes.

use std::arch::x86_64::*;
use std::ops::{Add, Mul, Sub};

use super::{Sse2F32x4, same, transpose};
use crate::vector::Sealed;
use crate::vector::{RSQRT_MAGIC_F32, RSQRT_MAGIC_F64};
use crate::{Real, Vector};

vector! {
    /// Four doubles.
    Avx2F64x4: 4 x f64 in [0: __m256d],
    half Avx2F64x4, tail Avx2F64x4, transpose transpose::avx2_f64x4,
    doubles Avx2F64x4 [0: same],
    _mm256_add_pd, _mm256_sub_pd, _mm256_mul_pd, _mm256_div_pd, _mm256_max_pd, _mm256_min_pd,
    _mm256_sqrt_pd,
    select256_pd, _mm256_fmadd_pd, _mm256_set1_pd, _mm256_loadu_pd,
    _mm256_storeu_pd, _mm256_stream_pd;
    #[inline(always)]
    fn load_partial<R: Real>(from: &[R]) -> Self {
        let at = from.as_ptr();
        // SAFETY: see the head of `x86/mod.rs`; no lane beyond the list is read. `R` is f32 or f64.
        unsafe {
            if R::BYTES == size_of::<f64>() {
                let lanes = _mm256_cmpgt_epi64(_mm256_set1_epi64x(from.len() as i64), ramp256());
                Avx2F64x4(_mm256_maskload_pd(at.cast(), lanes))
            } else {
                let lanes = _mm_cmpgt_epi32(_mm_set1_epi32(at_most_four(from.len())), ramp128());
                Avx2F64x4(_mm256_cvtps_pd(_mm_maskload_ps(at.cast(), lanes)))
            }
        }
    }
    #[inline(always)]
    fn store_partial<R: Real>(self, to: &mut [R]) {
        let at = to.as_mut_ptr();
        // SAFETY: see `load_partial`.
        unsafe {
            if R::BYTES == size_of::<f64>() {
                let lanes = _mm256_cmpgt_epi64(_mm256_set1_epi64x(to.len() as i64), ramp256());
                _mm256_maskstore_pd(at.cast(), lanes, self.0);
            } else {
                let lanes = _mm_cmpgt_epi32(_mm_set1_epi32(at_most_four(to.len())), ramp128());
                _mm_maskstore_ps(at.cast(), lanes, _mm256_cvtpd_ps(self.0));
            }
        }
    }
    #[inline(always)]
    fn store_from(self, skip: usize, to: &mut [f64]) {
        // SAFETY: see the head of `x86/mod.rs`; lanes beyond the list are not written.
        unsafe {
            let before = _mm256_cmpgt_epi64(_mm256_set1_epi64x(skip as i64), ramp256());
            let end = _mm256_set1_epi64x((skip + to.len()) as i64);
            let lanes = _mm256_andnot_si256(before, _mm256_cmpgt_epi64(end, ramp256()));
            _mm256_maskstore_pd(to.as_mut_ptr().wrapping_sub(skip), lanes, self.0);
        }
    }
    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: see the head of `x86/mod.rs`.
        unsafe { Avx2F64x4(_mm256_andnot_pd(_mm256_set1_pd(-0.0), self.0)) }
    }
    #[inline(always)]
    fn mask_below(self, limit: Self) -> u32 {
        // SAFETY: see the head of `x86/mod.rs`.
        unsafe {
            let below = _mm256_cmp_pd::<_CMP_LT_OQ>(self.0, limit.0);
            _mm256_movemask_pd(below) as u32
        }
    }
    #[inline(always)]
    fn shift(self, before: Self) -> Self {
        // SAFETY: see the head of `x86/mod.rs`.
        unsafe {
            let middle = _mm256_permute2f128_pd::<0x21>(before.0, self.0);
            Avx2F64x4(_mm256_shuffle_pd::<0b0101>(middle, self.0))
        }
    }
    #[inline(always)]
    fn floor(self) -> Self {
        // SAFETY: see the head of `x86/mod.rs`.
        unsafe { Avx2F64x4(_mm256_floor_pd(self.0)) }
    }
    #[inline(always)]
    fn rsqrt_estimate(self) -> Self {
        // SAFETY: see the head of `x86/mod.rs`.
        unsafe {
            let half = _mm256_srli_epi64::<1>(_mm256_castpd_si256(self.0));
            let one = _mm256_set1_epi64x(RSQRT_MAGIC_F64 as i64);
            Avx2F64x4(_mm256_castsi256_pd(_mm256_sub_epi64(one, half)))
        }
    }
}
vector! {
    /// Eight singles.
    Avx2F32x8: 8 x f32 in [0: __m256],
    half Avx2F32x8, tail Sse2F32x4, transpose transpose::avx2_f32x8,
    doubles Avx2F64x4 [0: widen_lower_four, 1: widen_upper_four],
    _mm256_add_ps, _mm256_sub_ps, _mm256_mul_ps, _mm256_div_ps, _mm256_max_ps, _mm256_min_ps,
    _mm256_sqrt_ps,
    select256_ps, _mm256_fmadd_ps, _mm256_set1_ps, _mm256_loadu_ps,
    _mm256_storeu_ps, _mm256_stream_ps;
    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: see the head of `x86/mod.rs`.
        unsafe { Avx2F32x8(_mm256_andnot_ps(_mm256_set1_ps(-0.0), self.0)) }
    }
    #[inline(always)]
    fn mask_below(self, limit: Self) -> u32 {
        // SAFETY: see the head of `x86/mod.rs`.
        unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LT_OQ>(self.0, limit.0)) as u32 }
    }
    #[inline(always)]
    fn floor(self) -> Self {
        // SAFETY: see the head of `x86/mod.rs`.
        unsafe { Avx2F32x8(_mm256_floor_ps(self.0)) }
    }
    #[inline(always)]
    fn rsqrt_estimate(self) -> Self {
        // SAFETY: see the head of `x86/mod.rs`.
        unsafe {
            let half = _mm256_srli_epi32::<1>(_mm256_castps_si256(self.0));
            let one = _mm256_set1_epi32(RSQRT_MAGIC_F32 as i32);
            Avx2F32x8(_mm256_castsi256_ps(_mm256_sub_epi32(one, half)))
        }
    }
    #[inline(always)]
    fn gather_pairs(from: &[f32], at: Self) -> [Self; 2] {
        assert!(2 <= from.len() && from.len() <= crate::MAX_SINGLE_INDEX);
        // SAFETY: see the head of `x86/mod.rs`; the assertions place all pairs in the slice, and
        // singles represent its indices exactly.
        unsafe {
            let last = _mm256_set1_ps(from.len() as f32 - 2.0);
            let below = _mm256_cmp_ps::<_CMP_LE_OQ>(at.0, last);
            let above = _mm256_cmp_ps::<_CMP_GE_OQ>(at.0, _mm256_setzero_ps());
            assert_eq!(_mm256_movemask_ps(_mm256_and_ps(below, above)), 0xff);
            let indices = _mm256_cvttps_epi32(at.0);
            let first = from.as_ptr();
            [
                Avx2F32x8(_mm256_i32gather_ps::<4>(first, indices)),
                Avx2F32x8(_mm256_i32gather_ps::<4>(first.add(1), indices)),
            ]
        }
    }
}

/// A count of lanes, no more than four.
#[inline(always)]
fn at_most_four(count: usize) -> i32 {
    count.min(4) as i32
}
/// The numbers of the lanes.
#[inline(always)]
unsafe fn ramp256() -> __m256i {
    // SAFETY: see the head of `x86/mod.rs`.
    unsafe { _mm256_setr_epi64x(0, 1, 2, 3) }
}
#[inline(always)]
unsafe fn ramp128() -> __m128i {
    // SAFETY: see the head of `x86/mod.rs`.
    unsafe { _mm_setr_epi32(0, 1, 2, 3) }
}
#[inline(always)]
unsafe fn widen_lower_four(v: Avx2F32x8) -> Avx2F64x4 {
    // SAFETY: see the head of `x86/mod.rs`.
    unsafe { Avx2F64x4(_mm256_cvtps_pd(_mm256_castps256_ps128(v.0))) }
}
#[inline(always)]
unsafe fn widen_upper_four(v: Avx2F32x8) -> Avx2F64x4 {
    // SAFETY: see the head of `x86/mod.rs`.
    unsafe { Avx2F64x4(_mm256_cvtps_pd(_mm256_extractf128_ps::<1>(v.0))) }
}
#[inline(always)]
unsafe fn select256_pd(a: __m256d, limit: __m256d, yes: __m256d, no: __m256d) -> __m256d {
    // SAFETY: see the head of `x86/mod.rs`.
    unsafe { _mm256_blendv_pd(no, yes, _mm256_cmp_pd::<_CMP_LT_OQ>(a, limit)) }
}
#[inline(always)]
unsafe fn select256_ps(a: __m256, limit: __m256, yes: __m256, no: __m256) -> __m256 {
    // SAFETY: see the head of `x86/mod.rs`.
    unsafe { _mm256_blendv_ps(no, yes, _mm256_cmp_ps::<_CMP_LT_OQ>(a, limit)) }
}

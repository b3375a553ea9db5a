//! Vectors of AVX-512: one register of 64 bytes.

use std::arch::x86_64::*;
use std::ops::{Add, Mul, Sub};

use super::{Avx2F32x8, Avx2F64x4, Sse2F32x4, same, transpose};
use crate::vector::Sealed;
use crate::vector::{RSQRT_MAGIC_F32, RSQRT_MAGIC_F64};
use crate::{Real, Vector};

/// Rounding to the whole number below.
const DOWN: i32 = _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC;

vector! {
    /// Eight doubles.
    Avx512F64x8: 8 x f64 in [0: __m512d],
    half Avx2F64x4, tail Avx2F64x4, transpose transpose::avx512_f64x8,
    doubles Avx512F64x8 [0: same],
    _mm512_add_pd, _mm512_sub_pd, _mm512_mul_pd, _mm512_div_pd, _mm512_max_pd, _mm512_min_pd,
    _mm512_sqrt_pd,
    select512_pd, _mm512_fmadd_pd, _mm512_set1_pd, _mm512_loadu_pd,
    _mm512_storeu_pd, _mm512_stream_pd;
    #[inline(always)]
    fn load_partial<R: Real>(from: &[R]) -> Self {
        let (at, lanes) = (from.as_ptr(), first_of_eight(from.len()));
        // SAFETY: see the head of `x86/mod.rs`; no lane beyond the list is read. `R` is f32 or f64.
        unsafe {
            if R::BYTES == size_of::<f64>() {
                Avx512F64x8(_mm512_maskz_loadu_pd(lanes, at.cast()))
            } else {
                Avx512F64x8(_mm512_cvtps_pd(_mm256_maskz_loadu_ps(lanes, at.cast())))
            }
        }
    }
    #[inline(always)]
    fn store_partial<R: Real>(self, to: &mut [R]) {
        let (at, lanes) = (to.as_mut_ptr(), first_of_eight(to.len()));
        // SAFETY: see `load_partial`.
        unsafe {
            if R::BYTES == size_of::<f64>() {
                _mm512_mask_storeu_pd(at.cast(), lanes, self.0);
            } else {
                _mm256_mask_storeu_ps(at.cast(), lanes, _mm512_cvtpd_ps(self.0));
            }
        }
    }
    #[inline(always)]
    fn store_from(self, skip: usize, to: &mut [f64]) {
        let lanes = first_of_eight(skip + to.len()) & !first_of_eight(skip);
        // SAFETY: see the head of `x86/mod.rs`; lanes beyond the list are not written.
        unsafe { _mm512_mask_storeu_pd(to.as_mut_ptr().wrapping_sub(skip), lanes, self.0) };
    }
    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: see the head of `x86/mod.rs`.
        unsafe { Avx512F64x8(_mm512_abs_pd(self.0)) }
    }
    #[inline(always)]
    fn mask_below(self, limit: Self) -> u32 {
        // SAFETY: see the head of `x86/mod.rs`.
        unsafe { u32::from(_mm512_cmp_pd_mask::<_CMP_LT_OQ>(self.0, limit.0)) }
    }
    #[inline(always)]
    fn shift(self, before: Self) -> Self {
        // SAFETY: see the head of `x86/mod.rs`.
        unsafe {
            let (lanes, before) = (_mm512_castpd_si512(self.0), _mm512_castpd_si512(before.0));
            let moved = _mm512_alignr_epi64::<7>(lanes, before);
            Avx512F64x8(_mm512_castsi512_pd(moved))
        }
    }
    #[inline(always)]
    fn floor(self) -> Self {
        // SAFETY: see the head of `x86/mod.rs`.
        unsafe { Avx512F64x8(_mm512_roundscale_pd::<DOWN>(self.0)) }
    }
    #[inline(always)]
    fn rsqrt_estimate(self) -> Self {
        // SAFETY: see the head of `x86/mod.rs`.
        unsafe {
            let half = _mm512_srli_epi64::<1>(_mm512_castpd_si512(self.0));
            let one = _mm512_set1_epi64(RSQRT_MAGIC_F64 as i64);
            Avx512F64x8(_mm512_castsi512_pd(_mm512_sub_epi64(one, half)))
        }
    }
}
vector! {
    /// Sixteen singles.
    Avx512F32x16: 16 x f32 in [0: __m512],
    half Avx2F32x8, tail Sse2F32x4, transpose transpose::avx512_f32x16,
    doubles Avx512F64x8 [0: widen_lower_eight, 1: widen_upper_eight],
    _mm512_add_ps, _mm512_sub_ps, _mm512_mul_ps, _mm512_div_ps, _mm512_max_ps, _mm512_min_ps,
    _mm512_sqrt_ps,
    select512_ps, _mm512_fmadd_ps, _mm512_set1_ps, _mm512_loadu_ps,
    _mm512_storeu_ps, _mm512_stream_ps;
    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: see the head of `x86/mod.rs`.
        unsafe { Avx512F32x16(_mm512_abs_ps(self.0)) }
    }
    #[inline(always)]
    fn mask_below(self, limit: Self) -> u32 {
        // SAFETY: see the head of `x86/mod.rs`.
        unsafe { u32::from(_mm512_cmp_ps_mask::<_CMP_LT_OQ>(self.0, limit.0)) }
    }
    #[inline(always)]
    fn floor(self) -> Self {
        // SAFETY: see the head of `x86/mod.rs`.
        unsafe { Avx512F32x16(_mm512_roundscale_ps::<DOWN>(self.0)) }
    }
    #[inline(always)]
    fn rsqrt_estimate(self) -> Self {
        // SAFETY: see the head of `x86/mod.rs`.
        unsafe {
            let half = _mm512_srli_epi32::<1>(_mm512_castps_si512(self.0));
            let one = _mm512_set1_epi32(RSQRT_MAGIC_F32 as i32);
            Avx512F32x16(_mm512_castsi512_ps(_mm512_sub_epi32(one, half)))
        }
    }
    #[inline(always)]
    fn gather_pairs(from: &[f32], at: Self) -> [Self; 2] {
        assert!(2 <= from.len() && from.len() <= crate::MAX_SINGLE_INDEX);
        // SAFETY: see the head of `x86/mod.rs`; the assertions place all pairs in the slice, and
        // singles represent its indices exactly.
        unsafe {
            let last = _mm512_set1_ps(from.len() as f32 - 2.0);
            let below = _mm512_cmp_ps_mask::<_CMP_LE_OQ>(at.0, last);
            let above = _mm512_cmp_ps_mask::<_CMP_GE_OQ>(at.0, _mm512_setzero_ps());
            assert_eq!(below & above, 0xffff);
            let indices = _mm512_cvttps_epi32(at.0);
            let first = from.as_ptr();
            [
                Avx512F32x16(_mm512_i32gather_ps::<4>(indices, first)),
                Avx512F32x16(_mm512_i32gather_ps::<4>(indices, first.add(1))),
            ]
        }
    }
}

/// The first `count` of eight lanes, as bits.
#[inline(always)]
fn first_of_eight(count: usize) -> u8 {
    (0xff_u32 >> (8 - count.min(8))) as u8
}
#[inline(always)]
unsafe fn widen_lower_eight(v: Avx512F32x16) -> Avx512F64x8 {
    // SAFETY: see the head of `x86/mod.rs`.
    unsafe { Avx512F64x8(_mm512_cvtps_pd(_mm512_castps512_ps256(v.0))) }
}
#[inline(always)]
unsafe fn widen_upper_eight(v: Avx512F32x16) -> Avx512F64x8 {
    // SAFETY: see the head of `x86/mod.rs`.
    unsafe {
        let upper = _mm512_extractf64x4_pd::<1>(_mm512_castps_pd(v.0));
        Avx512F64x8(_mm512_cvtps_pd(_mm256_castpd_ps(upper)))
    }
}
#[inline(always)]
unsafe fn select512_pd(a: __m512d, limit: __m512d, yes: __m512d, no: __m512d) -> __m512d {
    // SAFETY: see the head of `x86/mod.rs`.
    unsafe { _mm512_mask_blend_pd(_mm512_cmp_pd_mask::<_CMP_LT_OQ>(a, limit), no, yes) }
}
#[inline(always)]
unsafe fn select512_ps(a: __m512, limit: __m512, yes: __m512, no: __m512) -> __m512 {
    // SAFETY: see the head of `x86/mod.rs`.
    unsafe { _mm512_mask_blend_ps(_mm512_cmp_ps_mask::<_CMP_LT_OQ>(a, limit), no, yes) }
}

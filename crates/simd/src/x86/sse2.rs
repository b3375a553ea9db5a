//! Vectors of SSE2, which every x86-64 processor has: one or two registers of 16 bytes.

use std::arch::x86_64::*;
use std::ops::{Add, Mul, Sub};

use super::{same, transpose};
use crate::Vector;
use crate::vector::Sealed;

vector! {
    /// Four doubles in two registers.
    Sse2F64x4: 4 x f64 in [0: __m128d, 1: __m128d],
    half Sse2F64x4, tail Sse2F64x4, transpose transpose::sse2_f64x4,
    doubles Sse2F64x4 [0: same],
    _mm_add_pd, _mm_sub_pd, _mm_mul_pd, _mm_div_pd, _mm_max_pd, _mm_min_pd, _mm_sqrt_pd,
    select128_pd, fused128_pd, _mm_set1_pd, _mm_loadu_pd, _mm_storeu_pd, _mm_stream_pd
}
vector! {
    /// Four singles.
    Sse2F32x4: 4 x f32 in [0: __m128],
    half Sse2F32x4, tail Sse2F32x4, transpose transpose::sse2_f32x4,
    doubles Sse2F64x4 [0: widen_four],
    _mm_add_ps, _mm_sub_ps, _mm_mul_ps, _mm_div_ps, _mm_max_ps, _mm_min_ps, _mm_sqrt_ps,
    select128_ps, fused128_ps, _mm_set1_ps, _mm_loadu_ps, _mm_storeu_ps, _mm_stream_ps
}
vector! {
    /// Eight singles in two registers.
    Sse2F32x8: 8 x f32 in [0: __m128, 1: __m128],
    half Sse2F32x8, tail Sse2F32x4, transpose transpose::sse2_f32x8,
    doubles Sse2F64x4 [0: widen_first, 1: widen_second],
    _mm_add_ps, _mm_sub_ps, _mm_mul_ps, _mm_div_ps, _mm_max_ps, _mm_min_ps, _mm_sqrt_ps,
    select128_ps, fused128_ps, _mm_set1_ps, _mm_loadu_ps, _mm_storeu_ps, _mm_stream_ps
}

#[inline(always)]
unsafe fn pairs(v: __m128) -> Sse2F64x4 {
    // SAFETY: see the head of `x86/mod.rs`.
    unsafe { Sse2F64x4(_mm_cvtps_pd(v), _mm_cvtps_pd(_mm_movehl_ps(v, v))) }
}
#[inline(always)]
unsafe fn widen_four(v: Sse2F32x4) -> Sse2F64x4 {
    // SAFETY: see the head of `x86/mod.rs`.
    unsafe { pairs(v.0) }
}
#[inline(always)]
unsafe fn widen_first(v: Sse2F32x8) -> Sse2F64x4 {
    // SAFETY: see the head of `x86/mod.rs`.
    unsafe { pairs(v.0) }
}
#[inline(always)]
unsafe fn widen_second(v: Sse2F32x8) -> Sse2F64x4 {
    // SAFETY: see the head of `x86/mod.rs`.
    unsafe { pairs(v.1) }
}
#[inline(always)]
unsafe fn select128_pd(a: __m128d, limit: __m128d, yes: __m128d, no: __m128d) -> __m128d {
    // SAFETY: see the head of `x86/mod.rs`.
    unsafe {
        let below = _mm_cmplt_pd(a, limit);
        _mm_or_pd(_mm_and_pd(below, yes), _mm_andnot_pd(below, no))
    }
}
#[inline(always)]
unsafe fn select128_ps(a: __m128, limit: __m128, yes: __m128, no: __m128) -> __m128 {
    // SAFETY: see the head of `x86/mod.rs`.
    unsafe {
        let below = _mm_cmplt_ps(a, limit);
        _mm_or_ps(_mm_and_ps(below, yes), _mm_andnot_ps(below, no))
    }
}
// SSE2 has no fused multiply-add: the standard library computes each lane.
#[inline(always)]
unsafe fn fused128_pd(a: __m128d, factor: __m128d, term: __m128d) -> __m128d {
    let (mut lanes, mut factors, mut terms) = ([0.0; 2], [0.0; 2], [0.0; 2]);
    // SAFETY: see the head of `x86/mod.rs`.
    unsafe {
        _mm_storeu_pd(lanes.as_mut_ptr(), a);
        _mm_storeu_pd(factors.as_mut_ptr(), factor);
        _mm_storeu_pd(terms.as_mut_ptr(), term);
        for n in 0..2 {
            lanes[n] = f64::mul_add(lanes[n], factors[n], terms[n]);
        }
        _mm_loadu_pd(lanes.as_ptr())
    }
}
#[inline(always)]
unsafe fn fused128_ps(a: __m128, factor: __m128, term: __m128) -> __m128 {
    let (mut lanes, mut factors, mut terms) = ([0.0; 4], [0.0; 4], [0.0; 4]);
    // SAFETY: see the head of `x86/mod.rs`.
    unsafe {
        _mm_storeu_ps(lanes.as_mut_ptr(), a);
        _mm_storeu_ps(factors.as_mut_ptr(), factor);
        _mm_storeu_ps(terms.as_mut_ptr(), term);
        for n in 0..4 {
            lanes[n] = f32::mul_add(lanes[n], factors[n], terms[n]);
        }
        _mm_loadu_ps(lanes.as_ptr())
    }
}

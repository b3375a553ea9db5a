//! Lanes of x86-64: two pairs of doubles or two fours of singles (SSE2, on every machine), four
//! doubles or eight singles (AVX2), eight doubles or sixteen singles (AVX-512).
//!
//! SAFETY of every block here: the vectors are made by nothing but kernels that [`super::dispatch`]
//! runs after it has found the instruction set on the machine, and every load and store cuts its
//! slice to the width first.

use std::arch::x86_64::*;
use std::ops::{Add, Mul, Sub};

use super::Vector;
use super::x86_transpose as turn;
use crate::Real;
use crate::real::{INVERSE_ROOT_OF_ONE, INVERSE_ROOT_OF_ONE_SINGLE};

/// Rounding to the whole number below.
const DOWN: i32 = _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC;

/// A vector of one register, or of two side by side.
macro_rules! vector {
    (
        $(#[$doc:meta])*
        $name:ident: $width:literal x $number:ident in [$($i:tt: $register:ident),+],
        half $half:ident, tail $tail:ident, transpose $transpose:path,
        doubles $wide:ident [$($w:tt: $widen:path),+],
        $add:ident, $sub:ident, $mul:ident, $div:ident, $max:ident, $min:ident,
        $chosen:path, $fused:path, $set:ident, $load:ident, $store:ident, $past:ident
        $(; $($own:item)*)?
    ) => {
        $(#[$doc])*
        #[derive(Clone, Copy)]
        #[repr(C)]
        pub struct $name($(pub(super) $register),+);

        impl Add for $name {
            type Output = Self;
            #[inline(always)]
            fn add(self, other: Self) -> Self {
                // SAFETY: see the head of this file.
                unsafe { $name($($add(self.$i, other.$i)),+) }
            }
        }
        impl Sub for $name {
            type Output = Self;
            #[inline(always)]
            fn sub(self, other: Self) -> Self {
                // SAFETY: see the head of this file.
                unsafe { $name($($sub(self.$i, other.$i)),+) }
            }
        }
        impl Mul for $name {
            type Output = Self;
            #[inline(always)]
            fn mul(self, other: Self) -> Self {
                // SAFETY: see the head of this file.
                unsafe { $name($($mul(self.$i, other.$i)),+) }
            }
        }
        impl Vector for $name {
            const WIDTH: usize = $width;
            type Number = $number;
            type Half = $half;
            type Tail = $tail;
            #[inline(always)]
            fn splat(value: $number) -> Self {
                // SAFETY: see the head of this file.
                unsafe { $name($(splat!($i, $set, value)),+) }
            }
            #[inline(always)]
            fn load(from: &[$number]) -> Self {
                let from = from[..$width].as_ptr();
                // SAFETY: see the head of this file.
                unsafe { $name($($load(from.add($i * $width / 2))),+) }
            }
            #[inline(always)]
            fn store(self, to: &mut [$number]) {
                let to = to[..$width].as_mut_ptr();
                // SAFETY: see the head of this file.
                unsafe { $($store(to.add($i * $width / 2), self.$i));+ }
            }
            #[inline(always)]
            fn store_past(self, to: &mut [$number]) {
                let register = 0_usize $(.max(size_of_val(&self.$i)))+;
                if !to.as_ptr().addr().is_multiple_of(register) {
                    return self.store(to);
                }
                let to = to[..$width].as_mut_ptr();
                // SAFETY: see the head of this file; the registers fall on multiples of their size.
                unsafe { $($past(to.add($i * $width / 2), self.$i));+ }
            }
            #[inline(always)]
            fn fence() {
                // SAFETY: every machine of this architecture has the instruction.
                unsafe { _mm_sfence() }
            }
            #[inline(always)]
            fn over(self, divisor: Self) -> Self {
                // SAFETY: see the head of this file.
                unsafe { $name($($div(self.$i, divisor.$i)),+) }
            }
            #[inline(always)]
            fn larger(self, other: Self) -> Self {
                // SAFETY: see the head of this file.
                unsafe { $name($($max(self.$i, other.$i)),+) }
            }
            #[inline(always)]
            fn smaller(self, other: Self) -> Self {
                // SAFETY: see the head of this file.
                unsafe { $name($($min(self.$i, other.$i)),+) }
            }
            #[inline(always)]
            fn where_below(self, limit: Self, yes: Self, no: Self) -> Self {
                // SAFETY: see the head of this file.
                unsafe { $name($($chosen(self.$i, limit.$i, yes.$i, no.$i)),+) }
            }
            #[inline(always)]
            fn mul_add(self, factor: Self, term: Self) -> Self {
                // SAFETY: see the head of this file.
                unsafe { $name($($fused(self.$i, factor.$i, term.$i)),+) }
            }
            $($($own)*)?
            #[inline(always)]
            fn transpose(block: &mut [Self]) {
                // SAFETY: see the head of this file.
                unsafe { $transpose(block) }
            }
            #[inline(always)]
            fn add_to(self, sums: &mut [f64]) {
                $(
                    let here = &mut sums[$w * $wide::WIDTH..];
                    // SAFETY: see the head of this file.
                    ($wide::load(here) + unsafe { $widen(self) }).store(here);
                )+
            }
            #[inline(always)]
            fn raise(self, tops: &mut [f64]) {
                $(
                    let here = &mut tops[$w * $wide::WIDTH..];
                    // SAFETY: see the head of this file.
                    $wide::load(here).larger(unsafe { $widen(self) }).store(here);
                )+
            }
        }
    };
}
/// The same for every register of a vector.
macro_rules! splat {
    ($i:tt, $set:ident, $value:ident) => {
        $set($value)
    };
}

vector! {
    /// Two pairs of doubles.
    Pairs: 4 x f64 in [0: __m128d, 1: __m128d],
    half Pairs, tail Pairs, transpose turn::pairs,
    doubles Pairs [0: same],
    _mm_add_pd, _mm_sub_pd, _mm_mul_pd, _mm_div_pd, _mm_max_pd, _mm_min_pd,
    choose128_pd, fused128_pd, _mm_set1_pd, _mm_loadu_pd, _mm_storeu_pd, _mm_stream_pd
}
vector! {
    /// Four doubles.
    Four: 4 x f64 in [0: __m256d],
    half Four, tail Four, transpose turn::four,
    doubles Four [0: same],
    _mm256_add_pd, _mm256_sub_pd, _mm256_mul_pd, _mm256_div_pd, _mm256_max_pd, _mm256_min_pd,
    choose256_pd, _mm256_fmadd_pd, _mm256_set1_pd, _mm256_loadu_pd, _mm256_storeu_pd, _mm256_stream_pd;
    #[inline(always)]
    fn load_some<R: Real>(from: &[R]) -> Self {
        let at = from.as_ptr();
        // SAFETY: see the head of this file; no lane beyond the list is read. Singles and doubles are all
        // there is.
        unsafe {
            if R::BYTES == size_of::<f64>() {
                let lanes = _mm256_cmpgt_epi64(_mm256_set1_epi64x(from.len() as i64), ramp256());
                Four(_mm256_maskload_pd(at.cast(), lanes))
            } else {
                let lanes = _mm_cmpgt_epi32(_mm_set1_epi32(up_to(from.len())), ramp128());
                Four(_mm256_cvtps_pd(_mm_maskload_ps(at.cast(), lanes)))
            }
        }
    }
    #[inline(always)]
    fn store_some<R: Real>(self, to: &mut [R]) {
        let at = to.as_mut_ptr();
        // SAFETY: as of `load_some`.
        unsafe {
            if R::BYTES == size_of::<f64>() {
                let lanes = _mm256_cmpgt_epi64(_mm256_set1_epi64x(to.len() as i64), ramp256());
                _mm256_maskstore_pd(at.cast(), lanes, self.0);
            } else {
                let lanes = _mm_cmpgt_epi32(_mm_set1_epi32(up_to(to.len())), ramp128());
                _mm_maskstore_ps(at.cast(), lanes, _mm256_cvtpd_ps(self.0));
            }
        }
    }
    #[inline(always)]
    fn store_from(self, skip: usize, to: &mut [f64]) {
        // SAFETY: see the head of this file; lanes that the list has no place for are not written.
        unsafe {
            let before = _mm256_cmpgt_epi64(_mm256_set1_epi64x(skip as i64), ramp256());
            let end = _mm256_set1_epi64x((skip + to.len()) as i64);
            let lanes = _mm256_andnot_si256(before, _mm256_cmpgt_epi64(end, ramp256()));
            _mm256_maskstore_pd(to.as_mut_ptr().wrapping_sub(skip), lanes, self.0);
        }
    }
    #[inline(always)]
    fn is_zero(self) -> bool {
        // SAFETY: see the head of this file.
        unsafe {
            let zeros = _mm256_cmp_pd::<_CMP_EQ_OQ>(self.0, _mm256_setzero_pd());
            _mm256_movemask_pd(zeros) == 0xf
        }
    }
    #[inline(always)]
    fn mask_below(self, limit: Self) -> u32 {
        // SAFETY: see the head of this file.
        unsafe {
            let below = _mm256_cmp_pd::<_CMP_LT_OQ>(self.0, limit.0);
            _mm256_movemask_pd(below) as u32
        }
    }
    #[inline(always)]
    fn behind(self, before: Self) -> Self {
        // SAFETY: see the head of this file.
        unsafe {
            let middle = _mm256_permute2f128_pd::<0x21>(before.0, self.0);
            Four(_mm256_shuffle_pd::<0b0101>(middle, self.0))
        }
    }
    #[inline(always)]
    fn floor(self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Four(_mm256_floor_pd(self.0)) }
    }
    #[inline(always)]
    fn root(self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Four(_mm256_sqrt_pd(self.0)) }
    }
    #[inline(always)]
    fn inverse_root_guess(self) -> Self {
        // SAFETY: see the head of this file.
        unsafe {
            let half = _mm256_srli_epi64::<1>(_mm256_castpd_si256(self.0));
            let one = _mm256_set1_epi64x(INVERSE_ROOT_OF_ONE as i64);
            Four(_mm256_castsi256_pd(_mm256_sub_epi64(one, half)))
        }
    }
}
vector! {
    /// Eight doubles.
    Eight: 8 x f64 in [0: __m512d],
    half Four, tail Four, transpose turn::eight,
    doubles Eight [0: same],
    _mm512_add_pd, _mm512_sub_pd, _mm512_mul_pd, _mm512_div_pd, _mm512_max_pd, _mm512_min_pd,
    choose512_pd, _mm512_fmadd_pd, _mm512_set1_pd, _mm512_loadu_pd, _mm512_storeu_pd, _mm512_stream_pd;
    #[inline(always)]
    fn load_some<R: Real>(from: &[R]) -> Self {
        let (at, lanes) = (from.as_ptr(), first_of_eight(from.len()));
        // SAFETY: see the head of this file; no lane beyond the list is read. Singles and doubles are all
        // there is.
        unsafe {
            if R::BYTES == size_of::<f64>() {
                Eight(_mm512_maskz_loadu_pd(lanes, at.cast()))
            } else {
                Eight(_mm512_cvtps_pd(_mm256_maskz_loadu_ps(lanes, at.cast())))
            }
        }
    }
    #[inline(always)]
    fn store_some<R: Real>(self, to: &mut [R]) {
        let (at, lanes) = (to.as_mut_ptr(), first_of_eight(to.len()));
        // SAFETY: as of `load_some`.
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
        // SAFETY: see the head of this file; lanes that the list has no place for are not written.
        unsafe { _mm512_mask_storeu_pd(to.as_mut_ptr().wrapping_sub(skip), lanes, self.0) };
    }
    #[inline(always)]
    fn is_zero(self) -> bool {
        // SAFETY: see the head of this file.
        unsafe { _mm512_cmp_pd_mask::<_CMP_EQ_OQ>(self.0, _mm512_setzero_pd()) == 0xff }
    }
    #[inline(always)]
    fn mask_below(self, limit: Self) -> u32 {
        // SAFETY: see the head of this file.
        unsafe { u32::from(_mm512_cmp_pd_mask::<_CMP_LT_OQ>(self.0, limit.0)) }
    }
    #[inline(always)]
    fn behind(self, before: Self) -> Self {
        // SAFETY: see the head of this file.
        unsafe {
            let (lanes, before) = (_mm512_castpd_si512(self.0), _mm512_castpd_si512(before.0));
            let moved = _mm512_alignr_epi64::<7>(lanes, before);
            Eight(_mm512_castsi512_pd(moved))
        }
    }
    #[inline(always)]
    fn floor(self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Eight(_mm512_roundscale_pd::<DOWN>(self.0)) }
    }
    #[inline(always)]
    fn root(self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { Eight(_mm512_sqrt_pd(self.0)) }
    }
    #[inline(always)]
    fn inverse_root_guess(self) -> Self {
        // SAFETY: see the head of this file.
        unsafe {
            let half = _mm512_srli_epi64::<1>(_mm512_castpd_si512(self.0));
            let one = _mm512_set1_epi64(INVERSE_ROOT_OF_ONE as i64);
            Eight(_mm512_castsi512_pd(_mm512_sub_epi64(one, half)))
        }
    }
}
vector! {
    /// Four singles.
    FourSingles: 4 x f32 in [0: __m128],
    half FourSingles, tail FourSingles, transpose turn::four_singles,
    doubles Pairs [0: widen_four],
    _mm_add_ps, _mm_sub_ps, _mm_mul_ps, _mm_div_ps, _mm_max_ps, _mm_min_ps,
    choose128_ps, fused128_ps, _mm_set1_ps, _mm_loadu_ps, _mm_storeu_ps, _mm_stream_ps
}
vector! {
    /// Four singles, twice.
    SinglesTwice: 8 x f32 in [0: __m128, 1: __m128],
    half SinglesTwice, tail FourSingles, transpose turn::singles_twice,
    doubles Pairs [0: widen_first, 1: widen_second],
    _mm_add_ps, _mm_sub_ps, _mm_mul_ps, _mm_div_ps, _mm_max_ps, _mm_min_ps,
    choose128_ps, fused128_ps, _mm_set1_ps, _mm_loadu_ps, _mm_storeu_ps, _mm_stream_ps
}
vector! {
    /// Eight singles.
    EightSingles: 8 x f32 in [0: __m256],
    half EightSingles, tail FourSingles, transpose turn::eight_singles,
    doubles Four [0: widen_lower_four, 1: widen_upper_four],
    _mm256_add_ps, _mm256_sub_ps, _mm256_mul_ps, _mm256_div_ps, _mm256_max_ps, _mm256_min_ps,
    choose256_ps, _mm256_fmadd_ps, _mm256_set1_ps, _mm256_loadu_ps, _mm256_storeu_ps, _mm256_stream_ps;
    #[inline(always)]
    fn is_zero(self) -> bool {
        // SAFETY: see the head of this file.
        unsafe {
            let zeros = _mm256_cmp_ps::<_CMP_EQ_OQ>(self.0, _mm256_setzero_ps());
            _mm256_movemask_ps(zeros) == 0xff
        }
    }
    #[inline(always)]
    fn mask_below(self, limit: Self) -> u32 {
        // SAFETY: see the head of this file.
        unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LT_OQ>(self.0, limit.0)) as u32 }
    }
    #[inline(always)]
    fn floor(self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { EightSingles(_mm256_floor_ps(self.0)) }
    }
    #[inline(always)]
    fn root(self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { EightSingles(_mm256_sqrt_ps(self.0)) }
    }
    #[inline(always)]
    fn inverse_root_guess(self) -> Self {
        // SAFETY: see the head of this file.
        unsafe {
            let half = _mm256_srli_epi32::<1>(_mm256_castps_si256(self.0));
            let one = _mm256_set1_epi32(INVERSE_ROOT_OF_ONE_SINGLE as i32);
            EightSingles(_mm256_castsi256_ps(_mm256_sub_epi32(one, half)))
        }
    }
    #[inline(always)]
    fn pairs(from: &[f32], at: Self) -> [Self; 2] {
        assert!(2 <= from.len() && from.len() <= super::MOST_PLACES);
        // SAFETY: see the head of this file; the assertions place all pairs in the slice, and singles
        // represent its indices exactly.
        unsafe {
            let last = _mm256_set1_ps(from.len() as f32 - 2.0);
            let below = _mm256_cmp_ps::<_CMP_LE_OQ>(at.0, last);
            let above = _mm256_cmp_ps::<_CMP_GE_OQ>(at.0, _mm256_setzero_ps());
            assert_eq!(_mm256_movemask_ps(_mm256_and_ps(below, above)), 0xff);
            let indices = _mm256_cvttps_epi32(at.0);
            let first = from.as_ptr();
            [
                EightSingles(_mm256_i32gather_ps::<4>(first, indices)),
                EightSingles(_mm256_i32gather_ps::<4>(first.add(1), indices)),
            ]
        }
    }
}
vector! {
    /// Sixteen singles.
    SixteenSingles: 16 x f32 in [0: __m512],
    half EightSingles, tail FourSingles, transpose turn::sixteen_singles,
    doubles Eight [0: widen_lower_eight, 1: widen_upper_eight],
    _mm512_add_ps, _mm512_sub_ps, _mm512_mul_ps, _mm512_div_ps, _mm512_max_ps, _mm512_min_ps,
    choose512_ps, _mm512_fmadd_ps, _mm512_set1_ps, _mm512_loadu_ps, _mm512_storeu_ps, _mm512_stream_ps;
    #[inline(always)]
    fn is_zero(self) -> bool {
        // SAFETY: see the head of this file.
        unsafe { _mm512_cmp_ps_mask::<_CMP_EQ_OQ>(self.0, _mm512_setzero_ps()) == 0xffff }
    }
    #[inline(always)]
    fn mask_below(self, limit: Self) -> u32 {
        // SAFETY: see the head of this file.
        unsafe { u32::from(_mm512_cmp_ps_mask::<_CMP_LT_OQ>(self.0, limit.0)) }
    }
    #[inline(always)]
    fn floor(self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { SixteenSingles(_mm512_roundscale_ps::<DOWN>(self.0)) }
    }
    #[inline(always)]
    fn root(self) -> Self {
        // SAFETY: see the head of this file.
        unsafe { SixteenSingles(_mm512_sqrt_ps(self.0)) }
    }
    #[inline(always)]
    fn inverse_root_guess(self) -> Self {
        // SAFETY: see the head of this file.
        unsafe {
            let half = _mm512_srli_epi32::<1>(_mm512_castps_si512(self.0));
            let one = _mm512_set1_epi32(INVERSE_ROOT_OF_ONE_SINGLE as i32);
            SixteenSingles(_mm512_castsi512_ps(_mm512_sub_epi32(one, half)))
        }
    }
    #[inline(always)]
    fn pairs(from: &[f32], at: Self) -> [Self; 2] {
        assert!(2 <= from.len() && from.len() <= super::MOST_PLACES);
        // SAFETY: see the head of this file; the assertions place all pairs in the slice, and singles
        // represent its indices exactly.
        unsafe {
            let last = _mm512_set1_ps(from.len() as f32 - 2.0);
            let below = _mm512_cmp_ps_mask::<_CMP_LE_OQ>(at.0, last);
            let above = _mm512_cmp_ps_mask::<_CMP_GE_OQ>(at.0, _mm512_setzero_ps());
            assert_eq!(below & above, 0xffff);
            let indices = _mm512_cvttps_epi32(at.0);
            let first = from.as_ptr();
            [
                SixteenSingles(_mm512_i32gather_ps::<4>(indices, first)),
                SixteenSingles(_mm512_i32gather_ps::<4>(indices, first.add(1))),
            ]
        }
    }
}

/// The first `count` of eight lanes, as bits.
#[inline(always)]
fn first_of_eight(count: usize) -> u8 {
    (0xff_u32 >> (8 - count.min(8))) as u8
}
/// A count of lanes, no more than four.
#[inline(always)]
fn up_to(count: usize) -> i32 {
    count.min(4) as i32
}
/// The numbers of the lanes.
#[inline(always)]
unsafe fn ramp256() -> __m256i {
    unsafe { _mm256_setr_epi64x(0, 1, 2, 3) }
}
#[inline(always)]
unsafe fn ramp128() -> __m128i {
    unsafe { _mm_setr_epi32(0, 1, 2, 3) }
}
/// What has doubles already.
#[inline(always)]
unsafe fn same<V>(v: V) -> V {
    v
}
#[inline(always)]
unsafe fn pairs(v: __m128) -> Pairs {
    unsafe { Pairs(_mm_cvtps_pd(v), _mm_cvtps_pd(_mm_movehl_ps(v, v))) }
}
#[inline(always)]
unsafe fn widen_four(v: FourSingles) -> Pairs {
    unsafe { pairs(v.0) }
}
#[inline(always)]
unsafe fn widen_first(v: SinglesTwice) -> Pairs {
    unsafe { pairs(v.0) }
}
#[inline(always)]
unsafe fn widen_second(v: SinglesTwice) -> Pairs {
    unsafe { pairs(v.1) }
}
#[inline(always)]
unsafe fn widen_lower_four(v: EightSingles) -> Four {
    unsafe { Four(_mm256_cvtps_pd(_mm256_castps256_ps128(v.0))) }
}
#[inline(always)]
unsafe fn widen_upper_four(v: EightSingles) -> Four {
    unsafe { Four(_mm256_cvtps_pd(_mm256_extractf128_ps::<1>(v.0))) }
}
#[inline(always)]
unsafe fn widen_lower_eight(v: SixteenSingles) -> Eight {
    unsafe { Eight(_mm512_cvtps_pd(_mm512_castps512_ps256(v.0))) }
}
#[inline(always)]
unsafe fn widen_upper_eight(v: SixteenSingles) -> Eight {
    unsafe {
        let upper = _mm512_extractf64x4_pd::<1>(_mm512_castps_pd(v.0));
        Eight(_mm512_cvtps_pd(_mm256_castpd_ps(upper)))
    }
}
#[inline(always)]
unsafe fn choose128_pd(a: __m128d, limit: __m128d, yes: __m128d, no: __m128d) -> __m128d {
    unsafe {
        let below = _mm_cmplt_pd(a, limit);
        _mm_or_pd(_mm_and_pd(below, yes), _mm_andnot_pd(below, no))
    }
}
#[inline(always)]
unsafe fn choose128_ps(a: __m128, limit: __m128, yes: __m128, no: __m128) -> __m128 {
    unsafe {
        let below = _mm_cmplt_ps(a, limit);
        _mm_or_ps(_mm_and_ps(below, yes), _mm_andnot_ps(below, no))
    }
}
#[inline(always)]
unsafe fn choose256_pd(a: __m256d, limit: __m256d, yes: __m256d, no: __m256d) -> __m256d {
    unsafe { _mm256_blendv_pd(no, yes, _mm256_cmp_pd::<_CMP_LT_OQ>(a, limit)) }
}
#[inline(always)]
unsafe fn choose256_ps(a: __m256, limit: __m256, yes: __m256, no: __m256) -> __m256 {
    unsafe { _mm256_blendv_ps(no, yes, _mm256_cmp_ps::<_CMP_LT_OQ>(a, limit)) }
}
#[inline(always)]
unsafe fn choose512_pd(a: __m512d, limit: __m512d, yes: __m512d, no: __m512d) -> __m512d {
    unsafe { _mm512_mask_blend_pd(_mm512_cmp_pd_mask::<_CMP_LT_OQ>(a, limit), no, yes) }
}
#[inline(always)]
unsafe fn choose512_ps(a: __m512, limit: __m512, yes: __m512, no: __m512) -> __m512 {
    unsafe { _mm512_mask_blend_ps(_mm512_cmp_ps_mask::<_CMP_LT_OQ>(a, limit), no, yes) }
}
// Machines of this level have no such instruction: one by one, by the library.
#[inline(always)]
unsafe fn fused128_pd(a: __m128d, factor: __m128d, term: __m128d) -> __m128d {
    let (mut lanes, mut factors, mut terms) = ([0.0; 2], [0.0; 2], [0.0; 2]);
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

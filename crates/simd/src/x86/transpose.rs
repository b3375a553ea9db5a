//! Transposes of square blocks in registers of x86-64: pairs of numbers are swapped first, then
//! pairs of pairs, then quarters of a register.
//!
//! Every function requires the instruction set of its vector.

use std::arch::x86_64::*;

use super::*;

#[inline(always)]
pub unsafe fn sse2_f64x4(block: &mut [Sse2F64x4]) {
    let block = &mut block[..4];
    let [a, b, c, d] = [block[0], block[1], block[2], block[3]];
    // SAFETY: see the head of `x86/mod.rs`.
    unsafe {
        block[0] = Sse2F64x4(_mm_unpacklo_pd(a.0, b.0), _mm_unpacklo_pd(c.0, d.0));
        block[1] = Sse2F64x4(_mm_unpackhi_pd(a.0, b.0), _mm_unpackhi_pd(c.0, d.0));
        block[2] = Sse2F64x4(_mm_unpacklo_pd(a.1, b.1), _mm_unpacklo_pd(c.1, d.1));
        block[3] = Sse2F64x4(_mm_unpackhi_pd(a.1, b.1), _mm_unpackhi_pd(c.1, d.1));
    }
}

#[inline(always)]
pub unsafe fn avx2_f64x4(block: &mut [Avx2F64x4]) {
    let block = &mut block[..4];
    let [a, b, c, d] = [block[0].0, block[1].0, block[2].0, block[3].0];
    // SAFETY: see the head of `x86/mod.rs`.
    unsafe {
        let (e, f) = (_mm256_unpacklo_pd(a, b), _mm256_unpackhi_pd(a, b));
        let (g, h) = (_mm256_unpacklo_pd(c, d), _mm256_unpackhi_pd(c, d));
        block[0] = Avx2F64x4(_mm256_permute2f128_pd::<0x20>(e, g));
        block[1] = Avx2F64x4(_mm256_permute2f128_pd::<0x20>(f, h));
        block[2] = Avx2F64x4(_mm256_permute2f128_pd::<0x31>(e, g));
        block[3] = Avx2F64x4(_mm256_permute2f128_pd::<0x31>(f, h));
    }
}

#[inline(always)]
pub unsafe fn avx512_f64x8(block: &mut [Avx512F64x8]) {
    let block = &mut block[..8];
    // SAFETY: see the head of `x86/mod.rs`.
    unsafe {
        let mut pairs = [block[0].0; 8];
        for i in 0..4 {
            let (a, b) = (block[2 * i].0, block[2 * i + 1].0);
            pairs[i] = _mm512_unpacklo_pd(a, b);
            pairs[4 + i] = _mm512_unpackhi_pd(a, b);
        }
        for i in 0..2 {
            let here = &pairs[4 * i..][..4];
            let even = [
                _mm512_shuffle_f64x2::<0x88>(here[0], here[1]),
                _mm512_shuffle_f64x2::<0x88>(here[2], here[3]),
            ];
            let odd = [
                _mm512_shuffle_f64x2::<0xdd>(here[0], here[1]),
                _mm512_shuffle_f64x2::<0xdd>(here[2], here[3]),
            ];
            block[i] = Avx512F64x8(_mm512_shuffle_f64x2::<0x88>(even[0], even[1]));
            block[2 + i] = Avx512F64x8(_mm512_shuffle_f64x2::<0x88>(odd[0], odd[1]));
            block[4 + i] = Avx512F64x8(_mm512_shuffle_f64x2::<0xdd>(even[0], even[1]));
            block[6 + i] = Avx512F64x8(_mm512_shuffle_f64x2::<0xdd>(odd[0], odd[1]));
        }
    }
}

/// Columns of four rows of four singles.
#[inline(always)]
unsafe fn square([a, b, c, d]: [__m128; 4]) -> [__m128; 4] {
    // SAFETY: see the head of `x86/mod.rs`.
    unsafe {
        let (e, f) = (_mm_unpacklo_ps(a, b), _mm_unpackhi_ps(a, b));
        let (g, h) = (_mm_unpacklo_ps(c, d), _mm_unpackhi_ps(c, d));
        [_mm_movelh_ps(e, g), _mm_movehl_ps(g, e), _mm_movelh_ps(f, h), _mm_movehl_ps(h, f)]
    }
}

#[inline(always)]
pub unsafe fn sse2_f32x4(block: &mut [Sse2F32x4]) {
    let block = &mut block[..4];
    // SAFETY: see the head of `x86/mod.rs`.
    let columns = unsafe { square([block[0].0, block[1].0, block[2].0, block[3].0]) };
    for i in 0..4 {
        block[i] = Sse2F32x4(columns[i]);
    }
}

#[inline(always)]
pub unsafe fn sse2_f32x8(block: &mut [Sse2F32x8]) {
    let block = &mut block[..8];
    let [upper, lower] = [0, 4].map(|at| [block[at], block[at + 1], block[at + 2], block[at + 3]]);
    // SAFETY: see the head of `x86/mod.rs`.
    unsafe {
        let (a, b) = (
            square([upper[0].0, upper[1].0, upper[2].0, upper[3].0]),
            square([lower[0].0, lower[1].0, lower[2].0, lower[3].0]),
        );
        let (c, d) = (
            square([upper[0].1, upper[1].1, upper[2].1, upper[3].1]),
            square([lower[0].1, lower[1].1, lower[2].1, lower[3].1]),
        );
        for i in 0..4 {
            block[i] = Sse2F32x8(a[i], b[i]);
            block[4 + i] = Sse2F32x8(c[i], d[i]);
        }
    }
}

#[inline(always)]
pub unsafe fn avx2_f32x8(block: &mut [Avx2F32x8]) {
    let block = &mut block[..8];
    // SAFETY: see the head of `x86/mod.rs`.
    unsafe {
        // Columns c and 4 + c of the rows 4 i to 4 i + 3.
        let mut quarters = [block[0].0; 8];
        for i in 0..2 {
            let rows = &block[4 * i..][..4];
            let low = [
                _mm256_unpacklo_ps(rows[0].0, rows[1].0),
                _mm256_unpacklo_ps(rows[2].0, rows[3].0),
            ];
            let high = [
                _mm256_unpackhi_ps(rows[0].0, rows[1].0),
                _mm256_unpackhi_ps(rows[2].0, rows[3].0),
            ];
            quarters[4 * i] = _mm256_shuffle_ps::<0x44>(low[0], low[1]);
            quarters[4 * i + 1] = _mm256_shuffle_ps::<0xee>(low[0], low[1]);
            quarters[4 * i + 2] = _mm256_shuffle_ps::<0x44>(high[0], high[1]);
            quarters[4 * i + 3] = _mm256_shuffle_ps::<0xee>(high[0], high[1]);
        }
        for c in 0..4 {
            let (a, b) = (quarters[c], quarters[4 + c]);
            block[c] = Avx2F32x8(_mm256_permute2f128_ps::<0x20>(a, b));
            block[4 + c] = Avx2F32x8(_mm256_permute2f128_ps::<0x31>(a, b));
        }
    }
}

#[inline(always)]
pub unsafe fn avx512_f32x16(block: &mut [Avx512F32x16]) {
    let block = &mut block[..16];
    // SAFETY: see the head of `x86/mod.rs`.
    unsafe {
        // Columns c, 4 + c, 8 + c and 12 + c of the rows 4 i to 4 i + 3.
        let mut quarters = [block[0].0; 16];
        for i in 0..4 {
            let rows = &block[4 * i..][..4];
            let low = [
                _mm512_unpacklo_ps(rows[0].0, rows[1].0),
                _mm512_unpacklo_ps(rows[2].0, rows[3].0),
            ];
            let high = [
                _mm512_unpackhi_ps(rows[0].0, rows[1].0),
                _mm512_unpackhi_ps(rows[2].0, rows[3].0),
            ];
            quarters[4 * i] = _mm512_shuffle_ps::<0x44>(low[0], low[1]);
            quarters[4 * i + 1] = _mm512_shuffle_ps::<0xee>(low[0], low[1]);
            quarters[4 * i + 2] = _mm512_shuffle_ps::<0x44>(high[0], high[1]);
            quarters[4 * i + 3] = _mm512_shuffle_ps::<0xee>(high[0], high[1]);
        }
        for c in 0..4 {
            let even = [
                _mm512_shuffle_f32x4::<0x88>(quarters[c], quarters[4 + c]),
                _mm512_shuffle_f32x4::<0x88>(quarters[8 + c], quarters[12 + c]),
            ];
            let odd = [
                _mm512_shuffle_f32x4::<0xdd>(quarters[c], quarters[4 + c]),
                _mm512_shuffle_f32x4::<0xdd>(quarters[8 + c], quarters[12 + c]),
            ];
            block[c] = Avx512F32x16(_mm512_shuffle_f32x4::<0x88>(even[0], even[1]));
            block[4 + c] = Avx512F32x16(_mm512_shuffle_f32x4::<0x88>(odd[0], odd[1]));
            block[8 + c] = Avx512F32x16(_mm512_shuffle_f32x4::<0xdd>(even[0], even[1]));
            block[12 + c] = Avx512F32x16(_mm512_shuffle_f32x4::<0xdd>(odd[0], odd[1]));
        }
    }
}

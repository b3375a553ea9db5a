//! Fourier transforms of short fixed lengths (butterflies).
//!
//! Outputs come in pairs k, r - k: with e_k the cosine sum over x_t + x_{r-t} and o_k the sine sum
//! over x_t - x_{r-t} they are e_k - i o_k and e_k + i o_k.

use crate::math::Real;
use grainwake_simd::{Complex, Vector, rotated_butterfly};

/// Fourier transform of fixed length `R`.
pub trait Butterfly<const R: usize> {
    /// Returns X_k = sum over t of x_t exp(-2 pi i k t / R).
    fn apply<V: Vector>(x: [Complex<V>; R]) -> [Complex<V>; R];
}

/// Transform of length two.
pub struct Two;
/// Transform of length three.
pub struct Three;
/// Transform of length four.
pub struct Four;
/// Transform of length five.
pub struct Five;
/// Transform of length seven.
pub struct Seven;
/// Transform of length eight.
pub struct Eight;

impl Butterfly<2> for Two {
    #[inline(always)]
    fn apply<V: Vector>([a, b]: [Complex<V>; 2]) -> [Complex<V>; 2] {
        [a + b, a - b]
    }
}

impl Butterfly<3> for Three {
    #[inline(always)]
    fn apply<V: Vector>([a, b, c]: [Complex<V>; 3]) -> [Complex<V>; 3] {
        const SIN: f64 = 0.866_025_403_784_438_6;
        let sum = b + c;
        let [y, z] =
            rotated_butterfly(a - sum.scale(V::Number::of(0.5)), (b - c).scale(V::Number::of(SIN)));
        [a + sum, y, z]
    }
}

impl Butterfly<4> for Four {
    #[inline(always)]
    fn apply<V: Vector>([a, b, c, d]: [Complex<V>; 4]) -> [Complex<V>; 4] {
        let (s, t, u) = (a + c, a - c, b + d);
        let [y, z] = rotated_butterfly(t, b - d);
        [s + u, y, s - u, z]
    }
}

impl Butterfly<5> for Five {
    #[inline(always)]
    fn apply<V: Vector>([a, b, c, d, e]: [Complex<V>; 5]) -> [Complex<V>; 5] {
        const COS: [f64; 2] = [0.309_016_994_374_947_45, -0.809_016_994_374_947_5];
        const SIN: [f64; 2] = [0.951_056_516_295_153_5, 0.587_785_252_292_473_1];
        let (p, q, r, s) = (b + e, c + d, b - e, c - d);
        let [y1, y4] = rotated_butterfly(
            a + p.scale(V::Number::of(COS[0])) + q.scale(V::Number::of(COS[1])),
            r.scale(V::Number::of(SIN[0])) + s.scale(V::Number::of(SIN[1])),
        );
        let [y2, y3] = rotated_butterfly(
            a + p.scale(V::Number::of(COS[1])) + q.scale(V::Number::of(COS[0])),
            r.scale(V::Number::of(SIN[1])) - s.scale(V::Number::of(SIN[0])),
        );
        [a + p + q, y1, y2, y3, y4]
    }
}

impl Butterfly<7> for Seven {
    #[inline(always)]
    fn apply<V: Vector>([a, b, c, d, e, f, g]: [Complex<V>; 7]) -> [Complex<V>; 7] {
        const COS: [f64; 3] =
            [0.623_489_801_858_733_6, -0.222_520_933_956_314_34, -0.900_968_867_902_419_1];
        const SIN: [f64; 3] =
            [0.781_831_482_468_029_8, 0.974_927_912_181_823_6, 0.433_883_739_117_558_1];
        let (p, q, r) = (b + g, c + f, d + e);
        let (u, v, w) = (b - g, c - f, d - e);
        let [y1, y6] = rotated_butterfly(
            a + p.scale(V::Number::of(COS[0]))
                + q.scale(V::Number::of(COS[1]))
                + r.scale(V::Number::of(COS[2])),
            u.scale(V::Number::of(SIN[0]))
                + v.scale(V::Number::of(SIN[1]))
                + w.scale(V::Number::of(SIN[2])),
        );
        let [y2, y5] = rotated_butterfly(
            a + p.scale(V::Number::of(COS[1]))
                + q.scale(V::Number::of(COS[2]))
                + r.scale(V::Number::of(COS[0])),
            u.scale(V::Number::of(SIN[1]))
                - v.scale(V::Number::of(SIN[2]))
                - w.scale(V::Number::of(SIN[0])),
        );
        let [y3, y4] = rotated_butterfly(
            a + p.scale(V::Number::of(COS[2]))
                + q.scale(V::Number::of(COS[0]))
                + r.scale(V::Number::of(COS[1])),
            u.scale(V::Number::of(SIN[2])) - v.scale(V::Number::of(SIN[0]))
                + w.scale(V::Number::of(SIN[1])),
        );
        [a + p + q + r, y1, y2, y3, y4, y5, y6]
    }
}

impl Butterfly<8> for Eight {
    #[inline(always)]
    fn apply<V: Vector>([a, b, c, d, e, f, g, h]: [Complex<V>; 8]) -> [Complex<V>; 8] {
        use std::f64::consts::FRAC_1_SQRT_2;
        // Transforms of length four of the even and of the odd inputs.
        let [p, q, r, s] = Four::apply([a, c, e, g]);
        let [t, u, v, w] = Four::apply([b, d, f, h]);
        let half = V::Number::of(FRAC_1_SQRT_2);
        // Times exp(-i pi / 4) and exp(-3 i pi / 4).
        let u = Complex { re: u.re + u.im, im: u.im - u.re }.scale(half);
        let w = Complex { re: w.im - w.re, im: V::constant(0.0) - (w.re + w.im) }.scale(half);
        let [y2, y6] = rotated_butterfly(r, v);
        [p + t, q + u, y2, s + w, p - t, q - u, y6, s - w]
    }
}

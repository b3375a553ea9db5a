//! Aperture (open fraction) of a face or link near a solid surface.
//!
//! A(d) = (1 + s + sin(pi s) / pi) / 2 with s = d / eps limited to [-1, 1]: from 0 inside to 1
//! outside a band of half-width eps around the surface. The solid fraction is 1 - A. Velocities
//! near a surface are those of the fluid averaged over this band: a linear shear over a plane wall
//! becomes the open depth m(d), the integral of A; a parabola d^2 / 2 becomes M(d), the integral of
//! m. [`reference`] has the scalar forms.
//!
//! Legend: d signed distance (negative inside), eps half-width of the band, A aperture, m open
//! depth, M its integral.

use std::f64::consts::PI;

use crate::math::Real;
use grainwake_simd::Vector;

/// sin(pi s) / (s (1 - s^2)) for |s| <= 1 as a polynomial in s^2, by Chebyshev interpolation. The
/// factors make the zeros exact.
const SINE: [f64; 9] = [
    3.1415926535897896,
    -2.0261201264595803,
    0.5240439134012429,
    -0.07522061573981359,
    0.00692526986295523,
    -0.00044515778987953104,
    2.113839102396879e-05,
    -7.686190875908572e-07,
    2.015824977467548e-08,
];
/// cos(pi s / 2) / (1 - s^2) for |s| <= 1 as a polynomial in s^2.
const COSINE: [f64; 7] = [
    0.9999999999999923,
    -0.23370055013541344,
    0.019968957752765727,
    -0.0008945229257157461,
    2.4737068119937893e-05,
    -4.644596965254443e-07,
    6.097403736034505e-09,
];

/// Value of the limited aperture where A is zero. Without a limit an impulsive start is unstable.
const LEAST_APERTURE: f64 = 0.2;

/// sin(pi s) for |s| <= 1, within 1e-14 or single-precision rounding.
#[inline(always)]
fn sine<V: Vector>(s: V) -> V {
    s * vanishing(s, &SINE[..if is_single::<V>() { 7 } else { 9 }])
}

/// cos(pi s / 2) for |s| <= 1, within 1e-14 or single-precision rounding.
#[inline(always)]
fn cosine<V: Vector>(s: V) -> V {
    vanishing(s, &COSINE[..if is_single::<V>() { 5 } else { 7 }])
}

/// Returns whether the registers hold single-precision numbers.
#[inline(always)]
fn is_single<V: Vector>() -> bool {
    V::Number::BYTES == size_of::<f32>()
}

/// (1 - s^2) times the polynomial in s^2 with the coefficients `series`.
#[inline(always)]
fn vanishing<V: Vector>(s: V, series: &[f64]) -> V {
    let square = s * s;
    let (last, others) = series.split_last().expect("a series has terms");
    let mut sum = V::constant(*last);
    for term in others.iter().rev() {
        sum = sum.mul_add(square, V::constant(*term));
    }
    (V::constant(1.0) - square) * sum
}

/// Outer limit of the forcing band: distance from a surface [m] up to which a grain forces faces,
/// twice the half-width `eps` [m]. On a cubic grid the drag and the closed fraction vanish at
/// eps + h already, where the differences over one spacing h no longer reach the band of eps.
pub fn forcing_reach(eps: f64) -> f64 {
    2.0 * eps
}

/// Aperture of faces or links at distances `d` [m], which may be infinite.
#[inline(always)]
pub fn aperture<V: Vector>(d: V, eps: f64) -> V {
    let (one, half) = (V::constant(1.0), V::constant(0.5));
    let s = clamped(d, eps);
    sine(s).mul_add(V::constant(0.5 / PI), half * (one + s))
}

/// Inverse-aperture excess 1 / A' - 1 at distances `d` [m], with the limited aperture
/// A' = A + 0.2 (1 - A)^2. A limit without a kink keeps the error independent of where the grid
/// lies.
#[inline(always)]
pub fn inverse_aperture_excess<V: Vector>(d: V, eps: f64) -> V {
    let open = aperture(d, eps);
    let closed = V::constant(1.0) - open;
    let limited = (V::constant(LEAST_APERTURE) * closed).mul_add(closed, open);
    (V::constant(1.0) - limited).div(limited)
}

/// Open depth m(d) [m], the integral of the aperture up to `d`: 0 inside, d outside the band.
#[inline(always)]
pub fn open_depth<V: Vector>(d: V, eps: f64) -> V {
    let (zero, one, half) = (V::constant(0.0), V::constant(1.0), V::constant(0.5));
    let s = clamped(d, eps);
    // 1 + cos(pi s) = 2 cos^2(pi s / 2)
    let cosine = cosine(s);
    let inside = V::constant(-2.0 / (PI * PI)) * cosine * cosine;
    let inside = (half * (one + s)).mul_add(one + s, inside);
    let beyond = (d - V::constant(eps)).max(zero);
    inside.mul_add(V::constant(0.5 * eps), beyond)
}

/// Integral M(d) of the open depth up to `d` [m^2], beyond the band d^2 / 2 and a constant.
#[inline(always)]
pub fn open_depth_integral<V: Vector>(d: V, eps: f64) -> V {
    let (zero, half) = (V::constant(0.0), V::constant(0.5));
    let s = clamped(d, eps);
    let rise = V::constant(1.0) + s;
    let linear = sine(s).mul_add(V::constant(1.0 / PI), rise) * V::constant(-1.0 / (PI * PI));
    let inside = (rise * rise * rise).mul_add(V::constant(1.0 / 6.0), linear).max(zero);
    let beyond = (d - V::constant(eps)).max(zero);
    let outside = beyond * half.mul_add(beyond, V::constant(eps));
    inside.mul_add(V::constant(0.5 * eps * eps), outside)
}

/// Variance [m^2] of the distance under the derivative of the aperture, the kernel of the band.
pub fn band_variance(eps: f64) -> f64 {
    (1.0 / 3.0 - 2.0 / (PI * PI)) * eps * eps
}

/// s = d / eps, limited to [-1, 1].
#[inline(always)]
fn clamped<V: Vector>(d: V, eps: f64) -> V {
    let s = d * V::constant(1.0 / eps);
    s.max(V::constant(-1.0)).min(V::constant(1.0))
}

/// Scalar forms of the kernels.
#[cfg(test)]
pub mod reference {
    use super::PI;

    /// A = (1 + s + sin(pi s) / pi) / 2 with s = d / eps, limited to [-1, 1].
    pub fn aperture(d: f64, eps: f64) -> f64 {
        let s = (d / eps).clamp(-1.0, 1.0);
        0.5 * (1.0 + s + (PI * s).sin() / PI)
    }

    /// 1 / (A + 0.2 (1 - A)^2) - 1.
    pub fn inverse_aperture_excess(d: f64, eps: f64) -> f64 {
        let open = aperture(d, eps);
        1.0 / (open + 0.2 * (1.0 - open).powi(2)) - 1.0
    }

    /// m = eps / 2 ((1 + s)^2 / 2 - (1 + cos(pi s)) / pi^2) in the band, m = d beyond it.
    pub fn open_depth(d: f64, eps: f64) -> f64 {
        let s = (d / eps).clamp(-1.0, 1.0);
        let band = 0.5 * (1.0 + s).powi(2) - (1.0 + (PI * s).cos()) / (PI * PI);
        0.5 * eps * band + (d - eps).max(0.0)
    }

    /// M = eps^2 / 2 ((1 + s)^3 / 6 - (1 + s + sin(pi s) / pi) / pi^2) in the band; beyond it M
    /// continues as eps (d - eps) + (d - eps)^2 / 2.
    pub fn open_depth_integral(d: f64, eps: f64) -> f64 {
        let s = (d / eps).clamp(-1.0, 1.0);
        let linear = (1.0 + s + (PI * s).sin() / PI) / (PI * PI);
        let beyond = (d - eps).max(0.0);
        0.5 * eps * eps * ((1.0 + s).powi(3) / 6.0 - linear) + beyond * (eps + 0.5 * beyond)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use grainwake_simd::Scalar;

    fn open_depth(d: f64, eps: f64) -> f64 {
        super::open_depth(Scalar(d), eps).0
    }

    #[test]
    fn series_match_sine_and_cosine() {
        for n in -1000..=1000 {
            let s = f64::from(n) / 1000.0;
            assert!((sine(Scalar(s)).0 - (PI * s).sin()).abs() < 1e-14, "{s}");
            assert!((cosine(Scalar(s)).0 - (0.5 * PI * s).cos()).abs() < 1e-14, "{s}");
        }
        for s in [-1.0, 1.0] {
            assert_eq!((sine(Scalar(s)).0, cosine(Scalar(s)).0), (0.0, 0.0));
        }
    }

    #[test]
    fn single_precision_errors_are_at_round_off() {
        for n in -1000..=1000 {
            let s = n as f32 / 1000.0;
            let wide = f64::from(s);
            let error = |found: f32, exact: f64| (f64::from(found) - exact).abs();
            assert!(error(sine(Scalar(s)).0, (PI * wide).sin()) < 2.5e-7, "{s}");
            assert!(error(cosine(Scalar(s)).0, (0.5 * PI * wide).cos()) < 2e-7, "{s}");
            for eps in [1.0, 0.7] {
                let exact = reference::inverse_aperture_excess(wide, eps);
                assert!(
                    error(inverse_aperture_excess(Scalar(s), eps).0, exact) < 1e-5,
                    "{s} {eps}"
                );
            }
        }
        for s in [-1.0_f32, 1.0] {
            assert_eq!((sine(Scalar(s)).0, cosine(Scalar(s)).0), (0.0, 0.0));
        }
    }

    #[test]
    fn excess_matches_its_definition() {
        let eps = 0.7;
        for n in -2000..=2000 {
            let d = f64::from(n) / 1000.0;
            let exact = reference::inverse_aperture_excess(d, eps);
            let found = inverse_aperture_excess(Scalar(d), eps).0;
            assert!((found - exact).abs() < 1e-13, "{d}: {found} for {exact}");
        }
        assert!(inverse_aperture_excess(Scalar(eps), eps).0.abs() < 1e-15);
        assert_eq!(
            [9.0, f64::INFINITY].map(|d| inverse_aperture_excess(Scalar(d), eps).0),
            [0.0; 2]
        );
    }

    #[test]
    fn open_depth_and_its_integral_are_integrals_of_the_aperture() {
        let (eps, steps) = (0.7, 20_000);
        let (mut depth, mut moment, from) = (0.0, 0.0, -1.2);
        let width = 2.4 / steps as f64;
        for i in 0..steps {
            let middle = from + (i as f64 + 0.5) * width;
            depth += aperture(Scalar(middle), eps).0 * width;
            moment += open_depth(middle, eps) * width;
            let d = from + (i as f64 + 1.0) * width;
            assert!((depth - open_depth(d, eps)).abs() < 1e-8, "{d}");
            assert!((moment - open_depth_integral(Scalar(d), eps).0).abs() < 1e-8, "{d}");
        }
        assert_eq!(open_depth(-eps, eps), 0.0);
        assert_eq!(open_depth(-9.0, eps), 0.0);
        for (d, open) in [(-eps, 0.0), (eps, 1.0), (-9.0, 0.0), (f64::INFINITY, 1.0)] {
            assert_eq!(aperture(Scalar(d), eps).0, open);
        }
    }

    #[test]
    fn the_variance_is_that_of_the_derivative_of_the_aperture() {
        let (eps, steps) = (0.7, 20_000);
        let width = 2.0 * eps / f64::from(steps);
        let aperture = |d| aperture(Scalar(d), eps).0;
        let moments = (0..steps).map(|i| {
            let low = -eps + f64::from(i) * width;
            (low + 0.5 * width).powi(2) * (aperture(low + width) - aperture(low))
        });
        assert!((moments.sum::<f64>() - band_variance(eps)).abs() < 1e-8);
    }

    #[test]
    fn kernels_match_their_scalar_forms() {
        let eps = 0.7;
        for n in -2000..=2000 {
            let d = f64::from(n) / 1000.0;
            let [open, depth] = [aperture(Scalar(d), eps).0, open_depth(d, eps)];
            assert!((open - reference::aperture(d, eps)).abs() < 1e-14, "{d}");
            assert!((depth - reference::open_depth(d, eps)).abs() < 1e-14, "{d}");
            let integral = open_depth_integral(Scalar(d), eps).0;
            assert!((integral - reference::open_depth_integral(d, eps)).abs() < 1e-14, "{d}");
        }
    }
}

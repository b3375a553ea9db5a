//! Aperture (open fraction) of a face or link near a solid surface, and the drag on a face.
//!
//! A(d) = (1 + s + sin(pi s) / pi) / 2 with s = d / eps limited to [-1, 1]: from 0 inside to 1
//! outside a band of half-width eps around the surface. The solid fraction is 1 - A. Velocities
//! near a surface are those of the fluid averaged over this band: a linear shear over a plane wall
//! becomes the open depth m(d), the integral of A; a parabola d^2 / 2 becomes M(d), the integral of
//! m. [`reference`] has the scalar forms.
//!
//! The drag is a smoothed ghost-Dirichlet condition; the pressure weight P is the weight with which
//! a pressure gradient drives the face:
//!
//! drag = L m / m, P = L M - drag M,
//! with L f = sum_a (f(d + h_a n_a) + f(d - h_a n_a) - 2 f(d)) / h_a^2
//!
//! With this drag and weight two velocity profiles over a plane wall solve the discrete equations
//! exactly, so that the wall acts at d = 0 wherever the grid lies: the linear shear m(d), and the
//! parabola M(d) under a uniform pressure gradient or in an accelerated frame
//! (`docs/decisions/0018-pressure-weight.md`).
//!
//! Legend: d signed distance (negative inside), n unit normal, h spacing, eps half-width of the
//! band, A aperture, m open depth, M its integral.

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

/// Drag coefficient over kinematic viscosity [1/m^2] of faces at distances `d` [m] with unit
/// normals `n`, as numerator and positive denominator; very large where a face is closed.
#[inline(always)]
pub fn drag<V: Vector>(d: V, n: [V; 3], spacing: [f64; 3], eps: f64) -> [V; 2] {
    let depth = open_depth(d, eps);
    let excess = laplacian::<V, Shear>(d, n, spacing, eps, depth);
    let least = V::constant(1e-12 * eps);
    [excess.max(V::constant(0.0)), depth.max(least)]
}

/// Pressure weight P, 0 to 1, of faces at distances `d` [m] with unit normals `n`, which have the
/// drag `excess` / `depth`.
#[inline(always)]
pub fn pressure_weight<V: Vector>(
    d: V,
    n: [V; 3],
    spacing: [f64; 3],
    eps: f64,
    [excess, depth]: [V; 2],
) -> V {
    let integral = open_depth_integral(d, eps);
    let driven = laplacian::<V, Parabola>(d, n, spacing, eps, integral);
    // M / m grows from 0.2 to 0.29 times d + eps; the bound holds where rounding is larger than M.
    let bound = V::constant(0.3) * (d + V::constant(eps)).max(V::constant(0.0));
    let mean_depth = integral.div(depth);
    let outside = V::constant(2.0 * eps);
    let mean_depth = d.select_below(V::constant(eps), mean_depth.min(bound), mean_depth);
    let weight = driven - excess * mean_depth;
    let weight = weight.max(V::constant(0.0)).min(V::constant(1.0));
    d.select_below(outside, weight, V::constant(1.0))
}

/// Velocity profile over a plane wall. A trait, because a closure would not be inlined in a kernel.
trait Profile {
    /// Value at the distances `d` [m].
    fn at<V: Vector>(d: V, eps: f64) -> V;
}

/// m(d).
struct Shear;
/// M(d).
struct Parabola;

impl Profile for Shear {
    #[inline(always)]
    fn at<V: Vector>(d: V, eps: f64) -> V {
        open_depth(d, eps)
    }
}

impl Profile for Parabola {
    #[inline(always)]
    fn at<V: Vector>(d: V, eps: f64) -> V {
        open_depth_integral(d, eps)
    }
}

/// Discrete Laplacian of a profile over a plane, which has the value `here` at `d`.
#[inline(always)]
fn laplacian<V: Vector, P: Profile>(d: V, n: [V; 3], spacing: [f64; 3], eps: f64, here: V) -> V {
    let twice = here + here;
    let mut sum = V::constant(0.0);
    for axis in 0..3 {
        let h = spacing[axis];
        let step = V::constant(h) * n[axis];
        let rise = P::at(d + step, eps) + P::at(d - step, eps) - twice;
        sum = rise.mul_add(V::constant(1.0 / (h * h)), sum);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::immersed::geometry::aperture::reference;
    use glam::DVec3;
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

    /// Laplacian of `f(d)` at a plane's distance `d` by explicit differences of the positions.
    fn laplacian(f: impl Fn(f64) -> f64, d: f64, n: DVec3, h: f64) -> f64 {
        let f = |x: DVec3| f(d + n.dot(x));
        let second = |e: DVec3| (f(h * e) + f(-h * e) - 2.0 * f(DVec3::ZERO)) / (h * h);
        DVec3::AXES.map(second).iter().sum()
    }

    #[test]
    fn shear_and_parabola_over_a_plane_wall_are_exact_solutions() {
        let h = 0.5;
        for eps in [0.5, 0.625] {
            let shear = |d| reference::open_depth(d, eps);
            let parabola = |d| reference::open_depth_integral(d, eps);
            for n in [DVec3::X, DVec3::new(1.0, 2.0, -2.0) / 3.0] {
                for d in [-0.3, -0.05, 0.0, 0.2, 0.45, 0.7, 2.0] {
                    let normal = n.to_array().map(Scalar);
                    let drag = drag(Scalar(d), normal, [h; 3], eps);
                    let weight = pressure_weight(Scalar(d), normal, [h; 3], eps, drag).0;
                    let drag = drag[0].0 / drag[1].0;
                    let residual = laplacian(shear, d, n, h) - drag * shear(d);
                    assert!(residual.abs() < 1e-12, "shear at {d}: {residual:e}");
                    let residual = laplacian(parabola, d, n, h) - drag * parabola(d) - weight;
                    assert!(residual.abs() < 1e-12, "parabola at {d}: {residual:e}");
                }
            }
        }
    }

    #[test]
    fn pressure_weight_rises_from_closed_to_open() {
        let (h, eps) = (0.5, 0.625);
        let normal = (DVec3::new(1.0, 2.0, -2.0) / 3.0).to_array();
        let weight = |d: f64| {
            let normal = normal.map(Scalar);
            pressure_weight(Scalar(d), normal, [h; 3], eps, drag(Scalar(d), normal, [h; 3], eps)).0
        };
        let single = |d: f64| {
            let (normal, d) = (normal.map(|n| Scalar(n as f32)), Scalar(d as f32));
            pressure_weight(d, normal, [h; 3], eps, drag(d, normal, [h; 3], eps)).0
        };
        let mut last = 0.0;
        for n in -240..=500 {
            let d = f64::from(n) / 400.0;
            let here = weight(d);
            assert!(here >= last - 1e-12 && here <= 1.0, "{d}: {here} after {last}");
            let error = (f64::from(single(d)) - here).abs();
            // Near d = -eps, where a face takes the rigid velocity, M and m are differences of
            // nearly equal numbers.
            assert!(error < if d < -0.8 * eps { 0.05 } else { 2e-4 }, "{d}: {error:e}");
            last = here;
        }
        assert_eq!([weight(1.3), weight(f64::INFINITY)], [1.0; 2]);
    }
}

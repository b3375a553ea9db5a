//! The smoothed aperture of a face near a solid surface and the drag that goes with it.
//!
//! Over a band of half-width eps = h about the surface the open fraction of a face rises smoothly
//! from 0 to 1. Its integral m(d) is the velocity profile that a linear shear takes over a plane
//! wall; the drag is what makes this profile an exact discrete solution, so that the wall acts at
//! d = 0 wherever the grid lies.
//!
//! Legend: d signed distance (negative inside), eps half-width, A aperture, m its integral.

use std::f64::consts::PI;

use crate::math::lanes::Vector;

/// sin(pi t) for |t| <= 1/2 to 1e-13, by its power series; the library's sine takes a multiple.
#[inline(always)]
fn sine<V: Vector<Number = f64>>(t: V) -> V {
    const SERIES: [f64; 9] = {
        // (-1)^k pi^(2k+1) / (2k+1)!
        let mut series = [PI; 9];
        let mut k = 1;
        while k < series.len() {
            series[k] = -series[k - 1] * PI * PI / ((2 * k) * (2 * k + 1)) as f64;
            k += 1;
        }
        series
    };
    let square = t * t;
    let mut sum = V::constant(SERIES[8]);
    for k in (0..8).rev() {
        sum = sum * square + V::constant(SERIES[k]);
    }
    t * sum
}

/// Open fraction of faces at distances `d` [m], which may be infinite.
#[inline(always)]
pub fn aperture<V: Vector<Number = f64>>(d: V, eps: f64) -> V {
    let (one, half) = (V::constant(1.0), V::constant(0.5));
    let s = clamped(d, eps);
    // sin(pi s) = 2 sin(pi s / 2) cos(pi s / 2)
    let product = sine(half * s) * sine(half * (one - s.magnitude()));
    half * (one + s) + V::constant(1.0 / PI) * product
}

/// Integral of the aperture from deep inside to `d` [m]: 0 inside, d outside the band.
#[inline(always)]
pub fn open_depth<V: Vector<Number = f64>>(d: V, eps: f64) -> V {
    let (zero, one, half) = (V::constant(0.0), V::constant(1.0), V::constant(0.5));
    let s = clamped(d, eps);
    // 1 + cos(pi s) = 2 sin^2(pi (1 - |s|) / 2)
    let sine = sine(half * (one - s.magnitude()));
    let inside = half * (one + s) * (one + s) - V::constant(2.0 / (PI * PI)) * sine * sine;
    let beyond = (d - V::constant(eps)).larger(zero);
    V::constant(0.5 * eps) * inside + beyond
}

/// d / eps, between -1 and 1.
#[inline(always)]
fn clamped<V: Vector<Number = f64>>(d: V, eps: f64) -> V {
    let one = V::constant(1.0);
    (d * V::constant(1.0 / eps))
        .larger(V::constant(-1.0))
        .smaller(one)
}

/// Drag coefficient [1/s] per unit kinematic viscosity [m^2/s] of faces at distances `d` from a
/// surface with unit normals `n`, on a grid of `spacing`; immense where a face is closed.
#[inline(always)]
pub fn drag<V: Vector<Number = f64>>(d: V, n: [V; 3], spacing: [f64; 3], eps: f64) -> V {
    let here = open_depth(d, eps);
    let twice = here + here;
    let mut excess = V::constant(0.0);
    for axis in 0..3 {
        let h = spacing[axis];
        let step = V::constant(h) * n[axis];
        let rise = open_depth(d + step, eps) + open_depth(d - step, eps) - twice;
        excess = excess + rise * V::constant(1.0 / (h * h));
    }
    let least = V::constant(1e-12 * eps);
    excess.larger(V::constant(0.0)).over(here.larger(least))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::lanes::One;
    use glam::DVec3;

    fn open_depth(d: f64, eps: f64) -> f64 {
        super::open_depth(One(d), eps).0
    }

    #[test]
    fn the_series_is_the_sine() {
        for n in -500..=500 {
            let t = f64::from(n) / 1000.0;
            assert!((sine(One(t)).0 - (PI * t).sin()).abs() < 1e-13, "{t}");
        }
    }

    #[test]
    fn open_depth_is_the_integral_of_the_aperture() {
        let (eps, steps) = (0.7, 20_000);
        let (mut sum, from) = (0.0, -1.2);
        let width = 2.4 / steps as f64;
        for i in 0..steps {
            sum += aperture(One(from + (i as f64 + 0.5) * width), eps).0 * width;
            let d = from + (i as f64 + 1.0) * width;
            assert!((sum - open_depth(d, eps)).abs() < 1e-8, "{d}");
        }
        assert_eq!(open_depth(-eps, eps), 0.0);
        assert_eq!(open_depth(-9.0, eps), 0.0);
        for (d, open) in [(-eps, 0.0), (eps, 1.0), (-9.0, 0.0), (f64::INFINITY, 1.0)] {
            assert_eq!(aperture(One(d), eps).0, open);
        }
    }

    #[test]
    fn a_linear_shear_over_a_plane_wall_is_an_exact_solution() {
        let spacing = DVec3::new(0.5, 0.5, 0.5);
        for n in [DVec3::X, DVec3::new(1.0, 2.0, -2.0) / 3.0] {
            for d in [-0.3, -0.05, 0.0, 0.2, 0.45, 0.7, 2.0] {
                let u = |x: DVec3| open_depth(d + n.dot(x), 0.5);
                let mut lap = 0.0;
                for e in [DVec3::X, DVec3::Y, DVec3::Z] {
                    lap += (u(0.5 * e) + u(-0.5 * e) - 2.0 * u(DVec3::ZERO)) / 0.25;
                }
                let normal = n.to_array().map(One);
                let drag = drag(One(d), normal, spacing.to_array(), 0.5).0;
                let residual = lap - drag * u(DVec3::ZERO);
                assert!(residual.abs() < 1e-12, "{d}: {residual:e}");
            }
        }
    }
}

//! The smoothed aperture of a face near a solid surface and the drag that goes with it.
//!
//! Over a band of half-width eps = h about the surface the open fraction of a face rises smoothly
//! from 0 to 1. Its integral m(d) is the velocity profile that a linear shear takes over a plane
//! wall; the drag is what makes this profile an exact discrete solution, so that the wall acts at
//! d = 0 wherever the grid lies.
//!
//! Legend: d signed distance (negative inside), eps half-width, A aperture, m its integral.

use std::f64::consts::PI;

use glam::DVec3;

/// sin(pi t) for |t| <= 1/2 to 1e-13, by its power series; the library's sine takes a multiple.
#[inline]
fn sine(t: f64) -> f64 {
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
    t * SERIES.iter().rev().fold(0.0, |sum, c| sum * square + c)
}

/// Open fraction of a face at distance `d` [m].
#[inline]
pub fn aperture(d: f64, eps: f64) -> f64 {
    let s = (d / eps).clamp(-1.0, 1.0);
    // sin(pi s) is the same at s and at 1 - s.
    let t = s.abs().min(1.0 - s.abs()).copysign(s);
    0.5 * (1.0 + s + sine(t) / PI)
}

/// Integral of the aperture from deep inside to `d` [m]: 0 inside, d outside the band.
#[inline]
pub fn open_depth(d: f64, eps: f64) -> f64 {
    if d >= eps {
        return d;
    }
    let s = (d / eps).max(-1.0);
    // 1 + cos(pi s) = 2 sin^2(pi (1 - |s|) / 2)
    let half = sine(0.5 * (1.0 - s.abs())) / PI;
    0.5 * eps * (0.5 * (1.0 + s) * (1.0 + s) - 2.0 * half * half)
}

/// Drag coefficient [1/s] per unit kinematic viscosity [m^2/s] of a face at distance `d` from a
/// surface with unit normal `n`, on a grid of `spacing`; infinite where the face is closed.
pub fn drag(d: f64, n: DVec3, spacing: DVec3, eps: f64) -> f64 {
    let here = open_depth(d, eps);
    let mut excess = 0.0;
    for axis in 0..3 {
        let (step, h) = (spacing[axis] * n[axis], spacing[axis]);
        excess += (open_depth(d + step, eps) + open_depth(d - step, eps) - 2.0 * here) / (h * h);
    }
    if here <= 1e-12 * eps {
        f64::INFINITY
    } else {
        excess.max(0.0) / here
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_series_is_the_sine() {
        for n in -500..=500 {
            let t = f64::from(n) / 1000.0;
            assert!((sine(t) - (PI * t).sin()).abs() < 1e-13, "{t}");
        }
    }

    #[test]
    fn open_depth_is_the_integral_of_the_aperture() {
        let (eps, steps) = (0.7, 20_000);
        let (mut sum, from) = (0.0, -1.2);
        let width = 2.4 / steps as f64;
        for i in 0..steps {
            sum += aperture(from + (i as f64 + 0.5) * width, eps) * width;
            let d = from + (i as f64 + 1.0) * width;
            assert!((sum - open_depth(d, eps)).abs() < 1e-8, "{d}");
        }
        assert_eq!(open_depth(-eps, eps), 0.0);
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
                let residual = lap - drag(d, n, spacing, 0.5) * u(DVec3::ZERO);
                assert!(residual.abs() < 1e-12, "{d}: {residual:e}");
            }
        }
    }
}

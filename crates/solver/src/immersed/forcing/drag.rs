//! Drag on a face near a surface (a smoothed ghost-Dirichlet condition), and the weight with which
//! a pressure gradient drives the face.
//!
//! drag = L m / m, pressure weight P = L M - drag M,
//! with L f = sum_a (f(d + h_a n_a) + f(d - h_a n_a) - 2 f(d)) / h_a^2
//!
//! With this drag and weight two velocity profiles over a plane wall solve the discrete equations
//! exactly, so that the wall acts at d = 0 wherever the grid lies: the linear shear m(d), and the
//! parabola M(d) under a uniform pressure gradient or in an accelerated frame
//! (`docs/decisions/0018-pressure-weight.md`).
//!
//! Legend: d signed distance, n unit normal, h spacing, eps half-width of the band, m open depth, M
//! its integral.

use grainwake_simd::Vector;

use crate::immersed::geometry::aperture::{open_depth, open_depth_integral};

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
    use glam::DVec3;
    use grainwake_simd::Scalar;

    use super::*;
    use crate::immersed::geometry::aperture::reference;

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

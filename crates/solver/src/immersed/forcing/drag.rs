//! Drag on a face near a surface: smoothed ghost-Dirichlet condition.
//!
//! drag = sum_a (m(d + h_a n_a) + m(d - h_a n_a) - 2 m(d)) / h_a^2 / m(d)
//!
//! With this drag the velocity profile m(d) of a linear shear over a plane wall solves the discrete
//! equations exactly, so that the wall acts at d = 0 wherever the grid lies.
//!
//! Legend: d signed distance, n unit normal, h spacing, eps half-width of the band, m open depth.

use grainwake_simd::Vector;

use crate::immersed::geometry::aperture::open_depth;

/// Drag coefficient over kinematic viscosity [1/m^2] of faces at distances `d` [m] with unit
/// normals `n`, as numerator and positive denominator; very large where a face is closed.
#[inline(always)]
pub fn drag<V: Vector>(d: V, n: [V; 3], spacing: [f64; 3], eps: f64) -> [V; 2] {
    let depth = open_depth(d, eps);
    let twice = depth + depth;
    let mut excess = V::constant(0.0);
    for axis in 0..3 {
        let h = spacing[axis];
        let step = V::constant(h) * n[axis];
        let rise = open_depth(d + step, eps) + open_depth(d - step, eps) - twice;
        excess = rise.mul_add(V::constant(1.0 / (h * h)), excess);
    }
    let least = V::constant(1e-12 * eps);
    [excess.max(V::constant(0.0)), depth.max(least)]
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use grainwake_simd::Scalar;

    use super::*;
    use crate::immersed::geometry::aperture::reference;

    #[test]
    fn a_linear_shear_over_a_plane_wall_is_an_exact_solution() {
        let spacing = DVec3::new(0.5, 0.5, 0.5);
        for n in [DVec3::X, DVec3::new(1.0, 2.0, -2.0) / 3.0] {
            for d in [-0.3, -0.05, 0.0, 0.2, 0.45, 0.7, 2.0] {
                let u = |x: DVec3| reference::open_depth(d + n.dot(x), 0.5);
                let mut laplacian = 0.0;
                for e in [DVec3::X, DVec3::Y, DVec3::Z] {
                    laplacian += (u(0.5 * e) + u(-0.5 * e) - 2.0 * u(DVec3::ZERO)) / 0.25;
                }
                let normal = n.to_array().map(Scalar);
                let [excess, depth] = drag(Scalar(d), normal, spacing.to_array(), 0.5);
                let residual = laplacian - excess.0 / depth.0 * u(DVec3::ZERO);
                assert!(residual.abs() < 1e-12, "{d}: {residual:e}");
            }
        }
    }
}

//! Ellipsoid with its exact Euclidean distance.

use super::sorted;
use crate::assemble::{Body, assemble};
use crate::error::Result;
use crate::provenance::Provenance;
use crate::roundness::Surface;
use crate::{Shape, ShapeOptions};
use glam::DVec3;

/// Builds an ellipsoid with the given semi-axes [m], in any order.
///
/// # Errors
/// A length that is no size of a grain, or options out of their range; the message names it.
pub fn ellipsoid(a: f64, b: f64, c: f64, options: &ShapeOptions) -> Result<Shape> {
    let [a, b, c] = sorted(["a", "b", "c"], [a, b, c])?;
    let axes = DVec3::new(a, b, c);
    let provenance = Provenance::new("analytic")
        .with("body", "ellipsoid")
        .with("a_m", a)
        .with("b_m", b)
        .with("c_m", c);
    let body = Body {
        distance: |x, _: &mut u32| distance(axes, x),
        lower: -axes,
        upper: axes,
        volume: Some(4.0 / 3.0 * std::f64::consts::PI * a * b * c),
        area: None,
        corners: None,
        surface: Surface::Exact,
    };
    assemble(&body, provenance, options)
}

/// Returns the signed distance from `x` to the ellipsoid with semi-axes `axes`, sorted a >= b >= c.
/// The nearest point is the root of a monotone function of one variable (Eberly, Distance from a
/// Point to an Ellipse, an Ellipsoid, or a Hyperellipsoid, 2013), bracketed and bisected.
pub(crate) fn distance(axes: DVec3, x: DVec3) -> f64 {
    let y = x.abs();
    let c = axes.z;
    // In units of the shortest semi-axis; r >= 1 for the others.
    let r = (axes / c) * (axes / c);
    let z = y / axes;
    let level = z.length_squared() - 1.0;
    let sign = if level < 0.0 { -1.0 } else { 1.0 };
    if level == 0.0 {
        return 0.0;
    }
    let nearest = if y.z > 0.0 { foot(axes, y, r, z) } else { foot_in_plane(axes, y) };
    sign * nearest.distance(y)
}

/// Returns the foot of the normal from a point with y.z > 0.
fn foot(axes: DVec3, y: DVec3, r: DVec3, z: DVec3) -> DVec3 {
    let value = |s: f64| (r * z / (DVec3::splat(s) + r)).length_squared() - 1.0;
    let low = z.z - 1.0;
    let s = root(value, low, ((r * z).length() - 1.0).max(low));
    let nearest = r * y / (DVec3::splat(s) + r);
    // Rescale onto the surface: bisection stops one rounding step away from it.
    let length = (nearest / axes).length();
    if length > 0.0 { nearest / length } else { DVec3::new(0.0, 0.0, axes.z) }
}

/// Returns the foot of a point in the plane of the two longer axes, z = 0. Within the focal region
/// the foot leaves that plane.
fn foot_in_plane(axes: DVec3, y: DVec3) -> DVec3 {
    let squares = axes * axes;
    let mut unit = DVec3::ZERO;
    let mut focal = true;
    for i in 0..2 {
        let denominator = squares[i] - squares.z;
        let numerator = axes[i] * y[i];
        if numerator < denominator {
            unit[i] = numerator / denominator;
        } else if numerator > 0.0 || denominator > 0.0 {
            focal = false;
        }
    }
    let rest = 1.0 - unit.length_squared();
    if focal && rest > 0.0 {
        return DVec3::new(axes.x * unit.x, axes.y * unit.y, axes.z * rest.sqrt());
    }
    if y.y > 0.0 {
        // The planar ellipse: the same root with two terms.
        let r = (axes / axes.y) * (axes / axes.y);
        let z = DVec3::new(y.x / axes.x, y.y / axes.y, 0.0);
        let value = |s: f64| (r.x * z.x / (s + r.x)).powi(2) + (z.y / (s + 1.0)).powi(2) - 1.0;
        let s = root(value, z.y - 1.0, (r.x * z.x).hypot(z.y) - 1.0);
        let nearest = DVec3::new(r.x * y.x / (s + r.x), y.y / (s + 1.0), 0.0);
        return nearest / (nearest / axes).length();
    }
    let denominator = squares.x - squares.y;
    let numerator = axes.x * y.x;
    if numerator < denominator {
        let unit = numerator / denominator;
        return DVec3::new(axes.x * unit, axes.y * (1.0 - unit * unit).sqrt(), 0.0);
    }
    DVec3::new(axes.x, 0.0, 0.0)
}

/// Returns the root of a decreasing function between `low` and `high`, by bisection.
fn root(value: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    let mut middle = 0.5 * (low + high);
    for _ in 0..200 {
        middle = 0.5 * (low + high);
        if middle == low || middle == high {
            break;
        }
        if value(middle) > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    middle
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The nearest of densely sampled surface points bounds the distance from above, and the normal
    /// at the foot points at the query point.
    #[test]
    fn distance_agrees_with_brute_force() {
        let axes = DVec3::new(1.5, 1.0, 0.6);
        let mesh = crate::triangles::cube_sphere(160, |u| u * axes);
        let queries = [
            DVec3::ZERO,
            DVec3::X * 0.3,
            DVec3::X * 1.4,
            DVec3::X * 2.0,
            DVec3::Y * 0.5,
            DVec3::Y * 0.95,
            DVec3::Z * 0.2,
            DVec3::Z,
            DVec3::new(0.5, 0.4, 0.0),
            DVec3::new(1.3, 0.3, 0.0),
            DVec3::new(1.3, 0.0, 0.2),
            DVec3::new(0.0, 0.4, 0.3),
            DVec3::new(-1.0, 1.0, -1.0),
        ];
        let spread = (1..60).map(|i| {
            let u = DVec3::new(0.8191725134, 0.6710436067, 0.5497004779) * f64::from(i);
            4.0 * u.fract() - DVec3::splat(2.0)
        });
        for x in queries.into_iter().chain(spread) {
            let brute = mesh.vertices.iter().map(|v| v.distance(x)).fold(f64::INFINITY, f64::min);
            let signed = distance(axes, x);
            assert_eq!(signed < 0.0, (x / axes).length() < 1.0, "at {x}");
            let off = brute - signed.abs();
            assert!((-1e-12..4e-4).contains(&off), "at {x}: {signed} against {brute}");
        }
    }

    #[test]
    fn a_sphere_is_a_special_case() {
        for i in 0..200 {
            let u = DVec3::new(0.8191725134, 0.6710436067, 0.5497004779) * f64::from(i);
            let x = 4.0 * u.fract() - DVec3::splat(2.0);
            let d = distance(DVec3::ONE, x);
            assert!((d - (x.length() - 1.0)).abs() < 1e-12, "at {x}: {d}");
        }
        assert!(
            (distance(DVec3::ONE, DVec3::new(0.3, 0.2, 0.0)) + 1.0 - 0.13f64.sqrt()).abs() < 1e-12
        );
        assert_eq!(distance(DVec3::ONE, DVec3::ZERO), -1.0);
    }
}

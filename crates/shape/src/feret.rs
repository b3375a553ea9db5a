//! Feret (caliper) diameters of a point set.

use crate::nodes::golden_spiral;
use glam::DVec3;

/// Directions sampled for the longest diameter.
const DIRECTIONS: usize = 400;
/// Directions sampled in the plane normal to the longest diameter.
const ACROSS: usize = 90;

/// Returns the longest Feret diameter, the longest perpendicular to it, and the one perpendicular
/// to both, in the unit of the points.
pub(crate) fn lengths(points: &[DVec3]) -> [f64; 3] {
    let spiral = (0..DIRECTIONS).map(|n| golden_spiral(n, (n as f64 + 0.5) / DIRECTIONS as f64));
    let long = longest(points, spiral, |u| u);
    let e = long.any_orthonormal_vector();
    let f = long.cross(e);
    let fan = (0..ACROSS).map(|n| {
        let (s, c) = (std::f64::consts::PI * n as f64 / ACROSS as f64).sin_cos();
        c * e + s * f
    });
    let middle = longest(points, fan, |u| u - long * long.dot(u));
    [long, middle, long.cross(middle)].map(|u| {
        let (low, high) = ends(points, u);
        (high - low).dot(u)
    })
}

/// Returns the first and the last point along `u`.
fn ends(points: &[DVec3], u: DVec3) -> (DVec3, DVec3) {
    let start = (f64::INFINITY, DVec3::ZERO, f64::NEG_INFINITY, DVec3::ZERO);
    let (_, low, _, high) = points.iter().fold(start, |mut best, p| {
        let along = u.dot(*p);
        if along < best.0 {
            (best.0, best.1) = (along, *p);
        }
        if along > best.2 {
            (best.2, best.3) = (along, *p);
        }
        best
    });
    (low, high)
}

/// Returns the direction of the longest diameter: the best of `directions`, then refined along the
/// line between its two extreme points while that increases the diameter.
fn longest(
    points: &[DVec3],
    directions: impl Iterator<Item = DVec3>,
    allowed: impl Fn(DVec3) -> DVec3,
) -> DVec3 {
    let span = |u: DVec3| {
        let (low, high) = ends(points, u);
        ((high - low).dot(u), high - low)
    };
    let mut best = (0.0, DVec3::X, DVec3::X);
    for u in directions {
        let (length, line) = span(u);
        if length > best.0 {
            best = (length, u, line);
        }
    }
    for _ in 0..20 {
        let Some(u) = allowed(best.2).try_normalize() else {
            break;
        };
        let (length, line) = span(u);
        if length <= best.0 {
            break;
        }
        best = (length, u, line);
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;

    #[test]
    fn a_turned_box_is_read_along_its_diagonal() {
        let turn = DQuat::from_scaled_axis(DVec3::new(0.4, -1.3, 0.8));
        let corners: Vec<DVec3> = (0..8)
            .map(|c| {
                let sign = |bit: i32| f64::from(c >> bit & 1) - 0.5;
                turn * DVec3::new(4.0 * sign(0), 2.0 * sign(1), sign(2))
            })
            .collect();
        let [long, middle, short] = lengths(&corners);
        assert!((long - 21f64.sqrt()).abs() < 1e-12);
        // Reference for the largest width perpendicular to the diagonal d, by exhaustive search.
        let d = turn * DVec3::new(4.0, 2.0, 1.0).normalize();
        let (e, f) = (d.any_orthonormal_vector(), d.cross(d.any_orthonormal_vector()));
        let width = |u: DVec3| {
            let (low, high) = ends(&corners, u);
            (high - low).dot(u)
        };
        // The body has four equivalent diagonals; any of them may be found.
        let brute = (0..20_000).map(|n| {
            let (s, c) = (std::f64::consts::PI * f64::from(n) / 20_000.0).sin_cos();
            width(c * e + s * f)
        });
        let best = brute.fold(0.0, f64::max);
        assert!((middle - best).abs() < 1e-6, "{middle} {best}");
        assert!(short < middle && middle < long);
    }
}

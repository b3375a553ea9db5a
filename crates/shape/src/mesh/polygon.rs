//! Triangulation of the polygons of mesh files. All corners are kept, even those on straight edges:
//! neighbouring faces use them.

use super::TriangleMesh;
use crate::error::{Result, ShapeError};
use glam::{DVec2, DVec3};
use std::path::Path;

/// Area of a triangle relative to its polygon below which it counts as degenerate.
const DEGENERATE: f64 = 1e-12;

/// Appends the triangles of a polygon to `mesh`, which has all vertices. `face` is the index of the
/// polygon in the file, from 0.
pub(super) fn push(
    path: &Path,
    mesh: &mut TriangleMesh,
    face: usize,
    corners: &[u32],
) -> Result<()> {
    if corners.len() < 3 {
        let reason = format!("face {face} (counted from 0) has {} corners", corners.len());
        return Err(ShapeError::malformed(path, reason));
    }
    let points = corners.iter().map(|c| mesh.vertices.get(*c as usize).copied());
    let flat = points.collect::<Option<Vec<DVec3>>>().and_then(|points| flatten(&points));
    let triangles = match flat {
        Some(points) => fan(&points).or_else(|| clip_ears(&points)).ok_or_else(|| {
            let reason =
                format!("face {face} (counted from 0) crosses itself; split it into triangles");
            ShapeError::malformed(path, reason)
        })?,
        // Missing vertices and faces without area are reported by the checks of the mesh.
        None => (2..corners.len()).map(|n| [0, n - 1, n]).collect(),
    };
    mesh.triangles.extend(triangles.into_iter().map(|t| t.map(|n| corners[n])));
    Ok(())
}

/// Projects a polygon onto the plane of its area vector and scales it to unit area; `None` without
/// area. It is counterclockwise then.
fn flatten(points: &[DVec3]) -> Option<Vec<DVec2>> {
    let from = points[0];
    let area = points.windows(2).map(|p| (p[0] - from).cross(p[1] - from)).sum::<DVec3>() / 2.0;
    let normal = area.try_normalize()?;
    let (u, v) = normal.any_orthonormal_pair();
    let scale = area.length().sqrt().recip();
    Some(points.iter().map(|p| scale * DVec2::new(u.dot(p - from), v.dot(p - from))).collect())
}

/// Returns the area of a triangle, positive if it is counterclockwise.
fn area([a, b, c]: [DVec2; 3]) -> f64 {
    0.5 * (b - a).perp_dot(c - a)
}

/// Returns the fan about the first corner if all its triangles are counterclockwise, as in a convex
/// polygon.
fn fan(points: &[DVec2]) -> Option<Vec<[usize; 3]>> {
    let fan: Vec<[usize; 3]> = (2..points.len()).map(|n| [0, n - 1, n]).collect();
    fan.iter().all(|t| area(t.map(|n| points[n])) > DEGENERATE).then_some(fan)
}

/// Triangulates a counterclockwise polygon by removing ears, the best-shaped first; `None` if the
/// polygon crosses itself.
fn clip_ears(points: &[DVec2]) -> Option<Vec<[usize; 3]>> {
    let mut ring: Vec<usize> = (0..points.len()).collect();
    let mut shapes: Vec<f64> = (0..ring.len()).map(|n| ear(points, &ring, n)).collect();
    let mut triangles = Vec::with_capacity(points.len() - 2);
    while ring.len() > 3 {
        let best =
            |shapes: &[f64]| (0..shapes.len()).max_by(|p, q| shapes[*p].total_cmp(&shapes[*q]));
        let mut at = best(&shapes)?;
        if shapes[at] == 0.0 {
            // Corners may have become ears by the removal of distant ones.
            shapes = (0..ring.len()).map(|n| ear(points, &ring, n)).collect();
            at = best(&shapes).filter(|at| shapes[*at] > 0.0)?;
        }
        triangles.push(around(&ring, at));
        ring.remove(at);
        shapes.remove(at);
        for n in [at + ring.len() - 1, at].map(|n| n % ring.len()) {
            shapes[n] = ear(points, &ring, n);
        }
    }
    let last = around(&ring, 1);
    triangles.push(last);
    (area(last.map(|n| points[n])) > DEGENERATE).then_some(triangles)
}

/// Returns a corner of the ring between its neighbours.
fn around(ring: &[usize], at: usize) -> [usize; 3] {
    let count = ring.len();
    [at + count - 1, at, at + 1].map(|n| ring[n % count])
}

/// Returns the area of the triangle of a corner and its neighbours over its longest edge squared;
/// 0 if the triangle is no ear: clockwise, or with another corner in it or on its border.
fn ear(points: &[DVec2], ring: &[usize], at: usize) -> f64 {
    let corners = around(ring, at).map(|n| points[n]);
    let size = area(corners);
    if size <= DEGENERATE {
        return 0.0;
    }
    let [a, b, c] = corners;
    let inside = |p: DVec2| {
        !corners.contains(&p)
            && [[a, b, p], [b, c, p], [c, a, p]].into_iter().all(|t| area(t) >= -DEGENERATE)
    };
    if ring.iter().any(|n| inside(points[*n])) {
        return 0.0;
    }
    let longest = [a - b, b - c, c - a].map(DVec2::length_squared).into_iter().fold(0.0, f64::max);
    size / longest
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// Triangulates a polygon in an oblique plane.
    fn triangulate(polygon: &[[f64; 2]]) -> Result<TriangleMesh> {
        let (u, v) = DVec3::new(0.3, -0.5, 0.8).normalize().any_orthonormal_pair();
        let vertices = polygon.iter().map(|[x, y]| *x * u + *y * v + DVec3::splat(7.0)).collect();
        let mut mesh = TriangleMesh { vertices, triangles: Vec::new() };
        let corners: Vec<u32> = (0..polygon.len() as u32).collect();
        push(Path::new("a.ply"), &mut mesh, 4, &corners)?;
        Ok(mesh)
    }

    #[test]
    fn polygons_are_covered_once_from_any_first_corner() {
        let ell = [[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]].map(|p| p.map(f64::from));
        let horseshoe = [[0, 0], [3, 0], [3, 3], [2, 3], [2, 1], [1, 1], [1, 3], [0, 3]];
        // Corners in the middle of straight edges.
        let square = [[0, 0], [1, 0], [2, 0], [2, 1], [2, 2], [1, 2], [0, 2], [0, 1]];
        let star: Vec<[f64; 2]> = (0..40)
            .map(|n| {
                let (radius, angle) = ([2.0, 0.7][n % 2], 0.05 * PI * n as f64);
                [radius * angle.cos(), radius * angle.sin()]
            })
            .collect();
        let star_area = 20.0 * 2.0 * 0.7 * (0.05 * PI).sin();
        for (polygon, exact) in [
            (ell.to_vec(), 3.0),
            (horseshoe.map(|p| p.map(f64::from)).to_vec(), 7.0),
            (square.map(|p| p.map(f64::from)).to_vec(), 4.0),
            (star, star_area),
        ] {
            for first in 0..polygon.len() {
                let mut polygon = polygon.clone();
                polygon.rotate_left(first);
                let mesh = triangulate(&polygon).unwrap();
                assert_eq!(mesh.triangles.len(), polygon.len() - 2);
                // Equal with and without sign: no triangle is turned over, none overlaps.
                assert!((mesh.area() / exact - 1.0).abs() < 1e-5, "{first}: {}", mesh.area());
                let mut used: Vec<u32> = mesh.triangles.iter().flatten().copied().collect();
                used.sort_unstable();
                used.dedup();
                assert_eq!(used.len(), polygon.len());
                let smallest = (0..mesh.triangles.len())
                    .map(|t| {
                        let [a, b, c] = mesh.corners(t);
                        0.5 * (b - a).cross(c - a).length()
                    })
                    .fold(f64::INFINITY, f64::min);
                assert!(smallest > 1e-3, "{first}: {smallest}");
            }
        }
    }

    #[test]
    fn a_crossed_polygon_is_refused_with_its_number() {
        let bow = [[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 1.0]];
        let error = triangulate(&bow).unwrap_err().to_string();
        assert!(error.contains("face 4 (counted from 0) crosses itself; split"), "{error}");
    }
}

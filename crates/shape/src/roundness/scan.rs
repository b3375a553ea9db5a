//! Roundness of scanned grains.
//!
//! Noise perturbs the curvature of a scanned surface: where its radius is about R_in (spheres, the
//! sides of cylinders), half of it would pass for corners. In this method only the parts that a
//! much wider Gaussian classifies as corners count, and only by the curvature along the principal
//! direction of that Gaussian: next to the rim of a cylinder this is the curvature of the rim,
//! without the ripples around the cylinder. Corners that hardly turn the surface count in
//! proportion.
//!
//! Blur, smoothing and the Gaussians widen the remaining corners. Area and turning of the corners
//! are therefore measured with two Gaussians, and the radius is that of the edges for which the
//! forward model ([`super::edge`]) predicts the same values.

use super::CORNER;
use super::band::Band;
use super::edge::{Chain, edges_of};
use super::{Lost, Reading};
use crate::distance::Distance;
use crate::filter::{Kernel, gaussian};
use crate::triangles::TriangleMesh;
use glam::{DMat3, DVec3};
use rayon::prelude::*;
use std::f64::consts::PI;

/// Samples along the radius of the inscribed sphere.
const CELLS: f64 = 12.0;
/// Distance of the level set from the surface [R_in].
const LEVEL: f64 = 0.4;
/// Widths of the Gaussians [R_in].
pub(super) const WIDTHS: [f64; 2] = [0.14, 0.21];
/// Width of the Gaussian that separates corners from noise [R_in].
const COARSE: f64 = 0.4;
/// Upper bound of corner radii at that width [R_in].
const COARSE_CORNER: f64 = 0.98;
/// Turning below which corners count in proportion, relative to the turning of a sphere.
const LEAST_TURN: f64 = 0.05;
/// Clearance [R_in] from the cuts: parts of the level set closer to a cut than to a surface point
/// at this distance from it are excluded, because the wider Gaussian blurs the edge of the cut that
/// far.
const CLEAR: f64 = 0.5;
/// Minimum fraction of the surface that must remain.
const LEAST_LEFT: f64 = 0.25;
/// Width of the last Gaussian, which yields the derivatives between samples [samples].
const LAST: f64 = 1.0;
/// Support of the Gaussian [widths].
const REACH: f64 = 4.0;
/// Subdivisions of a triangle edge for the sums.
const PARTS: usize = 4;

/// Unit normal and Hessian, divided by the gradient length, of a smoothed distance.
type Bend = (DVec3, DMat3);

/// Returns the roundness of a scanned body in the box with the largest inscribed sphere of radius
/// `inscribed`; `image` is the kernel of blur and smoothing [m], and the surroundings of the points
/// `cuts` [m] are excluded. Returns `None` if hardly any surface remains or the grid would be too
/// large.
pub(super) fn measure(
    distance: &dyn Distance,
    [lower, upper]: [DVec3; 2],
    inscribed: f64,
    image: Kernel,
    cuts: &[DVec3],
) -> Option<Reading> {
    let spacing = inscribed / CELLS;
    let reach = spacing * (4.0 * COARSE * CELLS + REACH).ceil();
    // Only the coarse Gaussian extends farther.
    let near = inscribed * REACH * WIDTHS[1];
    let band = Band::whole(distance, lower, upper, spacing, [LEVEL * inscribed, reach, near])?;
    let mesh = band.surface();
    let (natural, left) = natural(&mesh, inscribed, cuts);
    if left < LEAST_LEFT {
        return None;
    }
    let bends = |width: f64| -> Vec<Bend> {
        let before = (width * CELLS).powi(2) - LAST * LAST;
        let smooth = Band { values: gaussian(&band.values, band.dims, before.sqrt()), ..band };
        mesh.vertices
            .par_iter()
            .map(|x| {
                let (gradient, hessian) = smooth.derivatives(*x, LAST, REACH);
                let slope = gradient.length().max(1e-9);
                (gradient / slope, hessian * (inscribed / slope))
            })
            .collect()
    };
    let coarse = bends(COARSE);
    let fine = WIDTHS.map(bends);
    // Area and turning [R_in^2, R_in] for each width.
    let mut totals = [(0.0, 0.0); 2];
    for (face, triangle) in mesh.triangles.iter().enumerate() {
        if triangle.iter().any(|v| !natural[*v as usize]) {
            continue;
        }
        let part = mesh.twice_area(face).length() / (2.0 * (PARTS * PARTS) as f64);
        let part = part / (inscribed * inscribed);
        for weights in parts() {
            let (k1, along) = sharpest(&coarse, triangle, weights);
            if k1 * (COARSE_CORNER + LEVEL) <= 1.0 {
                continue;
            }
            for (fine, (area, turn)) in fine.iter().zip(&mut totals) {
                let [k1, k2] = along_and_across(fine, triangle, weights, along);
                if k1 * (CORNER + LEVEL) <= 1.0 {
                    continue;
                }
                let below = part * (1.0 - LEVEL * k2).max(0.0);
                *area += below * (1.0 - LEVEL * k1);
                *turn += below * k1;
            }
        }
    }
    let (_, turn) = totals[0];
    if totals.iter().any(|(_, turn)| *turn <= 0.0) {
        return Some(Reading::of(1.0));
    }
    // Linear interpolation between the vertices widens the curvatures.
    let interpolated = spread(&mesh) / (inscribed * inscribed);
    let chain = Chain {
        image: image.map(|(weight, deviation)| (weight, deviation / inscribed)),
        level: LEVEL,
        widths: WIDTHS.map(|width| (width * width + interpolated).sqrt()),
        corner: CORNER,
    };
    let radii = totals.map(|(area, turn)| area / turn);
    let edges = edges_of(&chain, radii);
    let least = LEAST_TURN * 4.0 * PI * left;
    let section = chain.section(edges);
    let length = chain.length(edges, &section, turn);
    Some(Reading {
        roundness: 1.0 - (1.0 - edges.radius) * (turn / least).min(1.0),
        lost: Some(Lost {
            area: length * section.shorter * inscribed.powi(2),
            volume: length * section.outside * inscribed.powi(3),
            level: LEVEL * inscribed,
            area_there: mesh.area(),
        }),
    })
}

/// Returns which vertices of the level set are clear of the cuts, and the approximate fraction of
/// the surface that is.
fn natural(mesh: &TriangleMesh, inscribed: f64, cuts: &[DVec3]) -> (Vec<bool>, f64) {
    let near = inscribed * LEVEL.hypot(CLEAR);
    let clear: Vec<bool> = mesh
        .vertices
        .par_iter()
        .map(|x| cuts.iter().all(|cut| x.distance_squared(*cut) > near * near))
        .collect();
    let left = clear.iter().filter(|clear| **clear).count();
    let part = left as f64 / clear.len().max(1) as f64;
    (clear, part)
}

/// Returns the variance [m^2], in any direction, that linear interpolation between the vertices
/// adds: for a triangle 1/24 of the sum of its squared sides.
fn spread(mesh: &TriangleMesh) -> f64 {
    let (mut sum, mut whole) = (0.0, 0.0);
    for face in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(face);
        let area = mesh.twice_area(face).length();
        let sides = a.distance_squared(b) + b.distance_squared(c) + c.distance_squared(a);
        sum += area * sides / 24.0;
        whole += area;
    }
    sum / whole
}

/// Returns unit normal and Hessian at a point in a triangle. The tensor is interpolated instead of
/// its larger curvature, which has a kink where the principal direction changes.
fn between(bends: &[Bend], triangle: &[u32; 3], weights: [f64; 3]) -> Bend {
    let (mut normal, mut hessian) = (DVec3::ZERO, DMat3::ZERO);
    for (v, weight) in triangle.iter().zip(weights) {
        let (n, h) = bends[*v as usize];
        normal += weight * n;
        hessian += h * weight;
    }
    let length = normal.length().max(1e-9);
    (normal / length, hessian * (1.0 / length))
}

/// Returns the larger principal curvature [1/R_in] at a point in a triangle, and its direction.
fn sharpest(bends: &[Bend], triangle: &[u32; 3], weights: [f64; 3]) -> (f64, DVec3) {
    let (normal, hessian) = between(bends, triangle, weights);
    let e = normal.any_orthonormal_vector();
    let f = normal.cross(e);
    let (he, hf) = (hessian * e, hessian * f);
    let (mean, half) = (0.5 * (e.dot(he) + f.dot(hf)), 0.5 * (e.dot(he) - f.dot(hf)));
    let both = e.dot(hf);
    let (sine, cosine) = (0.5 * both.atan2(half)).sin_cos();
    (mean + half.hypot(both), cosine * e + sine * f)
}

/// Returns the curvatures [1/R_in] at a point in a triangle along this direction and across it.
fn along_and_across(
    bends: &[Bend],
    triangle: &[u32; 3],
    weights: [f64; 3],
    along: DVec3,
) -> [f64; 2] {
    let (normal, hessian) = between(bends, triangle, weights);
    let e = (along - normal * normal.dot(along)).normalize_or_zero();
    let f = normal.cross(e);
    [e.dot(hessian * e), f.dot(hessian * f)]
}

/// Returns the barycentric coordinates of the centres of the equal parts of a triangle.
fn parts() -> impl Iterator<Item = [f64; 3]> {
    let n = PARTS as f64;
    (0..PARTS).flat_map(move |i| {
        (0..2 * (PARTS - i) - 1).map(move |m| {
            let third = if m % 2 == 0 { 1.0 } else { 2.0 } / 3.0;
            let (u, v) = ((i as f64 + third) / n, ((m / 2) as f64 + third) / n);
            [1.0 - u - v, u, v]
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHARP: Kernel = [(1.0, 0.0), (0.0, 0.0)];

    fn roundness(body: impl Fn(DVec3) -> f64 + Sync, cuts: &[DVec3]) -> Option<f64> {
        let body = |x: DVec3, _: &mut u32| body(x);
        let bounds = [DVec3::splat(-2.0), DVec3::splat(2.0)];
        measure(&body, bounds, 1.0, SHARP, cuts).map(|reading| reading.roundness)
    }

    /// Points on the unit sphere above this height.
    fn on_sphere(above: f64) -> Vec<DVec3> {
        let places = (0..2000).map(|n| {
            let (z, turn) = (f64::from(n) / 999.5 - 1.0, 2.4 * f64::from(n));
            let across = (1.0 - z * z).max(0.0).sqrt();
            DVec3::new(across * turn.cos(), across * turn.sin(), z)
        });
        places.filter(|x| x.z >= above).collect()
    }

    #[test]
    fn the_edge_of_a_cut_is_no_corner() {
        // Flat beyond two thirds of the height.
        let body = |x: DVec3| {
            let (ball, across) = (x.length() - 1.0, x.truncate().length());
            let rim = (1.0 - 0.66f64 * 0.66).sqrt();
            if x.z > 0.66 && across < rim {
                (x.z - 0.66).max(ball)
            } else if x.z > 0.66 * x.length() {
                f64::hypot(across - rim, x.z - 0.66).copysign(x.z - 0.66)
            } else {
                ball.max(x.z - 0.66)
            }
        };
        let cut: Vec<DVec3> =
            on_sphere(0.66).into_iter().map(|x| DVec3::new(x.x, x.y, 0.66)).collect();
        let (whole, own) = (roundness(body, &[]).unwrap(), roundness(body, &cut).unwrap());
        println!("with the cut {whole:.3}, without {own:.3}");
        assert!(whole < 0.7 && own > 0.98, "{whole}, {own}");
        // Without enough remaining surface the result is `None`.
        assert_eq!(roundness(body, &on_sphere(-0.4)), None);
    }

    /// The side of a cylinder has the curvature of the largest inscribed sphere; its rim is curved
    /// more.
    #[test]
    fn rims_and_edges_have_their_radius() {
        let turn = glam::DQuat::from_scaled_axis(DVec3::new(0.37, 0.81, -0.52));
        for radius in [0.0, 0.2, 0.4, 0.8] {
            let cylinder = |x: DVec3| {
                let x = turn * x;
                let q = glam::DVec2::new(x.truncate().length(), x.z.abs()) - (1.0 - radius);
                q.max(glam::DVec2::ZERO).length() + q.max_element().min(0.0) - radius
            };
            let cube = |x: DVec3| {
                let q = (turn * x).abs() - (1.0 - radius);
                q.max(DVec3::ZERO).length() + q.max_element().min(0.0) - radius
            };
            let found = [roundness(cylinder, &[]), roundness(cube, &[])].map(Option::unwrap);
            println!("{radius}: rim {:.3}, cube {:.3}", found[0], found[1]);
            assert!(found.iter().all(|r| (r - radius).abs() < 0.025), "{found:?}");
        }
    }
}

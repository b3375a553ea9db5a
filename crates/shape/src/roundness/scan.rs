//! Roundness of scanned grains.
//!
//! Noise bends the surface of a scan: where its radius is about R_in anyway (spheres, the sides of
//! cylinders) half of it would pass for corners. There only what a much wider Gaussian sees as
//! corners counts, and only as far as the surface bends in the direction in which that one sees it
//! bend: beside the rim of a cylinder it sees the rim, and ripples around the cylinder are none of it.
//! Corners that hardly turn the surface count in proportion.
//!
//! Blur, smoothing and the Gaussians widen the corners that are left: area and turning of the
//! corners are measured with two Gaussians, and the radius is that of the edges which would be
//! measured so ([`super::edge`]).

use super::CORNER;
use super::band::Band;
use super::edge::{Chain, Kernel, radius_of};
use crate::distance::Distance;
use crate::mesh::TriangleMesh;
use crate::scan::gaussian;
use crate::surface::{Samples, extract};
use glam::{DMat3, DVec3};
use rayon::prelude::*;

/// Samples along the radius of the inscribed sphere.
const CELLS: f64 = 12.0;
/// Distance of the level set from the surface [R_in].
const LEVEL: f64 = 0.4;
/// Widths of the Gaussians [R_in].
pub(super) const WIDTHS: [f64; 2] = [0.14, 0.21];
/// Width of the Gaussian that tells corners from noise [R_in].
const COARSE: f64 = 0.4;
/// Radii below this share of R_in, seen by that Gaussian, are corners.
const COARSE_CORNER: f64 = 0.98;
/// Corners that turn the surface by less than this share of what a sphere turns count in proportion.
const LEAST_TURN: f64 = 0.05;
/// Width of the last of the Gaussians, which gives the derivatives between the samples [samples].
const LAST: f64 = 1.0;
/// Its reach [widths].
const REACH: f64 = 4.0;
/// Parts that an edge of a triangle is cut into for the sums.
const PARTS: usize = 4;

/// Unit normal and second derivatives, by the length of the gradient, of a smoothed distance.
type Bend = (DVec3, DMat3);

/// Roundness of the body in the box with the largest inscribed sphere of radius `inscribed`, whose
/// surface comes from an image that blur and smoothing [m] have gone over; none where the grid would be too large.
pub(super) fn measure(
    distance: &impl Distance,
    lower: DVec3,
    upper: DVec3,
    inscribed: f64,
    image: Kernel,
) -> Option<f64> {
    let spacing = inscribed / CELLS;
    let reach = spacing * (4.0 * COARSE * CELLS + REACH).ceil();
    let band = Band::whole(distance, lower, upper, spacing, [LEVEL * inscribed, reach])?;
    let mesh = extract(&Samples {
        dims: band.dims,
        lower: band.lower,
        spacing,
        values: &band.values,
    });
    let bends = |width: f64| -> Vec<Bend> {
        let before = (width * CELLS).powi(2) - LAST * LAST;
        let smooth = Band {
            values: gaussian(&band.values, band.dims, before.sqrt()),
            ..band
        };
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
    let corners = |width: f64| {
        let fine = bends(width);
        // Area and turning [R_in^2, R_in].
        let (mut area, mut turn) = (0.0, 0.0);
        for (face, triangle) in mesh.triangles.iter().enumerate() {
            let [a, b, c] = mesh.corners(face);
            let part = (b - a).cross(c - a).length() / (2.0 * (PARTS * PARTS) as f64);
            let part = part / (inscribed * inscribed);
            for weights in parts() {
                let (seen, along) = sharpest(&coarse, triangle, weights);
                if seen * (COARSE_CORNER + LEVEL) <= 1.0 {
                    continue;
                }
                let [k1, k2] = along_and_across(&fine, triangle, weights, along);
                if k1 * (CORNER + LEVEL) <= 1.0 {
                    continue;
                }
                let below = part * (1.0 - LEVEL * k2).max(0.0);
                area += below * (1.0 - LEVEL * k1);
                turn += below * k1;
            }
        }
        (area, turn)
    };
    let found = WIDTHS.map(corners);
    let (_, turn) = found[0];
    if found.iter().any(|(_, turn)| *turn <= 0.0) {
        return Some(1.0);
    }
    // Between the vertices the curvatures are interpolated, which widens them.
    let interpolated = spread(&mesh) / (inscribed * inscribed);
    let chain = Chain {
        image: image.map(|(weight, deviation)| (weight, deviation / inscribed)),
        level: LEVEL,
        widths: WIDTHS.map(|width| (width * width + interpolated).sqrt()),
        corner: CORNER,
    };
    let found = found.map(|(area, turn)| area / turn);
    let roundness = radius_of(&chain, found);
    let least = LEAST_TURN * 4.0 * std::f64::consts::PI;
    Some(1.0 - (1.0 - roundness) * (turn / least).min(1.0))
}

/// Variance [m^2], along any one direction, that linear interpolation between the vertices adds to
/// what they carry: in a triangle a 24th of the sum of its squared sides.
fn spread(mesh: &TriangleMesh) -> f64 {
    let (mut sum, mut whole) = (0.0, 0.0);
    for face in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(face);
        let area = (b - a).cross(c - a).length();
        let sides = a.distance_squared(b) + b.distance_squared(c) + c.distance_squared(a);
        sum += area * sides / 24.0;
        whole += area;
    }
    sum / whole
}

/// Unit normal and second derivatives at a place in a triangle. The tensor is interpolated, not
/// its larger curvature: that has a kink where it changes direction.
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

/// The larger principal curvature [1/R_in] at a place in a triangle, and the direction it is along.
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

/// Curvatures [1/R_in] at a place in a triangle along this direction and across it.
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

/// Weights of the corners at the middles of the equal parts of a triangle.
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

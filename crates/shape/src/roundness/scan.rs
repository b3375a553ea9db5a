//! Roundness of scanned grains.
//!
//! Noise bends the surface of a scan: where its radius is about R_in anyway (spheres, the sides of
//! cylinders) half of it would pass for corners. There only what a much wider Gaussian sees as
//! corners counts, and corners that hardly turn the surface count in proportion.
//!
//! Blur, smoothing and the Gaussians widen the corners that are left: area and turning of the
//! corners are measured with two Gaussians, and the radius is that of the edges which would be
//! measured so ([`super::edge`]).

use super::CORNER;
use super::band::{Band, principal};
use super::edge::{Chain, radius_of};
use crate::distance::Distance;
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
/// surface comes from an image that blur and smoothing of the standard deviation `image` [m] have
/// gone over; none where the grid would be too large.
pub(super) fn measure(
    distance: &impl Distance,
    lower: DVec3,
    upper: DVec3,
    inscribed: f64,
    image: f64,
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
                // The tensor is interpolated, not k1: that has a kink where it changes direction.
                let [k1, k2] = between(&fine, triangle, weights);
                if k1 * (CORNER + LEVEL) <= 1.0 {
                    continue;
                }
                let [seen, _] = between(&coarse, triangle, weights);
                if seen * (COARSE_CORNER + LEVEL) <= 1.0 {
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
    let roundness = radius_of([0, 1].map(|n| {
        let chain = Chain {
            image: image / inscribed,
            level: LEVEL,
            width: WIDTHS[n],
            corner: CORNER,
        };
        (chain, found[n].0 / found[n].1)
    }));
    let least = LEAST_TURN * 4.0 * std::f64::consts::PI;
    Some(1.0 - (1.0 - roundness) * (turn / least).min(1.0))
}

/// Principal curvatures [1/R_in], the larger first, at a place in a triangle.
fn between(bends: &[Bend], triangle: &[u32; 3], weights: [f64; 3]) -> [f64; 2] {
    let (mut normal, mut hessian) = (DVec3::ZERO, DMat3::ZERO);
    for (v, weight) in triangle.iter().zip(weights) {
        let (n, h) = bends[*v as usize];
        normal += weight * n;
        hessian += h * weight;
    }
    principal(normal, hessian)
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

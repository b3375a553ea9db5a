//! A random stone of given proportions and roundness.

use super::ball_intersection::{Ball, Core, inscribed};
use crate::mass::Mass;
use crate::nodes::golden_spiral;
use crate::principal;
use crate::random::{Random, direction};
use glam::{DMat3, DVec3};
use rand::{Rng, RngExt};

/// Minimum and maximum number of faces.
const FACES: (u64, u64) = (13, 20);
/// Repulsion iterations that spread the faces; few, so that face sizes vary.
const ROUNDS: usize = 4;
/// Relative variation of the face offsets.
const UNEVEN: f64 = 0.16;
/// Radius of a face relative to its own extent; larger is flatter.
const FLATNESS: f64 = 4.0;
/// Upper bound of twice the bulge height of a face relative to the depth of the stone.
const BULGE: f64 = 0.6;
/// Minimum radius of a face relative to the extent of the stone: its ball must contain the opposite
/// end. The radius exceeds that of the inscribed sphere, so that no face counts as a corner.
const LEAST: f64 = 2.0;
/// Relative tolerance of the proportions.
const CLOSE: f64 = 2e-4;
/// Exponent of the correction; below 1 because the bulges scale with the faces.
const CAUTION: f64 = 0.7;
/// Maximum number of iterations.
const SEARCH: usize = 60;

/// Half-space n . x <= h.
#[derive(Clone, Copy, Debug)]
struct Plane {
    normal: DVec3,
    offset: f64,
}

/// A finished stone in its principal frame, of arbitrary size.
pub(super) struct Stone {
    pub core: Core,
    /// Radius of edges and corners.
    pub radius: f64,
    /// Radius of the largest inscribed sphere.
    pub inscribed: f64,
    pub lower: DVec3,
    pub upper: DVec3,
    pub volume: f64,
    pub faces: usize,
}

/// Generates a stone whose extents along its principal axes have the ratios `shape` = (1, b/a,
/// c/a), or `None` if the iteration does not converge.
pub(super) fn stone(shape: DVec3, roundness: f64, random: &mut Random) -> Option<Stone> {
    let mut planes = faces(random);
    for plane in &mut planes {
        *plane = plane.mapped(DVec3::ZERO, DMat3::IDENTITY, shape);
    }
    for round in 0..SEARCH {
        let built = Built::new(&planes, roundness)?;
        let fine = round > 0 && round % 4 == 0;
        let mass = built.mass(if fine { 24_000 } else { 6_000 });
        let axes = principal::axes(mass.second, mass.volume, |axes| {
            built.third_moments(mass.centroid, axes)
        });
        let reach = |u: DVec3| built.core.support(u) + built.radius;
        let middle = axes.transpose() * mass.centroid;
        let columns = [axes.x_axis, axes.y_axis, axes.z_axis];
        let upper = DVec3::from_array(columns.map(reach)) - middle;
        let lower = -DVec3::from_array(columns.map(|u| reach(-u))) - middle;
        let extent = upper - lower;
        let wrong = extent.x * shape / extent;
        if fine && (wrong - DVec3::ONE).abs().max_element() < CLOSE {
            // The principal frame is known to this accuracy: transform the planes to it.
            let planes: Vec<Plane> =
                planes.iter().map(|p| p.mapped(mass.centroid, axes, DVec3::ONE)).collect();
            let built = Built::new(&planes, roundness)?;
            return Some(Stone {
                faces: built.faces,
                radius: built.radius,
                inscribed: built.inscribed,
                core: built.core,
                lower,
                upper,
                volume: mass.volume,
            });
        }
        for plane in &mut planes {
            *plane = plane.mapped(mass.centroid, axes, wrong.powf(CAUTION));
        }
    }
    None
}

/// Returns planes around the origin with random, slightly repelled directions and varied distances.
fn faces(random: &mut Random) -> Vec<Plane> {
    let count = FACES.0 + random.next_u64() % (FACES.1 - FACES.0 + 1);
    let mut normals: Vec<DVec3> = (0..count).map(|_| direction(random)).collect();
    for _ in 0..ROUNDS {
        let old = normals.clone();
        for (n, normal) in normals.iter_mut().enumerate() {
            let others = old.iter().enumerate().filter(|(m, _)| *m != n);
            let push: DVec3 = others
                .map(|(_, other)| (old[n] - *other) / old[n].distance(*other).max(1e-3).powi(3))
                .sum();
            let push = push - old[n] * push.dot(old[n]);
            *normal = (old[n] + push.clamp_length_max(4.0) * 0.03).normalize();
        }
    }
    let plane = |normal: DVec3| Plane {
        normal,
        offset: 1.0 + UNEVEN * (2.0 * random.random::<f64>() - 1.0),
    };
    normals.into_iter().map(plane).collect()
}

impl Plane {
    /// Transforms the plane to the frame with this origin and axes, then stretches it along the
    /// axes.
    fn mapped(self, origin: DVec3, axes: DMat3, stretch: DVec3) -> Plane {
        let normal = (axes.transpose() * self.normal) / stretch;
        let length = normal.length();
        Plane { normal: normal / length, offset: (self.offset - self.normal.dot(origin)) / length }
    }
}

struct Built {
    core: Core,
    radius: f64,
    inscribed: f64,
    centre: DVec3,
    reach: f64,
    faces: usize,
}

impl Built {
    /// Bulges the faces of the polytope, finds its inscribed sphere, and rounds it.
    fn new(planes: &[Plane], roundness: f64) -> Option<Built> {
        let corners = corners(planes);
        let mut bulged = Vec::new();
        let start = corners.iter().map(|c| c.0).sum::<DVec3>() / corners.len().max(1) as f64;
        let reach = corners.iter().fold(0.0f64, |m, c| m.max(c.0.distance(start)));
        let shallow =
            planes.iter().fold(f64::INFINITY, |m, p| m.min(p.offset - p.normal.dot(start)));
        if shallow <= 0.0 {
            return None;
        }
        for (n, plane) in planes.iter().enumerate() {
            let own: Vec<DVec3> =
                corners.iter().filter(|c| c.1.contains(&n)).map(|c| c.0).collect();
            if own.len() < 3 {
                continue;
            }
            let middle = own.iter().sum::<DVec3>() / own.len() as f64;
            let width = own.iter().fold(0.0f64, |m, c| m.max(c.distance(middle)));
            let radius =
                (FLATNESS * width).max(width * width / (BULGE * shallow)).max(LEAST * reach);
            bulged.push(Ball { centre: middle - radius * plane.normal, radius });
        }
        if bulged.len() < 4 {
            return None;
        }
        let (centre, inscribed) = inscribed(&bulged, start, 2.0 * reach);
        let radius = roundness * inscribed;
        if inscribed <= 0.0 {
            return None;
        }
        let faces = bulged.len();
        for ball in &mut bulged {
            ball.radius -= radius;
        }
        Some(Built {
            core: Core::new(bulged),
            radius,
            inscribed,
            centre,
            reach: 2.0 * reach,
            faces,
        })
    }

    /// Returns the distances of the surface from the centre of the inscribed sphere along `count`
    /// evenly spread directions (a golden spiral).
    fn radii(&self, count: usize) -> impl Iterator<Item = (DVec3, f64)> + '_ {
        (0..count).map(move |n| {
            let u = golden_spiral(n, 1.0 - (2.0 * n as f64 + 1.0) / count as f64);
            // Newton's method from outside: the distance is convex, so the iteration never
            // overshoots.
            let mut t = self.reach;
            for _ in 0..40 {
                let (distance, outward) = self.core.distance(self.centre + t * u);
                let step = (distance - self.radius) / outward.dot(u);
                t -= step;
                if step.abs() < 1e-12 * self.reach {
                    break;
                }
            }
            (u, t)
        })
    }

    fn mass(&self, count: usize) -> Mass {
        let share = 4.0 * std::f64::consts::PI / count as f64;
        let (mut volume, mut first, mut second) = (0.0, DVec3::ZERO, DMat3::ZERO);
        for (u, t) in self.radii(count) {
            volume += share * t.powi(3) / 3.0;
            first += share * t.powi(4) / 4.0 * u;
            second += DMat3::from_cols(u * u.x, u * u.y, u * u.z) * (share * t.powi(5) / 5.0);
        }
        let off = first / volume;
        let outer = DMat3::from_cols(off * off.x, off * off.y, off * off.z);
        Mass { volume, centroid: self.centre + off, second: second - outer * volume }
    }

    /// Returns the integrals of (x . axis)^3 about `origin`. Low accuracy suffices to distinguish
    /// the ends of an axis.
    fn third_moments(&self, origin: DVec3, axes: DMat3) -> DVec3 {
        let count = 2_000;
        let share = 4.0 * std::f64::consts::PI / count as f64;
        let off = axes.transpose() * (self.centre - origin);
        let mut sum = DVec3::ZERO;
        for (u, t) in self.radii(count) {
            let v = axes.transpose() * u;
            let power = |n: i32| t.powi(n + 3) / f64::from(n + 3);
            sum += share
                * (off.powf(3.0) * power(0)
                    + 3.0 * off * off * v * power(1)
                    + 3.0 * off * v * v * power(2)
                    + v * v * v * power(3));
        }
        sum
    }
}

/// Returns the corners of the polytope, each with the three planes that meet in it.
fn corners(planes: &[Plane]) -> Vec<(DVec3, [usize; 3])> {
    let mut corners = Vec::new();
    for i in 0..planes.len() {
        for j in i + 1..planes.len() {
            for k in j + 1..planes.len() {
                let [p, q, r] = [i, j, k].map(|n| planes[n]);
                let rows = DMat3::from_cols(p.normal, q.normal, r.normal).transpose();
                if rows.determinant().abs() < 1e-9 {
                    continue;
                }
                let x = rows.inverse() * DVec3::new(p.offset, q.offset, r.offset);
                let inside = |n: usize| {
                    [i, j, k].contains(&n) || planes[n].normal.dot(x) <= planes[n].offset
                };
                if (0..planes.len()).all(inside) {
                    corners.push((x, [i, j, k]));
                }
            }
        }
    }
    corners
}

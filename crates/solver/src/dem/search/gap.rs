//! Gaps between surfaces, initial overlaps and grains outside the box.

use glam::{DMat3, DVec3, IVec3};
use rayon::prelude::*;

use super::deepest_point::{DescentLimits, minimise_distance};
use super::surface::{PartnerField, SurfacePoint};
use super::{BoundingSphere, BroadPhase, shifts};
use crate::dem::enclosure::{Enclosure, PairKey, Partner, WallFace};
use crate::dem::grain::Grain;

/// Overlap of two grains, or of a grain and a wall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overlap {
    /// First grain.
    pub grain: usize,
    /// Second body; the index of `grain` itself for its own periodic image.
    pub partner: Partner,
    /// Deepest overlap [m], positive.
    pub depth: f64,
}

/// Grain whose surface crosses a face of the box that is not periodic.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outside {
    /// Index of the grain.
    pub grain: usize,
    /// Axis of the face's normal.
    pub axis: usize,
    /// 0 lower, 1 upper.
    pub side: usize,
    /// Largest distance of the surface beyond the face [m].
    pub by: f64,
    /// Whether the centroid is outside.
    pub centroid: bool,
}

/// Gap between the surfaces of two grains of a list, or of a grain and an image of another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gap {
    /// Index of the first grain.
    pub first: usize,
    /// Index of the second grain; that of the first one for its own periodic image.
    pub second: usize,
    /// Distance of the surfaces [m]; negative: overlap.
    pub distance: f64,
    /// Direction in which a shift of the second grain widens the gap fastest, unit vector.
    pub direction: DVec3,
}

/// Point of the grain's surface with the smallest distance in `field`: descent from the closest
/// node. None if it is farther than `limit` [m], or where the gradient of the field vanishes.
fn closest_point(owner: &Grain, field: &PartnerField, limit: f64) -> Option<SurfacePoint> {
    // Every point of the surface is closer to a node than this.
    let nodes = owner.shape.nodes().len() as f64;
    let spacing = 2.0 * (owner.shape.surface_area() / nodes).sqrt();
    let (mut least, mut nearest) = (limit + spacing, None);
    for node in owner.shape.nodes() {
        let distance = field.distance_within(node.position, least.max(0.0));
        // A grain whose pose is not a number has such a distance.
        if distance < least || distance.is_nan() {
            (least, nearest) = (distance, Some(node.position));
        }
    }
    let radius = owner.shape.bounding_radius();
    // Smooth surfaces need only a few steps.
    let limits = DescentLimits { stride: radius, tolerance: 1e-9 * radius, iterations: 40 };
    let start = nearest.and_then(|position| SurfacePoint::at(field, position));
    start.map(|start| minimise_distance(&owner.shape, field, start, limits))
}

/// Smallest distance of the surface of `owner` in the field of `other` [m] (infinite beyond
/// `limit`), and the direction in which a shift of `owner` widens it; `branch` is the vector from
/// the centroid of `owner` to that of `other` [m].
fn one_way_gap(owner: &Grain, other: &Grain, branch: DVec3, limit: f64) -> (f64, DVec3) {
    let to_other = DMat3::from_quat(other.pose.orientation.conjugate());
    let rotation = to_other * DMat3::from_quat(owner.pose.orientation);
    let field = PartnerField::grain(&other.shape, rotation, to_other * -branch);
    closest_point(owner, &field, limit).map_or((f64::INFINITY, DVec3::ZERO), |point| {
        (point.distance, owner.pose.orientation * point.normal)
    })
}

/// Smaller of the gaps of each surface in the field of the other grain [m], and the direction in
/// which a shift of `b` widens it; `branch` is the vector from the centroid of `a` to that of `b`.
/// A gap beyond `limit` [m] may be returned as infinite.
fn two_way_gap(a: &Grain, b: &Grain, branch: DVec3, limit: f64) -> (f64, DVec3) {
    let (of_a, shift_of_a) = one_way_gap(a, b, branch, limit);
    let (of_b, shift_of_b) = one_way_gap(b, a, -branch, limit);
    if of_a < of_b { (of_a, -shift_of_a) } else { (of_b, shift_of_b) }
}

/// Gap between the surfaces of two grains, nearest periodic image [m]; negative: overlap.
///
/// Each surface is tested in the field of the other. The result is exact for spheres; otherwise its
/// error is that of the sampled fields.
pub fn surface_gap(a: &Grain, b: &Grain, enclosure: &Enclosure) -> f64 {
    let period = enclosure.period();
    let branch = b.pose.position - a.pose.position;
    if !branch.is_finite() {
        return f64::INFINITY;
    }
    let nearest = enclosure.nearest_image(branch);
    let radii = a.shape.bounding_radius() + b.shape.bounding_radius();
    // Images beyond the nearest one matter for grains as large as the box.
    let most = IVec3::from_array([0, 1, 2].map(|axis| {
        if period[axis] > 0.0 { (radii / period[axis]).ceil().min(4.0) as i32 + 1 } else { 0 }
    }));
    let mut images: Vec<(f64, DVec3)> = Vec::new();
    for shift in shifts(-most, most) {
        let branch = nearest + shift.as_dvec3() * period;
        images.push((branch.length() - radii, branch));
    }
    images.sort_by(|x, y| x.0.total_cmp(&y.0));
    let mut best = f64::INFINITY;
    for (bound, branch) in images {
        if bound >= best {
            break;
        }
        best = best.min(two_way_gap(a, b, branch, best).0);
    }
    best
}

/// Gap between the grain's surface and a face of the box [m]; negative: the surface crosses it.
fn wall_face_gap(grain: &Grain, face: &WallFace) -> f64 {
    let to_body = grain.pose.orientation.conjugate();
    let offset = face.distance(grain.pose.position);
    let face = PartnerField::HalfSpace { normal: to_body * face.inward, offset };
    closest_point(grain, &face, f64::INFINITY).map_or(f64::INFINITY, |point| point.distance)
}

/// Gap between the grain's surface and the nearest wall [m] (negative: overlap), and that wall.
pub fn wall_gap(grain: &Grain, enclosure: &Enclosure) -> Option<(f64, Partner)> {
    let gaps = enclosure.faces().map(|face| (wall_face_gap(grain, &face), face.partner));
    gaps.min_by(|x, y| x.0.total_cmp(&y.0))
}

/// Pairs of grains, or of a grain and an image of one, whose bounding spheres have a gap of at most
/// `limit` [m], in ascending order.
fn near_images(grains: &[Grain], enclosure: &Enclosure, limit: f64) -> Vec<PairKey> {
    let spheres = grains.iter().map(|grain| BoundingSphere {
        centre: grain.pose.position,
        radius: grain.shape.bounding_radius() + 0.5 * limit,
    });
    let mut broad_phase = BroadPhase::default();
    broad_phase.search(&spheres.collect::<Vec<_>>(), enclosure);
    broad_phase.pairs
}

/// Pairs of different grains whose bounding spheres overlap, images included, in ascending order.
pub fn near_pairs(grains: &[Grain], enclosure: &Enclosure) -> Vec<[usize; 2]> {
    let pairs = near_images(grains, enclosure, 0.0).into_iter();
    let mut pairs: Vec<_> = pairs
        .filter_map(|pair| Some([pair.grain as usize, pair.partner.grain()?]))
        .filter(|[first, second]| first != second)
        .collect();
    pairs.dedup();
    pairs
}

/// Gaps below `limit` [m] of grains to grains and to images of grains, in ascending order of the
/// pairs.
pub fn gaps(grains: &[Grain], enclosure: &Enclosure, limit: f64) -> Vec<Gap> {
    let gaps = near_images(grains, enclosure, limit).into_par_iter().filter_map(|pair| {
        let (first, second) = (pair.grain as usize, pair.partner.grain()?);
        let (a, b) = (&grains[first], &grains[second]);
        let image = IVec3::from_array(pair.image).as_dvec3() * enclosure.period();
        let branch = b.pose.position + image - a.pose.position;
        let (distance, direction) = two_way_gap(a, b, branch, limit);
        (distance < limit).then_some(Gap { first, second, distance, direction })
    });
    gaps.collect()
}

/// All overlaps of grains with grains, with their own images and with walls.
pub fn initial_overlaps(grains: &[Grain], enclosure: &Enclosure) -> Vec<Overlap> {
    let mut found: Vec<Overlap> = Vec::new();
    for gap in gaps(grains, enclosure, 0.0) {
        let (grain, partner, depth) = (gap.first, Partner::Grain(gap.second), -gap.distance);
        match found.last_mut().filter(|last| (last.grain, last.partner) == (grain, partner)) {
            // The deepest of the images counts.
            Some(last) => last.depth = last.depth.max(depth),
            None => found.push(Overlap { grain, partner, depth }),
        }
    }
    for (index, grain) in grains.iter().enumerate() {
        let reach = grain.shape.bounding_radius();
        let near = |face: &WallFace| face.distance(grain.pose.position) <= reach;
        for face in enclosure.faces().filter(near) {
            let depth = -wall_face_gap(grain, &face);
            if depth > 0.0 {
                found.push(Overlap { grain: index, partner: face.partner, depth });
            }
        }
    }
    found.sort_by_key(|overlap| (overlap.grain, overlap.partner));
    found
}

/// Grains whose surface crosses a face of the box that is not periodic.
pub fn outside(grains: &[Grain], enclosure: &Enclosure) -> Vec<Outside> {
    let mut found = Vec::new();
    for (index, grain) in grains.iter().enumerate() {
        for (axis, side) in (0..6).map(|k| (k / 2, k % 2)) {
            let face = enclosure.plane(axis, side);
            let centroid = face.distance(grain.pose.position);
            if enclosure.is_periodic(axis) || centroid > grain.shape.bounding_radius() {
                continue;
            }
            let gap = wall_face_gap(grain, &face);
            // A position that is not a number counts as outside.
            if gap.is_nan() || gap < 0.0 {
                found.push(Outside {
                    grain: index,
                    axis,
                    side,
                    by: -gap,
                    centroid: centroid.is_nan() || centroid < 0.0,
                });
            }
        }
    }
    found
}

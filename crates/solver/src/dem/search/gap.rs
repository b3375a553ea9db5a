//! Gaps between surfaces, initial overlaps and grains outside the box.

use glam::{DMat3, DVec3, IVec3};

use super::deepest_point::{DescentLimits, minimise_distance};
use super::shifts;
use super::surface::{PartnerField, SurfacePoint};
use crate::dem::enclosure::{Enclosure, Partner, WallFace};
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

/// Smallest distance of the grain's surface in `field` [m]: descent from the closest node.
fn smallest_distance(owner: &Grain, field: &PartnerField) -> f64 {
    let mut best: Option<(f64, DVec3)> = None;
    for node in owner.shape.nodes() {
        let distance = field.distance(node.position);
        if best.is_none_or(|(least, _)| distance < least) {
            best = Some((distance, node.position));
        }
    }
    let radius = owner.shape.bounding_radius();
    // Smooth surfaces need only a few steps.
    let limits = DescentLimits { stride: radius, tolerance: 1e-9 * radius, iterations: 40 };
    let start = best.and_then(|(_, position)| SurfacePoint::at(field, position));
    let minimum = start.map(|start| minimise_distance(&owner.shape, field, start, limits));
    minimum.map_or(f64::INFINITY, |point| point.distance)
}

/// Smallest distance of the surface of `owner` in the field of `other` [m]; `branch` is the vector
/// from the centroid of `owner` to that of `other` [m].
fn one_way_gap(owner: &Grain, other: &Grain, branch: DVec3) -> f64 {
    let to_other = DMat3::from_quat(other.pose.orientation.conjugate());
    let rotation = to_other * DMat3::from_quat(owner.pose.orientation);
    smallest_distance(owner, &PartnerField::grain(&other.shape, rotation, to_other * -branch))
}

/// Smallest gap of `a` to the images of `b` other than `skip` [m]; at most `limit` [m].
fn gap_of_images(
    a: &Grain,
    b: &Grain,
    enclosure: &Enclosure,
    skip: Option<IVec3>,
    limit: f64,
) -> f64 {
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
    for shift in shifts(-most, most).filter(|shift| skip != Some(*shift)) {
        let branch = nearest + shift.as_dvec3() * period;
        images.push((branch.length() - radii, branch));
    }
    images.sort_by(|x, y| x.0.total_cmp(&y.0));
    let mut best = limit;
    for (bound, branch) in images {
        if bound >= best {
            break;
        }
        best = best.min(one_way_gap(a, b, branch)).min(one_way_gap(b, a, -branch));
    }
    best
}

/// Gap between the surfaces of two grains, nearest periodic image [m]; negative: overlap.
///
/// Each surface is tested in the field of the other. The result is exact for spheres; otherwise its
/// error is that of the sampled fields.
pub fn surface_gap(a: &Grain, b: &Grain, enclosure: &Enclosure) -> f64 {
    gap_of_images(a, b, enclosure, None, f64::INFINITY)
}

/// Gap between the grain's surface and a face of the box [m]; negative: the surface crosses it.
fn wall_face_gap(grain: &Grain, face: &WallFace) -> f64 {
    let to_body = grain.pose.orientation.conjugate();
    let offset = face.distance(grain.pose.position);
    smallest_distance(grain, &PartnerField::HalfSpace { normal: to_body * face.inward, offset })
}

/// Gap between the grain's surface and the nearest wall [m] (negative: overlap), and that wall.
pub fn wall_gap(grain: &Grain, enclosure: &Enclosure) -> Option<(f64, Partner)> {
    let gaps = enclosure.faces().map(|face| (wall_face_gap(grain, &face), face.partner));
    gaps.min_by(|x, y| x.0.total_cmp(&y.0))
}

/// All overlaps of grains with grains, with their own images and with walls.
pub fn initial_overlaps(grains: &[Grain], enclosure: &Enclosure) -> Vec<Overlap> {
    let mut found = Vec::new();
    let mut add = |grain, partner, gap: f64| {
        if gap < 0.0 {
            found.push(Overlap { grain, partner, depth: -gap });
        }
    };
    for (i, a) in grains.iter().enumerate() {
        for (j, b) in grains.iter().enumerate().skip(i) {
            let skip = (i == j).then_some(IVec3::ZERO);
            add(i, Partner::Grain(j), gap_of_images(a, b, enclosure, skip, 0.0));
        }
        for face in enclosure.faces() {
            if face.distance(a.pose.position) <= a.shape.bounding_radius() {
                add(i, face.partner, wall_face_gap(a, &face));
            }
        }
    }
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

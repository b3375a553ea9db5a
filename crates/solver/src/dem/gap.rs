//! Distances between surfaces, and the input checks that follow from them.

use glam::{DMat3, DVec3, IVec3};

use super::Partner;
use super::deepest::{Probe, slide};
use super::enclosure::{Enclosure, Face};
use super::grain::Grain;
use super::target::Target;

/// Iterations of the search for the closest point; it converges in a few where surfaces are smooth.
const ITERATIONS: usize = 40;
/// The search ends when the closest point moves less than this part of the bounding radius.
const TOLERANCE: f64 = 1e-9;

/// Two grains, or a grain and a wall, that share space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overlap {
    /// First grain.
    pub grain: usize,
    /// What it overlaps (its own periodic image: the same index).
    pub partner: Partner,
    /// Deepest overlap [m], positive.
    pub depth: f64,
}

/// A grain that sticks out of the box through a face that is not periodic, solid or open.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outside {
    /// The grain.
    pub grain: usize,
    /// Axis of the face's normal.
    pub axis: usize,
    /// 0 lower, 1 upper.
    pub side: usize,
    /// How far the surface reaches beyond the face [m].
    pub by: f64,
    /// Whether the centroid is outside as well.
    pub centroid: bool,
}

/// Point of the owner's surface with the smallest distance in `target`: the best node, then slid.
fn closest(owner: &Grain, target: &Target) -> Option<Probe> {
    let nodes = owner.shape.nodes();
    let mut best: Option<(f64, DVec3)> = None;
    for node in nodes {
        let distance = target.distance(node.position);
        if best.is_none_or(|(least, _)| distance < least) {
            best = Some((distance, node.position));
        }
    }
    let radius = owner.shape.bounding_radius();
    let start = Probe::at(target, best?.1)?;
    Some(slide(
        &owner.shape,
        target,
        start,
        radius,
        TOLERANCE * radius,
        ITERATIONS,
    ))
}

/// Distance of the nodes of `owner` from `other`, whose centroid is `apart` from the owner's [m].
fn one_way(owner: &Grain, other: &Grain, apart: DVec3) -> f64 {
    let to_other = DMat3::from_quat(other.pose.orientation.conjugate());
    let turn = to_other * DMat3::from_quat(owner.pose.orientation);
    let target = Target::grain(&other.shape, turn, to_other * -apart);
    closest(owner, &target).map_or(f64::INFINITY, |probe| probe.distance)
}

/// Smallest gap of `a` to the images of `b` other than `skip`, as far as it is under `limit` [m].
fn gap_of_images(
    a: &Grain,
    b: &Grain,
    enclosure: &Enclosure,
    skip: Option<IVec3>,
    limit: f64,
) -> f64 {
    let period = enclosure.period();
    let apart = b.pose.position - a.pose.position;
    if !apart.is_finite() {
        return f64::INFINITY;
    }
    let near = enclosure.nearest_image(apart);
    let radii = a.shape.bounding_radius() + b.shape.bounding_radius();
    // Images beyond the nearest one matter for grains as large as the box.
    let most = [0, 1, 2].map(|axis| {
        if period[axis] > 0.0 {
            (radii / period[axis]).ceil().min(4.0) as i32 + 1
        } else {
            0
        }
    });
    let mut images: Vec<(f64, DVec3)> = Vec::new();
    for k in -most[2]..=most[2] {
        for j in -most[1]..=most[1] {
            for i in -most[0]..=most[0] {
                let shift = IVec3::new(i, j, k);
                if skip != Some(shift) {
                    let apart = near + shift.as_dvec3() * period;
                    images.push((apart.length() - radii, apart));
                }
            }
        }
    }
    images.sort_by(|x, y| x.0.total_cmp(&y.0));
    let mut best = limit;
    for (bound, apart) in images {
        if bound >= best {
            break;
        }
        best = best.min(one_way(a, b, apart)).min(one_way(b, a, -apart));
    }
    best
}

/// Smallest distance between the surfaces of two grains [m] (negative: overlap), nearest periodic image.
///
/// Nodes of each in the field of the other, then slid to the closest point: exact for spheres,
/// otherwise as good as the sampled fields.
pub fn surface_gap(a: &Grain, b: &Grain, enclosure: &Enclosure) -> f64 {
    gap_of_images(a, b, enclosure, None, f64::INFINITY)
}

/// Distance of the grain's surface from a plane [m], negative beyond it.
fn plane_gap(grain: &Grain, face: &Face) -> f64 {
    let to_body = grain.pose.orientation.conjugate();
    let offset = face.distance(grain.pose.position);
    let target = Target::HalfSpace {
        normal: to_body * face.inward,
        offset,
    };
    closest(grain, &target).map_or(f64::INFINITY, |probe| probe.distance)
}

/// Nearest solid face and the distance of the grain's surface from it [m] (negative: overlap).
pub fn wall_gap(grain: &Grain, enclosure: &Enclosure) -> Option<(f64, Partner)> {
    let gaps = enclosure.faces().map(|face| {
        let wall = Partner::Wall {
            axis: face.axis as u8,
            side: face.side as u8,
        };
        (plane_gap(grain, &face), wall)
    });
    gaps.min_by(|x, y| x.0.total_cmp(&y.0))
}

/// Pairs that share space before the start: grain with grain, with its own images, with walls.
pub fn initial_overlaps(grains: &[Grain], enclosure: &Enclosure) -> Vec<Overlap> {
    let mut found = Vec::new();
    for (i, a) in grains.iter().enumerate() {
        for (j, b) in grains.iter().enumerate().skip(i) {
            let skip = (i == j).then_some(IVec3::ZERO);
            let gap = gap_of_images(a, b, enclosure, skip, 0.0);
            if gap < 0.0 {
                found.push(Overlap {
                    grain: i,
                    partner: Partner::Grain(j),
                    depth: -gap,
                });
            }
        }
        for face in enclosure.faces() {
            if face.distance(a.pose.position) > a.shape.bounding_radius() {
                continue;
            }
            let gap = plane_gap(a, &face);
            if gap < 0.0 {
                let partner = Partner::Wall {
                    axis: face.axis as u8,
                    side: face.side as u8,
                };
                found.push(Overlap {
                    grain: i,
                    partner,
                    depth: -gap,
                });
            }
        }
    }
    found
}

/// Grains that stick out of the box, face by face.
pub fn outside(grains: &[Grain], enclosure: &Enclosure) -> Vec<Outside> {
    let mut found = Vec::new();
    for (index, grain) in grains.iter().enumerate() {
        for (axis, side) in (0..6).map(|k| (k / 2, k % 2)) {
            let face = enclosure.plane(axis, side);
            let centroid = face.distance(grain.pose.position);
            if enclosure.is_periodic(axis) || centroid > grain.shape.bounding_radius() {
                continue;
            }
            let gap = plane_gap(grain, &face);
            // A position that is not a number is outside as well.
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

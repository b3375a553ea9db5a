//! Check that grains do not overlap at the start, except as far as the case accepts it.

use glam::{DQuat, DVec3};

use super::arrangement::{LISTED, Placement};
use super::check::Checker;
use crate::case::placement::extent_along;
use crate::case::sphere_cells::ROUNDING;
use crate::number_format::{length, number};
use grainwake_solver::dem::{
    Enclosure, Grain, Overlap, Partner, RelativeOverlap, initial_overlaps, near_pairs,
};

/// Largest overlap that may be one of grains at rest [diameters].
const OF_CONTACT: f64 = 0.05;

/// Reports pairs that overlap by more than `accepted` diameters, at most [`LISTED`] of them.
pub(super) fn check_overlaps(
    check: &mut Checker,
    grains: &[Grain],
    placements: &[Placement],
    enclosure: &Enclosure,
    accepted: f64,
) {
    let of_grains = |o: &Overlap| matches!(o.partner, Partner::Grain(_));
    let relative = |o: &Overlap| RelativeOverlap::of(grains, o.grain, o.partner, o.depth).relative;
    let mut found = overlaps(grains, enclosure);
    found.retain(|o| of_grains(o) && relative(o) > accepted);
    let largest = found.iter().map(relative).fold(0.0, f64::max);
    let help = help(accepted, largest);
    for overlap in found.iter().take(LISTED) {
        report(check, placements, overlap, &help);
    }
    let more = found.len().saturating_sub(LISTED);
    let deepest = found.iter().max_by(|a, b| a.depth.total_cmp(&b.depth));
    if let (1.., Some(deepest)) = (more, deepest) {
        let message = format!(
            "{more} more pairs overlap at the start; the deepest overlap of all, by {}, is that of {}",
            length(deepest.depth),
            names(deepest)
        );
        check.fail(&placements[deepest.grain].span, message, help);
    }
}

/// Returns the advice for overlaps of which the largest has `largest` diameters.
fn help(accepted: f64, largest: f64) -> String {
    let apart = "move them apart; contact begins with grains that do not touch";
    // Rounded up to two digits.
    let scale = 10f64.powf(largest.max(1e-9).log10().floor() - 1.0);
    let enough = number((largest / scale).ceil() * scale);
    match (accepted > 0.0, largest <= OF_CONTACT) {
        (true, true) => format!("move them apart, or raise accept_overlap to {enough}"),
        (true, false) => "move them apart: the overlap is far larger than that of a contact".into(),
        (false, true) => format!(
            "{apart}. For grains that have settled, [contact] accept_overlap = {enough} accepts these overlaps as contacts"
        ),
        (false, false) => apart.into(),
    }
}

fn names(overlap: &Overlap) -> String {
    match overlap.partner {
        Partner::Grain(j) if j == overlap.grain => format!("grain {j} and its image"),
        Partner::Grain(j) => {
            format!("grains {} and {}", overlap.grain.min(j), overlap.grain.max(j))
        }
        Partner::Wall { .. } => format!("grain {} and a wall", overlap.grain),
    }
}

fn report(check: &mut Checker, placements: &[Placement], overlap: &Overlap, help: &str) {
    let i = overlap.grain;
    let Partner::Grain(j) = overlap.partner else {
        return;
    };
    let depth = length(overlap.depth);
    if i == j {
        let message =
            format!("grain {i} touches its own image across the periodic box (by {depth})");
        let help = "make the box larger or the grain smaller";
        check.fail(&placements[i].span, message, help);
        return;
    }
    let (first, second) = (i.min(j), i.max(j));
    let message = format!("grains {first} and {second} overlap at the start by {depth}");
    let moved =
        if placements[first].overridden && !placements[second].overridden { first } else { second };
    check.fail(&placements[moved].span, message, help);
}

/// Returns the pairs that overlap, by the distance of the contact model. Depths within rounding do
/// not count.
///
/// The distance of the surfaces is no measure of the overlap if a grain contains the centre of
/// another, and vanishes for two equal grains at one place; [`nested`] replaces it.
fn overlaps(grains: &[Grain], enclosure: &Enclosure) -> Vec<Overlap> {
    let mut found = initial_overlaps(grains, enclosure);
    found.retain(|o| o.depth > ROUNDING * grains[o.grain].shape.bounding_radius());
    let solid: Vec<DVec3> = grains.iter().map(solid_point).collect();
    for [i, j] in near_pairs(grains, enclosure) {
        let Some(depth) = nested([&grains[i], &grains[j]], [solid[i], solid[j]], enclosure) else {
            continue;
        };
        let partner = Partner::Grain(j);
        match found.iter_mut().find(|o| o.grain == i && o.partner == partner) {
            Some(overlap) => overlap.depth = overlap.depth.max(depth),
            None => found.push(Overlap { grain: i, partner, depth }),
        }
    }
    found
}

/// Returns a point inside the solid, relative to the centroid, space frame [m]: the centroid, or
/// for rings and bowls a point below a surface node.
fn solid_point(grain: &Grain) -> DVec3 {
    let shape = &grain.shape;
    let below = |depth: f64| {
        let node = shape.nodes().first()?.position;
        let (_, outward) = shape.distance_and_gradient(node);
        Some(node - depth * outward.normalize_or_zero())
    };
    let depths = (1..8).map(|halving| 0.5 * shape.equivalent_diameter() / f64::from(1 << halving));
    let candidates = std::iter::once(DVec3::ZERO).chain(depths.filter_map(below));
    let inside = candidates.into_iter().find(|x| shape.distance(*x) < 0.0);
    grain.pose.orientation * inside.unwrap_or(DVec3::ZERO)
}

/// Returns the depth of two grains of which one contains a solid point of the other [m]. If the
/// points are the centres, it is the shortest separating displacement along the line of centres or
/// an axis, exact for spheres.
fn nested(grains: [&Grain; 2], solid: [DVec3; 2], enclosure: &Enclosure) -> Option<f64> {
    let [a, b] = grains;
    let line = enclosure.nearest_image(b.pose.position - a.pose.position);
    if line.length() >= a.shape.bounding_radius() + b.shape.bounding_radius() {
        return None;
    }
    let depth_at = |grain: &Grain, x: DVec3| {
        let inside = x.length() < grain.shape.bounding_radius();
        let depth = -grain.shape.distance(grain.pose.orientation.conjugate() * x);
        Some(depth).filter(|depth| inside && *depth > 0.0)
    };
    let in_a = depth_at(a, line + solid[1]).zip(depth_at(b, solid[1]));
    let in_b = depth_at(b, solid[0] - line).zip(depth_at(a, solid[0]));
    let (first, second) = in_a.or(in_b)?;
    if solid != [DVec3::ZERO; 2] {
        return Some(first.min(second));
    }
    let axes = DVec3::AXES.into_iter().flat_map(|axis| [axis, -axis]);
    let move_along = |way: DVec3| extent(a, way) + extent(b, -way) - line.dot(way);
    axes.chain(line.try_normalize()).map(move_along).reduce(f64::min)
}

/// Returns the extent of the grain from its centre in a direction [m].
fn extent(grain: &Grain, direction: DVec3) -> f64 {
    let mut turned = grain.clone();
    turned.pose.position = DVec3::ZERO;
    turned.pose.orientation =
        DQuat::from_rotation_arc(direction, DVec3::Z) * grain.pose.orientation;
    extent_along(&turned, 2).1
}

//! Check that grains lie in the box and do not overlap.

use glam::{DQuat, DVec3};

use super::check::Checker;
use crate::case::located::{Located, Span};
use crate::case::number_format::{AXES, SIDES, length};
use crate::case::packing::ROUNDING;
use crate::case::placement::extent_along;
use crate::case::raw::RawGrain;
use grainwake_solver::dem::{
    Enclosure, Grain, Outside, Overlap, Partner, initial_overlaps, outside,
};
use grainwake_solver::flow::{Boundaries, Boundary};

/// Coordinates and sizes of more box lengths than this suggest a forgotten unit.
const FAR: f64 = 10.0;
const FORGOTTEN: &str = "; was a unit forgotten? bare numbers are metres";

/// Positions in the source that place a grain and set its size.
pub(super) struct Placement {
    span: Span,
    /// Whether an override has set the placement.
    overridden: bool,
    /// Keys of the three coordinates.
    coordinates: [String; 3],
    size: Span,
}

impl Placement {
    /// Returns the placement of a `[[grain]]`; gaps are measured along the axis `vertical`.
    pub fn of(check: &Checker, grain: &Located<RawGrain>, vertical: usize) -> Placement {
        let above = grain.gap_above.as_ref();
        let written = [
            grain.position.as_ref().map(|position| &position.span),
            above.map(|above| &above.span),
            above.map(|above| &above.gap.span),
        ];
        let mut written = written.into_iter().flatten();
        let first = written.clone().next().unwrap_or(&grain.span);
        let changed = written.find(|span| check.is_overridden(span));
        let position = (grain.position.as_ref()).map_or("", |given| check.key(&given.span));
        let mut horizontal = 0..2;
        let coordinates = [0, 1, 2].map(|axis| match above {
            None => format!("{position}.{axis}"),
            Some(above) if axis == vertical => check.key(&above.gap.span).to_owned(),
            Some(_) => format!("{position}.{}", horizontal.next().unwrap_or(1)),
        });
        let size = match (&grain.equivalent_diameter, &grain.shape, &grain.file) {
            (Some(diameter), ..) => &diameter.span,
            (None, Some(shape), _) => &shape.span,
            (None, None, Some(file)) => &file.span,
            (None, None, None) => &grain.span,
        };
        Placement {
            span: changed.unwrap_or(first).clone(),
            overridden: changed.is_some(),
            coordinates,
            size: size.clone(),
        }
    }

    /// Returns the placement of a grain of the `[[packing]]` at `span`.
    pub fn packed(check: &Checker, span: &Span) -> Placement {
        Placement {
            span: span.clone(),
            overridden: false,
            coordinates: [0, 1, 2].map(|_| check.key(span).to_owned()),
            size: span.clone(),
        }
    }

    /// Returns a request for a unit if a coordinate without one lies far outside the box.
    fn forgotten_unit(&self, check: &Checker, grain: &Grain, enclosure: &Enclosure) -> &str {
        let x = grain.pose.position;
        let away = (enclosure.lower - x).max(x - enclosure.upper);
        let far = |axis: usize| away[axis] > FAR * enclosure.size()[axis];
        if (0..3).any(|axis| far(axis) && check.is_bare(&self.coordinates[axis])) {
            FORGOTTEN
        } else {
            ""
        }
    }
}

/// Reports grains that overlap or cross a side of the box other than a free surface.
pub(super) fn check(
    check: &mut Checker,
    grains: &[Grain],
    placements: &[Placement],
    enclosure: &Enclosure,
    boundaries: &Boundaries,
) {
    if grains.iter().all(|grain| grain.pose.position.is_finite()) {
        check_faces(check, grains, placements, enclosure, boundaries);
        check_overlaps(check, grains, placements, enclosure);
    }
}

fn check_faces(
    check: &mut Checker,
    grains: &[Grain],
    placements: &[Placement],
    enclosure: &Enclosure,
    boundaries: &Boundaries,
) {
    let mut reported = vec![false; grains.len()];
    let rounding = |o: &Outside| o.by <= ROUNDING * grains[o.grain].shape.bounding_radius();
    let floats = |o: &Outside| boundaries.0[o.axis][o.side] == Boundary::FreeSurface;
    for o in outside(grains, enclosure).into_iter().filter(|o| !rounding(o) && !floats(o)) {
        if std::mem::replace(&mut reported[o.grain], true) {
            continue;
        }
        let (grain, placement) = (&grains[o.grain], &placements[o.grain]);
        if let Some((axis, extent)) = too_large(grain, enclosure) {
            report_too_large(check, o.grain, &placement.size, enclosure, axis, extent);
            continue;
        }
        let face = [enclosure.lower, enclosure.upper][o.side][o.axis];
        let (by, axis, side) = (millimetres(o.by), AXES[o.axis], SIDES[o.side]);
        let what = if o.centroid { "lies outside the box" } else { "crosses a face of the box" };
        let message = format!(
            "grain {} {what}: it reaches {by} beyond the {side} {axis} face (at {})",
            o.grain,
            length(face)
        );
        let help = format!(
            "move it by at least {by} along {}{axis}, or make the box larger{}",
            ["", "-"][o.side],
            placement.forgotten_unit(check, grain, enclosure)
        );
        check.fail(&placement.span, message, help);
    }
    for (i, (grain, placement)) in grains.iter().zip(placements).enumerate() {
        for axis in (0..3).filter(|axis| enclosure.periodic[*axis]) {
            let x = grain.pose.position[axis];
            let (lower, upper) = (enclosure.lower[axis], enclosure.upper[axis]);
            if !(lower..=upper).contains(&x) {
                let message = format!(
                    "grain {i} lies outside the box: {} = {}, the box goes from {} to {}",
                    AXES[axis],
                    length(x),
                    length(lower),
                    length(upper)
                );
                let help = format!(
                    "move it into the box (the axis is periodic){}",
                    placement.forgotten_unit(check, grain, enclosure)
                );
                check.fail(&placement.span, message, help);
            }
        }
    }
}

/// Returns the first non-periodic axis along which the grain exceeds the box, and its extent [m].
fn too_large(grain: &Grain, enclosure: &Enclosure) -> Option<(usize, f64)> {
    let extent = |axis: usize| {
        let (lower, upper) = extent_along(grain, axis);
        (axis, upper - lower)
    };
    let axes = (0..3).filter(|axis| !enclosure.is_periodic(*axis));
    axes.map(extent).find(|(axis, extent)| *extent > enclosure.size()[*axis])
}

fn report_too_large(
    check: &mut Checker,
    index: usize,
    size: &Span,
    enclosure: &Enclosure,
    axis: usize,
    extent: f64,
) {
    let available = enclosure.size()[axis];
    let unit =
        if extent > FAR * available && check.is_bare(check.key(size)) { FORGOTTEN } else { "" };
    let message = format!(
        "grain {index} is larger than the box: {} along {}, the box has {}",
        length(extent),
        AXES[axis],
        length(available)
    );
    let help = format!("scale it with equivalent_diameter, or make the box larger{unit}");
    check.fail(size, message, help);
}

fn check_overlaps(
    check: &mut Checker,
    grains: &[Grain],
    placements: &[Placement],
    enclosure: &Enclosure,
) {
    for overlap in overlaps(grains, enclosure) {
        let i = overlap.grain;
        let Partner::Grain(j) = overlap.partner else {
            continue;
        };
        let depth = millimetres(overlap.depth);
        if i == j {
            let message =
                format!("grain {i} touches its own image across the periodic box (by {depth})");
            let help = "make the box larger or the grain smaller";
            check.fail(&placements[i].span, message, help);
            continue;
        }
        let (first, second) = (i.min(j), i.max(j));
        let message = format!("grains {first} and {second} overlap at the start by {depth}");
        let help = "move them apart; contact begins with grains that do not touch";
        let moved = if placements[first].overridden && !placements[second].overridden {
            first
        } else {
            second
        };
        check.fail(&placements[moved].span, message, help);
    }
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
    for (i, a) in grains.iter().enumerate() {
        for (j, b) in grains.iter().enumerate().skip(i + 1) {
            let Some(depth) = nested([a, b], [solid[i], solid[j]], enclosure) else {
                continue;
            };
            let partner = Partner::Grain(j);
            match found.iter_mut().find(|o| o.grain == i && o.partner == partner) {
                Some(overlap) => overlap.depth = overlap.depth.max(depth),
                None => found.push(Overlap { grain: i, partner, depth }),
            }
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

/// Formats a length [m] in millimetres if it is below one metre.
fn millimetres(x: f64) -> String {
    if x.abs() < 1.0 { format!("{:.4} mm", 1e3 * x) } else { length(x) }
}

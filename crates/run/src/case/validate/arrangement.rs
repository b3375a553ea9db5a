//! Check that grains lie in the box and do not overlap.

use super::check::Checker;
use crate::case::located::{Located, Span};
use crate::case::placement::extent_along;
use crate::case::raw::RawGrain;
use crate::case::sphere_cells::ROUNDING;
use crate::number_format::{AXES, SIDES, length};
use grainwake_solver::dem::{Enclosure, Grain, Outside, outside};
use grainwake_solver::flow::{Boundaries, Boundary};

/// Coordinates and sizes of more box lengths than this suggest a forgotten unit.
const FAR: f64 = 10.0;
const FORGOTTEN: &str = "; was a unit forgotten? bare numbers are metres";

/// Number of problems of one kind that are listed.
pub(super) const LISTED: usize = 10;

/// Positions in the source that place a grain and set its size.
pub(super) struct Placement {
    pub span: Span,
    /// Whether an override has set the placement.
    pub overridden: bool,
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

/// Reports free grains that start out of the plane of a flow that has one cell along `normal`.
pub(super) fn check_plane(
    check: &mut Checker,
    grains: &[Grain],
    placements: &[Placement],
    normal: usize,
) {
    let name = AXES[normal];
    let leaving = grains.iter().zip(placements).enumerate();
    for (i, (_, at)) in leaving.filter(|(_, (grain, _))| grain.leaves_plane(normal)).take(LISTED) {
        let message = format!(
            "grain {i} starts out of the plane of the flow, which has one cell along {name}"
        );
        let help = format!(
            "accepted: no velocity along {name}, and no angular velocity about the other axes; or prescribe them with motion"
        );
        check.fail(&at.span, message, help);
    }
}

/// Reports grains that cross a side of the box other than a free surface. Overlaps with a wall up
/// to `accepted` diameters are contacts.
pub(super) fn check_faces(
    check: &mut Checker,
    grains: &[Grain],
    placements: &[Placement],
    enclosure: &Enclosure,
    boundaries: &Boundaries,
    accepted: f64,
) {
    let rounding = |o: &Outside| o.by <= ROUNDING * grains[o.grain].shape.bounding_radius();
    let floats = |o: &Outside| boundaries.0[o.axis][o.side] == Boundary::FreeSurface;
    let touches = |o: &Outside| {
        let diameter = grains[o.grain].shape.equivalent_diameter();
        boundaries.0[o.axis][o.side].is_solid() && o.by <= accepted * diameter
    };
    let mut found = outside(grains, enclosure);
    found.retain(|o| !rounding(o) && !floats(o) && !touches(o));
    // The first face of a grain is reported.
    found.dedup_by_key(|o| o.grain);
    for o in found.iter().take(LISTED) {
        let (grain, placement) = (&grains[o.grain], &placements[o.grain]);
        if let Some((axis, extent)) = too_large(grain, enclosure) {
            report_too_large(check, o.grain, &placement.size, enclosure, axis, extent);
            continue;
        }
        let face = [enclosure.lower, enclosure.upper][o.side][o.axis];
        let (by, axis, side) = (length(o.by), AXES[o.axis], SIDES[o.side]);
        let what = if o.centroid { "lies outside the box" } else { "crosses a side of the box" };
        let message = format!(
            "grain {} {what}: it reaches {by} beyond the {side} {axis} side (at {})",
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
    if found.len() > LISTED {
        let message = format!("{} more grains cross a side of the box", found.len() - LISTED);
        let help = "move the grains, or make the box larger";
        check.fail(&placements[found[LISTED].grain].span, message, help);
    }
    check_periodic(check, grains, placements, enclosure);
}

/// Reports grains that reach a free surface at the start, where the grid cannot be refined.
pub(super) fn check_refined(
    check: &mut Checker,
    grains: &[Grain],
    placements: &[Placement],
    enclosure: &Enclosure,
    boundaries: &Boundaries,
) {
    let floats = |o: &Outside| boundaries.0[o.axis][o.side] == Boundary::FreeSurface;
    for o in outside(grains, enclosure).iter().filter(|o| floats(o)).take(LISTED) {
        let message = format!(
            "grain {} reaches {} beyond the free surface, where the grid cannot be refined",
            o.grain,
            length(o.by)
        );
        let help = "start it below the surface, or leave out [domain] refinement";
        check.fail(&placements[o.grain].span, message, help);
    }
}

/// Reports grains outside the box along a periodic axis.
fn check_periodic(
    check: &mut Checker,
    grains: &[Grain],
    placements: &[Placement],
    enclosure: &Enclosure,
) {
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

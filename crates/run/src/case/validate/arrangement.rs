//! Grains must stand in the box and clear of each other.

use std::ops::Range;

use glam::{DQuat, DVec3};

use super::check::Checker;
use crate::case::loc::Loc;
use crate::case::placement::reach;
use crate::case::raw::RawGrain;
use crate::case::readable::length;
use grainwake_solver::dem::{Enclosure, Grain, Overlap, Partner, initial_overlaps, outside};

const AXES: [&str; 3] = ["x", "y", "z"];
/// A coordinate or size of more box lengths than this is taken for a forgotten unit.
const FAR: f64 = 10.0;
const FORGOTTEN: &str = "; was a unit forgotten? bare numbers are metres";

/// Where the file says where a grain stands and how large it is.
pub(super) struct Site {
    key: String,
    span: Option<Range<usize>>,
    /// Whether an override has set it.
    overridden: bool,
    /// Keys of the three coordinates.
    coordinates: [String; 3],
    size: (String, Option<Range<usize>>),
}

impl Site {
    /// The site of a `[[grain]]`; gaps are measured along the axis `vertical`.
    pub fn of(check: &Checker, grain: &Loc<RawGrain>, index: usize, vertical: usize) -> Site {
        let key = |name: &str| format!("grain.{index}.{name}");
        let overridden =
            |span: &Option<Range<usize>>| span.as_ref().is_some_and(|s| check.is_overridden(s));
        let above = grain.gap_above.as_ref();
        let written = [
            grain.position.as_ref().map(|p| ("position", &p.span)),
            above.map(|above| ("gap_above", &above.span)),
            above.map(|above| ("gap_above.gap", &above.gap.span)),
        ];
        let mut written = written.into_iter().flatten();
        let first = written.clone().next().unwrap_or(("position", &grain.span));
        let changed = written.find(|(_, span)| overridden(span));
        let (name, span) = changed.unwrap_or(first);
        let mut horizontal = 0;
        let coordinates = [0, 1, 2].map(|axis| {
            if above.is_none() {
                return key(&format!("position.{axis}"));
            }
            if axis == vertical {
                return key("gap_above.gap");
            }
            horizontal += 1;
            key(&format!("position.{}", horizontal - 1))
        });
        let size = match (&grain.equivalent_diameter, &grain.shape, &grain.file) {
            (Some(diameter), ..) => ("equivalent_diameter", &diameter.span),
            (None, Some(shape), _) => ("shape", &shape.span),
            (None, None, Some(file)) => ("file", &file.span),
            (None, None, None) => ("shape", &grain.span),
        };
        Site {
            key: key(name),
            span: span.clone(),
            overridden: changed.is_some(),
            coordinates,
            size: (key(size.0), size.1.clone()),
        }
    }

    /// The site of a grain of a `[[packing]]`.
    pub fn packed(span: Option<&Range<usize>>, index: usize) -> Site {
        let key = format!("packing.{index}");
        Site {
            span: span.cloned(),
            overridden: false,
            coordinates: [0, 1, 2].map(|_| key.clone()),
            size: (key.clone(), span.cloned()),
            key,
        }
    }

    fn fail(&self, check: &mut Checker, message: String, help: String) {
        check.fail(self.span.as_ref(), &self.key, message, help);
    }
}

/// Grains must stand in the box and clear of each other.
pub(super) fn check(check: &mut Checker, grains: &[Grain], sites: &[Site], enclosure: &Enclosure) {
    let finite = |g: &Grain| g.pose.position.is_finite();
    if !grains.iter().all(finite) {
        return;
    }
    in_the_box(check, grains, sites, enclosure);
    apart(check, grains, sites, enclosure);
}

fn in_the_box(check: &mut Checker, grains: &[Grain], sites: &[Site], enclosure: &Enclosure) {
    let mut told = vec![false; grains.len()];
    for o in outside(grains, enclosure) {
        if std::mem::replace(&mut told[o.grain], true) {
            continue;
        }
        let (grain, site) = (&grains[o.grain], &sites[o.grain]);
        if let Some((axis, extent)) = too_large(grain, enclosure) {
            larger_than_the_box(check, o.grain, site, enclosure, axis, extent);
            continue;
        }
        let (side, face) = (
            ["lower", "upper"][o.side],
            [enclosure.lower, enclosure.upper][o.side][o.axis],
        );
        let what = if o.centroid {
            "lies outside the box"
        } else {
            "crosses a face of the box"
        };
        let message = format!(
            "grain {} {what}: it reaches {} beyond the {side} {} face (at {})",
            o.grain,
            millimetres(o.by),
            AXES[o.axis],
            length(face)
        );
        let help = format!(
            "move it by at least {} along {}{}, or make the box larger{}",
            millimetres(o.by),
            ["", "-"][o.side],
            AXES[o.axis],
            forgotten(check, grain, site, enclosure)
        );
        site.fail(check, message, help);
    }
    for (i, (grain, site)) in grains.iter().zip(sites).enumerate() {
        for (axis, name) in AXES.into_iter().enumerate() {
            let (x, lower, upper) = (
                grain.pose.position[axis],
                enclosure.lower[axis],
                enclosure.upper[axis],
            );
            if enclosure.periodic[axis] && !(lower..=upper).contains(&x) {
                let message = format!(
                    "grain {i} lies outside the box: {name} = {}, the box goes from {} to {}",
                    length(x),
                    length(lower),
                    length(upper)
                );
                let help = format!(
                    "move it into the box (the axis is periodic){}",
                    forgotten(check, grain, site, enclosure)
                );
                site.fail(check, message, help);
            }
        }
    }
}

/// The first axis with faces along which the grain does not fit into the box, and its extent there [m].
fn too_large(grain: &Grain, enclosure: &Enclosure) -> Option<(usize, f64)> {
    let extent = |axis: usize| {
        let (lower, upper) = reach(grain, axis);
        upper - lower
    };
    let faces = (0..3).filter(|axis| !enclosure.is_periodic(*axis));
    faces
        .map(|axis| (axis, extent(axis)))
        .find(|(axis, extent)| *extent > enclosure.size()[*axis])
}

/// No move helps a grain that does not fit.
fn larger_than_the_box(
    check: &mut Checker,
    index: usize,
    site: &Site,
    enclosure: &Enclosure,
    axis: usize,
    extent: f64,
) {
    let room = enclosure.size()[axis];
    let (key, span) = &site.size;
    let unit = if extent > FAR * room && check.is_bare(key) {
        FORGOTTEN
    } else {
        ""
    };
    check.fail(
        span.as_ref(),
        key,
        format!(
            "grain {index} is larger than the box: {} along {}, the box has {}",
            length(extent),
            AXES[axis],
            length(room)
        ),
        format!("scale it with equivalent_diameter, or make the box larger{unit}"),
    );
}

/// Asks for a unit where a coordinate without one lies far outside the box.
fn forgotten(check: &Checker, grain: &Grain, site: &Site, enclosure: &Enclosure) -> &'static str {
    let x = grain.pose.position;
    let away = (enclosure.lower - x).max(x - enclosure.upper);
    let far = |axis: usize| away[axis] > FAR * enclosure.size()[axis];
    if (0..3).any(|axis| far(axis) && check.is_bare(&site.coordinates[axis])) {
        FORGOTTEN
    } else {
        ""
    }
}

fn apart(check: &mut Checker, grains: &[Grain], sites: &[Site], enclosure: &Enclosure) {
    for overlap in overlaps(grains, enclosure) {
        let i = overlap.grain;
        let Partner::Grain(j) = overlap.partner else {
            continue;
        };
        if i == j {
            let message = format!(
                "grain {i} touches its own image across the periodic box (by {})",
                millimetres(overlap.depth)
            );
            let help = "make the box larger or the grain smaller".to_string();
            sites[i].fail(check, message, help);
            continue;
        }
        let (first, second) = (i.min(j), i.max(j));
        let message = format!(
            "grains {first} and {second} overlap at the start by {}",
            millimetres(overlap.depth)
        );
        let help = "move them apart; contact begins with grains that do not touch".to_string();
        let to_blame = if sites[first].overridden && !sites[second].overridden {
            first
        } else {
            second
        };
        sites[to_blame].fail(check, message, help);
    }
}

/// Pairs that share space. Where the centre of one grain lies in the other, the depth of surface
/// points says little, and nothing where both surfaces are the same.
fn overlaps(grains: &[Grain], enclosure: &Enclosure) -> Vec<Overlap> {
    let mut found = initial_overlaps(grains, enclosure);
    for (i, a) in grains.iter().enumerate() {
        for (j, b) in grains.iter().enumerate().skip(i + 1) {
            let Some(depth) = nested(a, b, enclosure) else {
                continue;
            };
            let partner = Partner::Grain(j);
            match found
                .iter_mut()
                .find(|o| o.grain == i && o.partner == partner)
            {
                Some(overlap) => overlap.depth = overlap.depth.max(depth),
                None => found.push(Overlap {
                    grain: i,
                    partner,
                    depth,
                }),
            }
        }
    }
    found
}

/// Shortest move that surely parts two grains of which one has its centre in the other [m]: along
/// the line of centres or an axis. Exact for spheres.
fn nested(a: &Grain, b: &Grain, enclosure: &Enclosure) -> Option<f64> {
    let line = enclosure.nearest_image(b.pose.position - a.pose.position);
    let holds = |grain: &Grain, x: DVec3| {
        x.length() < grain.shape.bounding_radius()
            && grain.shape.distance(grain.pose.orientation.conjugate() * x) < 0.0
    };
    if !holds(a, line) && !holds(b, -line) {
        return None;
    }
    let axes = DVec3::AXES.into_iter().flat_map(|axis| [axis, -axis]);
    let move_along = |way: DVec3| extent(a, way) + extent(b, -way) - line.dot(way);
    axes.chain(line.try_normalize())
        .map(move_along)
        .reduce(f64::min)
}

/// How far the grain reaches from its centre in a direction [m].
fn extent(grain: &Grain, direction: DVec3) -> f64 {
    let mut turned = grain.clone();
    turned.pose.position = DVec3::ZERO;
    turned.pose.orientation =
        DQuat::from_rotation_arc(direction, DVec3::Z) * grain.pose.orientation;
    reach(&turned, 2).1
}

/// A length [m] for people who place grains: in millimetres, where it is not far beyond them.
fn millimetres(x: f64) -> String {
    if x.abs() < 1.0 {
        format!("{:.4} mm", 1e3 * x)
    } else {
        length(x)
    }
}

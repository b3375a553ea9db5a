//! `[[grain]]` and `[[packing]]` -> grains.

use std::sync::Arc;

use glam::DVec3;
use grainwake_shape::Shape;

use super::check::Checker;
use crate::case::loc::Loc;
use crate::case::packing::{Ball, Random, Space};
use crate::case::placement::{orientation, reach};
use crate::case::quantity::{Quantity, Triple};
use crate::case::raw::{Arrangement, Law, Orientation, PackingOrientation, Position, RawGrain, RawPacking, Turns};
use crate::case::shapes::Library;
use crate::dem::{Dof, Enclosure, Grain, Partner, initial_overlaps, outside};
use crate::math::Pose;

const AXES: [&str; 3] = ["x", "y", "z"];

/// Axis of the vertical and its sense: against gravity, +z without it.
pub(super) fn up(gravity: DVec3) -> (usize, f64) {
    let g = gravity.abs();
    if gravity == DVec3::ZERO {
        return (2, 1.0);
    }
    let axis = (0..3).max_by(|a, b| g[*a].total_cmp(&g[*b])).unwrap_or(2);
    (axis, -gravity[axis].signum())
}

/// One grain of the case, with the resolved form that gives the same grain again.
pub(super) fn grain(check: &mut Checker, library: &mut Library, raw: &Loc<RawGrain>, index: usize, earlier: &[Option<Grain>], vertical: (usize, f64)) -> Option<(Grain, RawGrain)> {
    let before = check.problems.len();
    let key = |name: &str| format!("grain.{index}.{name}");
    let mut resolved = raw.value.clone();
    let shape = shape(check, library, raw, &mut resolved, index);
    let density = check.positive(&raw.density, &key("density"), "the density of a grain");
    let turn = orientation(&raw.orientation, &raw.rotate);
    if let Err(message) = &turn {
        check.fail(raw.orientation.span.as_ref(), &key("orientation"), message, "give two directions that are not parallel, or one");
    }
    let [velocity, angular_velocity] = velocities(check, raw, &key);
    let (shape, density, orientation) = (shape?, density?, turn.ok()?);
    let law = |law: Law| match law {
        Law::Free => Dof::Free,
        Law::Prescribed(v) => Dof::Prescribed(v),
    };
    let mut grain = Grain {
        shape,
        density,
        pose: Pose { position: DVec3::ZERO, orientation },
        velocity,
        angular_velocity,
        translation: law(raw.motion.velocity),
        rotation: law(raw.motion.angular_velocity),
    };
    grain.pose.position = position(check, raw, index, &grain, earlier, vertical)?;
    resolved.position = Some(Position(grain.pose.position.to_array().to_vec()).into());
    resolved.gap_above = None;
    resolved.orientation = Orientation::Quaternion(orientation).into();
    resolved.rotate = Turns::default();
    resolved.velocity = Some(Triple::new(velocity).into());
    resolved.angular_velocity = Some(Triple::new(angular_velocity).into());
    (check.problems.len() == before).then_some((grain, resolved))
}

fn shape(check: &mut Checker, library: &mut Library, raw: &Loc<RawGrain>, resolved: &mut RawGrain, index: usize) -> Option<Arc<Shape>> {
    let key = |name: &str| format!("grain.{index}.{name}");
    let found = match (&raw.file, &raw.shape) {
        (Some(file), None) => {
            if let Some(nodes) = &raw.nodes {
                check.fail(nodes.span.as_ref(), &key("nodes"), "a grain file brings its own surface nodes", "choose them when the file is made: `grainwake grain ... --nodes`");
            }
            library.file(&file.value).map(|(shape, name)| {
                resolved.file = Some(Loc { value: name, span: None });
                shape
            }).map_err(|refusal| (file.span.clone(), key("file"), refusal))
        }
        (None, Some(shape)) => {
            let nodes = raw.nodes.as_ref().map(|n| n.value);
            resolved.nodes = Some(nodes.unwrap_or(crate::case::shapes::DEFAULT_NODES).into());
            library.closed_form(shape, nodes).map_err(|refusal| (shape.span.clone(), key("shape"), refusal))
        }
        (Some(_), Some(shape)) => Err((shape.span.clone(), key("shape"), ("both file and shape are given".to_string(), "keep one of them".to_string()))),
        (None, None) => Err((raw.span.clone(), format!("grain.{index}"), ("the grain has no shape".to_string(), "add file = \"x.grain\" or shape = { kind = \"sphere\", diameter = \"2 mm\" }".to_string()))),
    };
    let shape = found.map_err(|(span, key, (message, help))| check.fail(span.as_ref(), &key, message, help)).ok()?;
    let Some(diameter) = &raw.equivalent_diameter else { return Some(shape) };
    let d = check.positive(diameter, &key("equivalent_diameter"), "the equivalent diameter")?;
    library.rescaled(&shape, d).map_err(|(message, help)| check.fail(diameter.span.as_ref(), &key("equivalent_diameter"), message, help)).ok()
}

/// Velocities at the start: the prescribed ones, else the given ones, else zero.
fn velocities(check: &mut Checker, raw: &RawGrain, key: &dyn Fn(&str) -> String) -> [DVec3; 2] {
    let mut start = |law: Law, given: Option<(DVec3, &Option<std::ops::Range<usize>>)>, name: &str| match (law, given) {
        (Law::Prescribed(v), Some((u, span))) if u != v => {
            check.fail(span.as_ref(), &key(name), format!("the motion prescribes {:?}, but this is {:?}", v.to_array(), u.to_array()), format!("leave out `{name}`: a prescribed motion sets it"));
            v
        }
        (Law::Prescribed(v), _) => v,
        (Law::Free, given) => given.map_or(DVec3::ZERO, |(u, _)| u),
    };
    let velocity = raw.velocity.as_ref().map(|v| (v.si, &v.span));
    let spin = raw.angular_velocity.as_ref().map(|v| (v.si, &v.span));
    [start(raw.motion.velocity, velocity, "velocity"), start(raw.motion.angular_velocity, spin, "angular_velocity")]
}

fn position(check: &mut Checker, raw: &Loc<RawGrain>, index: usize, grain: &Grain, earlier: &[Option<Grain>], (axis, sign): (usize, f64)) -> Option<DVec3> {
    let key = format!("grain.{index}.position");
    let horizontal: Vec<usize> = (0..3).filter(|a| *a != axis).collect();
    let Some(above) = &raw.gap_above else {
        return match raw.position.as_ref().map(|p| (p.0.as_slice(), &p.span)) {
            Some(([x, y, z], _)) => Some(DVec3::new(*x, *y, *z)),
            Some((_, span)) => {
                check.fail(span.as_ref(), &key, "two components, but nothing says the height", "give [x, y, z], or add gap_above = { grain = 0, gap = \"3 mm\" }");
                None
            }
            None => {
                check.fail(raw.span.as_ref(), &format!("grain.{index}"), "the grain has no position", "add position = [x, y, z], or gap_above = { grain = 0, gap = \"3 mm\" }");
                None
            }
        };
    };
    let below = above.grain.value;
    if below >= index {
        check.fail(above.grain.span.as_ref(), &format!("grain.{index}.gap_above.grain"), format!("grain {below} does not stand before grain {index}"), "name a grain that stands earlier in the file; they count from 0");
        return None;
    }
    // Its own problem has been noted where this one is missing.
    let below = earlier[below].as_ref()?;
    let mut at = below.pose.position;
    if let Some(given) = &raw.position {
        let [first, second] = given.0[..] else {
            check.fail(given.span.as_ref(), &key, "three components, but gap_above sets the height", format!("give only [{}, {}], or leave out gap_above", AXES[horizontal[0]], AXES[horizontal[1]]));
            return None;
        };
        (at[horizontal[0]], at[horizontal[1]]) = (first, second);
    }
    let (lower_of_below, upper_of_below) = reach(below, axis);
    let (lower, upper) = reach(grain, axis);
    at[axis] = if sign > 0.0 { upper_of_below + above.gap.si - lower } else { lower_of_below - above.gap.si - upper };
    Some(at)
}

/// Grains of a packing as the raw grains that stand for them.
pub(super) fn packing(check: &mut Checker, library: &mut Library, raw: &Loc<RawPacking>, index: usize, standing: &[Grain], enclosure: &Enclosure, vertical: (usize, f64)) -> Vec<RawGrain> {
    let key = |name: &str| format!("packing.{index}.{name}");
    let count = raw.count.value;
    let kinds = raw.files.len() + raw.shapes.len();
    if kinds == 0 || count == 0 {
        check.fail(raw.span.as_ref(), &format!("packing.{index}"), "there is nothing to pack", "give a count and files = [...] or shapes = [...]");
        return Vec::new();
    }
    if count > 1_000_000 {
        check.fail(raw.count.span.as_ref(), &key("count"), format!("{count} grains are too many"), "at most 1000000 grains");
        return Vec::new();
    }
    let (Some(_), Some(jitter), Some(clearance)) = (
        check.positive(&raw.density, &key("density"), "the density of a grain"),
        check.within(&raw.jitter, &key("jitter"), 0.0, 1.0),
        check.within(&raw.clearance, &key("clearance"), 0.0, f64::INFINITY),
    ) else {
        return Vec::new();
    };
    let diameters = raw.equivalent_diameter.as_ref();
    if let Some(range) = diameters.filter(|r| !(r.from > 0.0 && r.to >= r.from)) {
        check.fail(range.span.as_ref(), &key("equivalent_diameter"), "the range of diameters is empty or not positive", "write { from = \"1 mm\", to = \"2 mm\" }");
        return Vec::new();
    }
    let mut random = Random::new(raw.seed);
    let mut grains = Vec::with_capacity(count);
    let mut radii = Vec::with_capacity(count);
    for n in 0..count {
        let kind = n % kinds;
        let mut grain = RawGrain {
            density: raw.density.clone(),
            velocity: Some(raw.velocity.clone()),
            nodes: if kind < raw.files.len() { None } else { raw.nodes.clone() },
            ..RawGrain::default()
        };
        if kind < raw.files.len() {
            grain.file = Some(raw.files[kind].clone());
        } else {
            grain.shape = Some(raw.shapes[kind - raw.files.len()].clone());
        }
        if let Some(range) = diameters {
            let d = if range.to > range.from { range.from + (range.to - range.from) * random.unit() } else { range.from };
            grain.equivalent_diameter = Some(Loc { value: Quantity::new(d), span: range.span.clone() });
        }
        if raw.orientation == PackingOrientation::Random {
            grain.orientation = Orientation::Quaternion(random.orientation()).into();
        }
        let mut scratch = grain.clone();
        let located = Loc { value: grain.clone(), span: raw.span.clone() };
        // The key would name a grain that is not in the file: a packing's shape is its own.
        let problems = check.problems.len();
        let Some(shape) = shape(check, library, &located, &mut scratch, n) else {
            for problem in &mut check.problems[problems..] {
                problem.key = Some(format!("packing.{index}"));
            }
            return Vec::new();
        };
        radii.push(shape.bounding_radius());
        grains.push(grain);
    }
    let (lower, upper) = raw.region.as_ref().map_or((enclosure.lower, enclosure.upper), |r| (r.lower.si, r.upper.si));
    let region_span = raw.region.as_ref().map_or(raw.span.as_ref(), |r| r.span.as_ref());
    if (lower.cmplt(enclosure.lower) | upper.cmpgt(enclosure.upper) | upper.cmple(lower)).any() {
        check.fail(region_span, &key("region"), "the region is empty or reaches out of the box", format!("the box goes from {:?} to {:?}", enclosure.lower.to_array(), enclosure.upper.to_array()));
        return Vec::new();
    }
    let taken: Vec<Ball> = standing.iter().map(|g| Ball { centre: g.pose.position, radius: g.shape.bounding_radius() }).collect();
    let space = Space { lower, upper, clearance, enclosure, taken: &taken };
    let centres = match raw.arrangement {
        Arrangement::Lattice => space.lattice(&radii, jitter, vertical, &mut random),
        Arrangement::Random => space.random(&radii, &mut random),
    };
    let centres = match centres {
        Ok(centres) => centres,
        Err(fit) => {
            check.fail(region_span, &format!("packing.{index}"), format!("only {fit} of {count} grains find a place without touching"), "take fewer or smaller grains, a larger region, or less clearance; a lattice holds more than random places");
            return Vec::new();
        }
    };
    let balls: Vec<Ball> = centres.iter().zip(&radii).map(|(c, r)| Ball { centre: *c, radius: *r }).collect();
    if !space.clear(&balls) {
        check.fail(region_span, &format!("packing.{index}"), "the packing runs into grains that already stand there", "choose a region that is free, or arrangement = \"random\"");
        return Vec::new();
    }
    for (grain, centre) in grains.iter_mut().zip(centres) {
        grain.position = Some(Position(centre.to_array().to_vec()).into());
    }
    grains
}

/// Grains must stand in the box and clear of each other.
pub(super) fn arrangement(check: &mut Checker, grains: &[Grain], spans: &[Option<std::ops::Range<usize>>], enclosure: &Enclosure) {
    let millimetres = |x: f64| format!("{:.4} mm", 1e3 * x);
    let finite = |g: &Grain| g.pose.position.is_finite();
    if !grains.iter().all(finite) {
        return;
    }
    let mut out_of_box = vec![false; grains.len()];
    for o in outside(grains, enclosure) {
        if std::mem::replace(&mut out_of_box[o.grain], true) {
            continue;
        }
        let (side, face) = (["lower", "upper"][o.side], [enclosure.lower, enclosure.upper][o.side][o.axis]);
        let what = if o.centroid { "lies outside the box" } else { "crosses a face of the box" };
        check.fail(
            spans[o.grain].as_ref(),
            &format!("grain.{}.position", o.grain),
            format!("grain {} {what}: it reaches {} beyond the {side} {} face (at {face} m)", o.grain, millimetres(o.by), AXES[o.axis]),
            format!("move it by at least {} along {}{}, or make the box larger", millimetres(o.by), ["", "-"][o.side], AXES[o.axis]),
        );
    }
    for (i, grain) in grains.iter().enumerate() {
        for axis in 0..3 {
            let (x, lower, upper) = (grain.pose.position[axis], enclosure.lower[axis], enclosure.upper[axis]);
            if enclosure.periodic[axis] && !(lower..=upper).contains(&x) {
                check.fail(spans[i].as_ref(), &format!("grain.{i}.position"), format!("grain {i} lies outside the box: {} = {x} m, the box goes from {lower} to {upper} m", AXES[axis]), "move it into the box (the axis is periodic)");
            }
        }
    }
    for overlap in initial_overlaps(grains, enclosure) {
        let i = overlap.grain;
        let Partner::Grain(j) = overlap.partner else { continue };
        let (at, other) = if j > i { (j, i) } else { (i, j) };
        let (message, help) = if i == j {
            (format!("grain {i} touches its own image across the periodic box (by {})", millimetres(overlap.depth)), "make the box larger or the grain smaller".to_string())
        } else {
            (format!("grains {other} and {at} overlap at the start by {}", millimetres(overlap.depth)), "move them apart; contact begins with grains that do not touch".to_string())
        };
        check.fail(spans[at].as_ref(), &format!("grain.{at}.position"), message, help);
    }
}

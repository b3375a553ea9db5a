//! `[[grain]]` -> grains.

use std::ops::Range;
use std::sync::Arc;

use glam::DVec3;
use grainwake_shape::Shape;

use super::check::Checker;
use crate::case::estimate::LIGHTEST_FREE;
use crate::case::loc::Loc;
use crate::case::placement::{orientation, reach};
use crate::case::quantity::{Density, Quantity, Triple};
use crate::case::raw::{Law, Orientation, Position, RawGrain, Turns};
use crate::case::readable::{number, quantity, vector};
use crate::case::shapes::Library;
use grainwake_solver::dem::{Grain, MotionConstraint};
use grainwake_solver::sim::PrescribedMotion;

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
pub(super) fn grain(
    check: &mut Checker,
    library: &mut Library,
    raw: &Loc<RawGrain>,
    index: usize,
    earlier: &[Option<Grain>],
    vertical: (usize, f64),
    fluid_density: Option<f64>,
) -> Option<(Grain, RawGrain)> {
    let before = check.problems.len();
    let key = |name: &str| format!("grain.{index}.{name}");
    let mut resolved = raw.value.clone();
    let shape = shape(check, library, raw, &mut resolved, index);
    let density = check.positive(&raw.density, &key("density"), "the density of a grain");
    if raw.motion.velocity == Law::Free {
        not_too_light(check, &raw.density, &key("density"), fluid_density);
    }
    let turn = orientation(&raw.orientation, &raw.rotate);
    if let Err(message) = &turn {
        check.fail(
            raw.orientation.span.as_ref(),
            &key("orientation"),
            message,
            "give two directions that are not parallel, or one",
        );
    }
    let [velocity, angular_velocity] = velocities(check, raw, &key);
    let (shape, density, orientation) = (shape?, density?, turn.ok()?);
    let law = |law: &Law| match law {
        Law::Free => MotionConstraint::Free,
        Law::Prescribed(v) => MotionConstraint::Prescribed(*v),
        Law::Formula(formula) => MotionConstraint::Prescribed(formula.at(&[0.0])),
    };
    // `materials` sets the material for the contact laws that use it.
    let mut grain = Grain::new(shape, density)
        .with_orientation(orientation)
        .with_velocity(velocity)
        .with_angular_velocity(angular_velocity);
    grain.translation = law(&raw.motion.velocity);
    grain.rotation = law(&raw.motion.angular_velocity);
    grain.pose.position = position(check, raw, index, &grain, earlier, vertical)?;
    resolved.position = Some(Position(grain.pose.position.to_array().to_vec()).into());
    resolved.gap_above = None;
    resolved.orientation = Orientation::Quaternion(orientation).into();
    resolved.rotate = Turns::default();
    resolved.velocity = Some(Triple::new(velocity).into());
    resolved.angular_velocity = Some(Triple::new(angular_velocity).into());
    (check.problems.len() == before).then_some((grain, resolved))
}

/// Refuses a free grain that is too light for the coupling with a fluid of this density [kg/m3].
pub(super) fn not_too_light(
    check: &mut Checker,
    density: &Loc<Quantity<Density>>,
    key: &str,
    fluid_density: Option<f64>,
) {
    let Some(fluid) = fluid_density.filter(|fluid| density.si < LIGHTEST_FREE * fluid) else {
        return;
    };
    // What is not positive has been refused already.
    if density.si <= 0.0 {
        return;
    }
    let least = quantity(LIGHTEST_FREE * fluid, "kg/m3");
    let mut help = format!(
        "accepted: at least {LIGHTEST_FREE} times the fluid's density, {least}, or a grain whose velocity is prescribed (motion)"
    );
    if density.si < 30.0 && check.is_bare(key) {
        help.push_str("; kg/m3? was a unit such as g/cm3 forgotten?");
    }
    check.fail(
        density.span.as_ref(),
        key,
        format!(
            "{} is {} times the density of the fluid: below {LIGHTEST_FREE} times it, free grains become unstable in this coupling",
            quantity(density.si, "kg/m3"),
            number(density.si / fluid)
        ),
        help,
    );
}

pub(super) fn shape(
    check: &mut Checker,
    library: &mut Library,
    raw: &Loc<RawGrain>,
    resolved: &mut RawGrain,
    index: usize,
) -> Option<Arc<Shape>> {
    let key = |name: &str| format!("grain.{index}.{name}");
    let found = match (&raw.file, &raw.shape) {
        (Some(file), None) => {
            if let Some(nodes) = &raw.nodes {
                check.fail(
                    nodes.span.as_ref(),
                    &key("nodes"),
                    "a grain file brings its own surface nodes",
                    "choose them when the file is made: `grainwake grain ... --nodes`",
                );
            }
            library
                .file(&file.value)
                .map(|(shape, name)| {
                    resolved.file = Some(Loc {
                        value: name,
                        span: None,
                    });
                    shape
                })
                .map_err(|refusal| (file.span.clone(), key("file"), refusal))
        }
        (None, Some(shape)) => {
            let nodes = raw.nodes.as_ref().map(|n| n.value);
            resolved.nodes = Some(nodes.unwrap_or(crate::case::shapes::DEFAULT_NODES).into());
            library
                .closed_form(shape, nodes)
                .map_err(|refusal| match &raw.nodes {
                    Some(nodes) if refusal.0.starts_with("nodes") => {
                        (nodes.span.clone(), key("nodes"), refusal)
                    }
                    _ => (shape.span.clone(), key("shape"), refusal),
                })
        }
        (Some(_), Some(shape)) => Err((
            shape.span.clone(),
            key("shape"),
            (
                "both file and shape are given".to_string(),
                "keep one of them".to_string(),
            ),
        )),
        (None, None) => Err((
            raw.span.clone(),
            format!("grain.{index}"),
            (
                "the grain has no shape".to_string(),
                "add file = \"x.grain\" or shape = { kind = \"sphere\", diameter = \"2 mm\" }"
                    .to_string(),
            ),
        )),
    };
    let shape = found
        .map_err(|(span, key, (message, help))| check.fail(span.as_ref(), &key, message, help))
        .ok()?;
    let Some(diameter) = &raw.equivalent_diameter else {
        return Some(shape);
    };
    let d = check.positive(
        diameter,
        &key("equivalent_diameter"),
        "the equivalent diameter",
    )?;
    library
        .rescaled(&shape, d)
        .map_err(|(message, help)| {
            check.fail(
                diameter.span.as_ref(),
                &key("equivalent_diameter"),
                message,
                help,
            )
        })
        .ok()
}

/// Motions given by formulas.
pub(super) fn prescribed_motions(grains: &[Loc<RawGrain>]) -> Vec<PrescribedMotion> {
    let formula = |law: &Law| match law {
        Law::Formula(formula) => Some(formula.clone()),
        _ => None,
    };
    let motion = |(grain, raw): (usize, &Loc<RawGrain>)| {
        let motion = PrescribedMotion {
            grain,
            velocity: formula(&raw.motion.velocity),
            angular_velocity: formula(&raw.motion.angular_velocity),
        };
        (motion.velocity.is_some() || motion.angular_velocity.is_some()).then_some(motion)
    };
    grains.iter().enumerate().filter_map(motion).collect()
}

/// Velocities at the start: the prescribed ones, else the given ones, else zero.
fn velocities(check: &mut Checker, raw: &RawGrain, key: &dyn Fn(&str) -> String) -> [DVec3; 2] {
    let mut start =
        |law: &Law, given: Option<(DVec3, &Option<Range<usize>>)>, name: &str, unit: &str| {
            let prescribed = match law {
                Law::Free => None,
                Law::Prescribed(v) => Some(*v),
                Law::Formula(formula) => Some(formula.at(&[0.0])),
            };
            match (prescribed, given) {
                (Some(v), Some((u, span))) if u != v => {
                    check.fail(
                        span.as_ref(),
                        &key(name),
                        format!(
                            "the motion prescribes {}, but this is {}",
                            vector(v, unit),
                            vector(u, unit)
                        ),
                        format!("leave out `{name}`: a prescribed motion sets it"),
                    );
                    v
                }
                (Some(v), _) => v,
                (None, given) => given.map_or(DVec3::ZERO, |(u, _)| u),
            }
        };
    let velocity = raw.velocity.as_ref().map(|v| (v.si, &v.span));
    let spin = raw.angular_velocity.as_ref().map(|v| (v.si, &v.span));
    [
        start(&raw.motion.velocity, velocity, "velocity", "m/s"),
        start(
            &raw.motion.angular_velocity,
            spin,
            "angular_velocity",
            "rad/s",
        ),
    ]
}

fn position(
    check: &mut Checker,
    raw: &Loc<RawGrain>,
    index: usize,
    grain: &Grain,
    earlier: &[Option<Grain>],
    (axis, sign): (usize, f64),
) -> Option<DVec3> {
    let key = format!("grain.{index}.position");
    let horizontal: Vec<usize> = (0..3).filter(|a| *a != axis).collect();
    let Some(above) = &raw.gap_above else {
        return match raw.position.as_ref().map(|p| (p.0.as_slice(), &p.span)) {
            Some(([x, y, z], _)) => Some(DVec3::new(*x, *y, *z)),
            Some((_, span)) => {
                check.fail(
                    span.as_ref(),
                    &key,
                    "two components, but nothing says the height",
                    "give [x, y, z], or add gap_above = { grain = 0, gap = \"3 mm\" }",
                );
                None
            }
            None => {
                check.fail(
                    raw.span.as_ref(),
                    &format!("grain.{index}"),
                    "the grain has no position",
                    "add position = [x, y, z], or gap_above = { grain = 0, gap = \"3 mm\" }",
                );
                None
            }
        };
    };
    let below = above.grain.value;
    if below >= index {
        check.fail(
            above.grain.span.as_ref(),
            &format!("grain.{index}.gap_above.grain"),
            format!("grain {below} does not stand before grain {index}"),
            "name a grain that stands earlier in the file; they count from 0",
        );
        return None;
    }
    // Its own problem has been noted where this one is missing.
    let below = earlier[below].as_ref()?;
    let mut at = below.pose.position;
    if let Some(given) = &raw.position {
        let [first, second] = given.0[..] else {
            check.fail(
                given.span.as_ref(),
                &key,
                "three components, but gap_above sets the height",
                format!(
                    "give only [{}, {}], or leave out gap_above",
                    AXES[horizontal[0]], AXES[horizontal[1]]
                ),
            );
            return None;
        };
        (at[horizontal[0]], at[horizontal[1]]) = (first, second);
    }
    let (lower_of_below, upper_of_below) = reach(below, axis);
    let (lower, upper) = reach(grain, axis);
    at[axis] = if sign > 0.0 {
        upper_of_below + above.gap.si - lower
    } else {
        lower_of_below - above.gap.si - upper
    };
    Some(at)
}

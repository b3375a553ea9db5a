//! `[[grain]]` -> grains.

use std::sync::Arc;

use glam::DVec3;
use grainwake_shape::Shape;

use super::arrangement::Placement;
use super::check::Checker;
use crate::case::located::{Located, Span};
use crate::case::placement::{extent_along, orientation};
use crate::case::quantity::{Density, Kind, Quantity, Triple};
use crate::case::raw::{MotionLaw, Orientation, Position, RawGrain, Turns};
use crate::case::settling::HEAVIEST;
use crate::case::shapes::{DEFAULT_NODES, Library};
use crate::number_format::{AXES, number, quantity, vector};
use grainwake_solver::dem::{Grain, MotionConstraint};
use grainwake_solver::sim::{LIGHTEST_FREE_GRAIN, PrescribedMotion};

/// Vertical axis, and the sign of the upward direction along it.
#[derive(Clone, Copy)]
pub(super) struct Vertical {
    pub axis: usize,
    pub sign: f64,
}

impl Vertical {
    /// Returns the axis closest to gravity; +z without gravity.
    pub fn of(gravity: DVec3) -> Vertical {
        let g = gravity.abs();
        if gravity == DVec3::ZERO {
            return Vertical { axis: 2, sign: 1.0 };
        }
        let axis = (0..3).max_by(|a, b| g[*a].total_cmp(&g[*b])).unwrap_or(2);
        let sign = -gravity[axis].signum();
        Vertical { axis, sign }
    }
}

/// Grains of a case in the order of the file.
pub(super) struct Grains<'a> {
    pub library: Library<'a>,
    pub vertical: Vertical,
    /// Grains built so far; none where one was refused.
    pub built: Vec<Option<Grain>>,
    /// Resolved form of each grain, which gives the same grain again.
    pub resolved: Vec<Located<RawGrain>>,
    /// Positions of the grains in the file.
    pub placements: Vec<Placement>,
}

impl<'a> Grains<'a> {
    pub fn new(library: Library<'a>, vertical: Vertical) -> Grains<'a> {
        Grains {
            library,
            vertical,
            built: Vec::new(),
            resolved: Vec::new(),
            placements: Vec::new(),
        }
    }

    /// Validates and adds one grain. A free grain that is too light for the fluid is refused.
    pub fn add(
        &mut self,
        check: &mut Checker,
        raw: &Located<RawGrain>,
        placement: Placement,
        fluid_density: Option<f64>,
    ) {
        let (grain, resolved) = self.build(check, raw, fluid_density).unzip();
        self.built.push(grain);
        self.resolved.extend(resolved.map(Located::from));
        self.placements.push(placement);
    }

    fn build(
        &mut self,
        check: &mut Checker,
        raw: &Located<RawGrain>,
        fluid_density: Option<f64>,
    ) -> Option<(Grain, RawGrain)> {
        let before = check.problems.len();
        let mut resolved = raw.value.clone();
        let shape = shape(check, &mut self.library, raw, &mut resolved);
        let density = check.positive(&raw.density, "the density of a grain");
        let density = density.filter(|density| not_too_heavy(check, &raw.density, *density));
        if raw.motion.velocity == MotionLaw::Free {
            not_too_light(check, &raw.density, fluid_density);
        }
        let turned = orientation(&raw.orientation, &raw.rotate);
        if let Err(message) = &turned {
            let help = "give two directions that are not parallel, or one";
            check.fail(&raw.orientation.span, message, help);
        }
        let motion = &raw.motion;
        let velocity = initial(check, &motion.velocity, &raw.velocity);
        let angular_velocity = initial(check, &motion.angular_velocity, &raw.angular_velocity);
        let (shape, density, orientation) = (shape?, density?, turned.ok()?);
        // `materials` sets the material for the contact laws that use it.
        let mut grain = Grain::new(shape, density)
            .with_orientation(orientation)
            .with_velocity(velocity)
            .with_angular_velocity(angular_velocity);
        grain.translation = motion.velocity.at_start();
        grain.rotation = motion.angular_velocity.at_start();
        grain.pose.position = self.position(check, raw, &grain)?;
        resolved.position = Some(Position(grain.pose.position.to_array().to_vec()).into());
        resolved.gap_above = None;
        resolved.orientation = Orientation::Quaternion(orientation).into();
        resolved.rotate = Turns::default();
        resolved.velocity = Some(Triple::new(velocity).into());
        resolved.angular_velocity = Some(Triple::new(angular_velocity).into());
        (check.problems.len() == before).then_some((grain, resolved))
    }

    /// Returns the centroid [m].
    fn position(
        &self,
        check: &mut Checker,
        raw: &Located<RawGrain>,
        grain: &Grain,
    ) -> Option<DVec3> {
        let index = self.built.len();
        let Some(above) = &raw.gap_above else {
            let (span, message, alternative) = match &raw.position {
                Some(position) => match position.0[..] {
                    [x, y, z] => return Some(DVec3::new(x, y, z)),
                    _ => (&position.span, "two components, but nothing says the height", "give"),
                },
                None => (&raw.span, "the grain has no position", "add position ="),
            };
            let help = format!(
                "{alternative} [x, y, z], or add gap_above = {{ grain = 0, gap = \"3 mm\" }}"
            );
            return check.refuse(span, message, help);
        };
        let below = above.grain.value;
        if below >= index {
            let message = format!("grain {below} does not stand before grain {index}");
            let help = "name a grain that stands earlier in the file; they count from 0";
            return check.refuse(&above.grain.span, message, help);
        }
        // A missing grain has been reported.
        let below = self.built[below].as_ref()?;
        let mut position = below.pose.position;
        let Vertical { axis, sign } = self.vertical;
        if let Some(given) = &raw.position {
            let [h0, h1] = [[1, 2], [0, 2], [0, 1]][axis];
            let [first, second] = given.0[..] else {
                let message = "three components, but gap_above sets the height";
                let (a, b) = (AXES[h0], AXES[h1]);
                let help = format!("give only [{a}, {b}], or leave out gap_above");
                return check.refuse(&given.span, message, help);
            };
            (position[h0], position[h1]) = (first, second);
        }
        let (lower_of_below, upper_of_below) = extent_along(below, axis);
        let (lower, upper) = extent_along(grain, axis);
        position[axis] = if sign > 0.0 {
            upper_of_below + above.gap.si - lower
        } else {
            lower_of_below - above.gap.si - upper
        };
        Some(position)
    }

    /// Returns the motions that are given by formulas.
    pub fn prescribed_motions(&self) -> Vec<PrescribedMotion> {
        let motion = |(grain, raw): (usize, &Located<RawGrain>)| {
            let motion = PrescribedMotion {
                grain,
                velocity: raw.motion.velocity.formula(),
                angular_velocity: raw.motion.angular_velocity.formula(),
            };
            (motion.velocity.is_some() || motion.angular_velocity.is_some()).then_some(motion)
        };
        self.resolved.iter().enumerate().filter_map(motion).collect()
    }
}

/// Refuses a density above [`HEAVIEST`]: no matter has it, and contact would be too stiff for any
/// step.
fn not_too_heavy(check: &mut Checker, raw: &Located<Quantity<Density>>, density: f64) -> bool {
    if density > HEAVIEST {
        let message = format!("the density of a grain is {}", quantity(density, "kg/m3"));
        check.fail(&raw.span, message, format!("accepted: at most {HEAVIEST:e} kg/m3"));
    }
    density <= HEAVIEST
}

/// Refuses a free grain that is too light for the coupling with a fluid of this density [kg/m3].
pub(super) fn not_too_light(
    check: &mut Checker,
    density: &Located<Quantity<Density>>,
    fluid_density: Option<f64>,
) {
    // A density that is not positive is refused elsewhere.
    let too_light = |fluid: &f64| density.si > 0.0 && density.si < LIGHTEST_FREE_GRAIN * fluid;
    let Some(fluid) = fluid_density.filter(too_light) else {
        return;
    };
    let least = quantity(LIGHTEST_FREE_GRAIN * fluid, "kg/m3");
    let mut help = format!(
        "accepted: at least {LIGHTEST_FREE_GRAIN} times the fluid's density, {least}, or a grain whose velocity is prescribed (motion)"
    );
    if density.si < 30.0 && check.is_bare(check.key(&density.span)) {
        help.push_str("; without a unit it is in kg/m3: was \"g/cm3\" forgotten?");
    }
    let message = format!(
        "{} is {} times the density of the fluid: below {LIGHTEST_FREE_GRAIN} times it, free grains become unstable in this coupling",
        quantity(density.si, "kg/m3"),
        number(density.si / fluid)
    );
    check.fail(&density.span, message, help);
}

/// Returns the shape of a grain and writes its file and nodes to `resolved`.
pub(super) fn shape(
    check: &mut Checker,
    library: &mut Library,
    raw: &Located<RawGrain>,
    resolved: &mut RawGrain,
) -> Option<Arc<Shape>> {
    // A thousand sizes of one shape take seconds.
    if check.stopped() {
        return None;
    }
    let refused = |check: &mut Checker, span: &Span, (message, help): (String, String)| {
        check.fail(span, message, help);
    };
    let shape = match (&raw.file, &raw.shape) {
        (Some(file), None) => {
            if let Some(nodes) = &raw.nodes {
                let message = "a grain file brings its own surface nodes";
                let help = "choose them when the file is made: `grainwake grain ... --nodes`";
                check.fail(&nodes.span, message, help);
            }
            let found = library.file(&file.value);
            let (shape, name) = found.map_err(|e| refused(check, &file.span, e)).ok()?;
            resolved.file = Some(name.into());
            shape
        }
        (None, Some(shape)) => {
            let nodes = raw.nodes.as_ref().map_or(DEFAULT_NODES, |nodes| nodes.value);
            resolved.nodes = Some(nodes.into());
            let refused = |error: (String, String)| {
                let nodes = raw.nodes.as_ref().filter(|_| error.0.starts_with("nodes"));
                refused(check, nodes.map_or(&shape.span, |nodes| &nodes.span), error);
            };
            library.closed_form(shape, nodes).map_err(refused).ok()?
        }
        (Some(_), Some(shape)) => {
            return check.refuse(&shape.span, "both file and shape are given", "keep one of them");
        }
        (None, None) => {
            let help =
                "add file = \"x.grain\" or shape = { kind = \"sphere\", diameter = \"2 mm\" }";
            return check.refuse(&raw.span, "the grain has no shape", help);
        }
    };
    let Some(diameter) = &raw.equivalent_diameter else {
        return Some(shape);
    };
    let d = check.positive(diameter, "the equivalent diameter")?;
    let scaled = library.rescaled(&shape, d);
    scaled.map_err(|e| refused(check, &diameter.span, e)).ok()
}

/// Returns the velocity at the start: the prescribed one, else the given one, else zero.
pub(super) fn initial<K: Kind>(
    check: &mut Checker,
    law: &MotionLaw<K>,
    given: &Option<Located<Triple<K>>>,
) -> DVec3 {
    let MotionConstraint::Prescribed(prescribed) = law.at_start() else {
        return given.as_ref().map_or(DVec3::ZERO, |given| given.si);
    };
    if let Some(given) = given.as_ref().filter(|given| given.si != prescribed) {
        let (motion, start) = (vector(prescribed, K::SI), vector(given.si, K::SI));
        let message = format!("the motion prescribes {motion}, but this is {start}");
        let key = check.key(&given.span).to_owned();
        let name = key.rsplit('.').next().unwrap_or_default();
        let help = format!("leave out `{name}`: a prescribed motion sets it");
        check.fail(&given.span, message, help);
    }
    prescribed
}

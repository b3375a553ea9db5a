//! `[fluid]`, `[contact]` and gravity.

use glam::DVec3;

use super::check::Checker;
use super::materials::restitution;
use crate::case::located::{Located, Span};
use crate::case::quantity::{Number, Quantity};
use crate::case::raw::{RawContact, RawFluid};
use crate::case::settling::{impact_speed, is_free, smallest_diameter};
use crate::number_format::{length, quantity};
use grainwake_solver::dem::{ContactLawKind, ContactParams, Grain, Material};
use grainwake_solver::flow::FluidParams;
use grainwake_solver::grid::Mesh;
use grainwake_solver::sim::Prescription;

/// Default of the largest overlap at impact [diameters].
const MAXIMUM_OVERLAP: f64 = 0.01;
/// Default of the overlap at which a run stops [diameters].
const OVERLAP_LIMIT: f64 = 0.1;
/// Default of the roughness [smallest equivalent diameters].
const ROUGHNESS: f64 = 1e-3;
/// Added mass of a sphere in contact, relative to the displaced fluid.
///
/// Potential flow gives 0.5 far from a wall and 0.803 at it (Hicks 1879). With 0.8 an undamped
/// impact nearly conserves the speed (`docs/decisions/0018-pressure-weight.md`).
const ADDED_MASS: f64 = 0.8;

/// Returns the overlap at which the run stops [diameters].
fn overlap_limit(raw: &RawContact) -> f64 {
    match (&raw.overlap_limit, &raw.maximum_overlap) {
        (Some(limit), _) => limit.si,
        (None, Some(overlap)) => OVERLAP_LIMIT.max(2.0 * overlap.si),
        (None, None) => OVERLAP_LIMIT,
    }
}

/// Returns the overlap up to which grains may overlap at the start [diameters].
pub(super) fn accepted_overlap(check: &mut Checker, raw: &RawContact) -> f64 {
    let limit = overlap_limit(raw);
    let accepted = raw.accept_overlap.as_ref();
    accepted.and_then(|accepted| check.within(accepted, 0.0, limit)).unwrap_or(0.0)
}

/// Returns the fluid and its formulas; writes the viscosity as a kinematic one.
pub(super) fn fluid(
    check: &mut Checker,
    raw: &mut Located<RawFluid>,
    prescription: &mut Prescription,
) -> Option<FluidParams> {
    let density = check.positive(&raw.density, "the density of the fluid");
    let kinematic_viscosity = match (&raw.viscosity, &raw.kinematic_viscosity) {
        (Some(mu), None) => {
            check.positive(mu, "the viscosity").zip(density).map(|(mu, rho)| mu / rho)
        }
        (None, Some(nu)) => check.positive(nu, "the viscosity"),
        (Some(mu), Some(_)) => {
            let message = "both viscosity and kinematic_viscosity are given";
            check.refuse(&mu.span, message, "keep one of them")
        }
        (None, None) => {
            let help = "add viscosity = \"1 mPa s\" or kinematic_viscosity = \"1 cSt\"";
            check.refuse(&raw.span, "the viscosity is missing", help)
        }
    };
    let fluid = &mut raw.value;
    let (body_acceleration, formula) = fluid.body_acceleration.parts();
    prescription.body_acceleration = formula;
    let (initial_velocity, formula) = fluid.initial_velocity.parts();
    prescription.initial_velocity = formula;
    let params = FluidParams {
        density: density?,
        kinematic_viscosity: kinematic_viscosity?,
        body_acceleration,
        initial_velocity,
    };
    fluid.viscosity = None;
    fluid.kinematic_viscosity = Some(Quantity::new(params.kinematic_viscosity).into());
    Some(params)
}

/// Refuses formulas of the fluid without a finite value.
pub(super) fn formulas(
    check: &mut Checker,
    raw: &RawFluid,
    given: &Prescription,
    mesh: &Mesh,
    end: f64,
) {
    if given.initial_speed(mesh).is_some_and(f64::is_nan) {
        refuse_formula(check, &raw.initial_velocity.span, "everywhere in the box");
    }
    let acceleration = |time| given.body_acceleration(time);
    finite_over_time(check, &raw.body_acceleration.span, end, acceleration);
}

/// Refuses a formula of time that is not finite at one of a thousand times from 0 to `end` [s].
pub(super) fn finite_over_time(
    check: &mut Checker,
    span: &Span,
    end: f64,
    formula: impl Fn(f64) -> Option<DVec3>,
) {
    const TIMES: u32 = 1000;
    let end = if end.is_finite() { end } else { 0.0 };
    let mut times = (0..=TIMES).map(|n| end * f64::from(n) / f64::from(TIMES));
    let undefined = |time: &f64| formula(*time).is_some_and(|value| !value.is_finite());
    if let Some(time) = times.find(undefined) {
        let time = if time == 0.0 { "0".into() } else { quantity(time, "s") };
        refuse_formula(check, span, &format!("at t = {time}"));
    }
}

fn refuse_formula(check: &mut Checker, span: &Span, place: &str) {
    let message = format!("the formula does not give a finite number {place}");
    let help = "avoid divisions by zero and roots or logarithms of negative numbers";
    check.fail(span, message, help);
}

/// Returns the contact parameters. A stiffness that is not given follows from the largest overlap.
pub(super) fn contact(
    check: &mut Checker,
    raw: &mut RawContact,
    grains: &[Grain],
    wall_material: Option<Material>,
    fluid: Option<&FluidParams>,
    gravity: DVec3,
    mesh: &Mesh,
) -> Option<ContactParams> {
    let before = check.problems.len();
    let defaults = ContactParams::default();
    let tangential_ratio = match &raw.tangential_ratio {
        // Sub-steps follow the normal spring, and a ratio of 0 would turn off the friction.
        Some(ratio) => check.within(ratio, 1e-3, 1.0),
        None => Some(defaults.tangential_ratio),
    };
    let mut or_default = |value: &Option<Located<Quantity<Number>>>, default| match value {
        Some(value) => check.not_negative(value),
        None => Some(default),
    };
    let tangential_damping = or_default(&raw.tangential_damping, defaults.tangential_damping);
    let wall_friction = or_default(&raw.wall_friction, raw.friction.si);
    let friction = check.not_negative(&raw.friction);
    let restitution = restitution(check, &raw.restitution);
    let global_damping = check.not_negative(&raw.global_damping);
    let lubrication = lubrication(check, raw, grains, fluid.is_some());
    let substeps = check.within(&raw.substeps_per_contact, 5.0, 1e6);
    if let Some(limit) = &raw.overlap_limit {
        check.within(limit, 1e-3, 0.5)?;
    }
    let overlap_limit = overlap_limit(raw);
    let law = raw.law.value;
    let for_overlap = |overlap| stiffness_for(overlap, grains, fluid, gravity, mesh);
    let stiffness = match (&raw.stiffness, &raw.maximum_overlap) {
        (Some(k), Some(_)) => {
            let message = "both stiffness and maximum_overlap are given";
            check.refuse(&k.span, message, "keep one of them")
        }
        (Some(k), None) => check.positive(k, "the stiffness"),
        (None, Some(overlap)) => check.within(overlap, 1e-6, 0.2).map(for_overlap),
        (None, None) if law == ContactLawKind::Linear => Some(for_overlap(MAXIMUM_OVERLAP)),
        (None, None) => Some(defaults.normal_stiffness),
    };
    if check.problems.len() > before {
        return None;
    }
    let [lubrication_gap, roughness] = lubrication?;
    let params = ContactParams {
        law,
        normal_stiffness: stiffness?,
        tangential_ratio: tangential_ratio?,
        friction: friction?,
        wall_friction: wall_friction?,
        restitution: restitution?,
        tangential_damping: tangential_damping?,
        wall_material: wall_material?,
        global_damping: global_damping?,
        lubrication_gap,
        lubrication_viscosity: fluid.map_or(0.0, |f| f.density * f.kinematic_viscosity),
        roughness,
        added_density: fluid.map_or(0.0, |f| ADDED_MASS * f.density),
        substeps_per_contact: substeps?,
        overlap_limit,
    };
    write_resolved(raw, &params);
    Some(params)
}

/// Returns the lubrication gap and the roughness [m].
fn lubrication(
    check: &mut Checker,
    raw: &RawContact,
    grains: &[Grain],
    has_fluid: bool,
) -> Option<[f64; 2]> {
    let diameter = smallest_diameter(grains);
    let lubrication_gap = check.not_negative(&raw.lubrication_gap);
    let roughness = match &raw.roughness {
        Some(given) => check.positive(given, "the roughness"),
        None => Some(ROUGHNESS * diameter),
    };
    if let Some(given) = raw.roughness.as_ref().filter(|_| lubrication_gap == Some(0.0)) {
        let message = "a roughness needs a lubrication gap";
        check.fail(&given.span, message, "add lubrication_gap, or remove roughness");
    }
    if let Some(gap) = lubrication_gap.filter(|gap| *gap > 0.0 && !has_fluid) {
        let message = format!("a lubrication gap of {} needs a fluid", length(gap));
        let help = "add [fluid] or set lubrication_gap = 0";
        check.fail(&raw.lubrication_gap.span, message, help);
    }
    // A missing unit makes these lengths a thousand times too large.
    let lengths = [("a lubrication gap", Some(&raw.lubrication_gap))];
    for (what, given) in lengths.into_iter().chain([("a roughness", raw.roughness.as_ref())]) {
        if let Some(given) = given.filter(|given| given.si > diameter) {
            let (given_length, diameter) = (length(given.si), length(diameter));
            let message = format!("{what} of {given_length} is larger than a grain ({diameter})");
            let help = "give a few per cent of the diameter, with its unit: \"0.1 mm\"";
            check.fail(&given.span, message, help);
        }
    }
    if let (Some(gap), Some(roughness)) = (lubrication_gap, roughness)
        && gap > 0.0
        && gap <= roughness
        && roughness.is_finite()
    {
        let (given, least) = (length(gap), length(roughness));
        let message = format!("the lubrication gap of {given} is not above the roughness, {least}");
        let help = "films thinner than the roughness do not resist: make lubrication_gap larger or \
                    roughness smaller, or set lubrication_gap = 0";
        check.fail(&raw.lubrication_gap.span, message, help);
    }
    Some([lubrication_gap?, roughness?])
}

/// Writes the values that the case does not give, for the resolved case.
fn write_resolved(raw: &mut RawContact, params: &ContactParams) {
    raw.maximum_overlap = None;
    raw.overlap_limit = Some(Quantity::new(params.overlap_limit).into());
    if params.lubrication_gap > 0.0 && params.roughness.is_finite() {
        raw.roughness = Some(Quantity::new(params.roughness).into());
    }
    if params.law == ContactLawKind::Linear {
        raw.stiffness = Some(Quantity::new(params.normal_stiffness).into());
        raw.tangential_ratio = Some(Quantity::new(params.tangential_ratio).into());
        raw.tangential_damping = Some(Quantity::new(params.tangential_damping).into());
    }
    raw.wall_friction = Some(Quantity::new(params.wall_friction).into());
}

/// Stiffness [N/m] for which no grain that meets a wall at 1.5 times its settling speed (dry: after
/// falling through the box), or lies on it, overlaps by more than `fraction` of the smallest
/// equivalent diameter, added mass left out.
fn stiffness_for(
    fraction: f64,
    grains: &[Grain],
    fluid: Option<&FluidParams>,
    gravity: DVec3,
    mesh: &Mesh,
) -> f64 {
    let overlap = fraction * smallest_diameter(grains);
    let needed = |grain: &Grain| {
        let speed = impact_speed(grain, fluid, gravity, mesh);
        let buoyant = fluid.map_or(0.0, |f| f.density);
        let weight = (grain.density - buoyant).abs() * grain.shape.volume() * gravity.length();
        ContactParams::stiffness_for_overlap(grain.mass(), speed, overlap).max(weight / overlap)
    };
    // A fixed grain hits nothing.
    let moves = |grain: &&Grain| is_free(grain) || grain.velocity != DVec3::ZERO;
    let stiffness = grains.iter().filter(moves).map(needed).fold(0.0, f64::max);
    if stiffness > 0.0 { stiffness } else { ContactParams::default().normal_stiffness }
}

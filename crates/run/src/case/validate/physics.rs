//! `[fluid]`, `[contact]` and gravity.

use glam::DVec3;

use super::check::Checker;
use super::materials::restitution;
use crate::case::estimate::impact_speed;
use crate::case::loc::Loc;
use crate::case::quantity::Quantity;
use crate::case::raw::{RawContact, RawFluid};
use crate::case::readable::length;
use grainwake_solver::dem::{ContactLawKind, ContactParams, Grain, Material};
use grainwake_solver::flow::FluidParams;
use grainwake_solver::grid::Mesh;
use grainwake_solver::sim::Prescription;

/// Largest overlap at impact where neither stiffness nor overlap is given [diameters].
const MAXIMUM_OVERLAP: f64 = 0.01;
/// Roughness over the smallest equal-volume radius, where none is given.
const ROUGHNESS: f64 = 3e-3;
/// Added mass of a sphere in contact over the mass of the displaced fluid.
///
/// Potential flow gives 0.5 far from a wall and 0.803 at it (Hicks 1879), the grid 0.75. With 0.7,
/// undamped impacts conserve the speed (`docs/decisions/0014-contact-with-the-fluid-response.md`).
const ADDED_MASS: f64 = 0.7;

/// The fluid; the viscosity is kept as a kinematic one.
pub(super) fn fluid(
    check: &mut Checker,
    raw: &mut Loc<RawFluid>,
    given: &mut Prescription,
) -> Option<FluidParams> {
    let density = check.positive(&raw.density, "fluid.density", "the density of the fluid");
    let span = raw.span.clone();
    let fluid = &mut raw.value;
    let kinematic_viscosity = match (&fluid.viscosity, &fluid.kinematic_viscosity) {
        (Some(mu), None) => check
            .positive(mu, "fluid.viscosity", "the viscosity")
            .zip(density)
            .map(|(mu, rho)| mu / rho),
        (None, Some(nu)) => check.positive(nu, "fluid.kinematic_viscosity", "the viscosity"),
        (Some(mu), Some(_)) => {
            check.fail(
                mu.span.as_ref(),
                "fluid.viscosity",
                "both viscosity and kinematic_viscosity are given",
                "keep one of them",
            );
            None
        }
        (None, None) => {
            check.fail(
                span.as_ref(),
                "fluid",
                "the viscosity is missing",
                "add viscosity = \"1 mPa s\" or kinematic_viscosity = \"1 cSt\"",
            );
            None
        }
    };
    let (body_acceleration, formula) = fluid.body_acceleration.parts();
    given.body_acceleration = formula;
    let (initial_velocity, formula) = fluid.initial_velocity.parts();
    given.initial_velocity = formula;
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

/// Refuses formulas of the fluid that give no number.
pub(super) fn defined(check: &mut Checker, raw: &RawFluid, given: &Prescription, mesh: &Mesh) {
    let nowhere = given.initial_speed(mesh).is_some_and(f64::is_nan);
    let never = given.body_acceleration(0.0).is_some_and(DVec3::is_nan);
    let found = [
        (
            nowhere,
            &raw.initial_velocity.span,
            "initial_velocity",
            "everywhere in the box",
        ),
        (
            never,
            &raw.body_acceleration.span,
            "body_acceleration",
            "at t = 0",
        ),
    ];
    for (undefined, span, name, place) in found {
        if undefined {
            check.fail(
                span.as_ref(),
                &format!("fluid.{name}"),
                format!("the formula does not give a finite number {place}"),
                "avoid divisions by zero and roots or logarithms of negative numbers",
            );
        }
    }
}

/// The contact law; a stiffness that is not given follows from the largest overlap.
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
    let infinite = f64::INFINITY;
    let defaults = ContactParams::default();
    let law = raw.law.value;
    let tangential_ratio = match &raw.tangential_ratio {
        Some(ratio) => check.within(ratio, "contact.tangential_ratio", 0.0, infinite),
        None => Some(defaults.tangential_ratio),
    };
    let friction = check.within(&raw.friction, "contact.friction", 0.0, infinite);
    let wall_friction = match &raw.wall_friction {
        Some(wall) => check.within(wall, "contact.wall_friction", 0.0, infinite),
        None => friction,
    };
    let restitution = restitution(check, &raw.restitution, "contact.restitution");
    let tangential_damping = match &raw.tangential_damping {
        Some(damping) => check.within(damping, "contact.tangential_damping", 0.0, infinite),
        None => Some(defaults.tangential_damping),
    };
    let global_damping = check.within(&raw.global_damping, "contact.global_damping", 0.0, infinite);
    let lubrication_gap = check.within(
        &raw.lubrication_gap,
        "contact.lubrication_gap",
        0.0,
        infinite,
    );
    let roughness = match &raw.roughness {
        Some(given) => check.positive(given, "contact.roughness", "the roughness"),
        None => Some(ROUGHNESS * 0.5 * smallest_diameter(grains)),
    };
    let substeps = check.within(
        &raw.substeps_per_contact,
        "contact.substeps_per_contact",
        5.0,
        1e6,
    );
    let viscosity = fluid.map_or(0.0, |f| f.density * f.kinematic_viscosity);
    if let Some(gap) = lubrication_gap.filter(|gap| *gap > 0.0 && fluid.is_none()) {
        check.fail(
            raw.lubrication_gap.span.as_ref(),
            "contact.lubrication_gap",
            format!("a lubrication gap of {} needs a fluid", length(gap)),
            "add [fluid] or set lubrication_gap = 0",
        );
    }
    let stiffness = match (&raw.stiffness, &raw.maximum_overlap) {
        (Some(k), Some(_)) => {
            check.fail(
                k.span.as_ref(),
                "contact.stiffness",
                "both stiffness and maximum_overlap are given",
                "keep one of them",
            );
            None
        }
        (Some(k), None) => check.positive(k, "contact.stiffness", "the stiffness"),
        (None, Some(overlap)) => check
            .within(overlap, "contact.maximum_overlap", 1e-6, 0.2)
            .map(|overlap| stiffness_for(overlap, grains, fluid, gravity, mesh)),
        (None, None) if law == ContactLawKind::Linear => {
            Some(stiffness_for(MAXIMUM_OVERLAP, grains, fluid, gravity, mesh))
        }
        (None, None) => Some(defaults.normal_stiffness),
    };
    if check.problems.len() > before {
        return None;
    }
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
        lubrication_gap: lubrication_gap?,
        lubrication_viscosity: viscosity,
        roughness: roughness?,
        added_density: fluid.map_or(0.0, |f| ADDED_MASS * f.density),
        substeps_per_contact: substeps?,
    };
    raw.maximum_overlap = None;
    if params.lubrication_gap > 0.0 {
        raw.roughness = Some(Quantity::new(params.roughness).into());
    }
    if law == ContactLawKind::Linear {
        raw.stiffness = Some(Quantity::new(params.normal_stiffness).into());
        raw.tangential_ratio = Some(Quantity::new(params.tangential_ratio).into());
        raw.tangential_damping = Some(Quantity::new(params.tangential_damping).into());
    }
    raw.wall_friction = Some(Quantity::new(params.wall_friction).into());
    Some(params)
}

/// Smallest equal-volume diameter [m]; infinite without grains.
fn smallest_diameter(grains: &[Grain]) -> f64 {
    grains
        .iter()
        .map(|g| g.shape.equivalent_diameter())
        .fold(f64::INFINITY, f64::min)
}

/// Stiffness [N/m] for which no grain that meets a wall at 1.5 times its settling speed (dry: after
/// falling through the box), or lies on it, overlaps by more than `fraction` of the smallest
/// equal-volume diameter.
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
    let stiffness = grains.iter().map(needed).fold(0.0, f64::max);
    if stiffness > 0.0 {
        stiffness
    } else {
        ContactParams::default().normal_stiffness
    }
}

//! Warnings about settings that impair the results of a run.

mod contact;
mod resolution;

use glam::DVec3;

use crate::case::estimate::Estimate;
use crate::case::expect::{Expectation, Measure};
use crate::case::settling::{expected_time_step, is_free};
use crate::number_format::{AXES, SIDES, number, quantity};
use crate::{Plane, PlanePosition, RunPlan, Stop};
use grainwake_solver::dem::{Grain, MotionConstraint, outside};
use grainwake_solver::flow::Boundary;
use grainwake_solver::immersed::{Scheme, Start};
use grainwake_solver::math::Precision;
use grainwake_solver::sim::events::StopWhen;
use grainwake_solver::sim::{Setup, StepRule};

/// Number of steps that suggests a wrong unit.
const ABSURD_STEPS: f64 = 100_000_000.0;
/// Densities of grains that do not suggest a wrong unit [kg/m^3], from foam to osmium.
const ORDINARY_DENSITIES: std::ops::RangeInclusive<f64> = 5.0..=25_000.0;
/// Settling Reynolds number below which a grain hardly moves, which suggests a wrong unit.
const ABSURD_REYNOLDS: f64 = 1e-4;
/// Part of the weight that a body acceleration may leave unbalanced without a warning.
const BALANCE_TOLERANCE: f64 = 0.01;

/// Returns all warnings of a case.
pub(super) fn warnings(
    setup: &Setup,
    plan: &RunPlan,
    expect: &[Expectation],
    e: &Estimate,
) -> Vec<String> {
    let mut found = wrong_units(setup, plan, e);
    found.extend(resolution::resolution_and_cost(setup, e));
    found.extend(contact::deep_impacts(setup));
    found.extend(contact::long_substeps(setup));
    found.extend(contact::few_substeps(setup));
    found.extend(contact::film_off_the_grid(setup));
    found.extend(contact::tiny_asperities(setup));
    found.extend(contact::start_out_of_balance(setup));
    found.extend(light_grains(setup, plan.stop.as_ref()));
    found.extend(ignored_in_dry_runs(setup, plan, expect));
    found.extend(open_faces(setup));
    found.extend(starts_next_to_open_face(setup));
    found.extend(surface_against_gravity(setup));
    found.extend(unsupported_weight(setup));
    found.extend(prescribed_motions(setup, plan.end));
    found.extend(flat_box(setup));
    found.extend(output_intervals(setup, e));
    found
}

/// Output intervals that shorten the steps.
fn output_intervals(setup: &Setup, e: &Estimate) -> Option<String> {
    let settling = e.settling_speed_m_per_s.unwrap_or(0.0);
    let allowed = expected_time_step(setup, settling, e.expected_end_s);
    (e.time_step_s < 0.5 * allowed).then(|| {
        format!(
            "an output every {} makes the steps shorter than the {} they could have: make [output] intervals longer",
            quantity(e.time_step_s, "s"),
            quantity(allowed, "s")
        )
    })
}

/// Open faces through which grains may leave.
fn open_faces(setup: &Setup) -> Vec<String> {
    let density = setup.fluid.as_ref().map_or(0.0, |fluid| fluid.density);
    let weights = setup.grains.iter().filter(|grain| is_free(grain));
    let pulls: Vec<DVec3> =
        weights.map(|grain| setup.gravity * (grain.density - density).signum()).collect();
    let mut found = Vec::new();
    for (axis, side) in (0..6).map(|k| (k / 2, k % 2)) {
        let outward = if side == 0 { -1.0 } else { 1.0 };
        let boundary = setup.boundaries.0[axis][side];
        let open = !boundary.is_solid() && !setup.boundaries.is_periodic(axis);
        let falls = pulls
            .iter()
            .any(|pull| outward * pull[axis] > 0.5 * pull.length() && *pull != DVec3::ZERO);
        let (side, axis) = (SIDES[side], AXES[axis]);
        if open && falls && boundary == Boundary::FreeSurface {
            found.push(format!(
                "grains may float in the free surface at the {side} side of {axis}, which stays flat: they have their buoyancy there, but make no waves and feel no splash and no surface tension"
            ));
        } else if open && falls {
            found.push(format!(
                "grains may leave through the {side} side of {axis}: they are gone from then on, with an event \"left\"; make it a \"wall\" to keep them"
            ));
        }
    }
    found
}

/// Free surfaces that are not level, or that have no fluid below them.
fn surface_against_gravity(setup: &Setup) -> Option<String> {
    let mut sides = (0..6).map(|k| (k / 2, k % 2));
    let tilted = |(axis, side): &(usize, usize)| {
        let outward = if *side == 0 { -1.0 } else { 1.0 };
        let up = -outward * setup.gravity.normalize_or_zero()[*axis];
        let surface = setup.boundaries.0[*axis][*side] == Boundary::FreeSurface;
        surface && setup.gravity != DVec3::ZERO && up < 0.999
    };
    let (axis, side) = sides.find(tilted)?;
    Some(format!(
        "gravity does not point straight into the fluid at the free surface on the {} side of {}: a free surface at rest is level, with the fluid below it; turn gravity, or make the side a \"slip\" wall",
        SIDES[side], AXES[axis]
    ))
}

/// Grains that start so close to an inflow or outflow that they move under the load of the step
/// before, and before the first step there is none.
fn starts_next_to_open_face(setup: &Setup) -> Option<String> {
    setup.fluid.as_ref()?;
    let mesh = &setup.mesh;
    let near = |grain: &Grain, axis: usize, side: usize| {
        let open =
            matches!(setup.boundaries.0[axis][side], Boundary::Inflow { .. } | Boundary::Outflow);
        let face = [mesh.origin, mesh.upper()][side][axis];
        let distance = (grain.pose.position[axis] - face).abs() - grain.shape.bounding_radius();
        open && distance < 2.0 * mesh.spacing[axis]
    };
    let mut found = (0..setup.grains.len()).flat_map(|i| (0..6).map(move |k| (i, k / 2, k % 2)));
    let (index, axis, side) = found.find(|(index, axis, side)| {
        let grain = &setup.grains[*index];
        is_free(grain) && near(grain, *axis, *side)
    })?;
    Some(format!(
        "grain {index} starts within two cells of the open {} side of {}: it moves without drag until it is farther away; move it by two cells",
        SIDES[side], AXES[axis]
    ))
}

/// Boxes in which neither wall nor grain supports the weight.
fn unsupported_weight(setup: &Setup) -> Option<String> {
    let fluid = setup.fluid.as_ref()?;
    let holds = |axis: usize| {
        let walls = setup.boundaries.0[axis];
        !setup.boundaries.is_periodic(axis)
            && (setup.gravity[axis] != 0.0
                || walls.iter().any(|wall| !matches!(wall, Boundary::Slip | Boundary::FreeSurface)))
    };
    let held = setup.grains.iter().any(|grain| !is_free(grain));
    let varies = setup.prescription.body_acceleration.is_some();
    if setup.gravity == DVec3::ZERO || held || varies || (0..3).any(holds) {
        return None;
    }
    let excess = |grain: &Grain| (grain.density - fluid.density) * grain.shape.volume();
    let weight: f64 = setup.grains.iter().map(excess).sum();
    // The acceleration drives the displaced fluid too: a grain takes the pressure gradient.
    let volume = setup.mesh.extent().element_product();
    let balance = -weight / (fluid.density * volume) * setup.gravity;
    let given = fluid.body_acceleration;
    let missing = (balance - given).project_onto(setup.gravity);
    if weight == 0.0 || missing.length() <= BALANCE_TOLERANCE * balance.length() {
        return None;
    }
    let (motion, cause) = match (missing.dot(setup.gravity) < 0.0, given == DVec3::ZERO) {
        (true, true) => ("fall", "no wall and no fixed grain carries the weight"),
        (false, true) => ("rise", "no wall and no fixed grain holds the grains down"),
        (true, false) => ("fall", "[fluid] body_acceleration does not balance the weight"),
        (false, false) => ("rise", "[fluid] body_acceleration is more than the weight"),
    };
    let balanced = (given + missing).to_array().map(number).join(", ");
    Some(format!(
        "{cause}: grains and fluid {motion} together, faster and faster; [fluid] body_acceleration = [{balanced}] (m/s2) balances it"
    ))
}

/// Prescribed motions through a wall.
fn prescribed_motions(setup: &Setup, end: f64) -> Vec<String> {
    const STEPS: u32 = 1000;
    let (mut grains, enclosure) = (setup.grains.clone(), setup.enclosure());
    let dt = end / f64::from(STEPS);
    let motions = setup.prescription.motions.iter();
    let driven: Vec<usize> = motions.map(|motion| motion.grain).collect();
    let moves = |index: &usize| match grains[*index].translation {
        MotionConstraint::Prescribed(velocity) => velocity != DVec3::ZERO || driven.contains(index),
        MotionConstraint::Free => false,
    };
    let moving: Vec<usize> = (0..grains.len()).filter(moves).collect();
    let mut found = Vec::new();
    let mut gone = vec![false; grains.len()];
    for step in 0..STEPS {
        let middle = (f64::from(step) + 0.5) * dt;
        setup.prescription.prescribe_motion(&mut grains, middle);
        for &index in &moving {
            if gone[index] {
                continue;
            }
            let grain = &mut grains[index];
            if let MotionConstraint::Prescribed(velocity) = grain.translation {
                grain.pose.position += dt * velocity;
            }
            let out = outside(std::slice::from_ref(grain), &enclosure);
            let through = |axis: usize, side: usize| setup.boundaries.0[axis][side].is_solid();
            if let Some(out) = out.iter().find(|out| through(out.axis, out.side)) {
                gone[index] = true;
                found.push(format!(
                    "the prescribed motion of grain {index} takes it through the {} wall of {} at t = {}: nothing stops a prescribed motion",
                    SIDES[out.side],
                    AXES[out.axis],
                    quantity(middle + 0.5 * dt, "s")
                ));
            }
        }
    }
    found
}

/// Grains in a box that is one cell thick: free ones, and those away from its middle.
fn flat_box(setup: &Setup) -> Vec<String> {
    let Some(axis) = setup.flat_axis() else { return Vec::new() };
    let (mesh, name) = (&setup.mesh, AXES[axis]);
    let depth = mesh.extent()[axis];
    let mut found = Vec::new();
    if setup.grains.iter().any(is_free) {
        found.push(format!(
            "the box is one cell thick along {name}: grains move in its plane only, and the flow sees a grain as a body of the whole depth, {}, but its weight and inertia are those of its own shape; make it nearly as deep",
            quantity(depth, "m")
        ));
    }
    let middle = mesh.origin[axis] + 0.5 * depth;
    let away = |grain: &Grain| (grain.pose.position[axis] - middle).abs() > 0.01 * depth;
    if let Some(index) = setup.grains.iter().position(away) {
        found.push(format!(
            "the box is one cell thick along {name}: the flow sees the section of grain {index} at {name} = {}, in the middle of the box, but its centre is at {}; move it to the middle",
            quantity(middle, "m"),
            quantity(setup.grains[index].pose.position[axis], "m")
        ));
    }
    found
}

/// Numbers that suggest a wrong unit.
fn wrong_units(setup: &Setup, plan: &RunPlan, e: &Estimate) -> Vec<String> {
    let mut found = Vec::new();
    let steps = plan.end / e.time_step_s;
    if steps > ABSURD_STEPS {
        let viscous = matches!(setup.step, StepRule::Limits { .. }) && setup.fluid.is_some();
        let cause = if viscous {
            "look at the units of viscosity, cell_size, velocities and time.end"
        } else {
            "look at the units of time.step and time.end"
        };
        found.push(format!(
            "{:.1e} steps of {} to the end are more than can be run: {cause}",
            steps,
            quantity(e.time_step_s, "s")
        ));
    }
    // Dimensionless cases have other gravities.
    let in_si = (9.0..10.5).contains(&setup.gravity.length());
    let odd = |grain: &Grain| in_si && !ORDINARY_DENSITIES.contains(&grain.density);
    if let Some((index, grain)) = setup.grains.iter().enumerate().find(|(_, grain)| odd(grain)) {
        let more = setup.grains.iter().skip(index + 1).filter(|grain| odd(grain)).count();
        let others = if more == 0 { String::new() } else { format!(", {more} more like it") };
        found.push(format!(
            "grain {index} has a density of {}{others}: look at its unit, for example \"2.5 g/cm3\"",
            quantity(grain.density, "kg/m3")
        ));
    }
    let falls = setup.gravity != DVec3::ZERO;
    if let (Some(re), Some(speed)) = (e.reynolds, e.settling_speed_m_per_s)
        && falls
        && re < ABSURD_REYNOLDS
    {
        found.push(format!(
            "the grains settle at Re {re:.1e} and {}: they will hardly move; look at the units of viscosity, densities and diameters",
            quantity(speed, "m/s")
        ));
    }
    found
}

/// Returns whether a plane differs from the default planes.
fn is_own(plane: &Plane, setup: &Setup) -> bool {
    let (origin, extent) = (setup.mesh.origin[plane.axis], setup.mesh.extent()[plane.axis]);
    plane.axis == 2
        || match plane.position {
            PlanePosition::Grain(_) => false,
            PlanePosition::At(at) => (at - origin - 0.5 * extent).abs() >= 1e-9 * extent,
        }
}

/// Requests about the flow of a dry run.
fn ignored_in_dry_runs(setup: &Setup, plan: &RunPlan, expect: &[Expectation]) -> Option<String> {
    let of_flow = |e: &Expectation| e.measure == Measure::MaxDivergence;
    let requests = [
        (plan.planes.iter().any(|plane| is_own(plane, setup)), "output.planes"),
        (plan.slices > 0.0, "output.slices"),
        (plan.fields > 0.0, "output.fields"),
        (expect.iter().any(of_flow), "expect.max_divergence"),
        (setup.start != Start::default(), "coupling.start"),
        (setup.scheme != Scheme::default(), "coupling.scheme"),
        (setup.precision != Precision::default(), "run.precision"),
    ];
    let requested = requests.into_iter().filter(|(requested, _)| *requested);
    let names: Vec<&str> = requested.map(|(_, name)| name).collect();
    (setup.fluid.is_none() && !names.is_empty()).then(|| {
        format!(
            "there is no [fluid], so the run is dry and {} {} no effect: add [fluid] with density and viscosity if it was forgotten",
            names.join(", "),
            if names.len() == 1 { "has" } else { "have" }
        )
    })
}

/// Free grains that rise.
fn light_grains(setup: &Setup, stop: Option<&Stop>) -> Vec<String> {
    let Some(fluid) = &setup.fluid else {
        return Vec::new();
    };
    let grains = setup.grains.iter();
    let free: Vec<f64> =
        grains.filter(|grain| is_free(grain)).map(|grain| grain.density / fluid.density).collect();
    let mut found = Vec::new();
    let rising = free.iter().filter(|ratio| **ratio < 1.0).count();
    if rising == 0 || setup.gravity == DVec3::ZERO {
        return found;
    }
    let all = rising == free.len();
    found.push(if all {
        "the free grains are lighter than the fluid: they rise, and settling, landing and leading are meant upwards".into()
    } else {
        format!("{rising} of {} free grains are lighter than the fluid and rise", free.len())
    });
    if !all && stop.is_some_and(|stop| stop.when == StopWhen::Landing) {
        found.push(
            "stop = \"landing\" may never be met: it waits until every free grain has touched the floor"
                .into(),
        );
    }
    found
}

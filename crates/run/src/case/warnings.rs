//! What may spoil the results of a case, said before it runs.

use glam::DVec3;

use super::Case;
use super::estimate::{Estimate, terminal_speed, time_step};
use super::readable::quantity;
use crate::{Plane, PlanePosition, Stop};
use grainwake_solver::dem::{ContactLawKind, Grain, MotionConstraint, outside};
use grainwake_solver::flow::Boundary;
use grainwake_solver::math::Precision;
use grainwake_solver::sim::events::StopWhen;
use grainwake_solver::sim::{Setup, StepRule};

/// Steps over which the roundings of singles, all of one sign, come to .3 %.
const MOST_SINGLE_STEPS: u64 = 50_000;
/// More steps than any run has: a unit must be wrong.
const ABSURD_STEPS: u64 = 100_000_000;
/// A grain that settles with a smaller Reynolds number does not move.
const ABSURD_REYNOLDS: f64 = 1e-4;

/// All warnings of a case.
pub(super) fn all(case: &Case, e: &Estimate) -> Vec<String> {
    let mut found = of_units(&case.setup, e);
    found.extend(of_numbers(&case.setup, e));
    found.extend(of_light_grains(&case.setup, case.plan.stop.as_ref()));
    found.extend(of_dry(case));
    found.extend(of_open_faces(&case.setup));
    found.extend(of_endless_fall(&case.setup));
    found.extend(of_given_motions(&case.setup, case.plan.end));
    found.extend(of_flat_boxes(&case.setup));
    found
}

fn is_free(grain: &&Grain) -> bool {
    grain.translation == MotionConstraint::Free
}

/// Faces that grains fall, or rise, out through.
fn of_open_faces(setup: &Setup) -> Vec<String> {
    let density = setup.fluid.as_ref().map_or(0.0, |fluid| fluid.density);
    let weights = setup.grains.iter().filter(is_free);
    let pulls: Vec<DVec3> = weights
        .map(|grain| setup.gravity * (grain.density - density).signum())
        .collect();
    let mut found = Vec::new();
    for (axis, side) in (0..6).map(|k| (k / 2, k % 2)) {
        let outward = if side == 0 { -1.0 } else { 1.0 };
        let boundary = setup.boundaries.0[axis][side];
        let open = !boundary.is_solid() && !setup.boundaries.is_periodic(axis);
        let falls = pulls
            .iter()
            .any(|pull| outward * pull[axis] > 0.5 * pull.length() && *pull != DVec3::ZERO);
        if open && falls {
            found.push(format!(
                "grains may leave through the {} face of {}: outside they go on in free fall, feel no fluid and still count in tables and speeds; make it a \"wall\", or end the run before",
                ["lower", "upper"][side],
                ["x", "y", "z"][axis]
            ));
        }
    }
    found
}

/// A box in which nothing holds fluid and grains against gravity.
fn of_endless_fall(setup: &Setup) -> Option<String> {
    let fluid = setup.fluid.as_ref()?;
    let holds = |axis: usize| {
        let walls = setup.boundaries.0[axis];
        !setup.boundaries.is_periodic(axis)
            && (setup.gravity[axis] != 0.0
                || walls
                    .iter()
                    .any(|wall| !matches!(wall, Boundary::Slip | Boundary::FreeSurface)))
    };
    let held = setup.grains.iter().any(|grain| !is_free(&grain));
    let driven =
        fluid.body_acceleration != DVec3::ZERO || setup.prescription.body_acceleration.is_some();
    if setup.gravity == DVec3::ZERO || held || driven || (0..3).any(holds) {
        return None;
    }
    let (mut weight, mut solid) = (0.0, 0.0);
    for grain in &setup.grains {
        weight += (grain.density - fluid.density) * grain.shape.volume();
        solid += grain.shape.volume();
    }
    let open = setup.mesh.extent().element_product() - solid;
    let balance = -weight / (fluid.density * open) * setup.gravity;
    (weight != 0.0).then(|| {
        let balance = balance.to_array().map(|a| match a == 0.0 {
            true => "0".into(),
            false => format!("{a:.4e}"),
        });
        format!(
            "no wall and no held grain carries the weight: grains and fluid fall together, faster and faster; [fluid] body_acceleration = [{}] (m/s2) balances it within a percent",
            balance.join(", ")
        )
    })
}

/// Given motions that take a grain through a wall.
fn of_given_motions(setup: &Setup, end: f64) -> Vec<String> {
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
                    "the given motion of grain {index} takes it through the {} wall of {} at t = {}: nothing stops a given motion",
                    ["lower", "upper"][out.side],
                    ["x", "y", "z"][out.axis],
                    quantity(middle + 0.5 * dt, "s")
                ));
            }
        }
    }
    found
}

/// Grains in a box one cell thick, where they stand for bodies of its whole depth.
fn of_flat_boxes(setup: &Setup) -> Option<String> {
    setup.fluid.as_ref()?;
    let axis = (0..3).find(|axis| setup.mesh.cells[*axis] == 1)?;
    let mut free = setup.grains.iter().filter(is_free);
    free.next().map(|_| {
        let name = ["x", "y", "z"][axis];
        format!(
            "the box is one cell thick along {name}: the flow sees a grain as a body of the whole depth, {}, but its weight and inertia are those of its own shape; make it nearly as deep",
            quantity(setup.mesh.extent()[axis], "m")
        )
    })
}

/// Numbers that no run has, from a unit mistaken.
fn of_units(setup: &Setup, e: &Estimate) -> Vec<String> {
    let mut found = Vec::new();
    if e.steps > ABSURD_STEPS {
        let viscous = matches!(setup.step, StepRule::Limits { .. }) && setup.fluid.is_some();
        let cause = if viscous {
            "look at the units of viscosity, cell_size and time.end"
        } else {
            "look at the units of time.step and time.end"
        };
        found.push(format!(
            "{:.1e} steps of {} to the end are more than can be run: {cause}",
            e.steps as f64,
            quantity(e.time_step_s, "s")
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

/// Whether the planes are not those of a case that gives none.
fn own_planes(case: &Case) -> bool {
    let mesh = &case.setup.mesh;
    let middle = mesh.origin + 0.5 * mesh.extent();
    let usual = |plane: &Plane| match plane.position {
        PlanePosition::Grain(_) => plane.axis < 2,
        PlanePosition::At(at) => {
            plane.axis < 2 && (at - middle[plane.axis]).abs() < 1e-9 * mesh.extent()[plane.axis]
        }
    };
    !case.plan.planes.iter().all(usual)
}

/// What is asked for of the flow of a case without one.
fn of_dry(case: &Case) -> Option<String> {
    if case.setup.fluid.is_some() {
        return None;
    }
    let table: toml::Table = case.resolved.parse().ok()?;
    let section = |name: &str| table.get(name).and_then(toml::Value::as_table);
    let asked = [
        (own_planes(case), "output.planes"),
        (case.plan.slices > 0.0, "output.slices"),
        (case.plan.fields > 0.0, "output.fields"),
        (
            section("expect").is_some_and(|e| e.contains_key("max_divergence")),
            "expect.max_divergence",
        ),
    ];
    let names: Vec<&str> = asked
        .iter()
        .filter(|(is, _)| *is)
        .map(|(_, name)| *name)
        .collect();
    (!names.is_empty()).then(|| {
        format!(
            "there is no [fluid], so the run is dry and {} {} no effect: add [fluid] with density and viscosity if it was forgotten",
            names.join(", "),
            if names.len() == 1 { "has" } else { "have" }
        )
    })
}

fn of_numbers(setup: &Setup, e: &Estimate) -> Vec<String> {
    let mut found = Vec::new();
    if let Some(n) = e.cells_per_diameter.filter(|n| *n < 8.0) {
        found.push(format!("only {n:.1} cells across the smallest grain: below 8 forces are rough; make cell_size smaller"));
    }
    if let (Some(n), Some(re)) = (e.cells_per_diameter, e.reynolds) {
        let error = 0.02 * re / (n * n);
        if error > 0.1 {
            found.push(format!(
                "at Re {re:.0} and {n:.1} cells per diameter the boundary layer is not resolved (its thickness is about {:.1} cells); expect forces off by 10 % or more",
                n / re.sqrt()
            ));
        }
    }
    if let Some(blockage) = e.blockage.filter(|b| *b > 0.05) {
        let closed =
            (0..3).any(|axis| !setup.boundaries.is_periodic(axis) && setup.gravity[axis] == 0.0);
        let what = if closed {
            "the walls slow the grains"
        } else {
            "the grain feels its own images"
        };
        found.push(format!("a grain blocks {:.0} % of the cross-section: {what}; widen the box for an unbounded fluid", 100.0 * blockage));
    }
    // A dry run has nothing but contact to compute.
    let wet = setup.fluid.is_some();
    // On a small grid it does not matter.
    let large = wet && setup.mesh.cell_count() > 1_000_000;
    for (axis, &n) in setup.mesh.cells.iter().enumerate() {
        if large && largest_prime(n) > LARGEST_CHEAP_PRIME {
            let near = |step: i64| {
                let mut m = n as i64;
                while m > 1 && largest_prime(m as usize) > 5 {
                    m += step;
                }
                m
            };
            found.push(format!(
                "{n} cells along {} have a large prime factor, {}: a step takes half as long again; {} or {} cells are fast",
                ["x", "y", "z"][axis],
                largest_prime(n),
                near(-1),
                near(1)
            ));
        }
    }
    if setup.precision == Precision::Single && e.steps > MOST_SINGLE_STEPS {
        found.push(format!(
            "single precision loses what a step adds beyond its seventh digit: over {} steps speeds may drift by {:.1} %; \"f64\" does not",
            e.steps,
            100.0 * f64::from(f32::EPSILON) / 2.0 * e.steps as f64
        ));
    }
    if let Some(substeps) = e.contact_substeps.filter(|n| wet && *n > 200.0) {
        let remedy = match setup.contact.law {
            ContactLawKind::Linear => "a lower [contact] stiffness or a larger maximum_overlap",
            ContactLawKind::HertzMindlin => "a lower youngs_modulus",
        };
        found.push(format!(
            "contacts need {substeps:.0} sub-steps a step: {remedy} is cheaper"
        ));
    }
    if let Some(overlap) = expected_overlap(setup).filter(|overlap| *overlap > 0.05) {
        let remedy = match setup.contact.law {
            ContactLawKind::Linear => "[contact] stiffness",
            ContactLawKind::HertzMindlin => "youngs_modulus",
        };
        found.push(format!(
            "a grain at its settling speed would overlap by {:.0} % of its diameter at impact: raise {remedy}",
            100.0 * overlap
        ));
    }
    if let StepRule::Fixed(step) = setup.step {
        let limits = setup.clone().with_step(StepRule::Limits {
            cfl: 0.6,
            viscous: 0.216,
            max_step: f64::INFINITY,
        });
        let most = time_step(&limits, e.settling_speed_m_per_s.unwrap_or(0.0));
        if step > most {
            found.push(format!(
                "the fixed step of {} is above the stability limit of about {}",
                quantity(step, "s"),
                quantity(most, "s")
            ));
        }
    }
    found
}

/// Warnings of free grains that are light beside the fluid: they rise.
fn of_light_grains(setup: &Setup, stop: Option<&Stop>) -> Vec<String> {
    let Some(fluid) = &setup.fluid else {
        return Vec::new();
    };
    let grains = setup.grains.iter();
    let free: Vec<f64> = grains
        .filter(|grain| grain.translation == MotionConstraint::Free)
        .map(|grain| grain.density / fluid.density)
        .collect();
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

/// Prime factors of a number of cells up to this one cost no more than others.
const LARGEST_CHEAP_PRIME: usize = 13;

/// Largest prime factor of `n`; 1 of 1.
fn largest_prime(mut n: usize) -> usize {
    let (mut largest, mut factor) = (1, 2);
    while factor * factor <= n {
        while n.is_multiple_of(factor) {
            (largest, n) = (factor, n / factor);
        }
        factor += 1;
    }
    largest.max(n)
}

/// Overlap of an impact at the settling speed over the diameter, largest.
fn expected_overlap(setup: &Setup) -> Option<f64> {
    let fluid = setup.fluid.as_ref()?;
    let g = setup.gravity.length();
    let of = |grain: &Grain| {
        let speed = terminal_speed(grain, fluid, g).max(grain.velocity.length());
        setup.contact.impact_overlap(grain, speed) / grain.shape.equivalent_diameter()
    };
    setup.grains.iter().map(of).reduce(f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prime_factors_are_found() {
        let found = [1, 2, 97, 100, 131, 390, 2 * 53].map(largest_prime);
        assert_eq!(found, [1, 2, 97, 5, 131, 13, 53]);
    }
}

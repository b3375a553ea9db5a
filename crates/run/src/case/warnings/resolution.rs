//! Warnings about resolution and cost.

use crate::case::blockage::flow_direction;
use crate::case::estimate::{
    Estimate, cells_for_drag_error, drag_error_text, thin_layer_drag_error,
};
use crate::case::settling::{is_free, prescribed_speeds, time_step};
use crate::case::time_scale::resolved_step;
use crate::number_format::{AXES, quantity};
use glam::DVec3;
use grainwake_solver::dem::{ContactLawKind, Grain};
use grainwake_solver::flow::Boundary;
use grainwake_solver::immersed::Scheme;
use grainwake_solver::math::{Precision, largest_prime_factor};
use grainwake_solver::sim::{Setup, StepRule};

/// Cells across the shortest axis of a grain below which forces are rough. Oblate spheroids of
/// 3 : 1 at 8 cells per diameter have 3.8 (`docs/accuracy.md`).
const THIN: f64 = 3.0;
/// Wall-clock time from which the cost of contact is a reason for a warning [s].
const LONG_RUN: f64 = 600.0;
/// Part of the cost of contact from which it dominates.
const CONTACT_DOMINATES: f64 = 0.5;
/// CFL number of the first step from which it is unstable.
const UNSTABLE_CFL: f64 = 1.0;
/// Cells per diameter below which forces are rough.
const COARSE: f64 = 8.0;
/// Cells per diameter below which a run may become unstable.
const MAY_FAIL: f64 = 4.0;
/// Estimated error of the drag from which the resolution is a reason for a warning.
const LARGEST_DRAG_ERROR: f64 = 0.05;
/// Step over the longest one that follows the formulas from which it is a reason for a warning.
const LONGEST_FORMULA_STEP: f64 = 2.0;
/// Steps over which single-precision rounding errors of one sign add up to 0.3 %.
const MOST_SINGLE_STEPS: u64 = 50_000;

/// Coarse grids, blockage, and costs.
pub(super) fn resolution_and_cost(setup: &Setup, e: &Estimate) -> Vec<String> {
    let mut found = Vec::new();
    let finer = finer_grid(setup);
    // The number counts as printed: a measured diameter of 7.98 cells is no reason for a warning.
    let printed = |n: f64| (10.0 * n).round() / 10.0;
    if let Some(n) = e.cells_per_diameter.map(printed).filter(|n| *n < COARSE) {
        let unstable = match n < MAY_FAIL {
            true => format!(", and below {MAY_FAIL:.0} the run may become unstable"),
            false => String::new(),
        };
        found.push(format!("only {n:.1} cells across the smallest grain: below {COARSE:.0} forces are rough{unstable}; {finer}"));
    }
    if let Some(n) = e.cells_across_shortest_axis.map(printed).filter(|n| *n < THIN) {
        found.push(format!("only {n:.1} cells across the shortest axis of the thinnest grain: below {THIN:.0} forces are rough; {finer}"));
    }
    if let (Some(n), Some(re)) = (e.cells_per_diameter, e.largest_reynolds()) {
        let error = thin_layer_drag_error(n, re);
        if error > LARGEST_DRAG_ERROR {
            found.push(format!(
                "at Re {re:.0} and {n:.1} cells per diameter the boundary layer is not resolved (its thickness is about {:.1} cells): the drag may be up to {} too low; {} cells reduce the error to 3 %: {finer}",
                n / re.sqrt(),
                drag_error_text(error, 0),
                cells_for_drag_error(0.03, re)
            ));
        }
    }
    if let Some(blockage) = e.blockage.filter(|b| *b > 0.05) {
        let along = flow_direction(setup, e.expected_end_s).unwrap_or(DVec3::ZERO).abs();
        let main = (0..3).find(|axis| along[*axis] > 0.0 && along[*axis] == along.max_element());
        let closed = (0..3).any(|axis| Some(axis) != main && !setup.boundaries.is_periodic(axis));
        let what = match (closed, setup.grains.iter().any(is_free)) {
            (true, true) => "the walls slow the grains",
            (true, false) => "the sides of the box raise the drag",
            (false, _) => "the grain feels its own images",
        };
        found.push(format!("a grain blocks {:.0} % of the cross-section: {what}; widen the box for an unbounded fluid", 100.0 * blockage));
    }
    let wet = setup.fluid.is_some();
    // The transform is a small part of the cost of a small grid.
    let large = wet && setup.mesh.cell_count() > 1_000_000;
    for (axis, &n) in setup.mesh.cells.iter().enumerate() {
        if large && largest_prime_factor(n) > LARGEST_CHEAP_PRIME {
            let fast = |n: &usize| largest_prime_factor(*n) <= 5;
            let below = (1..n).rev().find(fast).unwrap_or(1);
            let above = (n..).find(fast).unwrap_or(n);
            found.push(format!(
                "{n} cells along {} have a large prime factor, {}: a step takes half as long again; {below} or {above} cells are fast",
                AXES[axis],
                largest_prime_factor(n)
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
    found.extend(refined_surface(setup));
    found.extend(contact_cost(setup, e));
    found.extend(first_step(setup));
    found.extend(unresolved_formulas(setup, e));
    if let StepRule::Fixed(step) = setup.step {
        let limits = setup.clone().with_step(StepRule::Limits {
            cfl: 0.6,
            viscous: 0.216,
            max_step: f64::INFINITY,
        });
        let prescribed = prescribed_speeds(setup, e.expected_end_s);
        let speed = prescribed.into_iter().fold(e.settling_speed_m_per_s.unwrap_or(0.0), f64::max);
        let most = time_step(&limits, speed);
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

/// Refined box around a grain that floats up to a free surface, where the run stops.
fn refined_surface(setup: &Setup) -> Option<String> {
    (setup.refinement > 1 && floats_up(setup)).then(|| {
        "a grain that is lighter than the fluid floats up to the free surface, where the grid cannot be refined and the run stops: leave out [domain] refinement, and make cell_size smaller".into()
    })
}

/// Returns whether a free grain is lighter than the fluid, and the box has a free surface.
fn floats_up(setup: &Setup) -> bool {
    let has_surface = setup.boundaries.0.as_flattened().contains(&Boundary::FreeSurface);
    let density = setup.fluid.map_or(0.0, |fluid| fluid.density);
    has_surface && setup.grains.iter().any(|grain| is_free(grain) && grain.density < density)
}

/// Advice to resolve the grains better.
fn finer_grid(setup: &Setup) -> &'static str {
    let can_refine = setup.refinement == 1
        && setup.scheme == Scheme::Aperture
        && setup.mesh.cells.iter().all(|n| *n > 1)
        && !floats_up(setup);
    if can_refine {
        "make cell_size smaller, or set refinement = 2 in [domain], which halves the cells around the grains"
    } else {
        "make cell_size smaller"
    }
}

/// Contact that dominates the cost of a long run, or needs many sub-steps in a fluid.
fn contact_cost(setup: &Setup, e: &Estimate) -> Option<String> {
    let substeps = e.contact_substeps?;
    let dominates = e.contact_share > CONTACT_DOMINATES && e.wall_s > LONG_RUN;
    let many = setup.fluid.is_some() && substeps > 200.0;
    let stiffness = match setup.contact.law {
        ContactLawKind::Linear => "a lower [contact] stiffness or a larger maximum_overlap",
        ContactLawKind::HertzMindlin => "a lower youngs_modulus",
    };
    (dominates || many).then(|| {
        format!(
            "contact takes {:.0} % of the wall time ({substeps:.0} sub-steps per step): {stiffness}, fewer nodes per grain or fewer substeps_per_contact are cheaper",
            100.0 * e.contact_share
        )
    })
}

/// Steps that are too long for the formulas of time.
fn unresolved_formulas(setup: &Setup, e: &Estimate) -> Option<String> {
    let step = e.time_step_s;
    let resolved = resolved_step(&setup.prescription, e.expected_end_s, step);
    (step > LONGEST_FORMULA_STEP * resolved).then(|| {
        format!(
            "steps of {} do not follow the prescribed motions or the body acceleration; steps of at most {} do",
            quantity(step, "s"),
            quantity(resolved, "s")
        )
    })
}

/// Initial velocities of free grains for which the first fixed step is too long.
fn first_step(setup: &Setup) -> Option<String> {
    let StepRule::Fixed(step) = setup.step else {
        return None;
    };
    setup.fluid.as_ref()?;
    let spacing = setup.finest_spacing();
    let inverse_spacing = |axis: usize| {
        if setup.mesh.is_resolved(axis) { 1.0 / spacing[axis] } else { 0.0 }
    };
    let cfl = |grain: &Grain| {
        let turning = grain.angular_velocity.length() * grain.shape.bounding_radius();
        (0..3)
            .map(|axis| (grain.velocity[axis].abs() + turning) * inverse_spacing(axis))
            .sum::<f64>()
            * step
    };
    let free = setup.grains.iter().enumerate().filter(|(_, grain)| is_free(grain));
    let numbers = free.map(|(index, grain)| (index, cfl(grain)));
    let (index, cfl) = numbers.max_by(|a, b| a.1.total_cmp(&b.1))?;
    (cfl > UNSTABLE_CFL).then(|| {
        format!(
            "the velocity of grain {index} at the start gives the first step a CFL number of {cfl:.1}: a fixed step of {} or less is stable, and [time] cfl adapts it",
            quantity(step * UNSTABLE_CFL / cfl, "s")
        )
    })
}

/// Largest prime factor of a number of cells for which the Fourier transform is fast.
const LARGEST_CHEAP_PRIME: usize = 13;

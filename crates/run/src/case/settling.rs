//! Settling of grains in closed form: Galileo number, settling speed, impact speed, time step.

use std::f64::consts::{FRAC_PI_4, LN_2};

use glam::DVec3;

use grainwake_solver::dem::{Grain, MotionConstraint};
use grainwake_solver::flow::{Boundary, FluidParams};
use grainwake_solver::grid::Mesh;
use grainwake_solver::sim::events::EventParams;
use grainwake_solver::sim::{Prescription, Setup, StepRule};

use super::blockage::blockage_along;
use super::time_scale::{resolved_step, spread_times};

/// Speed of the fluid beside a grain, as the sum over the axes that counts in the CFL number, over
/// that of the grain relative to the fluid far away (1.39 in an inflow past a fixed sphere, Re 60).
const BESIDE_GRAIN: f64 = 1.4;
/// Largest blockage by which the speed of the fluid beside a grain is raised.
const MOST_BLOCKAGE: f64 = 0.5;
/// Part of its limit up to which the clock takes longer steps again, after the flow past a held
/// grain was fastest in the first steps.
pub(super) const LONGER_UP_TO: f64 = 0.95;
/// Largest density of a grain [kg/m3].
pub(super) const HEAVIEST: f64 = 1e9;

/// Returns the Galileo number sqrt(|rho_p / rho_f - 1| g d^3) / nu of a grain.
pub fn galileo(grain: &Grain, fluid: &FluidParams, g: f64) -> f64 {
    let d = grain.shape.equivalent_diameter();
    ((grain.density / fluid.density - 1.0).abs() * g * d.powi(3)).sqrt() / fluid.kinematic_viscosity
}

/// Returns the drag coefficient of a sphere by Schiller and Naumann (0.44 from Re 1000 on).
pub fn sphere_drag(reynolds: f64) -> f64 {
    if reynolds >= 1000.0 { 0.44 } else { 24.0 / reynolds * (1.0 + 0.15 * reynolds.powf(0.687)) }
}

/// Factors by which the shape of a grain raises the drag of slow (k_S) and of fast flow (k_N), mean
/// over the orientations (Bagheri & Bonadonna 2016), with the extents `a` >= `b` >= `c` [m], the
/// equal-volume diameter `d` [m] and the density over that of the fluid.
fn shape_factors([a, b, c]: [f64; 3], d: f64, density_ratio: f64) -> [f64; 2] {
    let (flatness, elongation, box_part) = (c / b, b / a, d.powi(3) / (a * b * c));
    let slow = (flatness * elongation.powf(1.3) * box_part).cbrt();
    let fast = (flatness * flatness * elongation * box_part).min(1.0);
    let ratio = density_ratio.log10();
    let factor = 0.45 + 10.0 / ((2.5 * ratio).exp() + 30.0);
    let exponent = 1.0 - 37.0 / ((3.0 * ratio).exp() + 100.0);
    [0.5 * (slow + 1.0 / slow), 10.0_f64.powf(factor * (-fast.log10()).powf(exponent))]
}

/// Returns the drag coefficient of a grain for its equal-volume diameter by Bagheri and Bonadonna
/// (2016), at least that of a sphere.
fn grain_drag([slow, fast]: [f64; 2], reynolds: f64) -> f64 {
    let re = reynolds * fast / slow;
    let viscous = 24.0 * slow / reynolds * (1.0 + 0.125 * re.cbrt().powi(2));
    sphere_drag(reynolds).max(viscous + 0.46 * fast / (1.0 + 5330.0 / re))
}

/// Returns the settling Reynolds number of an unbounded sphere of this Galileo number.
pub fn settling_reynolds(galileo: f64) -> f64 {
    reynolds_with(galileo, sphere_drag)
}

/// Returns the Reynolds number at which the drag balances the weight less buoyancy:
/// C_D Re^2 = 4/3 Ga^2.
fn reynolds_with(galileo: f64, drag: impl Fn(f64) -> f64) -> f64 {
    let wanted = 4.0 / 3.0 * galileo * galileo;
    if wanted <= 0.0 {
        return 0.0;
    }
    let (mut low, mut high) = (1e-12_f64, 1e9_f64);
    for _ in 0..200 {
        let middle = (low * high).sqrt();
        if drag(middle) * middle * middle < wanted { low = middle } else { high = middle }
    }
    (low * high).sqrt()
}

/// Returns the settling speed of the equal-volume sphere [m/s].
pub fn terminal_speed(grain: &Grain, fluid: &FluidParams, g: f64) -> f64 {
    settling_reynolds(galileo(grain, fluid, g)) * fluid.kinematic_viscosity
        / grain.shape.equivalent_diameter()
}

/// Returns axis and side of the floor and the direction in which the grains fall; none if that side
/// of the box is no wall.
pub(super) fn floor(setup: &Setup) -> Option<(usize, usize, DVec3)> {
    let density = setup.fluid.map_or(0.0, |fluid| fluid.density);
    let EventParams { down, floor: (axis, side), .. } =
        EventParams::for_grains(&setup.grains, setup.gravity, density, setup.enclosure());
    let (axis, side) = (axis as usize, side as usize);
    let wall = setup.boundaries.0[axis][side];
    matches!(wall, Boundary::Wall { .. } | Boundary::Slip).then_some((axis, side, down))
}

/// Returns the time at which the last free grain is expected to touch the floor [s]; `None` if
/// there is no floor, a grain does not fall, something else drives the fluid, or the grains cover
/// half of the floor, so that some may come to rest on others.
///
/// Without fluid a grain falls freely. In a fluid it falls at its terminal speed, ln 2 relaxation
/// times later, as from rest under a drag that grows with the square of the speed. Velocities at
/// the start and other walls are left out.
pub(super) fn landing_time(setup: &Setup) -> Option<f64> {
    let (g, density) = (setup.gravity.length(), setup.fluid.map_or(0.0, |fluid| fluid.density));
    let (axis, side, down) = floor(setup)?;
    let cross_section = |grain: &Grain| grain.shape.equivalent_diameter().powi(2) * FRAC_PI_4;
    let covered: f64 = setup.grains.iter().map(cross_section).sum();
    let extent = setup.mesh.extent();
    if covered > 0.5 * extent.element_product() / extent[axis] || is_driven(setup) {
        return None;
    }
    let floor = [setup.mesh.origin, setup.mesh.upper()][side][axis];
    let time = |grain: &Grain| {
        let radius = 0.5 * grain.shape.equivalent_diameter();
        let height = (floor - grain.pose.position[axis]).abs() - radius;
        let fall = height.max(0.0) / down[axis].abs();
        let excess = (grain.density - density).abs();
        let Some(fluid) = &setup.fluid else {
            return (2.0 * fall / g).sqrt();
        };
        let (d, extents) = (2.0 * radius, grain.shape.morphology());
        let shape = shape_factors([extents.a, extents.b, extents.c], d, grain.density / density);
        let reynolds = reynolds_with(galileo(grain, fluid, g), |re| grain_drag(shape, re));
        let speed = reynolds * fluid.kinematic_viscosity / d;
        let relaxation = speed * (grain.density + 0.5 * density) / (excess * g);
        fall / speed + LN_2 * relaxation
    };
    let free = setup.grains.iter().filter(|grain| is_free(grain));
    let falls = |grain: &Grain| (grain.density - density) * setup.gravity.dot(down) > 0.0;
    if !free.clone().all(falls) {
        return None;
    }
    free.map(time).reduce(f64::max).filter(|time| time.is_finite())
}

/// Returns whether anything but grains drives the fluid.
fn is_driven(setup: &Setup) -> bool {
    let still = |side: &Boundary| match side {
        Boundary::Wall { velocity } | Boundary::Inflow { velocity } => *velocity == DVec3::ZERO,
        _ => true,
    };
    let given = &setup.prescription;
    let fluid_moves = |fluid: FluidParams| {
        fluid.body_acceleration != DVec3::ZERO || fluid.initial_velocity != DVec3::ZERO
    };
    setup.fluid.is_some_and(fluid_moves)
        || given.body_acceleration.is_some()
        || given.initial_velocity.is_some()
        || !setup.boundaries.0.iter().flatten().all(still)
}

/// Returns the speed at which a grain may hit a wall [m/s]: 1.5 times its settling speed, without
/// fluid the speed after falling through the box; at least its speed at the start.
pub(super) fn impact_speed(
    grain: &Grain,
    fluid: Option<&FluidParams>,
    gravity: DVec3,
    mesh: &Mesh,
) -> f64 {
    let g = gravity.length();
    let height = (mesh.extent() * gravity.normalize_or_zero()).length();
    let falling = match fluid {
        Some(fluid) => 1.5 * terminal_speed(grain, fluid, g),
        None => (2.0 * g * height).sqrt(),
    };
    falling.max(grain.velocity.length())
}

/// Returns the step that the rule allows at the largest settling speed [s].
pub(super) fn settled_time_step(setup: &Setup) -> f64 {
    let g = setup.gravity.length();
    let speed = setup.fluid.as_ref().map_or(0.0, |fluid| {
        let free = setup.grains.iter().filter(|grain| is_free(grain));
        let speeds = free.map(|grain| terminal_speed(grain, fluid, g));
        speeds.fold(0.0, f64::max)
    });
    time_step(setup, speed)
}

/// Returns the mean step expected of a run until `end` [s], at the `settling` speed [m/s] or the
/// speeds of grains with prescribed motion.
pub(super) fn expected_time_step(setup: &Setup, settling: f64, end: f64) -> f64 {
    let (allowed, speeds) = (step_at(setup), prescribed_speeds(setup, end));
    let steps_per_second = speeds.iter().map(|speed| 1.0 / allowed(speed.max(settling)));
    speeds.len() as f64 / steps_per_second.sum::<f64>()
}

/// Returns the largest speed of the grains with prescribed motion, as the sum over the axes that
/// counts in the CFL number [m/s], at times spread over the run until `end` [s]; at one time, if no
/// motion is a formula.
pub(super) fn prescribed_speeds(setup: &Setup, end: f64) -> Vec<f64> {
    let times = if setup.prescription.motions.is_empty() { 1 } else { 200 };
    let mut driven: Vec<Grain> = setup.grains.clone();
    let prescribed = |constraint: MotionConstraint| match constraint {
        MotionConstraint::Prescribed(velocity) => velocity,
        MotionConstraint::Free => DVec3::ZERO,
    };
    let of = |grain: &Grain| {
        let spin = prescribed(grain.rotation).length() * grain.shape.bounding_radius();
        prescribed(grain.translation).abs().element_sum() + spin
    };
    let at = |time: f64| {
        setup.prescription.prescribe_motion(&mut driven, time);
        driven.iter().map(of).fold(0.0, f64::max)
    };
    spread_times(times, end).map(at).collect()
}

/// Returns the step that the rule allows at `speed` [s].
pub(super) fn time_step(setup: &Setup, speed: f64) -> f64 {
    step_at(setup)(speed)
}

/// Returns the step [s] that the rule allows, as a function of the speed of the grains [m/s].
fn step_at(setup: &Setup) -> impl Fn(f64) -> f64 {
    let spacing = setup.finest_spacing();
    let h: Vec<f64> = setup.mesh.resolved_axes().map(|axis| spacing[axis]).collect();
    let smallest = h.iter().copied().fold(f64::INFINITY, f64::min);
    let inverse_squares: f64 = h.iter().map(|h| h.powi(-2)).sum();
    // Speed of the fluid without the grains, and beside those that are held in its flow.
    let given = setup.fluid.as_ref().map_or(0.0, |fluid| {
        let sides = setup.boundaries.0.iter().flatten().map(|side| match side {
            Boundary::Wall { velocity } | Boundary::Inflow { velocity } => {
                velocity.abs().element_sum()
            }
            _ => 0.0,
        });
        let initial = (setup.prescription.initial_speed(&setup.mesh))
            .unwrap_or(fluid.initial_velocity.abs().element_sum());
        sides.fold(initial, f64::max)
    });
    let given = given.max(speed_beside_held_grains(setup));
    let (rule, nu) = (setup.step, setup.fluid.map(|fluid| fluid.kinematic_viscosity));
    move |speed| match (rule, nu) {
        (StepRule::Fixed(step), _) => step,
        (StepRule::Limits { max_step, .. }, None) => max_step,
        (StepRule::Limits { cfl, viscous, max_step }, Some(nu)) => (cfl * smallest
            / given.max(BESIDE_GRAIN * speed))
        .min(viscous / (nu * inverse_squares))
        .min(max_step),
    }
}

/// Returns the largest speed of the fluid beside grains that are held in an inflow, or in a fluid
/// that moves at the start, as the sum over the axes that counts in the CFL number [m/s].
///
/// It is zero without such grains. The narrowed cross-section raises it.
fn speed_beside_held_grains(setup: &Setup) -> f64 {
    let Some(fluid) = &setup.fluid else { return 0.0 };
    let inflows = setup.boundaries.0.as_flattened().iter().filter_map(|side| match side {
        Boundary::Inflow { velocity } => Some(*velocity),
        _ => None,
    });
    let streams = inflows.chain([fluid.initial_velocity]);
    let moving = streams.filter_map(|stream| Some((stream, stream.try_normalize()?)));
    let beside = moving.flat_map(|(stream, direction)| {
        let open = 1.0 - blockage_along(setup, direction).min(MOST_BLOCKAGE);
        setup.grains.iter().filter_map(move |grain| match grain.translation {
            MotionConstraint::Prescribed(velocity) => {
                Some(BESIDE_GRAIN / open * (stream - velocity).abs().element_sum())
            }
            MotionConstraint::Free => None,
        })
    });
    beside.fold(0.0, f64::max)
}

/// Returns whether the flow past held grains limits the `step` [s].
pub(super) fn is_limited_beside_held_grains(setup: &Setup, step: f64) -> bool {
    let spacing = setup.finest_spacing();
    let smallest = setup.mesh.resolved_axes().map(|axis| spacing[axis]).fold(f64::MAX, f64::min);
    let speed = speed_beside_held_grains(setup);
    match setup.step {
        StepRule::Limits { cfl, .. } => cfl * smallest <= step * speed * (1.0 + 1e-9),
        StepRule::Fixed(_) => false,
    }
}

/// Returns the default of the longest step [s]: gravity moves a grain by one cell (dry: a fiftieth
/// of its diameter) from rest in this time, and the step follows the formulas of time.
pub(super) fn default_max_step(
    mesh_spacing: DVec3,
    grains: &[Grain],
    gravity: DVec3,
    prescription: &Prescription,
    dry: bool,
    end: f64,
) -> f64 {
    let g = gravity.length();
    let length = if dry { smallest_diameter(grains) / 50.0 } else { mesh_spacing.min_element() };
    let step = if g > 0.0 && length.is_finite() { (2.0 * length / g).sqrt() } else { end / 100.0 };
    resolved_step(prescription, end, step.min(end))
}

/// Returns whether the grain moves freely.
pub(super) fn is_free(grain: &Grain) -> bool {
    grain.translation == MotionConstraint::Free
}

/// Returns the smallest equivalent diameter [m]; infinite without grains.
pub(super) fn smallest_diameter(grains: &[Grain]) -> f64 {
    let diameters = grains.iter().map(|grain| grain.shape.equivalent_diameter());
    diameters.fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settling_numbers_of_the_paper() {
        // Ga 198 settles at Re 271 by Schiller and Naumann.
        let re = settling_reynolds(198.1);
        assert!((re - 271.0).abs() < 3.0, "{re}");
        // Stokes limit: Re = Ga^2 / 18.
        let re = settling_reynolds(0.1);
        assert!((re / (0.01 / 18.0) - 1.0).abs() < 0.01, "{re}");
        assert_eq!(settling_reynolds(0.0), 0.0);
        // A sphere is as fast as before; by the formulas a flat ellipsoid has 0.57 of its speed.
        let re = |extents: [f64; 3]| {
            let d = extents.iter().product::<f64>().cbrt();
            reynolds_with(198.1, |re| grain_drag(shape_factors(extents, d, 1.5), re))
        };
        assert!((re([1.0; 3]) / 271.0 - 1.0).abs() < 0.02, "{}", re([1.0; 3]));
        let flat = re([2.0, 1.0, 0.5]);
        assert!((flat / 153.3 - 1.0).abs() < 1e-3, "{flat}");
    }
}

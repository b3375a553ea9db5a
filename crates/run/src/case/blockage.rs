//! Blockage: the part of the cross-section of the box that a grain takes.

use std::f64::consts::FRAC_PI_4;

use glam::DVec3;

use grainwake_solver::dem::MotionConstraint;
use grainwake_solver::flow::Boundary;
use grainwake_solver::sim::Setup;

use super::time_scale::spread_times;

/// Times at which formulas are evaluated.
const TIMES: usize = 200;

/// Returns the cross-section of the largest grain over that of the box, normal to
/// [`flow_direction`]; none without fluid, without grains or if nothing moves.
pub(super) fn blockage(setup: &Setup, end: f64) -> Option<f64> {
    setup.fluid.as_ref().filter(|_| !setup.grains.is_empty())?;
    Some(blockage_along(setup, flow_direction(setup, end)?))
}

/// Returns the cross-section of the largest grain over that of the box, normal to the unit vector
/// `direction`.
pub(super) fn blockage_along(setup: &Setup, direction: DVec3) -> f64 {
    let diameters = setup.grains.iter().map(|g| g.shape.equivalent_diameter());
    let largest = diameters.fold(0.0, f64::max);
    let extent = setup.mesh.extent();
    let along = (extent * direction.abs()).element_sum();
    FRAC_PI_4 * largest * largest * along / extent.element_product()
}

/// Returns the unit vector along which grains and fluid are expected to pass each other, until
/// `end` [s].
///
/// It is that of gravity if a grain moves freely; else that of the first of these that is not zero:
/// the fastest motion of a grain, prescribed or at the start, the fastest inflow, the velocity of
/// the fluid at the start, its largest body acceleration, and gravity. Initial velocities by a
/// formula of space are left out.
pub(super) fn flow_direction(setup: &Setup, end: f64) -> Option<DVec3> {
    let fluid = setup.fluid?;
    let given = &setup.prescription;
    let inflows = setup.boundaries.0.as_flattened().iter().filter_map(|side| match side {
        Boundary::Inflow { velocity } => Some(*velocity),
        _ => None,
    });
    let times = || [0.0].into_iter().chain(spread_times(TIMES, end));
    let motions = (given.motions.iter()).filter_map(|motion| motion.velocity.as_ref());
    let prescribed = motions.flat_map(|formula| times().map(|time| formula.at(&[time])));
    let at_start = setup.grains.iter().map(|grain| grain.velocity);
    let accelerations = times().filter_map(|time| given.body_acceleration(time));
    let settles = setup.grains.iter().any(|grain| grain.translation == MotionConstraint::Free);
    let vectors = [
        if settles { setup.gravity } else { DVec3::ZERO },
        fastest(at_start.chain(prescribed)),
        fastest(inflows),
        fluid.initial_velocity,
        fastest(accelerations.chain([fluid.body_acceleration])),
        setup.gravity,
    ];
    vectors.into_iter().find_map(DVec3::try_normalize)
}

/// Returns the longest of some vectors, the first of equal ones; zero if there are none.
fn fastest(vectors: impl Iterator<Item = DVec3>) -> DVec3 {
    vectors.fold(DVec3::ZERO, |longest, vector| {
        if vector.length_squared() > longest.length_squared() { vector } else { longest }
    })
}

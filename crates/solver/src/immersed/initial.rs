//! Flow around the grains at t = 0.
//!
//! A grain that starts with a velocity differing from the fluid's sets the fluid in motion at once,
//! as an impulsive start does: the velocity jumps from the given one to the irrotational flow
//! around the moving grain, before viscosity acts. The fluid outside a sphere then has half the
//! momentum of the displaced fluid (its added mass).
//!
//! The faces inside the grains take the rigid velocity and the projection follows, in turns, until
//! the faces hardly change. Faces in the band around the surface stay free: forced as well, they
//! would drag along a layer of fluid.
//!
//! A released grain has no impulse from outside ([`Start::Released`]). It loses the impulse P that
//! the projections take from the faces inside it, and has M V = M V_0 - P at the end. In a periodic
//! box grain and fluid together then keep the momentum M V_0; walls and open sides take part of it.
//! Irrotational flow exerts no torque on a sphere, so a sphere keeps its angular velocity; the
//! faces inside it, which are not quite symmetric, would change it.

use super::rigidity::{Impulse, sum_impulse};
use super::update::{GrainUpdate, PendingRigidity, locate_and_compute_weights};
use super::{ImmersedGrain, ImmersedGrains};
use crate::dem::{Grain, MotionConstraint, is_sphere};
use crate::flow::{Flow, FlowMeasures, NestedFlow};
use crate::math::{Real, RigidVelocity, Vector6};
use glam::DVec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Start of a grain that has a velocity relative to the fluid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Start {
    /// With the given velocity: an impulse from outside has set grain and fluid in motion.
    #[default]
    Impulsive,
    /// Let go in the fluid with the given velocity: the fluid around the grain takes part of the
    /// momentum at once, and the grain goes on more slowly.
    Released,
}

/// Share of the first impulse at which the iteration ends.
const TOLERANCE: f64 = 1e-3;
/// Largest number of projections.
const MAX_PROJECTIONS: usize = 50;

impl<R: Real> ImmersedGrains<R> {
    /// Sets the flow around the grains in motion, or to rest; released grains get their new
    /// velocities. Returns the measures of the flow.
    pub fn initialise(
        &mut self,
        flow: &mut NestedFlow<R>,
        grains: &mut [Grain],
        start: Start,
    ) -> FlowMeasures {
        self.force_inside(grains);
        let mut released: Vec<Released> = match start {
            Start::Impulsive => Vec::new(),
            Start::Released => grains.iter().map(Released::new).collect(),
        };
        let mut first = None;
        for _ in 1..MAX_PROJECTIONS {
            let finest = flow.finest_mut();
            finest.predicted.copy_from(&finest.velocity);
            let impulse = self.impose_start(finest, grains, &mut released);
            finest.velocity.copy_from(&finest.predicted);
            if impulse <= TOLERANCE * *first.get_or_insert(impulse)
                && released.iter().all(Released::converged)
            {
                break;
            }
            flow.make_solenoidal();
        }
        self.release_forcing();
        flow.make_solenoidal()
    }

    /// Lists the faces inside the grains as forced faces, with full weight: those at a negative
    /// distance, nearer to their grain than to its neighbours.
    fn force_inside(&mut self, grains: &[Grain]) {
        self.locator.find_neighbours(grains, |_| 0.0);
        let params = self.forcing_params(1.0);
        let (locator, scratch) = (&self.locator, &self.scratch);
        let each = self.grains.par_iter_mut().enumerate();
        each.for_each(|(index, ImmersedGrain { body, forced, .. })| {
            let (grain, scratch) = (&grains[index], &mut scratch.borrow().locate);
            locate_and_compute_weights(locator, &params, index, grain, body, forced, scratch);
            let band = &scratch.band;
            for (weight, distance) in forced.weight[..band.count()].iter_mut().zip(&band.distance) {
                *weight = if *distance < 0.0 { 1.0 } else { 0.0 };
            }
            for face in &band.shared {
                if face.nearest < f64::from(band.distance[face.entry]) {
                    forced.weight[face.entry] = 0.0;
                }
            }
            forced.closed_fraction.fill(0.0);
            forced.total_closed_fraction.fill(0.0);
            forced.solid_fraction.fill(0.0);
        });
    }

    /// Gives the forced faces of the prediction the velocities of the grains, which change if they
    /// are `released`; returns the magnitude of the impulse that this takes [N s].
    fn impose_start(
        &mut self,
        flow: &mut Flow<R>,
        grains: &mut [Grain],
        released: &mut [Released],
    ) -> f64 {
        let (known, predictions) = flow.prediction();
        let rest = RigidVelocity::default();
        let mut updates = std::mem::take(&mut self.updates);
        updates.clear();
        let mut square = 0.0;
        for (index, (immersed, grain)) in self.grains.iter_mut().zip(grains).enumerate() {
            let (density, forced) = (self.fluid_density, &mut immersed.forced);
            let impulse = sum_impulse(&known, &predictions, density, forced, [rest; 2], 0.0);
            let [x, y, z, ..] = impulse.at(grain.rigid_velocity());
            square += x * x + y * y + z * z;
            if let Some(released) = released.get_mut(index) {
                released.lose(grain, &impulse, density);
            }
            let velocity = grain.rigid_velocity();
            // The change has a weight only in a step.
            let pending = Some(PendingRigidity { velocity, change: rest });
            updates.push(GrainUpdate { pending, ..GrainUpdate::default() });
        }
        self.impose_pending(flow, &updates);
        self.updates = updates;
        square.sqrt()
    }
}

/// A released grain.
struct Released {
    given: RigidVelocity,
    /// Impulse P on the fluid around the grain so far [N s, N m s]; `None` before the first
    /// projection.
    passed_on: Option<Vector6>,
    /// Speed relative to the fluid at the start, rotation included [m/s].
    relative_speed: f64,
    /// Error of M V = M V_0 - P, and the last change of P, both as speeds [m/s].
    error: f64,
}

impl Released {
    fn new(grain: &Grain) -> Released {
        let given = grain.rigid_velocity();
        Released { given, passed_on: None, relative_speed: 0.0, error: f64::INFINITY }
    }

    /// Adds what the last projection has taken from the faces inside, which `impulse` would
    /// restore, to P, and moves the velocity of `grain` towards V_0 - P / M. Prescribed degrees of
    /// freedom and the angular velocity of a sphere stay.
    ///
    /// The division by 1 + m_f / (2 M), with the displaced mass m_f, accounts for the added mass of
    /// a sphere: without it the iteration would diverge for light grains.
    fn lose(&mut self, grain: &mut Grain, impulse: &Impulse, fluid_density: f64) {
        let now = grain.rigid_velocity();
        let taken = impulse.at(now);
        let speed = |velocity: RigidVelocity| {
            velocity.linear.length() + velocity.angular.length() * grain.shape.bounding_radius()
        };
        let displaced = fluid_density / grain.density;
        let last = free_change(grain, &taken);
        let Some(passed_on) = &mut self.passed_on else {
            self.relative_speed = speed(last) / displaced;
            self.passed_on = Some([0.0; 6]);
            return;
        };
        passed_on.iter_mut().zip(taken).for_each(|(sum, taken)| *sum += taken);
        let residual = self.given - now - free_change(grain, passed_on);
        // One of them alone may be small by chance.
        self.error = speed(residual) + speed(last);
        grain.velocity += residual.linear / (1.0 + 0.5 * displaced);
        grain.angular_velocity += residual.angular / (1.0 + 0.5 * displaced);
    }

    /// Returns whether M V = M V_0 - P holds within the tolerance.
    fn converged(&self) -> bool {
        self.error <= TOLERANCE * self.relative_speed
    }
}

/// Change of the velocities of a grain by an impulse. Prescribed degrees of freedom do not change,
/// nor does the angular velocity of a sphere.
fn free_change(grain: &Grain, impulse: &Vector6) -> RigidVelocity {
    let mut change = RigidVelocity::default();
    if grain.translation == MotionConstraint::Free {
        change.linear = grain.in_plane(DVec3::from_slice(&impulse[..3])) / grain.mass();
    }
    if grain.rotation == MotionConstraint::Free && !is_sphere(&grain.shape) {
        change.angular = grain.angular_response(DVec3::from_slice(&impulse[3..]));
    }
    change
}

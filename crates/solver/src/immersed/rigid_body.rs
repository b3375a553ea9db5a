//! Newton's and Euler's equations of a grain with the impulse of the fluid (Eqs 4b, 4c, 5).
//!
//! The impulse is affine in the six new velocities, so the equations form a 6 x 6 system that is
//! stable at any density ratio. The hydrodynamic load is Eq. 5 in the form that also holds for the
//! torque (Eq. 5b as printed can lose a third of it).
//!
//! The fluid around a grain responds by the projection, one step late. For a grain lighter than the
//! fluid this delay is unstable. A virtual mass, the inertia of the displaced fluid, is therefore
//! added to both sides of the equations: it multiplies the change of the velocities in this step on
//! the left and that in the previous step on the right (`docs/decisions/0013-light-grains.md`).
//!
//! Legend: a and b matrix and right-hand side, x new velocities, J impulse on the fluid.

use glam::{DMat3, DVec3};

use super::emerged::{EmergedLoads, EmergedPart};
use super::rigidity::Impulse;
use crate::dem::{Grain, GrainResponse, MotionConstraint};
use crate::math::{Load, Matrix6, RigidVelocity, Vector6, multiply6, solve6};

/// State that a grain carries over from the previous step.
#[derive(Clone, Copy, Debug, Default)]
pub struct PreviousStep {
    /// Velocities at the end of the previous step, which the forced faces have.
    pub velocity: RigidVelocity,
    /// Inertia tensor at the start of the step [kg m^2, space frame].
    pub inertia: DMat3,
    /// Change of the velocities between the steps, by control of the grain. The grain has its
    /// momentum, the displaced fluid does not.
    pub set_change: RigidVelocity,
    /// Mean acceleration over the previous step [m/s^2, rad/s^2], without `added_mass_uptake`; zero
    /// after contact, and extrapolated to the next step for a grain in a free surface.
    pub acceleration: RigidVelocity,
    /// Change of the linear velocity over the previous step [m/s], that by contact included.
    pub change: DVec3,
    /// Part of `velocity` that contact caused in the previous step and that the added mass takes up
    /// in this step (`docs/decisions/0014-contact-with-the-fluid-response.md`).
    pub pending_added_mass_velocity: RigidVelocity,
    /// Pending velocity that the added mass took up in the previous step, over its length [m/s^2,
    /// rad/s^2]. The hydrodynamic load of that step contains it; the next trial step leaves it out
    /// (`docs/decisions/0022-rest-after-impacts.md`).
    pub added_mass_uptake: RigidVelocity,
}

impl PreviousStep {
    /// State before the first step of a grain.
    pub fn of(grain: &Grain) -> PreviousStep {
        let (velocity, inertia) = (grain.rigid_velocity(), grain.inertia());
        PreviousStep { velocity, inertia, ..Default::default() }
    }

    /// Velocities at the start of the step.
    pub fn start_velocity(&self) -> RigidVelocity {
        // Adding zero would turn -0.0 into 0.0.
        if self.was_set() { self.velocity + self.set_change } else { self.velocity }
    }

    /// Returns whether a velocity was set between the steps.
    pub fn was_set(&self) -> bool {
        self.set_change != RigidVelocity::default()
    }

    /// Returns whether contact in the previous step left a velocity that the added mass takes up in
    /// this step.
    pub fn has_pending_velocity(&self) -> bool {
        self.pending_added_mass_velocity != RigidVelocity::default()
    }

    /// Load that balances `added_mass_uptake` in the hydrodynamic load; none in other steps.
    pub fn uptake_load(&self, grain: &Grain) -> Option<Load> {
        let RigidVelocity { linear, angular } = self.added_mass_uptake;
        let load = || Load { force: grain.mass() * linear, torque: grain.inertia() * angular };
        (self.added_mass_uptake != RigidVelocity::default()).then(load)
    }
}

/// Equations a x = b for the new velocities x of one grain.
#[derive(Clone, Copy, Debug, Default)]
pub struct RigidBodySystem {
    matrix: Matrix6,
    right: Vector6,
    virtual_mass: VirtualMass,
    pub(super) impulse: Impulse,
    surface: Option<EmergedLoads>,
    /// Load of a grain that leaves the box or is airborne.
    pub(super) last_load: Option<Load>,
}

impl RigidBodySystem {
    /// Assembles the equations under the `applied` load (weight less buoyancy, and external loads)
    /// over `dt` [s], without contact. `surface` is the part of the grain beyond a free surface,
    /// and the load of the pressure at this surface.
    pub fn new(
        grain: &Grain,
        previous: &PreviousStep,
        impulse: Impulse,
        fluid_density: f64,
        applied: Load,
        surface: Option<(&EmergedPart, Load)>,
        dt: f64,
    ) -> RigidBodySystem {
        let middle = previous.start_velocity().angular + 0.5 * dt * previous.acceleration.angular;
        let surface =
            surface.map(|(part, load)| EmergedLoads::new(part, load, middle, fluid_density));
        let applied = surface.map_or(applied, |surface| applied + surface.pressure);
        // Mass and inertia less those of the displaced fluid.
        let excess = 1.0 - fluid_density / grain.density;
        let (mass, inertia) = (grain.mass() * excess, grain.inertia() * excess);
        let virtual_mass = VirtualMass::new(grain, previous, fluid_density, surface.is_some(), dt);
        let mut linear =
            mass * previous.velocity.linear + dt * applied.force + virtual_mass.momentum[0];
        // With the inertia at the start: Euler's equation for the angular momentum.
        let start = previous.inertia * excess * previous.velocity.angular;
        let mut angular = start + dt * applied.torque + virtual_mass.momentum[1];
        if previous.was_set() {
            linear += grain.mass() * previous.set_change.linear;
            angular += previous.inertia * previous.set_change.angular;
        }
        let (mut a, mut b) = (impulse.matrix, [0.0; 6]);
        for row in 0..3 {
            a[row][row] += mass + virtual_mass.mass;
            b[row] = linear[row] - impulse.constant[row];
            b[3 + row] = angular[row] - impulse.constant[3 + row];
            for column in 0..3 {
                a[3 + row][3 + column] += (inertia + virtual_mass.inertia).col(column)[row];
            }
        }
        if let Some(surface) = &surface {
            let momentum = surface.momentum(RigidVelocity::default() - previous.velocity, dt);
            for row in 0..6 {
                b[row] -= momentum[row];
                for column in 0..6 {
                    a[row][column] += surface.inertia[row][column];
                }
            }
        }
        let (free, prescribed) = (grain.free_axes(), grain.rigid_velocity().to_vector());
        for row in (0..6).filter(|row| !free[*row]) {
            a[row] = [0.0; 6];
            a[row][row] = 1.0;
            b[row] = prescribed[row];
        }
        RigidBodySystem { matrix: a, right: b, virtual_mass, impulse, surface, last_load: None }
    }

    /// New velocities under the mean `contact` load over `dt` [s].
    pub fn velocities(
        &self,
        grain: &Grain,
        previous: &PreviousStep,
        contact: Load,
        dt: f64,
    ) -> RigidVelocity {
        let (mut right, free) = (self.right, grain.free_axes());
        let load = [contact.force, contact.torque];
        for row in (0..6).filter(|row| free[*row]) {
            right[row] += dt * load[row / 3][row % 3];
        }
        // Singular only if no face is forced; such a grain keeps its velocities.
        let x = solve6(self.matrix, right);
        x.map_or(previous.start_velocity(), |x| RigidVelocity::from_vector(&x))
    }

    /// Hydrodynamic load (Eq. 5) on the grain, which has its new velocities.
    pub fn hydrodynamic_load(
        &self,
        grain: &Grain,
        previous: &PreviousStep,
        fluid_density: f64,
        dt: f64,
    ) -> Load {
        if let Some(load) = self.last_load {
            return load;
        }
        let new = grain.rigid_velocity();
        let mut j = self.impulse.at(new);
        let change = new - previous.velocity;
        if let Some(surface) = &self.surface {
            let momentum = surface.momentum(change, dt);
            j.iter_mut().zip(momentum).for_each(|(j, momentum)| *j += momentum);
        }
        let VirtualMass { mass, inertia, momentum } = self.virtual_mass;
        let force = DVec3::from_slice(&j[..3]) + mass * new.linear - momentum[0];
        let torque = DVec3::from_slice(&j[3..]) + inertia * new.angular - momentum[1];
        let displaced = fluid_density / grain.density;
        let spin = grain.inertia() * new.angular - previous.inertia * previous.velocity.angular;
        let load = Load {
            force: (displaced * grain.mass() * change.linear - force) / dt,
            torque: (displaced * spin - torque) / dt,
        };
        self.surface.map_or(load, |surface| load + surface.pressure)
    }

    /// Response of the grain to contact in the sub-steps of this step. Without further contact the
    /// grain has the velocities of [`Self::velocities`] at their end
    /// (`docs/decisions/0014-contact-with-the-fluid-response.md`).
    ///
    /// The mass is at least that of the grain with `added_density` [kg/m^3] of fluid in its volume,
    /// since most of the added mass responds by the projection, one step late. The initial
    /// velocities exclude the pending added-mass velocity of the last impact.
    pub fn response(
        &self,
        grain: &Grain,
        previous: &PreviousStep,
        added_density: f64,
        dt: f64,
    ) -> GrainResponse {
        let start = previous.start_velocity() - previous.pending_added_mass_velocity;
        let free = grain.free_axes();
        // Load that changes the initial velocities over dt, with the matrix before mass is added.
        let momentum = multiply6(&self.matrix, &start.to_vector());
        let drive: Vector6 = std::array::from_fn(|row| {
            if free[row] { (self.right[row] - momentum[row]) / dt } else { 0.0 }
        });
        let mut a = self.matrix;
        let least_mass = grain.mass() + added_density * grain.shape.volume();
        // The virtual mass returns its momentum in the next step.
        let virtual_mass = if added_density > 0.0 { self.virtual_mass.mass } else { 0.0 };
        let moving = (0..3).filter(|axis| free[*axis]);
        let total: f64 = moving.clone().map(|axis| a[axis][axis]).sum();
        let mean_mass = total / moving.clone().count() as f64 - virtual_mass;
        for axis in moving {
            a[axis][axis] += (least_mass - mean_mass).max(0.0) - virtual_mass;
        }
        let columns: [Vector6; 6] = std::array::from_fn(|n| {
            let mut unit = [0.0; 6];
            unit[n] = if free[n] { 1.0 } else { 0.0 };
            solve6(a, unit).unwrap_or([0.0; 6])
        });
        let response = GrainResponse::new(start, drive, columns);
        if previous.has_pending_velocity() {
            response.after_contact(self.velocities(grain, previous, Load::default(), dt))
        } else {
            response
        }
    }
}

/// Inertia of the fluid that a light grain accelerates with itself.
#[derive(Clone, Copy, Debug, Default)]
struct VirtualMass {
    /// Virtual mass [kg].
    mass: f64,
    /// Virtual inertia about the centroid, space frame [kg m^2].
    inertia: DMat3,
    /// Linear and angular momentum if the velocities change as in the previous step [kg m/s, kg
    /// m^2/s].
    momentum: [DVec3; 2],
}

/// Density ratio below which the virtual mass is the displaced mass. Above it the virtual mass
/// decreases linearly to 0 at a density ratio of 1.
const FULL_BELOW: f64 = 0.8;

impl VirtualMass {
    /// Virtual mass of a grain in a step of `dt` [s]; 0 along prescribed degrees of freedom. A
    /// grain in a free surface gets all of it, since its added mass may exceed the displaced mass.
    fn new(
        grain: &Grain,
        previous: &PreviousStep,
        fluid_density: f64,
        in_free_surface: bool,
        dt: f64,
    ) -> VirtualMass {
        let density_ratio = grain.density / fluid_density;
        let part = ((1.0 - density_ratio) / (1.0 - FULL_BELOW)).clamp(0.0, 1.0);
        let part = if in_free_surface { 1.0 } else { part };
        // Virtual mass over the mass of the grain.
        let part = part / density_ratio;
        let [translation, rotation] = [grain.translation, grain.rotation]
            .map(|constraint| if constraint == MotionConstraint::Free { part } else { 0.0 });
        let (mass, inertia) = (grain.mass() * translation, grain.inertia() * rotation);
        let PreviousStep { velocity, acceleration, change, .. } = previous;
        // The change, and not the acceleration times dt, keeps the momentum if the step varies, and
        // after an impact.
        let change = if in_free_surface { dt * acceleration.linear } else { *change };
        let momentum = [
            mass * (velocity.linear + change),
            inertia * (velocity.angular + dt * acceleration.angular),
        ];
        VirtualMass { mass, inertia, momentum }
    }
}

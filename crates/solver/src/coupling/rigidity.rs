//! Rigidity imposed on the grid and the load it leaves on the grain (Eqs 4b, 4c, 5).
//!
//! Every forced face takes a share of the rigid velocity V + Omega x r, which is affine in the six
//! velocities of the grain; so is the impulse that this takes from the fluid. Newton's and Euler's
//! laws with that impulse are one 6 x 6 system, stable at any density ratio. What the fluid gains
//! the grain loses: momentum is conserved to round-off, and the load is Eq. 5 in the form that
//! holds for the torque as well (the printed Eq. 5b can lose a third of it).
//!
//! Legend: w mass of a face's cell, J impulse on the fluid, M its derivative by the velocities,
//! m_s and m_f masses of the grain and of the fluid it displaces.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::Past;
use super::locate::{Body, ForcedFace};
use crate::dem::{Dof, Grain};
use crate::flow::Flow;
use crate::grid::FaceVector;
use crate::math::{Load, Matrix6, Real, Vector6, solve6};

/// What a step of the fluid does to one grain.
pub struct Impulse {
    constant: Vector6,
    slope: Matrix6,
}

/// Sums the impulse on the fluid as an affine function of the grain's new velocities; its old ones
/// are in `past`. `relief` is the time over which the closed part of a face takes the acceleration
/// of the grains instead of the pressure gradient; zero turns both off. Faces that several grains
/// hold take a part from each, and what one takes does not depend on the others' new velocities.
///
/// The pressure given back to the closed part is that of the last step moved with the grain,
/// p - dt U . grad p. Left where it was it would be a step behind the surface, and the drag of a
/// moving grain of first order in the step (`docs/decisions/0011-pressure-moves-with-the-grain.md`).
pub fn gather<R: Real>(
    flow: &Flow<R>,
    fluid_density: f64,
    body: &mut Body,
    past: &Past,
    relief: f64,
) -> Impulse {
    let before = past.velocity;
    let w = fluid_density * flow.mesh().cell_volume();
    let mut sums = [Moments::default(); 3];
    for face in &mut body.forced {
        let predicted = flow.predicted.component(face.axis)[face.at].wide();
        face.back = moved_pressure_pull(flow, face, before, relief);
        face.free = predicted + face.closed_by_all * face.back;
        let follow = follow(face, relief);
        let push = face.closed * face.back
            - face.share * face.free
            - follow * rigid_velocity(before, face);
        sums[face.axis].add(push, face.share + follow, face);
    }
    let mut impulse = Impulse {
        constant: [0.0; 6],
        slope: [[0.0; 6]; 6],
    };
    for (axis, sum) in sums.iter().enumerate() {
        let rows = [axis, 3 + (axis + 1) % 3, 3 + (axis + 2) % 3];
        for (a, row) in rows.into_iter().enumerate() {
            impulse.constant[row] += w * sum.push[a];
            for (b, column) in rows.into_iter().enumerate() {
                impulse.slope[row][column] += w * sum.pull[a + b + usize::from(a.min(b) > 0)];
            }
        }
    }
    impulse
}

/// Sums over the faces of one component, with the weights 1 and the two components that a lever
/// arm x unit has: a force along the axis has no torque about it.
#[derive(Clone, Copy, Default)]
struct Moments {
    push: [f64; 3],
    /// Of 1, l, m, l l, l m and m m, l and m the levers.
    pull: [f64; 6],
}

impl Moments {
    #[inline]
    fn add(&mut self, push: f64, pull: f64, face: &ForcedFace) {
        let l = face.arm[(face.axis + 2) % 3];
        let m = -face.arm[(face.axis + 1) % 3];
        for (sum, weight) in self.push.iter_mut().zip([1.0, l, m]) {
            *sum += push * weight;
        }
        for (sum, weight) in self.pull.iter_mut().zip([1.0, l, m, l * l, l * m, m * m]) {
            *sum += pull * weight;
        }
    }
}

/// New velocities of the grain from those in `past` under the impulse and the `other` loads (weight less
/// buoyancy, contact) over `dt`; returns the hydrodynamic load on it.
pub fn advance(
    grain: &mut Grain,
    past: &Past,
    impulse: &Impulse,
    fluid_density: f64,
    other: Load,
    dt: f64,
) -> Load {
    let ratio = 1.0 - fluid_density / grain.density;
    let (mass, inertia) = (grain.mass() * ratio, grain.inertia() * ratio);
    let [v, omega] = past.velocity;
    let gyroscopic = omega.cross(inertia * omega);
    let momentum = mass * v + dt * other.force;
    let angular = inertia * omega + dt * (other.torque - gyroscopic);
    let carried = Carried::by(grain, past, fluid_density, dt);
    let mut a = impulse.slope;
    let mut b = [0.0; 6];
    for row in 0..3 {
        a[row][row] += mass + carried.mass;
        b[row] = momentum[row] + carried.momentum[row] - impulse.constant[row];
        b[3 + row] = angular[row] + carried.angular[row] - impulse.constant[3 + row];
        for column in 0..3 {
            a[3 + row][3 + column] += (inertia + carried.inertia).col(column)[row];
        }
    }
    prescribe(&mut a, &mut b, 0, grain.translation);
    prescribe(&mut a, &mut b, 3, grain.rotation);
    // Positive definite whenever a face is forced; a grain without faces moves on as it was.
    let x = solve6(a, b).unwrap_or([v.x, v.y, v.z, omega.x, omega.y, omega.z]);
    grain.velocity = DVec3::new(x[0], x[1], x[2]);
    grain.angular_velocity = DVec3::new(x[3], x[4], x[5]);

    let j: Vector6 = std::array::from_fn(|row| {
        impulse.constant[row]
            + impulse.slope[row]
                .iter()
                .zip(x)
                .map(|(m, x)| m * x)
                .sum::<f64>()
    });
    let force = DVec3::new(j[0], j[1], j[2]) + carried.mass * grain.velocity - carried.momentum;
    let torque =
        DVec3::new(j[3], j[4], j[5]) + carried.inertia * grain.angular_velocity - carried.angular;
    let displaced = fluid_density / grain.density;
    let fluid_inertia: DMat3 = grain.inertia() * displaced;
    Load {
        force: (displaced * grain.mass() * (grain.velocity - v) - force) / dt,
        torque: (fluid_inertia * (grain.angular_velocity - omega) - torque) / dt
            + omega.cross(fluid_inertia * omega),
    }
}

/// Fluid that a grain lighter than the fluid carries along, its virtual mass: as much as it
/// displaces, on both sides of its equations, with the new acceleration on one and the last on the
/// other. The fluid around a grain answers by the projection, one step late; without this, a light
/// grain and that answer drive each other (`docs/decisions/0013-light-grains.md`).
struct Carried {
    mass: f64,
    inertia: DMat3,
    momentum: DVec3,
    angular: DVec3,
}

impl Carried {
    fn by(grain: &Grain, past: &Past, fluid_density: f64, dt: f64) -> Carried {
        let displaced = if grain.density < fluid_density {
            fluid_density / grain.density
        } else {
            0.0
        };
        let (mass, inertia) = (grain.mass() * displaced, grain.inertia() * displaced);
        let goes_on = |which: usize| past.velocity[which] + dt * past.acceleration[which];
        Carried {
            mass,
            inertia,
            momentum: mass * goes_on(0),
            angular: inertia * goes_on(1),
        }
    }
}

/// Gives the forced faces what the grains give them; arguments as of [`gather`], which came before.
pub fn impose<R: Real>(
    flow: &mut Flow<R>,
    grains: &[Grain],
    bodies: &[Body],
    before: &[Past],
    relief: f64,
) {
    let FaceVector { x, y, z } = &mut flow.predicted;
    let components: [&mut [R]; 3] = [x, y, z];
    let each = components.into_par_iter().enumerate();
    each.for_each(|(axis, predicted)| {
        for ((grain, body), Past { velocity, .. }) in grains.iter().zip(bodies).zip(before) {
            let now = [grain.velocity, grain.angular_velocity];
            for face in body.forced_along(axis) {
                let rigid = rigid_velocity(now, face);
                let change = rigid - rigid_velocity(*velocity, face);
                let gain = face.closed * face.back
                    + face.share * (rigid - face.free)
                    + follow(face, relief) * change;
                predicted[face.at] = R::of(predicted[face.at].wide() + gain);
            }
        }
    });
}

/// Part of the grain's change of velocity that a face takes beside its share of the velocity.
fn follow(face: &ForcedFace, relief: f64) -> f64 {
    if relief > 0.0 {
        (1.0 - face.share) * face.closed
    } else {
        0.0
    }
}

/// Velocity along a face's axis of a body that moves at `[velocity, angular velocity]`.
fn rigid_velocity([velocity, omega]: [DVec3; 2], face: &ForcedFace) -> f64 {
    (velocity + omega.cross(face.arm))[face.axis]
}

/// What the pressure takes from a face over `dt` [m/s] once it has moved with a grain at
/// `[velocity, angular velocity]` for as long.
fn moved_pressure_pull<R: Real>(
    flow: &Flow<R>,
    face: &ForcedFace,
    [velocity, omega]: [DVec3; 2],
    dt: f64,
) -> f64 {
    if dt == 0.0 || face.closed_by_all == 0.0 {
        return 0.0;
    }
    let strides = flow.mesh().layout().strides();
    let p = |at: usize| flow.pressure[at].wide();
    let spacing = flow.mesh().spacing;
    let half = 0.5 * spacing[face.axis] * DVec3::AXES[face.axis];
    let moved = |at: usize, arm: DVec3| -> f64 {
        let cells = 0.5 * dt * (velocity + omega.cross(arm)) / spacing;
        let change = |axis: usize| cells[axis] * (p(at + strides[axis]) - p(at - strides[axis]));
        p(at) - (0..3).map(change).sum::<f64>()
    };
    let rise = moved(face.at, face.arm + half) - moved(face.below, face.arm - half);
    dt / spacing[face.axis] * rise
}

/// Replaces three equations by given velocities.
fn prescribe(a: &mut Matrix6, b: &mut Vector6, first: usize, law: Dof) {
    if let Dof::Prescribed(given) = law {
        for i in 0..3 {
            a[first + i] = [0.0; 6];
            a[first + i][first + i] = 1.0;
            b[first + i] = given[i];
        }
    }
}

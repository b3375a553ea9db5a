//! The motion of a grain with the fluid that it holds (Eqs 4b, 4c, 5).
//!
//! Newton's and Euler's laws with the impulse of the fluid, which is affine in the six velocities of the
//! grain, are one 6 x 6 system, stable at any density ratio. The load is Eq. 5 in the form that holds for
//! the torque as well (the printed Eq. 5b can lose a third of it).
//!
//! Legend: J impulse on the fluid, a and b matrix and right-hand side of the system for the velocities x.

use glam::{DMat3, DVec3};

use super::Past;
use super::rigidity::Impulse;
use crate::dem::{Dof, Grain, Response};
use crate::math::{Load, Matrix6, Vector6, solve6};

/// Newton's and Euler's equations of one grain and the fluid it holds over a step, as a linear system for
/// its new velocities.
#[derive(Clone, Copy, Default)]
pub struct Motion {
    matrix: Matrix6,
    right: Vector6,
    carried: Carried,
}

impl Motion {
    /// From the velocities in `past`, under the impulse and the `other` loads (weight less buoyancy) over
    /// `dt`, without contact.
    pub fn new(
        grain: &Grain,
        past: &Past,
        impulse: &Impulse,
        fluid_density: f64,
        other: Load,
        dt: f64,
    ) -> Motion {
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
        Motion {
            matrix: a,
            right: b,
            carried,
        }
    }

    /// How the grain answers contact within the step, so that it leaves its sub-steps as [`velocities`] will
    /// have it. Its mass is at least its own with `added_density` of the fluid, most of which answers by
    /// the projection, one step late: what an impact gave beyond that the grain owes the fluid, and does not
    /// start with (`docs/decisions/0014-contact-and-fluid-at-once.md`).
    pub fn response(&self, grain: &Grain, past: &Past, added_density: f64, dt: f64) -> Response {
        let start: [DVec3; 2] = std::array::from_fn(|n| past.velocity[n] - past.owed[n]);
        let [v, omega] = start;
        let before = [v.x, v.y, v.z, omega.x, omega.y, omega.z];
        // What there is to accelerate it, the answer to the last impact included, with its mass before that
        // grows.
        let mut drive: Vector6 = std::array::from_fn(|row| {
            let held: f64 = (0..6).map(|n| self.matrix[row][n] * before[n]).sum();
            (self.right[row] - held) / dt
        });
        let mut a = self.matrix;
        let least = grain.mass() + added_density * grain.shape.volume();
        let mean = (a[0][0] + a[1][1] + a[2][2]) / 3.0;
        let free = [grain.translation, grain.rotation].map(|dof| dof == Dof::Free);
        if free[0] {
            for (axis, row) in a.iter_mut().take(3).enumerate() {
                row[axis] += (least - mean).max(0.0);
            }
        }
        let column = |n: usize| {
            let mut unit = [0.0; 6];
            unit[n] = if free[n / 3] { 1.0 } else { 0.0 };
            solve6(a, unit).unwrap_or([0.0; 6])
        };
        let columns: [Vector6; 6] = std::array::from_fn(column);
        for (n, dof) in free.into_iter().enumerate() {
            if !dof {
                drive[3 * n..3 * n + 3].fill(0.0);
            }
        }
        Response::new(start, drive, columns)
    }
}

/// New velocity and angular velocity of the grain by its motion's equations, under the mean `contact` load over
/// `dt` too.
pub fn velocities(
    grain: &Grain,
    past: &Past,
    motion: &Motion,
    contact: Load,
    dt: f64,
) -> [DVec3; 2] {
    let [v, omega] = past.velocity;
    let mut right = motion.right;
    let free = [grain.translation, grain.rotation].map(|dof| dof == Dof::Free);
    for axis in 0..3 {
        if free[0] {
            right[axis] += dt * contact.force[axis];
        }
        if free[1] {
            right[3 + axis] += dt * contact.torque[axis];
        }
    }
    // Positive definite whenever a face is forced; a grain without faces moves on as it was.
    let x = solve6(motion.matrix, right).unwrap_or([v.x, v.y, v.z, omega.x, omega.y, omega.z]);
    [DVec3::new(x[0], x[1], x[2]), DVec3::new(x[3], x[4], x[5])]
}

/// The hydrodynamic load on the grain, once it has its new velocities.
pub fn load(
    grain: &Grain,
    past: &Past,
    impulse: &Impulse,
    motion: &Motion,
    fluid_density: f64,
    dt: f64,
) -> Load {
    let [v, omega] = past.velocity;
    let now = [grain.velocity, grain.angular_velocity].map(|u| u.to_array());
    let x: Vector6 = std::array::from_fn(|n| now[n / 3][n % 3]);
    let carried = &motion.carried;
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

/// Fluid that a grain lighter than the fluid carries along, its virtual mass, on both sides of its
/// equations, with the new acceleration on one and the last on the other. The fluid around a grain
/// answers by the projection, one step late; without this, a light grain and that answer drive each
/// other (`docs/decisions/0013-light-grains.md`).
#[derive(Clone, Copy, Default)]
struct Carried {
    mass: f64,
    inertia: DMat3,
    momentum: DVec3,
    angular: DVec3,
}

/// Below this density ratio a grain carries all the fluid that it displaces; above, less and less, and
/// none from 1 on.
const CARRIES_ALL: f64 = 0.8;

impl Carried {
    fn by(grain: &Grain, past: &Past, fluid_density: f64, dt: f64) -> Carried {
        let ratio = grain.density / fluid_density;
        let part = ((1.0 - ratio) / (1.0 - CARRIES_ALL)).clamp(0.0, 1.0) / ratio;
        let free = |dof: Dof| if dof == Dof::Free { part } else { 0.0 };
        let mass = grain.mass() * free(grain.translation);
        let inertia = grain.inertia() * free(grain.rotation);
        let goes_on = |which: usize| past.velocity[which] + dt * past.acceleration[which];
        Carried {
            mass,
            inertia,
            momentum: mass * goes_on(0),
            angular: inertia * goes_on(1),
        }
    }
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

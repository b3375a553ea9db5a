//! Rigidity of the forced faces (Eqs 4b, 4c), and the impulse that it takes from the fluid (Eq. 5)
//! as an affine function of the new velocities of the grain.
//!
//! In a step of dt, a forced face gains with the rigid velocity U, and U_old before it,
//!
//! - e = dt / h (p~(above) - p~(below)) - dt a, if the step's pressure gradient and body
//!   acceleration are removed from the face;
//! - r = c e - s (u* + C e), next to a grain at rest: the drag acts on u* + C e;
//! - r + s U + f (U - U_old) + (1 - s) (c - phi) W, next to a moving grain, with f = (1 - s) phi.
//!
//! W is the change of U expected from the previous step. The solid part phi of a face follows any
//! change of U at once. The whole closed part c follows a steady acceleration, as it follows a
//! pressure gradient: viscosity takes a while to bring the outer part along. An impact moves phi
//! only.
//!
//! p~ = p - dt U_old . grad p is the pressure of the last step, moved with the grain; without this
//! shift the drag of a moving grain is of first order in the step
//! (`docs/decisions/0011-pressure-moves-with-the-grain.md`). The impulse on the fluid is the sum of
//! fluid mass times gain over the faces, J = constant + matrix (V, Omega). The grain loses what the
//! fluid gains ([`super::rigid_body`]). `immersed::reference` has the scalar form.
//!
//! Legend: s weight of the rigid velocity, c closed fraction, C total closed fraction, phi solid
//! fraction (these three zero in the paper's scheme), f weight of the change of velocity, r rest
//! gain, u* predicted velocity, a body acceleration, h spacing along the component, l and m lever
//! arms of the face about the two other axes.

use glam::DVec3;

use super::forcing::ForcedFaces;
use super::geometry::FaceRun;
use crate::flow::{OldState, Prediction};
use crate::math::{Matrix6, Real, RigidVelocity, Vector6, multiply6};
use grainwake_simd::{Kernel, Partial, Stencil, Vector, dispatch};

/// Impulse on the fluid in a step [N s, N m s], affine in the six new velocities of a grain.
#[derive(Clone, Copy, Debug, Default)]
pub struct Impulse {
    /// Impulse for a grain at rest.
    pub constant: Vector6,
    /// Derivative with respect to the six velocities.
    pub matrix: Matrix6,
}

impl Impulse {
    /// Impulse for a grain with the new `velocity`.
    pub fn at(&self, velocity: RigidVelocity) -> Vector6 {
        let linear = multiply6(&self.matrix, &velocity.to_vector());
        std::array::from_fn(|row| self.constant[row] + linear[row])
    }
}

/// Sums the impulse over the faces of `forced` for a grain that had the velocity and acceleration
/// `old` and `acceleration`, and fills their `rest_gain`. `dt` [s] is the length of the step; 0
/// leaves out the pressure gradient, the body acceleration and that of the grain.
pub fn sum_impulse<R: Real>(
    known: &OldState<R>,
    predictions: &[Prediction<R>; 3],
    fluid_density: f64,
    forced: &mut ForcedFaces,
    [old, acceleration]: [RigidVelocity; 2],
    dt: f64,
) -> Impulse {
    let mut sums = [Moments::default(); 3];
    dispatch(SumImpulse { known, predictions, forced, old, acceleration, dt, sums: &mut sums });
    let w = fluid_density * known.mesh.cell_volume();
    let mut impulse = Impulse::default();
    for (axis, moments) in sums.iter().enumerate() {
        let moments = moments.map(|sum| sum.sum());
        let (constant, matrix) = moments.split_at(3);
        // A force along the axis has no torque about it.
        let rows = [axis, 3 + (axis + 1) % 3, 3 + (axis + 2) % 3];
        for (a, row) in rows.into_iter().enumerate() {
            impulse.constant[row] += w * constant[a];
            for (b, column) in rows.into_iter().enumerate() {
                impulse.matrix[row][column] += w * matrix[a + b + usize::from(a.min(b) > 0)];
            }
        }
    }
    impulse
}

/// Moments of the gain of one component: sums of its part at U = 0 times 1, l and m, then of its
/// derivative dGain / dU times 1, l, m, l l, l m and m m.
type Moments = [Partial; 9];

struct SumImpulse<'a, R> {
    known: &'a OldState<'a, R>,
    predictions: &'a [Prediction<'a, R>; 3],
    forced: &'a mut ForcedFaces,
    old: RigidVelocity,
    acceleration: RigidVelocity,
    dt: f64,
    sums: &'a mut [Moments; 3],
}

impl<R: Real> Kernel for SumImpulse<'_, R> {
    type Number = f64;
    #[inline(always)]
    fn run<V: Vector<Number = f64>>(self) {
        let (mesh, spacing, forced) = (self.known.mesh, self.known.mesh.spacing, self.forced);
        let mut rest_gain = std::mem::take(&mut forced.rest_gain);
        rest_gain.resize(forced.weight.len(), 0.0);
        let [x, y, z] = mesh.layout().strides().map(|stride| stride as isize);
        let stencil = Stencil::new([0, x, -x, y, -y, z, -z]);
        let total_closed_fraction = forced.total_closed_fraction();
        for (axis, runs) in forced.runs.iter().enumerate() {
            let half_cell = 0.5 * spacing[axis] * DVec3::AXES[axis];
            let above = self.old.angular.cross(half_cell);
            for run in runs {
                let rigid = RigidRun::new(self.old, run.lever_arm, spacing);
                let shifted = |offset| RigidRun { first: rigid.first + offset, ..rigid };
                let faces = RunImpulse {
                    axis,
                    run,
                    predicted: self.predictions[axis].velocity(run.at, run.count),
                    pressure: self.known.pressure,
                    stencil,
                    rigid,
                    acceleration: RigidRun::new(self.acceleration, run.lever_arm, spacing),
                    dt: self.dt,
                    cells: [above, -above].map(shifted),
                    dt_per_h: (self.dt / spacing).to_array(),
                    dt_g: self.dt * self.known.body_acceleration[axis],
                    spacing: spacing.x,
                };
                for n in (0..run.count).step_by(V::WIDTH) {
                    let entry = run.first + n;
                    let weights = [
                        V::load_from(&forced.weight[entry..]),
                        V::load_from(&forced.closed_fraction[entry..]),
                        V::load_from(&total_closed_fraction[entry..]),
                        V::load_from(&forced.solid_fraction[entry..]),
                    ];
                    let gain = faces.add(n, weights, &mut self.sums[axis]);
                    // Entries beyond the run are overwritten by the next run.
                    gain.store(&mut rest_gain[entry..]);
                }
            }
        }
        forced.rest_gain = rest_gain;
    }
}

/// Faces of one run.
struct RunImpulse<'a, R> {
    axis: usize,
    run: &'a FaceRun,
    /// u* of the faces [m/s].
    predicted: &'a [R],
    /// p of the last step [m^2/s^2].
    pressure: &'a [R],
    /// A cell and its six neighbours.
    stencil: Stencil<7>,
    /// U_old at the faces [m/s].
    rigid: RigidRun,
    /// Acceleration of the grain over the previous step, at the faces [m/s^2].
    acceleration: RigidRun,
    /// Length of the step [s].
    dt: f64,
    /// U_old at the centres of the cells above and below the faces [m/s].
    cells: [RigidRun; 2],
    /// dt / h along each axis [s/m].
    dt_per_h: [f64; 3],
    /// dt a along the component, with the body acceleration a [m/s].
    dt_g: f64,
    /// h along x [m].
    spacing: f64,
}

impl<R: Real> RunImpulse<'_, R> {
    /// Moved pressure p~ [m^2/s^2] of the cells above (`side` 0) or below (1) the faces from face
    /// `n` of the run on.
    #[inline(always)]
    fn moved_pressure<V: Vector<Number = f64>>(&self, side: usize, n: usize) -> V {
        let at = [self.run.at, self.run.below][side] + n;
        let [mut moved, neighbours @ ..] = self.stencil.load_within::<V, R>(self.pressure, at);
        for axis in 0..3 {
            let velocity = self.cells[side].component(axis, lane_indices(n));
            let displacement = V::constant(-0.5 * self.dt_per_h[axis]) * velocity;
            let difference = neighbours[2 * axis] - neighbours[2 * axis + 1];
            moved = displacement.mul_add(difference, moved);
        }
        moved
    }

    /// Adds the faces from face `n` of the run on, with the weights s, c, C and phi, to the sums;
    /// returns their gain for U = U_old = 0 [m/s].
    #[inline(always)]
    fn add<V: Vector<Number = f64>>(
        &self,
        n: usize,
        [weight, closed_fraction, total_closed_fraction, solid_fraction]: [V; 4],
        sums: &mut Moments,
    ) -> V {
        let (zero, index) = (V::constant(0.0), lane_indices::<V>(n));
        let predicted = V::load_partial(&self.predicted[n..]);
        let rise = self.moved_pressure::<V>(0, n) - self.moved_pressure(1, n);
        let e = rise.mul_add(V::constant(self.dt_per_h[self.axis]), V::constant(-self.dt_g));
        let without_drag = total_closed_fraction.mul_add(e, predicted);
        let rest_gain = (zero - weight).mul_add(without_drag, closed_fraction * e);
        let expected = V::constant(self.dt) * self.acceleration.component(self.axis, index);
        let rest_gain =
            change_weight(weight, closed_fraction - solid_fraction).mul_add(expected, rest_gain);
        let f = change_weight(weight, solid_fraction);
        let constant = rest_gain - f * self.rigid.component(self.axis, index);
        let derivative = weight + f;
        let lever_arm = self.run.lever_arm;
        let x = V::constant(lever_arm.x) + V::constant(self.spacing) * index;
        let lever_arm = [x, V::constant(lever_arm.y), V::constant(lever_arm.z)];
        let end = V::constant(self.run.count as f64);
        let constant = index.select_below(end, constant, zero);
        let derivative = index.select_below(end, derivative, zero);
        let (l, m) = (lever_arm[(self.axis + 2) % 3], zero - lever_arm[(self.axis + 1) % 3]);
        let [by_l, by_m] = [derivative * l, derivative * m];
        let [constant_l, constant_m] = [constant * l, constant * m];
        let [l_l, l_m, m_m] = [by_l * l, by_l * m, by_m * m];
        let moments = [constant, constant_l, constant_m, derivative, by_l, by_m, l_l, l_m, m_m];
        for (sum, value) in sums.iter_mut().zip(&moments) {
            sum.add(n + 1, *value);
        }
        rest_gain
    }
}

/// Adds the gain of the forced faces to component `axis` of a part of the prediction, for a grain
/// with the new `velocity` that changed by `change` in the step. [`sum_impulse`] has filled
/// the lists of `forced`.
pub fn add_rigid_gain<R: Real>(
    axis: usize,
    spacing: DVec3,
    forced: &ForcedFaces,
    velocity: RigidVelocity,
    change: RigidVelocity,
    prediction: &mut Prediction<R>,
) {
    dispatch(AddRigidGain { axis, spacing, forced, velocity, change, prediction });
}

struct AddRigidGain<'a, 'b, R> {
    axis: usize,
    spacing: DVec3,
    forced: &'a ForcedFaces,
    velocity: RigidVelocity,
    change: RigidVelocity,
    prediction: &'a mut Prediction<'b, R>,
}

impl<R: Real> Kernel for AddRigidGain<'_, '_, R> {
    type Number = f64;
    #[inline(always)]
    fn run<V: Vector<Number = f64>>(self) {
        let (axis, forced) = (self.axis, self.forced);
        let part = self.prediction.range().clone();
        let runs = forced.runs[axis].iter();
        for run in runs.filter(|run| part.contains(&run.at)) {
            let velocity = RigidRun::new(self.velocity, run.lever_arm, self.spacing);
            let change = RigidRun::new(self.change, run.lever_arm, self.spacing);
            let predicted = self.prediction.velocity_mut(run.at, run.count);
            for n in (0..run.count).step_by(V::WIDTH) {
                let entry = run.first + n;
                let weight = V::load_from(&forced.weight[entry..]);
                let solid_fraction = V::load_from(&forced.solid_fraction[entry..]);
                let index = lane_indices(n);
                let gain = V::load(&forced.rest_gain[entry..])
                    + weight * velocity.component(axis, index)
                    + change_weight(weight, solid_fraction) * change.component(axis, index);
                gain.add_partial(&mut predicted[n..]);
            }
        }
    }
}

/// Rigid velocity V + Omega x r along a run of faces: linear in the index of the face.
#[derive(Clone, Copy)]
struct RigidRun {
    /// Velocity at the first face [m/s].
    first: DVec3,
    /// Change from a face to the next [m/s].
    change: DVec3,
}

impl RigidRun {
    /// Velocity along the run of faces that begins at `lever_arm` from the centroid [m].
    #[inline(always)]
    fn new(velocity: RigidVelocity, lever_arm: DVec3, spacing: DVec3) -> RigidRun {
        RigidRun {
            first: velocity.at(lever_arm),
            change: velocity.angular.cross(DVec3::X * spacing.x),
        }
    }
    /// Component `axis` of the velocity at the faces `index` of the run [m/s].
    #[inline(always)]
    fn component<V: Vector<Number = f64>>(&self, axis: usize, index: V) -> V {
        let [first, change] = [self.first, self.change].map(|u| V::constant(u[axis]));
        index.mul_add(change, first)
    }
}

/// Indices of the faces in the lanes of a register that begins at face `n` of a run.
#[inline(always)]
fn lane_indices<V: Vector<Number = f64>>(n: usize) -> V {
    V::constant(n as f64) + V::ramp()
}

/// Weight f = (1 - s) phi of the change U - U_old of the rigid velocity, with the weight s of the
/// velocity and the solid fraction phi.
#[inline(always)]
fn change_weight<V: Vector<Number = f64>>(weight: V, solid_fraction: V) -> V {
    (V::constant(1.0) - weight) * solid_fraction
}

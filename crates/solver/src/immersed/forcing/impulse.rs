//! Impulse that a grain's rigidity takes from the fluid, as an affine function of its new velocities.
//!
//! In a step a forced face gains, with the new rigid velocity U and the one before, U_old:
//!
//! - back = dt / h (p~(above) - p~(below)) - dt g: removes pressure gradient and body acceleration,
//! - free = u* + C back: velocity of the face without drag,
//! - rest_gain = c back - s free: gain next to a grain at rest,
//! - gain = rest_gain + s U + f (U - U_old), with f = (1 - s) c.
//!
//! p~ = p - dt U_old . grad p is the pressure of the last step moved with the grain; the unmoved one
//! would make the drag of a moving grain first order in the step
//! (`docs/decisions/0011-pressure-moves-with-the-grain.md`). The sum of w gain over the faces is the
//! impulse J = constant + slope (V, Omega). What the fluid gains the grain loses
//! ([`crate::immersed::rigid_body`]). `immersed::reference` has the scalar form.
//!
//! Legend: s weight, c closed fraction, C closed fraction of all grains together, w fluid mass of a
//! face, h spacing along the component, l and m levers of the face about the two other axes.

use super::faces::ForcedFaces;
use super::rigid_run::{RigidRun, follow, lane_indices};
use crate::flow::{Known, Prediction};
use crate::immersed::geometry::FaceRun;
use crate::immersed::kinematics::RigidVelocity;
use crate::math::{Matrix6, Real, Vector6};
use glam::DVec3;
use grainwake_simd::{Kernel, Partial, Stencil, Vector, dispatch};

/// Impulse on the fluid in a step [N s, N m s], affine in the six new velocities of a grain.
#[derive(Clone, Copy, Debug, Default)]
pub struct Impulse {
    /// Impulse for a grain at rest.
    pub constant: Vector6,
    /// Derivative by the six velocities.
    pub slope: Matrix6,
}

/// Sums the impulse over the faces of `forced` for a grain that had the velocities `before`, and fills
/// their `rest_gain`. `closure_dt` [s] is the step for which closed fractions follow the grain instead
/// of the pressure gradient; zero turns both off.
pub fn sum_impulse<R: Real>(
    known: &Known<R>,
    predictions: &[Prediction<R>; 3],
    fluid_density: f64,
    forced: &mut ForcedFaces,
    before: RigidVelocity,
    closure_dt: f64,
) -> Impulse {
    let mut sums = [Moments::default(); 3];
    dispatch(SumImpulse {
        known,
        predictions,
        forced,
        before,
        closure_dt,
        sums: &mut sums,
    });
    let w = fluid_density * known.mesh.cell_volume();
    let mut impulse = Impulse::default();
    for (axis, sum) in sums.iter().enumerate() {
        let constant = sum.constant.map(|s| s.sum());
        let slope = sum.slope.map(|s| s.sum());
        // A force along the axis has no torque about it.
        let rows = [axis, 3 + (axis + 1) % 3, 3 + (axis + 2) % 3];
        for (a, row) in rows.into_iter().enumerate() {
            impulse.constant[row] += w * constant[a];
            for (b, column) in rows.into_iter().enumerate() {
                impulse.slope[row][column] += w * slope[a + b + usize::from(a.min(b) > 0)];
            }
        }
    }
    impulse
}

/// Sums over the faces of one component.
#[derive(Clone, Copy, Default)]
struct Moments {
    /// Constant part with the factors 1, l, m.
    constant: [Partial; 3],
    /// Slope with the factors 1, l, m, l l, l m, m m.
    slope: [Partial; 6],
}

impl Moments {
    /// Adds the faces from the `n`th of a run on, at `arm` from the centroid.
    #[inline(always)]
    fn add<V: Vector<Number = f64>>(
        &mut self,
        axis: usize,
        n: usize,
        arm: [V; 3],
        constant: V,
        slope: V,
    ) {
        let (l, m) = (arm[(axis + 2) % 3], V::constant(0.0) - arm[(axis + 1) % 3]);
        let [slope_l, slope_m] = [slope * l, slope * m];
        let constants = [constant, constant * l, constant * m];
        let slopes = [
            slope,
            slope_l,
            slope_m,
            slope_l * l,
            slope_l * m,
            slope_m * m,
        ];
        for (sum, value) in self.constant.iter_mut().zip(&constants) {
            sum.add(n + 1, *value);
        }
        for (sum, value) in self.slope.iter_mut().zip(&slopes) {
            sum.add(n + 1, *value);
        }
    }
}

struct SumImpulse<'a, R> {
    known: &'a Known<'a, R>,
    predictions: &'a [Prediction<'a, R>; 3],
    forced: &'a mut ForcedFaces,
    before: RigidVelocity,
    closure_dt: f64,
    sums: &'a mut [Moments; 3],
}

impl<R: Real> Kernel for SumImpulse<'_, R> {
    type Number = f64;
    #[inline(always)]
    fn run<V: Vector<Number = f64>>(self) {
        let mesh = self.known.mesh;
        let forced = self.forced;
        let mut rest_gain = std::mem::take(&mut forced.rest_gain);
        rest_gain.resize(forced.weight.len(), 0.0);
        let spacing = mesh.spacing;
        let [x, y, z] = mesh.layout().strides().map(|stride| stride as isize);
        let stencil = Stencil::new([0, x, -x, y, -y, z, -z]);
        let (weights, closed, closed_by_all) =
            (&forced.weight, &forced.closed, forced.closed_by_all());
        for (axis, runs) in forced.runs.iter().enumerate() {
            let half_cell = 0.5 * spacing[axis] * DVec3::AXES[axis];
            let above = self.before.angular.cross(half_cell);
            for run in runs {
                let rigid = RigidRun::new(self.before, run.arm, spacing);
                let faces = RunImpulse {
                    axis,
                    run,
                    predicted: self.predictions[axis].velocity(run.at, run.count),
                    pressure: self.known.pressure,
                    stencil,
                    rigid,
                    cells: [above, -above].map(|offset| rigid.shifted(offset)),
                    drift: (0.5 * self.closure_dt / spacing).to_array(),
                    dt_per_h: self.closure_dt / spacing[axis],
                    driven: self.closure_dt * self.known.body_acceleration[axis],
                    closure_dt: self.closure_dt,
                    spacing: spacing.x,
                };
                for n in (0..run.count).step_by(V::WIDTH) {
                    let entry = run.first + n;
                    let weight = V::load_from(&weights[entry..]);
                    let closed = V::load_from(&closed[entry..]);
                    let closed_by_all = V::load_from(&closed_by_all[entry..]);
                    // Lanes beyond the run are overwritten by the next.
                    faces
                        .add(n, weight, [closed, closed_by_all], &mut self.sums[axis])
                        .store(&mut rest_gain[entry..]);
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
    pressure: &'a [R],
    /// A cell and its six neighbours.
    stencil: Stencil<7>,
    rigid: RigidRun,
    /// Rigid velocity at the centres of the cells above and below the faces.
    cells: [RigidRun; 2],
    /// dt / (2 h) along each axis [s/m].
    drift: [f64; 3],
    /// dt / h along the component [s/m].
    dt_per_h: f64,
    /// dt g along the component [m/s].
    driven: f64,
    closure_dt: f64,
    spacing: f64,
}

impl<R: Real> RunImpulse<'_, R> {
    /// Moved pressure p~ of the cells above (`side` 0) or below (1) the faces from the `n`th on.
    #[inline(always)]
    fn moved_pressure<V: Vector<Number = f64>>(&self, side: usize, n: usize) -> V {
        let at = [self.run.at, self.run.below][side] + n;
        let [mut moved, rest @ ..] = self.stencil.load_within::<V, R>(self.pressure, at);
        for axis in 0..3 {
            let velocity = self.cells[side].component(axis, lane_indices(n));
            let cells = V::constant(-self.drift[axis]) * velocity;
            moved = cells.mul_add(rest[2 * axis] - rest[2 * axis + 1], moved);
        }
        moved
    }

    /// Adds the faces from the `n`th on to the sums; returns their `rest_gain`.
    #[inline(always)]
    fn add<V: Vector<Number = f64>>(
        &self,
        n: usize,
        weight: V,
        [closed, closed_by_all]: [V; 2],
        sums: &mut Moments,
    ) -> V {
        let (zero, index) = (V::constant(0.0), lane_indices::<V>(n));
        let predicted = V::load_partial(&self.predicted[n..]);
        let follow = follow(weight, closed, self.closure_dt);
        let (mut free, mut returned) = (predicted, zero);
        // Nothing is closed outside the band.
        if !closed_by_all.is_zero() {
            let rise = self.moved_pressure::<V>(0, n) - self.moved_pressure(1, n);
            let back = rise.mul_add(V::constant(self.dt_per_h), V::constant(-self.driven));
            (free, returned) = (closed_by_all.mul_add(back, predicted), closed * back);
        }
        let rest_gain = (zero - weight).mul_add(free, returned);
        let constant = rest_gain - follow * self.rigid.component(self.axis, index);
        let slope = weight + follow;
        let arm = self.run.arm;
        let x = V::constant(arm.x) + V::constant(self.spacing) * index;
        let arm = [x, V::constant(arm.y), V::constant(arm.z)];
        let end = V::constant(self.run.count as f64);
        let constant = index.select_below(end, constant, zero);
        let slope = index.select_below(end, slope, zero);
        sums.add(self.axis, n, arm, constant, slope);
        rest_gain
    }
}

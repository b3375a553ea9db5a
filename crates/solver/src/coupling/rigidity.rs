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

use std::ops::Range;

use glam::{DMat3, DVec3};

use super::Past;
use super::forced::Forced;
use super::locate::Body;
use crate::dem::{Dof, Grain, Response};
use crate::flow::Flow;
use crate::grid::{FaceVector, for_slabs};
use crate::math::lanes::{Kernel, Partial, RAMP, RowWork, Vector, along_row, dispatch, prefetch};
use crate::math::{Load, Matrix6, Real, Vector6, solve6};

/// How many runs ahead memory is asked for.
const AHEAD: usize = 8;

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
    let mut sums = [Moments::default(); 3];
    dispatch(Gather {
        flow,
        body,
        before: past.velocity,
        relief,
        sums: &mut sums,
    });
    let w = fluid_density * flow.mesh().cell_volume();
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
    /// Adds a run of component `axis` whose first face has this `arm`, by its sums of push and pull
    /// with the powers of the way along x.
    fn add(&mut self, axis: usize, arm: DVec3, push: [f64; 2], pull: [f64; 3]) {
        // A lever is a + b x.
        let along = |component: usize| [arm[component], if component == 0 { 1.0 } else { 0.0 }];
        let [l, m] = [along((axis + 2) % 3), along((axis + 1) % 3).map(|v| -v)];
        let once = |v: [f64; 2], sum: &[f64]| v[0] * sum[0] + v[1] * sum[1];
        let twice = |v: [f64; 2], w: [f64; 2]| v[0] * once(w, &pull) + v[1] * once(w, &pull[1..]);
        let pushes = [push[0], once(l, &push), once(m, &push)];
        let pulls = [
            pull[0],
            once(l, &pull),
            once(m, &pull),
            twice(l, l),
            twice(l, m),
            twice(m, m),
        ];
        self.push
            .iter_mut()
            .zip(pushes)
            .for_each(|(sum, x)| *sum += x);
        self.pull
            .iter_mut()
            .zip(pulls)
            .for_each(|(sum, x)| *sum += x);
    }
}

/// What a run of faces needs of the rigid motion: at its first face, and the change to the next.
#[derive(Clone, Copy)]
struct Rigid {
    first: DVec3,
    change: DVec3,
}

impl Rigid {
    /// Velocity of a body at `[velocity, angular velocity]` along a run that begins at `arm`.
    fn of([velocity, omega]: [DVec3; 2], arm: DVec3, spacing: DVec3) -> Rigid {
        Rigid {
            first: velocity + omega.cross(arm),
            change: omega.cross(DVec3::X * spacing.x),
        }
    }
    /// A component at the faces `i` of the run.
    #[inline(always)]
    fn at<V: Vector<Number = f64>>(&self, axis: usize, i: V) -> V {
        V::constant(self.first[axis]) + V::constant(self.change[axis]) * i
    }
}

/// The lanes of a vector, counted from `n`.
#[inline(always)]
fn count_from<V: Vector<Number = f64>>(n: usize) -> V {
    V::constant(n as f64) + V::load(&RAMP)
}

/// Part of the grain's change of velocity that a face takes beside its share of the velocity; `relieved`
/// is 1, or 0 without relief.
#[inline(always)]
fn follow<V: Vector<Number = f64>>(share: V, closed: V, relieved: f64) -> V {
    V::constant(relieved) * (V::constant(1.0) - share) * closed
}

fn relieved(relief: f64) -> f64 {
    if relief > 0.0 { 1.0 } else { 0.0 }
}

/// Sums over the forced faces of one grain; leaves what the faces know in their lists.
struct Gather<'a, R> {
    flow: &'a Flow<R>,
    body: &'a mut Body,
    before: [DVec3; 2],
    relief: f64,
    sums: &'a mut [Moments; 3],
}

impl<R: Real> Kernel for Gather<'_, R> {
    type Number = f64;
    #[inline(always)]
    fn run<V: Vector<Number = f64>>(self) {
        let forced = &mut self.body.forced;
        let faces = forced.share.len();
        forced.back.resize(faces, 0.0);
        forced.free.resize(faces, 0.0);
        let spacing = self.flow.mesh().spacing;
        let strides = self.flow.mesh().layout().strides();
        let Forced {
            runs,
            share,
            closed,
            closed_by_all,
            back,
            free,
        } = forced;
        for (axis, runs) in runs.iter().enumerate() {
            let half = 0.5 * spacing[axis] * DVec3::AXES[axis];
            for (number, run) in runs.iter().enumerate() {
                if let Some(run) = runs.get(number + AHEAD) {
                    prefetch(self.flow.predicted.component(axis), run.at, run.count);
                    prefetch(&self.flow.pressure, run.at, run.count);
                    prefetch(&self.flow.pressure, run.at + strides[2], run.count);
                }
                let faces = run.first..run.first + run.count;
                let mut work = GatherRun {
                    axis,
                    predicted: &self.flow.predicted.component(axis)[run.at..],
                    pressure: &self.flow.pressure,
                    strides,
                    cells: [run.at, run.below],
                    rigid: Rigid::of(self.before, run.arm, spacing),
                    sides: [half, -half]
                        .map(|half| Rigid::of(self.before, run.arm + half, spacing)),
                    drift: (0.5 * self.relief / spacing).to_array(),
                    pull: self.relief / spacing[axis],
                    driven: self.relief * self.flow.body_acceleration()[axis],
                    relieved: relieved(self.relief),
                    spacing: spacing.x,
                    share: &share[faces.clone()],
                    closed: &closed[faces.clone()],
                    closed_by_all: &closed_by_all[faces.clone()],
                    back: &mut back[faces.clone()],
                    free: &mut free[faces],
                    sums: Default::default(),
                };
                along_row::<V>(run.count, &mut work);
                let [push, push_x, pull, pull_x, pull_xx] = work.sums.map(|sum| sum.sum());
                self.sums[axis].add(axis, run.arm, [push, push_x], [pull, pull_x, pull_xx]);
            }
        }
    }
}

/// One run; the lists are of its faces.
struct GatherRun<'a, R> {
    axis: usize,
    predicted: &'a [R],
    pressure: &'a [R],
    strides: [usize; 3],
    /// The first of the cells above and below the faces.
    cells: [usize; 2],
    rigid: Rigid,
    /// Motion of the middles of those cells.
    sides: [Rigid; 2],
    /// Half a step over the spacing along each axis [s/m].
    drift: [f64; 3],
    /// A step over the spacing along the component [s/m].
    pull: f64,
    /// What a uniform acceleration gives a face in the step [m/s].
    driven: f64,
    relieved: f64,
    spacing: f64,
    share: &'a [f64],
    closed: &'a [f64],
    closed_by_all: &'a [f64],
    back: &'a mut [f64],
    free: &'a mut [f64],
    /// Of push, push x, pull, pull x and pull x x.
    sums: [Partial; 5],
}

impl<R: Real> GatherRun<'_, R> {
    /// Pressure of the cells from face `n` on, above or below it, moved with the grain for a step.
    #[inline(always)]
    fn moved<V: Vector<Number = f64>>(&self, side: usize, n: usize) -> V {
        let at = self.cells[side] + n;
        let p = |at: usize| V::load_from(&self.pressure[at..]);
        let mut moved = p(at);
        for axis in 0..3 {
            let stride = self.strides[axis];
            let cells = V::constant(self.drift[axis]) * self.sides[side].at(axis, count_from(n));
            moved = moved - cells * (p(at + stride) - p(at - stride));
        }
        moved
    }
}

impl<R: Real> RowWork for GatherRun<'_, R> {
    type Number = f64;
    #[inline(always)]
    fn at<V: Vector<Number = f64>>(&mut self, i: usize) {
        let n = i - 1;
        let x = V::constant(self.spacing) * count_from(n);
        let (share, closed) = (V::load(&self.share[n..]), V::load(&self.closed[n..]));
        let rise = self.moved::<V>(0, n) - self.moved(1, n);
        let back = V::constant(self.pull) * rise - V::constant(self.driven);
        let predicted = V::load_from(&self.predicted[n..]);
        let free = predicted + V::load(&self.closed_by_all[n..]) * back;
        let follow = follow(share, closed, self.relieved);
        let push = closed * back - share * free - follow * self.rigid.at(self.axis, count_from(n));
        let pull = share + follow;
        back.store(&mut self.back[n..]);
        free.store(&mut self.free[n..]);
        let [push_x, pull_x] = [push * x, pull * x];
        let sums = [push, push_x, pull, pull_x, pull_x * x];
        for (sum, value) in self.sums.iter_mut().zip(sums) {
            sum.add(i, value);
        }
    }
}

/// Newton's and Euler's equations of one grain and the fluid it holds over a step, as a linear system for
/// its new velocities.
#[derive(Clone, Copy)]
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

    /// How the grain answers contact within the step, so that it leaves its sub-steps as [`advance`] will
    /// have it. Its mass is at least its own with `added_density` of the fluid, most of which answers by
    /// the projection, one step late (`docs/decisions/0014-contact-and-fluid-at-once.md`); not so where
    /// it touched something in the step before: struck again ahead of that answer, it would gain.
    pub fn response(&self, grain: &Grain, past: &Past, added_density: f64, dt: f64) -> Response {
        let [v, omega] = past.velocity;
        let before = [v.x, v.y, v.z, omega.x, omega.y, omega.z];
        // What there is to accelerate it, with its mass before that grows.
        let mut drive: Vector6 = std::array::from_fn(|row| {
            let held: f64 = (0..6).map(|n| self.matrix[row][n] * before[n]).sum();
            (self.right[row] - held) / dt
        });
        let mut a = self.matrix;
        // After a step with contact there is no acceleration that goes on.
        let flew = past.acceleration != [DVec3::ZERO; 2];
        let added_density = if flew { added_density } else { 0.0 };
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
        Response::new(drive, columns)
    }
}

/// New velocities of the grain under its motion's equations and the mean `contact` load over `dt`; returns
/// the hydrodynamic load on it.
pub fn advance(
    grain: &mut Grain,
    past: &Past,
    impulse: &Impulse,
    motion: &Motion,
    fluid_density: f64,
    contact: Load,
    dt: f64,
) -> Load {
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
    grain.velocity = DVec3::new(x[0], x[1], x[2]);
    grain.angular_velocity = DVec3::new(x[3], x[4], x[5]);

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
#[derive(Clone, Copy)]
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

/// Gives the forced faces what the grains give them; arguments as of [`gather`], which came before.
pub fn impose<R: Real>(
    flow: &mut Flow<R>,
    grains: &[Grain],
    bodies: &[Body],
    before: &[Past],
    relief: f64,
) {
    let (mesh, relieved) = (*flow.mesh(), relieved(relief));
    let FaceVector { x, y, z } = &mut flow.predicted;
    for_slabs(
        mesh.layout(),
        [[&mut **x], [y], [z]],
        |axis, from, [predicted]| {
            let slab = from..from + predicted.len();
            for ((grain, body), past) in grains.iter().zip(bodies).zip(before) {
                if body.lies_in(&slab, mesh.layout()) {
                    dispatch(Impose {
                        axis,
                        spacing: mesh.spacing,
                        grain,
                        forced: &body.forced,
                        before: past.velocity,
                        relieved,
                        slab: slab.clone(),
                        predicted: &mut *predicted,
                    });
                }
            }
        },
    );
}

/// What one grain gives the faces of a component in a slab of memory.
struct Impose<'a, R> {
    axis: usize,
    spacing: DVec3,
    grain: &'a Grain,
    forced: &'a Forced,
    before: [DVec3; 2],
    relieved: f64,
    slab: Range<usize>,
    predicted: &'a mut [R],
}

impl<R: Real> Kernel for Impose<'_, R> {
    type Number = f64;
    #[inline(always)]
    fn run<V: Vector<Number = f64>>(self) {
        let now = [self.grain.velocity, self.grain.angular_velocity];
        let change = [0, 1].map(|which| now[which] - self.before[which]);
        let forced = self.forced;
        let runs = forced.runs[self.axis].iter();
        for run in runs.filter(|run| self.slab.contains(&run.at)) {
            let faces = run.first..run.first + run.count;
            let at = run.at - self.slab.start;
            let mut work = ImposeRun {
                axis: self.axis,
                rigid: Rigid::of(now, run.arm, self.spacing),
                change: Rigid::of(change, run.arm, self.spacing),
                relieved: self.relieved,
                share: &forced.share[faces.clone()],
                closed: &forced.closed[faces.clone()],
                back: &forced.back[faces.clone()],
                free: &forced.free[faces],
                predicted: &mut self.predicted[at..at + run.count],
            };
            along_row::<V>(run.count, &mut work);
        }
    }
}

/// One run; the lists are of its faces.
struct ImposeRun<'a, R> {
    axis: usize,
    rigid: Rigid,
    change: Rigid,
    relieved: f64,
    share: &'a [f64],
    closed: &'a [f64],
    back: &'a [f64],
    free: &'a [f64],
    predicted: &'a mut [R],
}

impl<R: Real> RowWork for ImposeRun<'_, R> {
    type Number = f64;
    #[inline(always)]
    fn at<V: Vector<Number = f64>>(&mut self, i: usize) {
        let n = i - 1;
        let load = |list: &[f64]| V::load(&list[n..]);
        let (share, closed) = (load(self.share), load(self.closed));
        let place = count_from(n);
        let gain = closed * load(self.back)
            + share * (self.rigid.at(self.axis, place) - load(self.free))
            + follow(share, closed, self.relieved) * self.change.at(self.axis, place);
        (V::load_from(&self.predicted[n..]) + gain).store_to(&mut self.predicted[n..]);
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

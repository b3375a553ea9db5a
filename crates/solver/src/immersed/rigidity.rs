//! Rigidity imposed on the grid and the load it leaves on the grain (Eqs 4b, 4c, 5).
//!
//! Every forced face takes a share of the rigid velocity V + Omega x r, which is affine in the six
//! velocities of the grain; so is the impulse that this takes from the fluid. What the fluid gains the
//! grain loses ([`super::newton`]): momentum is conserved to round-off.
//!
//! Legend: w mass of a face's cell.

use glam::DVec3;

use super::Past;
use super::forced::{Forced, Run};
use crate::flow::{Known, Prediction};
use crate::math::{Matrix6, Real, Vector6};
use grainwake_simd::{Kernel, Partial, Stencil, Vector, dispatch, prefetch};

/// How many runs ahead memory is asked for.
const AHEAD: usize = 8;

/// What a step of the fluid does to one grain.
#[derive(Default)]
pub struct Impulse {
    /// At rest, and its derivative by the six velocities.
    pub constant: Vector6,
    pub slope: Matrix6,
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
    known: &Known<R>,
    predictions: &[Prediction<R>; 3],
    fluid_density: f64,
    forced: &mut Forced,
    past: &Past,
    relief: f64,
) -> Impulse {
    let mut sums = [Moments::default(); 3];
    dispatch(Gather {
        known,
        predictions,
        forced,
        before: past.velocity,
        relief,
        sums: &mut sums,
    });
    let w = fluid_density * known.mesh.cell_volume();
    let mut impulse = Impulse {
        constant: [0.0; 6],
        slope: [[0.0; 6]; 6],
    };
    for (axis, sum) in sums.iter().enumerate() {
        let (push, pull) = (sum.push.map(|s| s.sum()), sum.pull.map(|s| s.sum()));
        let rows = [axis, 3 + (axis + 1) % 3, 3 + (axis + 2) % 3];
        for (a, row) in rows.into_iter().enumerate() {
            impulse.constant[row] += w * push[a];
            for (b, column) in rows.into_iter().enumerate() {
                impulse.slope[row][column] += w * pull[a + b + usize::from(a.min(b) > 0)];
            }
        }
    }
    impulse
}

/// Sums over the faces of one component, with the weights 1 and the two components that a lever
/// arm x unit has: a force along the axis has no torque about it.
#[derive(Clone, Copy, Default)]
struct Moments {
    push: [Partial; 3],
    /// Of 1, l, m, l l, l m and m m, l and m the levers.
    pull: [Partial; 6],
}

impl Moments {
    /// Adds faces of component `axis` at the places `arm` from the centroid, in the lanes from the `n`th on.
    #[inline(always)]
    fn add<V: Vector<Number = f64>>(
        &mut self,
        axis: usize,
        n: usize,
        arm: [V; 3],
        push: V,
        pull: V,
    ) {
        let (l, m) = (arm[(axis + 2) % 3], V::constant(0.0) - arm[(axis + 1) % 3]);
        let [pull_l, pull_m] = [pull * l, pull * m];
        let pushes = [push, push * l, push * m];
        let pulls = [pull, pull_l, pull_m, pull_l * l, pull_l * m, pull_m * m];
        for (sum, value) in self.push.iter_mut().zip(&pushes) {
            sum.add(n + 1, *value);
        }
        for (sum, value) in self.pull.iter_mut().zip(&pulls) {
            sum.add(n + 1, *value);
        }
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
    #[inline(always)]
    fn of([velocity, omega]: [DVec3; 2], arm: DVec3, spacing: DVec3) -> Rigid {
        Rigid {
            first: velocity + omega.cross(arm),
            change: omega.cross(DVec3::X * spacing.x),
        }
    }
    /// The same beside the run, where the velocity is `more`.
    #[inline(always)]
    fn beside(self, more: DVec3) -> Rigid {
        Rigid {
            first: self.first + more,
            ..self
        }
    }
    /// A component at the faces `i` of the run.
    #[inline(always)]
    fn at<V: Vector<Number = f64>>(&self, axis: usize, i: V) -> V {
        i.mul_add(
            V::constant(self.change[axis]),
            V::constant(self.first[axis]),
        )
    }
}

/// The lanes of a vector, counted from `n`.
#[inline(always)]
fn count_from<V: Vector<Number = f64>>(n: usize) -> V {
    V::constant(n as f64) + V::ramp()
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
    known: &'a Known<'a, R>,
    predictions: &'a [Prediction<'a, R>; 3],
    forced: &'a mut Forced,
    before: [DVec3; 2],
    relief: f64,
    sums: &'a mut [Moments; 3],
}

impl<R: Real> Kernel for Gather<'_, R> {
    type Number = f64;
    #[inline(always)]
    fn run<V: Vector<Number = f64>>(self) {
        let Known { mesh, pressure, .. } = self.known;
        let forced = self.forced;
        let faces = forced.share.len();
        forced.taken.resize(faces, 0.0);
        let spacing = mesh.spacing;
        let strides = mesh.layout().strides();
        let [x, y, z] = strides.map(|stride| stride as isize);
        let around = Stencil::new([0, x, -x, y, -y, z, -z]);
        let Forced {
            runs,
            share,
            closed,
            closed_by_all,
            taken,
        } = forced;
        let by_all = if closed_by_all.is_empty() {
            &*closed
        } else {
            closed_by_all
        };
        for (axis, runs) in runs.iter().enumerate() {
            let half = 0.5 * spacing[axis] * DVec3::AXES[axis];
            let above = self.before[1].cross(half);
            let prediction = &self.predictions[axis];
            for (number, run) in runs.iter().enumerate() {
                if let Some(run) = runs.get(number + AHEAD) {
                    prediction.ask(run.at, run.count);
                    prefetch(pressure, run.at, run.count);
                    prefetch(pressure, run.at + strides[2], run.count);
                }
                let rigid = Rigid::of(self.before, run.arm, spacing);
                let work = GatherRun {
                    axis,
                    run,
                    predicted: prediction.velocity(run.at, run.count),
                    pressure,
                    around,
                    rigid,
                    sides: [above, -above].map(|more| rigid.beside(more)),
                    drift: (0.5 * self.relief / spacing).to_array(),
                    pull: self.relief / spacing[axis],
                    driven: self.relief * self.known.body_acceleration[axis],
                    relieved: relieved(self.relief),
                    spacing: spacing.x,
                };
                for n in (0..run.count).step_by(V::WIDTH) {
                    let at = run.first + n;
                    let closed = [V::load_from(&closed[at..]), V::load_from(&by_all[at..])];
                    let share = V::load_from(&share[at..]);
                    // Beyond the run this is of no meaning until the next one comes.
                    work.at(n, share, closed, &mut self.sums[axis])
                        .store(&mut taken[at..]);
                }
            }
        }
    }
}

/// One run.
struct GatherRun<'a, R> {
    axis: usize,
    run: &'a Run,
    /// u* of its faces [m/s].
    predicted: &'a [R],
    pressure: &'a [R],
    /// A cell, and those ahead and behind along each axis.
    around: Stencil<7>,
    rigid: Rigid,
    /// Motion of the middles of the cells above and below the faces.
    sides: [Rigid; 2],
    /// Half a step over the spacing along each axis [s/m].
    drift: [f64; 3],
    /// A step over the spacing along the component [s/m].
    pull: f64,
    /// What a uniform acceleration gives a face in the step [m/s].
    driven: f64,
    relieved: f64,
    spacing: f64,
}

impl<R: Real> GatherRun<'_, R> {
    /// Pressure of the cells from face `n` on, above or below it, moved with the grain for a step.
    #[inline(always)]
    fn moved<V: Vector<Number = f64>>(&self, side: usize, n: usize) -> V {
        let at = [self.run.at, self.run.below][side] + n;
        let [mut moved, rest @ ..] = self.around.load_within::<V, R>(self.pressure, at);
        for axis in 0..3 {
            let cells = V::constant(-self.drift[axis]) * self.sides[side].at(axis, count_from(n));
            moved = cells.mul_add(rest[2 * axis] - rest[2 * axis + 1], moved);
        }
        moved
    }

    /// Adds the faces from the `n`th on to the sums; what they take from a grain at rest.
    #[inline(always)]
    fn at<V: Vector<Number = f64>>(
        &self,
        n: usize,
        share: V,
        [closed, closed_by_all]: [V; 2],
        sums: &mut Moments,
    ) -> V {
        let count = count_from::<V>(n);
        let predicted = V::load_some(&self.predicted[n..]);
        let follow = follow(share, closed, self.relieved);
        let (mut free, mut taken) = (predicted, V::constant(0.0));
        // Beside the band nothing is closed.
        if !closed_by_all.is_zero() {
            let rise = self.moved::<V>(0, n) - self.moved(1, n);
            let back = rise.mul_add(V::constant(self.pull), V::constant(-self.driven));
            (free, taken) = (closed_by_all.mul_add(back, predicted), closed * back);
        }
        let taken = (V::constant(0.0) - share).mul_add(free, taken);
        let push = taken - follow * self.rigid.at(self.axis, count);
        let pull = share + follow;
        let arm = self.run.arm;
        let x = V::constant(arm.x) + V::constant(self.spacing) * count;
        let arm = [x, V::constant(arm.y), V::constant(arm.z)];
        let (zero, end) = (V::constant(0.0), V::constant(self.run.count as f64));
        let push = count.where_below(end, push, zero);
        let pull = count.where_below(end, pull, zero);
        sums.add(self.axis, n, arm, push, pull);
        taken
    }
}

/// Gives the forced faces of a component, as far as they lie in the prediction, what a grain gives them that now
/// has the velocity and angular velocity `now`; the other arguments as of [`gather`], which came before.
pub fn impose<R: Real>(
    axis: usize,
    spacing: DVec3,
    forced: &Forced,
    [before, now]: [[DVec3; 2]; 2],
    relief: f64,
    prediction: &mut Prediction<R>,
) {
    dispatch(Impose {
        axis,
        spacing,
        forced,
        now,
        change: [0, 1].map(|which| now[which] - before[which]),
        relieved: relieved(relief),
        prediction,
    });
}

/// What one grain gives the faces of a component.
struct Impose<'a, 'b, R> {
    axis: usize,
    spacing: DVec3,
    forced: &'a Forced,
    now: [DVec3; 2],
    change: [DVec3; 2],
    relieved: f64,
    prediction: &'a mut Prediction<'b, R>,
}

impl<R: Real> Kernel for Impose<'_, '_, R> {
    type Number = f64;
    #[inline(always)]
    fn run<V: Vector<Number = f64>>(self) {
        let forced = self.forced;
        let part = self.prediction.range().clone();
        let runs = forced.runs[self.axis].iter();
        for run in runs.filter(|run| part.contains(&run.at)) {
            let rigid = Rigid::of(self.now, run.arm, self.spacing);
            let change = Rigid::of(self.change, run.arm, self.spacing);
            let predicted = self.prediction.velocity_mut(run.at, run.count);
            for n in (0..run.count).step_by(V::WIDTH) {
                let at = run.first + n;
                let share = V::load_from(&forced.share[at..]);
                let closed = V::load_from(&forced.closed[at..]);
                let place = count_from(n);
                let gain = V::load(&forced.taken[at..])
                    + share * rigid.at(self.axis, place)
                    + follow(share, closed, self.relieved) * change.at(self.axis, place);
                gain.add_some(&mut predicted[n..]);
            }
        }
    }
}

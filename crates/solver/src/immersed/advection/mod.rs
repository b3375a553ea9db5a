//! Advection next to a grain, mended where central differences are at their worst.
//!
//! 1. A face value near the surface stands for its open part only, q = A u, so a link's product of
//!    two such values carries A^2 u u where the flux is A u u: the part relative to the grain is
//!    divided by the aperture of the link.
//! 2. The boundary layer is about a cell thick and moves with the grain. Second-order central
//!    differences carry such a profile at about two thirds of its speed; within two cells of the
//!    surface the mean of two faces gives way to the sixth-order mean of six.
//!
//! Both are fluxes between two faces, so they move no momentum in or out
//! (`docs/decisions/0003-advection-next-to-grains.md` has the measurements).

mod links;
mod weights;

use std::ops::Range;

use glam::{DVec3, IVec3};

use super::locate::{Body, PushRow};
use super::places::PAD;
use crate::dem::Grain;
use crate::flow::{Known, Prediction};
use crate::grid::Mesh;
use crate::math::Real;
use grainwake_simd::{Kernel, MOST, Vector, dispatch, prefetch_ahead};
use links::Lines;
use weights::Planes;

/// What one thread needs: copies of the velocity in a box and about it, and a plane there.
#[derive(Default)]
pub struct Scratch<R> {
    velocity: [Vec<R>; 3],
    planes: Planes,
}

/// How a grain moves as the flow is predicted.
#[derive(Clone, Copy, Default)]
pub struct Stand {
    /// [m]
    pub position: DVec3,
    /// [m/s]
    pub velocity: DVec3,
    /// [rad/s]
    pub angular_velocity: DVec3,
}

impl Stand {
    /// That of a grain at present.
    pub fn of(grain: &Grain) -> Stand {
        Stand {
            position: grain.pose.position,
            velocity: grain.velocity,
            angular_velocity: grain.angular_velocity,
        }
    }
    /// Velocity of the material point at `x` [m/s].
    fn velocity_at(&self, x: DVec3) -> DVec3 {
        self.velocity + self.angular_velocity.cross(x - self.position)
    }
}

/// The velocity in a box and three cells about it, in the fields or copied.
struct View<'a, R> {
    components: [&'a [R]; 3],
    strides: [usize; 3],
    /// Position of cell (0, 0, 0) of the box, if it were in memory: counted with wrapping.
    origin: usize,
}

impl<'a, R: Real> View<'a, R> {
    fn new(known: &Known<'a, R>, body: &Body, copies: &'a mut [Vec<R>; 3]) -> View<'a, R> {
        let (layout, velocity) = (known.mesh.layout(), known.velocity);
        let walled = known.boundaries.walled();
        // What lies beyond a wall is no unknown, so no link reaches there. Registers reach beyond a row.
        let direct = layout.cells[0] >= MOST
            && (0..3).all(|axis| {
                let high = body.first[axis] + body.size[axis] + PAD - 1;
                walled[axis] || body.first[axis] >= PAD && high <= layout.cells[axis] as i32 + 1
            });
        if direct {
            let strides = layout.strides();
            let along = |axis: usize| (body.first[axis] as usize).wrapping_mul(strides[axis]);
            return View {
                components: [0, 1, 2].map(|axis| velocity.component(axis)),
                strides,
                origin: along(0).wrapping_add(along(1)).wrapping_add(along(2)),
            };
        }
        for (axis, copy) in copies.iter_mut().enumerate() {
            body.places.copy(velocity.component(axis), copy);
            copy.resize(copy.len() + MOST, R::default());
        }
        let wide = (body.size + 2 * PAD).to_array().map(|n| n as usize);
        let strides = [1, wide[0], wide[0] * wide[1]];
        View {
            components: copies.each_ref().map(|copy| &copy[..]),
            strides,
            origin: PAD as usize * strides.iter().sum::<usize>(),
        }
    }
}

impl<R> View<'_, R> {
    /// Whether all about a box of `size` cells is in memory, of rows that are up to `MOST` longer than the box.
    fn reaches(&self, size: IVec3) -> bool {
        let [_, line, plane] = self.strides;
        let ahead = (size.as_usizevec3() + PAD as usize - 1).to_array();
        let last = (ahead[0] + MOST) + ahead[1] * line + ahead[2] * plane;
        let before = PAD as usize * (1 + line + plane);
        let [x, y, z] = self.components;
        let entries = x.len().min(y.len()).min(z.len());
        self.origin >= before && self.origin < entries && last < entries - self.origin
    }
    /// Position of the first place of row (j, k).
    #[inline(always)]
    fn row(&self, [j, k]: [i32; 2]) -> usize {
        let [_, line, plane] = self.strides;
        self.origin
            .wrapping_add(j as usize * line + k as usize * plane)
    }
}

/// What the links of one grain bring to the faces in the lists of its [`Body`] [m/s^2].
pub type Push = [Vec<f64>; 3];

/// Finds what the links of a grain bring, which was found at `body` and moves as it did there, in a band of
/// half-width `band` [m]. Calls `ahead` for every component and plane k of so many.
pub fn find<R: Real>(
    band: f64,
    known: &Known<R>,
    stand: &Stand,
    body: &Body,
    scratch: &mut Scratch<R>,
    push: &mut Push,
    ahead: impl Fn(usize, [i32; 2]),
) {
    dispatch(Links {
        band,
        mesh: known.mesh,
        stand,
        body,
        velocity: View::new(known, body, &mut scratch.velocity),
        ahead,
        planes: &mut scratch.planes,
        push,
    });
}

/// Adds that to a component of the prediction, as far as it lies there.
pub fn add<R: Real>(body: &Body, push: &Push, component: usize, prediction: &mut Prediction<R>) {
    dispatch(Pushes {
        rows: &body.rows[component],
        push: &push[component],
        prediction,
    });
}

/// The `k`th share of `count` entries, of as many shares as `of`.
fn share([k, of]: [i32; 2], count: usize) -> Range<usize> {
    let end = |k: i32| k as usize * count / of as usize;
    end(k)..end(k + 1)
}

/// Asks for what the grain at `body` pushes of a component, and for the pressure there, which is read next: a share
/// of it.
#[inline]
pub fn ask_pushed<R: Real>(
    known: &Known<R>,
    predictions: &[Prediction<R>; 3],
    body: &Body,
    component: usize,
    part: [i32; 2],
) {
    let rows = &body.rows[component];
    for row in &rows[share(part, rows.len())] {
        predictions[component].ask_pushed(row.at, row.count);
        if component == 0 {
            prefetch_ahead(known.pressure, row.at - 1, row.count + 1);
        }
    }
}

/// Asks for what the links of the grain at `body` read of a component: a share of it.
#[inline]
pub fn ask<R: Real>(known: &Known<R>, body: &Body, component: usize, part: [i32; 2]) {
    let field = known.velocity.component(component);
    body.places
        .ask_ahead(field, share(part, body.places.planes_about()));
    let (spans, rows) = (&body.spans[component], &body.rows[component]);
    let distances = &body.distance[component];
    let [some_spans, some_rows, some] =
        [spans.len(), rows.len(), distances.len()].map(|count| share(part, count));
    prefetch_ahead(spans, some_spans.start, some_spans.len());
    prefetch_ahead(rows, some_rows.start, some_rows.len());
    prefetch_ahead(distances, some.start, some.len());
}

/// What one grain adds to the tendency of a component.
struct Pushes<'a, 'b, R> {
    rows: &'a [PushRow],
    push: &'a [f64],
    prediction: &'a mut Prediction<'b, R>,
}

impl<R: Real> Kernel for Pushes<'_, '_, R> {
    type Number = f64;
    #[inline(always)]
    fn run<V: Vector<Number = f64>>(self) {
        let part = self.prediction.range().clone();
        for row in self.rows.iter().filter(|row| part.contains(&row.at)) {
            let push = &self.push[row.first..];
            self.prediction.push::<V>(row.at, row.count, push);
        }
    }
}

/// The links of one grain.
struct Links<'a, R, A> {
    band: f64,
    mesh: &'a Mesh,
    stand: &'a Stand,
    body: &'a Body,
    velocity: View<'a, R>,
    ahead: A,
    planes: &'a mut Planes,
    push: &'a mut Push,
}

impl<R: Real, A: Fn(usize, [i32; 2])> Kernel for Links<'_, R, A> {
    type Number = f64;
    #[inline(always)]
    fn run<V: Vector<Number = f64>>(self) {
        let Links {
            band,
            mesh,
            stand,
            body,
            velocity,
            ahead,
            planes,
            push,
        } = self;
        for (component, push) in push.iter_mut().enumerate() {
            push.resize(body.distance[component].len(), 0.0);
            Lines::new(band, mesh, stand, body, &velocity, component)
                .push::<V>(&ahead, planes, push);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::DQuat;
    use grainwake_shape::Shape;

    use super::*;
    use crate::dem::{Dof, Grain};
    use crate::flow::{Advection, Boundaries, Boundary, Flow, FluidParams};
    use crate::grid::Mesh;
    use crate::immersed::{Coupling, Scheme};
    use crate::math::Pose;

    #[test]
    fn what_fills_up_rows_reaches_no_link() {
        let mesh = Mesh {
            cells: [24; 3],
            spacing: DVec3::splat(0.25),
            origin: DVec3::ZERO,
        };
        let params = FluidParams {
            density: 1.0,
            kinematic_viscosity: 0.01,
            body_acceleration: DVec3::ZERO,
            initial_velocity: DVec3::ZERO,
            advection: Advection::Central,
        };
        // Close to a corner of the box: links on both sides have less than six faces in line.
        let grain = |place: f64| Grain {
            shape: Arc::new(Shape::sphere(1.0, 100)),
            density: 2.0,
            pose: Pose {
                position: DVec3::splat(place),
                orientation: DQuat::IDENTITY,
            },
            velocity: DVec3::ONE,
            angular_velocity: DVec3::ZERO,
            translation: Dof::Free,
            rotation: Dof::Free,
        };
        let grains = [grain(1.1), grain(4.9)];
        let predicted = |filling: f64| {
            let boundaries = Boundaries([[Boundary::WALL; 2]; 3]);
            let mut flow = Flow::<f64>::new(&mesh, boundaries, &params);
            flow.start_from(|axis, x| (3.0 * x).to_array()[(axis + 1) % 3].sin());
            let (row, entries) = (mesh.layout().row(), mesh.cells[0] + 2);
            assert!(row > entries);
            for axis in 0..3 {
                let rows = flow.velocity.component_mut(axis).chunks_exact_mut(row);
                rows.for_each(|row| row[entries..].fill(filling));
            }
            let mut coupling = Coupling::new(&flow, Scheme::Aperture, 1.0, 0.01, &grains);
            flow.predict(0.01);
            let before: Vec<f64> = flow.predicted.component(0).to_vec();
            coupling.remember(&grains);
            coupling.correct_advection(&mut flow);
            assert!(flow.predicted.component(0) != before);
            let all = (0..3).flat_map(|axis| flow.predicted.component(axis).to_vec());
            all.map(f64::to_bits).collect::<Vec<_>>()
        };
        assert!(predicted(0.0) == predicted(f64::NAN));
    }
}

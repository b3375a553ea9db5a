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

use rayon::prelude::*;

use super::locate::{Body, PushRow};
use super::places::PAD;
use crate::dem::Grain;
use crate::flow::{Flow, TendencySlab};
use crate::grid::Mesh;
use crate::math::Real;
use crate::math::lanes::{Kernel, MOST, Vector, dispatch, prefetch_ahead};
use links::{Lines, Planes};

/// What one thread needs: copies of the velocity in a box and about it, and a plane there.
#[derive(Default)]
struct Scratch<R> {
    velocity: [Vec<R>; 3],
    planes: Planes,
}

/// The velocity in a box and three cells about it, in the fields or copied.
struct View<'a, R> {
    components: [&'a [R]; 3],
    strides: [usize; 3],
    /// Position of cell (0, 0, 0) of the box, if it were in memory: counted with wrapping.
    origin: usize,
}

impl<'a, R: Real> View<'a, R> {
    fn new(flow: &'a Flow<R>, body: &Body, copies: &'a mut [Vec<R>; 3]) -> View<'a, R> {
        let (layout, velocity) = (flow.mesh().layout(), &flow.velocity);
        let walled = flow.boundaries().walled();
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

/// Corrects the tendency of the step just predicted; `bodies` are where `grains` were located, in a
/// band of half-width `band` [m]. Leaves what the links bring in `pushes`.
pub fn correct<R: Real>(
    band: f64,
    flow: &mut Flow<R>,
    grains: &[Grain],
    bodies: &[Body],
    pushes: &mut [Push],
) {
    let (mesh, from) = (*flow.mesh(), &*flow);
    let each = pushes.par_iter_mut().zip(grains).enumerate();
    each.for_each_init(Scratch::default, |scratch, (index, (push, grain))| {
        let body = &bodies[index];
        dispatch(Links {
            band,
            mesh: &mesh,
            grain,
            body,
            velocity: View::new(from, body, &mut scratch.velocity),
            next: bodies.get(index + 1).map(|body| Next {
                body,
                velocity: [0, 1, 2].map(|axis| from.velocity.component(axis)),
            }),
            planes: &mut scratch.planes,
            push,
        });
    });
    let (pushes, layout) = (&*pushes, mesh.layout());
    flow.add_tendency(|component, mut slab| {
        let part = slab.range();
        for (body, push) in bodies.iter().zip(pushes) {
            if body.lies_in(&part, layout) {
                dispatch(Pushes {
                    rows: &body.rows[component],
                    push: &push[component],
                    slab: &mut slab,
                });
            }
        }
    });
}

/// The grain that comes next: what is read of it is asked for while there is something else to do.
pub struct Next<'a, R> {
    body: &'a Body,
    velocity: [&'a [R]; 3],
}

impl<R> Next<'_, R> {
    /// Asks for plane `k` of a component.
    #[inline]
    fn ask(&self, component: usize, k: i32) {
        let body = self.body;
        body.places.ask_ahead(self.velocity[component], k as usize);
        let list = &body.distance[component];
        let share = list.len() / body.size.z.max(1) as usize;
        prefetch_ahead(list, k as usize * share, share);
    }
}

/// What one grain adds to the tendency of a component in a slab of memory.
struct Pushes<'a, 'b, R> {
    rows: &'a [PushRow],
    push: &'a [f64],
    slab: &'a mut TendencySlab<'b, R>,
}

impl<R: Real> Kernel for Pushes<'_, '_, R> {
    type Number = f64;
    #[inline(always)]
    fn run<V: Vector<Number = f64>>(self) {
        let part = self.slab.range();
        for row in self.rows.iter().filter(|row| part.contains(&row.at)) {
            for n in (0..row.count).step_by(V::WIDTH) {
                let push = V::load(&self.push[row.first + n..]);
                self.slab.add(row.at + n, row.count - n, push);
            }
        }
    }
}

/// The links of one grain.
struct Links<'a, R> {
    band: f64,
    mesh: &'a Mesh,
    grain: &'a Grain,
    body: &'a Body,
    velocity: View<'a, R>,
    next: Option<Next<'a, R>>,
    planes: &'a mut Planes,
    push: &'a mut Push,
}

impl<R: Real> Kernel for Links<'_, R> {
    type Number = f64;
    #[inline(always)]
    fn run<V: Vector<Number = f64>>(self) {
        let Links {
            band,
            mesh,
            grain,
            body,
            velocity,
            next,
            planes,
            push,
        } = self;
        for (component, push) in push.iter_mut().enumerate() {
            push.resize(body.distance[component].len(), 0.0);
            Lines::new(band, mesh, grain, body, &velocity, component)
                .push::<V>(&next, planes, push);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::{DQuat, DVec3};
    use grainwake_shape::Shape;

    use crate::coupling::{Coupling, Scheme};
    use crate::dem::{Dof, Grain};
    use crate::flow::{Advection, Boundaries, Boundary, Flow, FluidParams};
    use crate::grid::Mesh;
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
            coupling.correct_advection(&mut flow, &grains);
            assert!(flow.predicted.component(0) != before);
            let all = (0..3).flat_map(|axis| flow.predicted.component(axis).to_vec());
            all.map(f64::to_bits).collect::<Vec<_>>()
        };
        assert!(predicted(0.0) == predicted(f64::NAN));
    }
}

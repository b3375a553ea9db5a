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
//!
//! Legend: q component carried, c velocity that carries it, d signed distance of a link.

use std::ops::Range;

use glam::{DVec3, IVec3};
use rayon::prelude::*;

use super::aperture::aperture;
use super::locate::Body;
use super::places::PAD;
use crate::dem::Grain;
use crate::flow::Flow;
use crate::grid::{FACE_OFFSET, Mesh};
use crate::math::Real;
use crate::math::lanes::{Kernel, MOST, RAMP, Vector, dispatch, prefetch};

/// Smallest aperture divided by; smaller ones are unstable on an impulsive start.
const LEAST_APERTURE: f64 = 0.4;
/// What one thread needs: copies of the velocity in a box and about it, and the fluxes of a row.
#[derive(Default)]
struct Scratch<R> {
    velocity: [Vec<R>; 3],
    flux: Vec<f64>,
}

/// The velocity in a box and three cells about it, in the fields or copied.
struct View<'a, R> {
    components: [&'a [R]; 3],
    strides: [usize; 3],
    /// Position of cell (0, 0, 0) of the box.
    origin: usize,
}

impl<'a, R: Real> View<'a, R> {
    fn new(flow: &'a Flow<R>, body: &Body, copies: &'a mut [Vec<R>; 3]) -> View<'a, R> {
        let (layout, velocity) = (flow.mesh().layout(), &flow.velocity);
        let low = body.first - PAD;
        // A plane more above, for vectors that reach beyond the last entry.
        let high = body.first + body.size + PAD - IVec3::ONE;
        let cells = IVec3::from_array(layout.cells.map(|n| n as i32));
        if low.cmpge(IVec3::ZERO).all() && high.cmple(cells).all() {
            let [x, y, z] = body.first.to_array().map(|first| first as usize);
            return View {
                components: [0, 1, 2].map(|axis| velocity.component(axis)),
                strides: layout.strides(),
                origin: layout.index(x, y, z),
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
    /// Asks for the box of `size` cells to be brought near.
    #[inline(always)]
    fn prefetch(&self, size: IVec3) {
        let [nx, ny, nz] = size.to_array().map(|n| n as usize);
        let [_, line, plane] = self.strides;
        for field in self.components {
            for (k, j) in (0..nz).flat_map(|k| (0..ny).map(move |j| (k, j))) {
                prefetch(field, self.origin + j * line + k * plane, nx);
            }
        }
    }
}

/// Corrects the tendency of the step just predicted; `bodies` are where `grains` were located, in a
/// band of half-width `band` [m].
pub fn correct<R: Real>(band: f64, flow: &mut Flow<R>, grains: &[Grain], bodies: &mut [Body]) {
    let (mesh, from) = (*flow.mesh(), &*flow);
    let each = bodies.par_iter_mut().zip(grains);
    each.for_each_init(Scratch::default, |scratch, (body, grain)| {
        let mut push = std::mem::take(&mut body.push);
        dispatch(Links {
            band,
            mesh: &mesh,
            grain,
            body,
            velocity: View::new(from, body, &mut scratch.velocity),
            flux: &mut scratch.flux,
            push: &mut push,
        });
        body.push = push;
    });
    let (bodies, layout) = (&*bodies, mesh.layout());
    flow.add_tendency(|component, slab, add| {
        for body in bodies.iter().filter(|body| body.lies_in(&slab, layout)) {
            let rows = body.rows[component].iter();
            for row in rows.filter(|row| slab.contains(&row.at)) {
                add(row.at, &body.push[component][row.first..][..row.count]);
            }
        }
    });
}

/// The links of one grain.
struct Links<'a, R> {
    band: f64,
    mesh: &'a Mesh,
    grain: &'a Grain,
    body: &'a Body,
    velocity: View<'a, R>,
    flux: &'a mut Vec<f64>,
    push: &'a mut [Vec<f64>; 3],
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
            flux,
            push,
        } = self;
        let size = body.size;
        velocity.prefetch(size);
        flux.resize(size.x as usize + MOST, 0.0);
        for (component, push) in push.iter_mut().enumerate() {
            push.resize((size.x * size.y * size.z) as usize, 0.0);
            for (row, span) in body.spans[component].iter().enumerate() {
                let first = row * size.x as usize;
                let [start, end] = span.map(|at| first + at as usize);
                push[start..end].fill(0.0);
            }
            for along in (0..3).filter(|&axis| mesh.cells[axis] > 1) {
                let lines = Lines::new(band, mesh, grain, body, &velocity, component, along);
                let step = IVec3::AXES[along];
                for k in 0..size.z - step.z {
                    for j in 0..size.y - step.y {
                        let Some((range, inner)) = lines.ranges(j, k) else {
                            continue;
                        };
                        let (start, end) = (range.start, range.end);
                        // Near the ends of the grid there are no six faces.
                        let first = inner.start.clamp(start, end);
                        let last = inner.end.clamp(first, end);
                        let [_, line, plane] = velocity.strides;
                        let at = velocity.origin + j as usize * line + k as usize * plane;
                        let row = body.local(0, j, k);
                        let next = row + body.local(step.x, step.y, step.z);
                        let d = &body.distance[component][..];
                        for (part, six) in [
                            (start..first, false),
                            (first..last, true),
                            (last..end, false),
                        ] {
                            for i in part.step_by(V::WIDTH) {
                                let (here, there) = (row + i as usize, next + i as usize);
                                let d =
                                    V::constant(0.5) * (V::load(&d[here..]) + V::load(&d[there..]));
                                let at = at + i as usize;
                                lines
                                    .flux([j, k], i, at, d, six)
                                    .store(&mut flux[i as usize..]);
                            }
                        }
                        for i in start as usize..end as usize {
                            push[row + i] -= flux[i];
                        }
                        for i in start as usize..end as usize {
                            push[next + i] += flux[i];
                        }
                    }
                }
            }
        }
    }
}

/// The links of one component along one axis.
struct Lines<'a, R> {
    body: &'a Body,
    /// The component carried and that along the links.
    fields: [&'a [R]; 2],
    component: usize,
    along: usize,
    band: f64,
    /// Faces that are unknowns, along each axis.
    unknowns: [Range<i32>; 3],
    /// From a face to the next along the link, and to the next along the component, in the fields.
    next: usize,
    across: usize,
    /// 1/h along the link [1/m].
    inverse: f64,
    /// Rigid velocity of the component and along the link in the middle of link (0, 0, 0), and its
    /// change from a link to the next along each axis [m/s].
    rigid: [[f64; 2]; 4],
}

impl<'a, R: Real> Lines<'a, R> {
    fn new(
        band: f64,
        mesh: &Mesh,
        grain: &Grain,
        body: &'a Body,
        velocity: &View<'a, R>,
        component: usize,
        along: usize,
    ) -> Lines<'a, R> {
        let half = 0.5 * IVec3::AXES[along].as_dvec3();
        let middle = DVec3::from_array(FACE_OFFSET[component]) + half - 1.0;
        let first = mesh.origin + mesh.spacing * (body.first.as_dvec3() + middle);
        let of = |v: DVec3| [v[component], v[along]];
        let change = |axis: usize| {
            of(grain
                .angular_velocity
                .cross(DVec3::AXES[axis] * mesh.spacing))
        };
        Lines {
            body,
            component,
            along,
            band,
            unknowns: [0, 1, 2].map(|axis| body.places.unknowns(component, axis)),
            fields: [velocity.components[component], velocity.components[along]],
            next: velocity.strides[along],
            across: velocity.strides[component],
            inverse: 1.0 / mesh.spacing[along],
            rigid: [
                of(grain.velocity_at(first)),
                change(0),
                change(1),
                change(2),
            ],
        }
    }

    /// Which links of a row are to be mended, and those of them with six faces in line.
    fn ranges(&self, j: i32, k: i32) -> Option<(Range<i32>, Range<i32>)> {
        let (body, along) = (self.body, self.along);
        let step = IVec3::AXES[along];
        let span = |j: i32, k: i32| body.spans[self.component][(j + body.size.y * k) as usize];
        let (here, there) = (span(j, k), span(j + step.y, k + step.z));
        let [ux, uy, uz] = &self.unknowns;
        let inside = |j: i32, k: i32| uy.contains(&j) && uz.contains(&k);
        if !(inside(j, k) && inside(j + step.y, k + step.z)) {
            return None;
        }
        let start = here[0].max(there[0] - step.x).max(ux.start);
        let end = here[1]
            .min(there[1] - step.x)
            .min(ux.end - step.x)
            .min(body.size.x - step.x);
        if start >= end {
            return None;
        }
        let six = match along {
            0 => ux.start + 2..ux.end - 3,
            _ if inside(j - 2 * step.y, k - 2 * step.z)
                && inside(j + 3 * step.y, k + 3 * step.z) =>
            {
                start..end
            }
            _ => 0..0,
        };
        Some((start..end, six))
    }

    /// Flux through the links from place `i` of row (j, k) on, whose lower faces are at `at` in the
    /// fields, over their length [m/s^2]; zero where `d` is not near the surface.
    #[inline(always)]
    fn flux<V: Vector<Number = f64>>(
        &self,
        [j, k]: [i32; 2],
        i: i32,
        at: usize,
        d: V,
        six: bool,
    ) -> V {
        let (half, one) = (V::constant(0.5), V::constant(1.0));
        let [q, c] = self.fields;
        let face =
            |shift: isize| V::load_from(&q[at.wrapping_add_signed(shift * self.next as isize)..]);
        let (from, to) = (face(0), face(1));
        let mean = half * (from + to);
        let carrier = if self.along == self.component {
            mean
        } else {
            // Two faces of the carrying component share the link.
            let to = at + self.next;
            half * (V::load_from(&c[to..]) + V::load_from(&c[to - self.across..]))
        };
        let ramp = V::load(&RAMP);
        let rigid = |of: usize| {
            let [start, x, y, z] = self.rigid.map(|rigid| rigid[of]);
            let first = start + f64::from(i) * x + f64::from(j) * y + f64::from(k) * z;
            V::constant(first) + ramp * V::constant(x)
        };
        let relative = (carrier - rigid(1)) * (mean - rigid(0));
        let open = aperture(d, self.band).larger(V::constant(LEAST_APERTURE));
        let mut flux = relative * (one.over(open) - one);
        if six {
            let outer = V::constant(7.0) * (from + to) - V::constant(8.0) * (face(-1) + face(2));
            let sixth = outer + face(-2) + face(3);
            flux = flux + carrier * sixth * V::constant(1.0 / 60.0);
        }
        let near = d.is_below(V::constant(2.0 * self.band));
        let outside = V::constant(-self.band).is_below(d);
        flux * near * outside * V::constant(self.inverse)
    }
}

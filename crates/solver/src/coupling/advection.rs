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
use super::locate::{Body, PushRow};
use super::places::PAD;
use crate::dem::Grain;
use crate::flow::{Flow, TendencySlab};
use crate::grid::{FACE_OFFSET, Mesh};
use crate::math::Real;
use crate::math::lanes::{Kernel, MOST, Vector, dispatch, prefetch};

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
    /// Position of cell (0, 0, 0) of the box, if it were in memory: counted with wrapping.
    origin: usize,
}

impl<'a, R: Real> View<'a, R> {
    fn new(flow: &'a Flow<R>, body: &Body, copies: &'a mut [Vec<R>; 3]) -> View<'a, R> {
        let (layout, velocity) = (flow.mesh().layout(), &flow.velocity);
        let walled = flow.boundaries().walled();
        let direct = (0..3).all(|axis| {
            let low = body.first[axis] - PAD;
            let high = body.first[axis] + body.size[axis] + PAD - 1;
            walled[axis] || low >= 0 && high <= layout.cells[axis] as i32
        });
        // What lies beyond a wall is no unknown, so no link reaches there.
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
    /// Asks for the box of `size` cells to be brought near.
    #[inline(always)]
    fn prefetch(&self, size: IVec3) {
        for field in self.components {
            for (k, j) in (0..size.z).flat_map(|k| (0..size.y).map(move |j| (k, j))) {
                prefetch(field, self.row([j, k]), size.x as usize);
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
    flow.add_tendency(|component, mut slab| {
        let part = slab.range();
        for body in bodies.iter().filter(|body| body.lies_in(&part, layout)) {
            dispatch(Pushes {
                rows: &body.rows[component],
                push: &body.push[component],
                slab: &mut slab,
            });
        }
    });
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
        // A zero comes before the fluxes of a row.
        flux.clear();
        flux.resize(size.x as usize + 2 * MOST, 0.0);
        for (component, push) in push.iter_mut().enumerate() {
            let distance = &body.distance[component][..];
            push.clear();
            push.resize(distance.len(), 0.0);
            for along in (0..3).filter(|&axis| mesh.cells[axis] > 1) {
                let lines = Lines::new(band, mesh, grain, body, &velocity, component, along);
                let step = IVec3::AXES[along];
                for k in 0..size.z - step.z {
                    for j in 0..size.y - step.y {
                        let Some(row) = lines.row([j, k], velocity.row([j, k])) else {
                            continue;
                        };
                        if along == 0 {
                            for n in (0..row.count).step_by(V::WIDTH) {
                                let value: V = lines.flux(&row, n, distance);
                                value.store(&mut flux[1 + n..]);
                            }
                            let end = row.count.next_multiple_of(V::WIDTH);
                            V::constant(0.0).store(&mut flux[1 + end..]);
                            for n in (0..row.count + 1).step_by(V::WIDTH) {
                                let gain = V::load(&flux[n..]) - V::load(&flux[n + 1..]);
                                gain.add_to(&mut push[row.here + n..]);
                            }
                        } else {
                            let zero = V::constant(0.0);
                            for n in (0..row.count).step_by(V::WIDTH) {
                                let value: V = lines.flux(&row, n, distance);
                                (zero - value).add_to(&mut push[row.here + n..]);
                                value.add_to(&mut push[row.there + n..]);
                            }
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

/// Neighbouring links of a row.
struct Row {
    /// Where their lower faces and their upper ones are in the lists of [`Body`].
    here: usize,
    there: usize,
    /// Where the lower ones are in the fields.
    at: usize,
    count: usize,
    /// Those with six faces in line.
    six: Range<usize>,
    /// Rigid velocity of the component and along the link at the first [m/s].
    rigid: [f64; 2],
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

    /// The links of row (j, k) to be mended; the row begins at `origin` in the fields.
    #[inline(always)]
    fn row(&self, [j, k]: [i32; 2], origin: usize) -> Option<Row> {
        let (body, along) = (self.body, self.along);
        let [x, y, z] = [0, 1, 2].map(|axis| i32::from(axis == along));
        let span = |j: i32, k: i32| &body.spans[self.component][(j + body.size.y * k) as usize];
        let (here, there) = (span(j, k), span(j + y, k + z));
        let [ux, uy, uz] = &self.unknowns;
        let start = here.start.max(there.start - x).max(ux.start);
        let end = here.end.min(there.end - x).min(ux.end - x);
        let inside = |j: i32, k: i32| uy.contains(&j) && uz.contains(&k);
        if start >= end || !(inside(j, k) && inside(j + y, k + z)) {
            return None;
        }
        // Near the ends of the grid there are no six faces.
        let six = match along {
            0 => (ux.start + 2).clamp(start, end)..(ux.end - 3).clamp(start, end),
            _ if inside(j - 2 * y, k - 2 * z) && inside(j + 3 * y, k + 3 * z) => start..end,
            _ => start..start,
        };
        let rigid = [0, 1].map(|of| {
            let [first, x, y, z] = self.rigid.map(|rigid| rigid[of]);
            first + f64::from(start) * x + f64::from(j) * y + f64::from(k) * z
        });
        Some(Row {
            here: here.place(start),
            there: there.place(start + x),
            at: origin.wrapping_add(start as usize),
            count: (end - start) as usize,
            six: (six.start - start) as usize..(six.end - start) as usize,
            rigid,
        })
    }

    /// The face of the component carried `shift` faces along the links from those from `at` on.
    #[inline(always)]
    fn face<V: Vector<Number = f64>>(&self, at: usize, shift: isize) -> V {
        let away = shift.wrapping_mul(self.next as isize);
        V::load_within(self.fields[0], at.wrapping_add_signed(away))
    }

    /// Rigid velocity of the component, or along the link, at links of a row.
    #[inline(always)]
    fn rigid<V: Vector<Number = f64>>(&self, row: &Row, of: usize, count: V) -> V {
        V::constant(row.rigid[of]) + count * V::constant(self.rigid[1][of])
    }

    /// Flux through the links of a row from the `n`th on over their length [m/s^2]; zero where they are not
    /// near the surface and after the last.
    #[inline(always)]
    fn flux<V: Vector<Number = f64>>(&self, row: &Row, n: usize, distance: &[f64]) -> V {
        let (zero, half, one) = (V::constant(0.0), V::constant(0.5), V::constant(1.0));
        let d = V::load(&distance[row.here + n..]) + V::load(&distance[row.there + n..]);
        let d = half * d;
        let count = V::constant(n as f64) + V::ramp();
        let c = self.fields[1];
        let at = row.at.wrapping_add(n);
        let (from, to): (V, V) = (self.face(at, 0), self.face(at, 1));
        let mean = half * (from + to);
        let carrier = if self.along == self.component {
            mean
        } else {
            // Two faces of the carrying component share the link.
            let to = at + self.next;
            half * (V::load_within(c, to) + V::load_within(c, to - self.across))
        };
        let relative = carrier - self.rigid(row, 1, count);
        let relative = relative * (mean - self.rigid(row, 0, count));
        let open = aperture(d, self.band).larger(V::constant(LEAST_APERTURE));
        let mut flux = relative * (one.over(open) - one);
        if !row.six.is_empty() {
            let outer: V = self.face::<V>(at, -1) + self.face(at, 2);
            let outer = V::constant(7.0) * (from + to) - V::constant(8.0) * outer;
            let sixth = outer + self.face(at, -2) + self.face(at, 3);
            let mut more = carrier * sixth * V::constant(1.0 / 60.0);
            if row.six != (0..row.count) {
                more = count.where_below(V::constant(row.six.end as f64), more, zero);
                more = count.where_below(V::constant(row.six.start as f64), zero, more);
            }
            flux = flux + more;
        }
        let near = d.is_below(V::constant(2.0 * self.band));
        let outside = V::constant(-self.band).is_below(d);
        let flux = flux * near * outside * V::constant(self.inverse);
        count.where_below(V::constant(row.count as f64), flux, zero)
    }
}

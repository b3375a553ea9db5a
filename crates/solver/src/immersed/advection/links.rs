//! The links next to one grain: fluxes between neighbouring faces of a component, plane by plane.
//!
//! Legend: q component carried, c velocity that carries it, d signed distance of a link, U rigid velocity.

use std::ops::Range;

use glam::DVec3;

use super::weights::{Planes, near, weigh};
use super::{Stand, View};
use crate::grid::{FACE_OFFSET, Mesh};
use crate::immersed::locate::Body;
use crate::immersed::places::PAD;
use crate::math::Real;
use grainwake_simd::{Stencil, Vector};

/// The links of one component.
pub struct Lines<'a, R> {
    body: &'a Body,
    velocity: &'a View<'a, R>,
    component: usize,
    band: f64,
    /// Faces that are unknowns, along each axis.
    unknowns: [Range<i32>; 3],
    /// Whether all faces about the box are, so that all links have six in line, and vectors that begin in rows of
    /// the box stay in the lists (`View::reaches`).
    inner: bool,
    axes: [Axis; 3],
    /// Of the links along each axis U of the component and U along the link, two by two (the last two entries are
    /// of no meaning): in the middle of link (0, 0, 0), and the change from a link to the next along each axis
    /// [m/s].
    rigid: [[f64; 8]; 4],
}

/// The links along one axis.
struct Axis {
    /// Whether there are any.
    exists: bool,
    /// From the lower face of a link: the six faces along it, the two of the link first, and the two faces
    /// of the carrying component that share it.
    carried: Stencil<6>,
    carrying: Stencil<2>,
    /// From a face to the next along it, and along the component.
    next: isize,
    across: isize,
    /// The link's own two alone, three times.
    alone: Stencil<6>,
    /// 1/h along the link [1/m].
    inverse: f64,
}

/// Those links along an axis of a row that have six faces in line, and the faces to load.
#[derive(Clone, Copy)]
struct Six<'a> {
    start: f64,
    end: f64,
    carried: &'a Stencil<6>,
}

impl<'a, R: Real> Lines<'a, R> {
    pub fn new(
        band: f64,
        mesh: &Mesh,
        stand: &Stand,
        body: &'a Body,
        velocity: &'a View<'a, R>,
        component: usize,
    ) -> Lines<'a, R> {
        let mut rigid = [[0.0; 8]; 4];
        for along in 0..3 {
            let middle = DVec3::from_array(FACE_OFFSET[component]) - 1.0;
            let middle = body.first.as_dvec3() + middle + 0.5 * DVec3::AXES[along];
            let first = stand.velocity_at(mesh.origin + mesh.spacing * middle);
            let change = DVec3::AXES.map(|axis| stand.angular_velocity.cross(axis * mesh.spacing));
            for (of, place) in [component, along].into_iter().zip(2 * along..) {
                rigid[0][place] = first[of];
                (0..3).for_each(|axis| rigid[1 + axis][place] = change[axis][of]);
            }
        }
        let axes = [0, 1, 2].map(|along| {
            let [next, across] = [along, component].map(|axis| velocity.strides[axis] as isize);
            Axis {
                exists: mesh.cells[along] > 1,
                next,
                across,
                carried: Stencil::new([0, next, -next, 2 * next, -2 * next, 3 * next]),
                carrying: match along == component {
                    true => Stencil::new([0, next]),
                    false => Stencil::new([next, next - across]),
                },
                alone: Stencil::new([0, next, 0, next, 0, next]),
                inverse: 1.0 / mesh.spacing[along],
            }
        });
        let unknowns = [0, 1, 2].map(|axis| body.places.unknowns(component, axis));
        let size = body.size.to_array();
        let inner = (0..3).all(|axis| unknowns[axis] == (-PAD..size[axis] + PAD));
        let inner = inner && velocity.reaches(body.size);
        Lines {
            body,
            velocity,
            component,
            band,
            unknowns,
            inner,
            axes,
            rigid,
        }
    }

    /// Writes what the links bring to the list `to` of all faces of the component.
    #[inline(always)]
    pub fn push<V: Vector<Number = f64>>(
        &self,
        ahead: &impl Fn(usize, [i32; 2]),
        planes: &mut Planes,
        to: &mut [f64],
    ) {
        let count = self.body.size.z;
        planes.begin(self.body);
        let weigh = |k, planes: &mut Planes| {
            weigh(
                &self.unknowns,
                self.body,
                self.component,
                self.band,
                k,
                planes,
            );
        };
        weigh(-1, planes);
        for k in 0..count {
            ahead(self.component, [k, count]);
            weigh(k, planes);
            for j in planes.rows[(k % 2) as usize].clone() {
                if self.inner {
                    self.row::<V, true>([j, k], planes, to);
                } else {
                    self.row::<V, false>([j, k], planes, to);
                }
            }
        }
    }

    /// Finds the fluxes of the links whose lower faces are in row (j, k), and what they bring to its faces with those
    /// of the row and the plane before; `INNER` where all have six in line.
    #[inline(always)]
    fn row<V: Vector<Number = f64>, const INNER: bool>(
        &self,
        [j, k]: [i32; 2],
        planes: &mut Planes,
        to: &mut [f64],
    ) {
        let Some(near) = near(self.body, &self.unknowns, self.component, [j, k]) else {
            return;
        };
        let (at, place) = (self.velocity.row([j, k]), planes.place(j));
        let [a, b, c] = &self.axes;
        let six = if INNER {
            [Six::all(a), Six::all(b), Six::all(c)]
        } else {
            let place = [0, j, k];
            [self.six(0, place), self.six(1, place), self.six(2, place)]
        };
        let [y, z] = [j, k].map(f64::from);
        let [first, _, by_y, by_z] = &self.rigid;
        let mut rigid = [0.0; 8];
        for n in 0..8 {
            rigid[n] = first[n] + y * by_y[n] + z * by_z[n];
        }
        let Planes {
            line, weight, y, z, ..
        } = planes;
        let line = *line;
        let [wx, wy, wz] = weight;
        let (wx, wy, wz) = (
            &wx[place..][..line],
            &wy[place..][..line],
            &wz[place..][..line],
        );
        let (fy, fz) = (&mut y[..line], &mut z[place..][..line]);
        let zero = V::constant(0.0);
        let (mut n, mut before, mut count) = (0, zero, V::ramp());
        while n + V::WIDTH <= line {
            let at = at.wrapping_add(n);
            let mut brought = zero;
            if a.exists {
                let flux =
                    self.flux::<V, INNER>(0, six[0], &rigid, at, count, V::load_from(&wx[n..]));
                brought = flux.behind(before) - flux;
                before = flux;
            }
            if b.exists {
                let flux =
                    self.flux::<V, INNER>(1, six[1], &rigid, at, count, V::load_from(&wy[n..]));
                brought = brought + (V::load(&fy[n..]) - flux);
                flux.store(&mut fy[n..]);
            }
            if c.exists {
                let flux =
                    self.flux::<V, INNER>(2, six[2], &rigid, at, count, V::load_from(&wz[n..]));
                brought = brought + (V::load(&fz[n..]) - flux);
                flux.store(&mut fz[n..]);
            }
            // The part of the row in these lanes.
            let (start, end) = (near.start.max(n), near.end.min(n + V::WIDTH));
            if start < end {
                let listed = near.listed + (start - near.start);
                brought.store_from(start - n, &mut to[listed..listed + (end - start)]);
            }
            n += V::WIDTH;
            count = count + V::constant(V::WIDTH as f64);
        }
    }

    /// Near the ends of the grid there are no six faces.
    fn six(&self, along: usize, place: [i32; 3]) -> Six<'_> {
        let (axis, range, place) = (&self.axes[along], &self.unknowns[along], place[along]);
        let (start, end) = (range.start + 2 - place, range.end - 3 - place);
        if along == 0 {
            return Six {
                start: f64::from(start),
                end: f64::from(end),
                carried: &axis.carried,
            };
        }
        if start <= 0 && 0 < end {
            return Six::all(axis);
        }
        Six {
            start: 0.0,
            end: 0.0,
            carried: &axis.alone,
        }
    }

    /// Flux through links along an axis over their length [m/s^2]; zero where they are not near the surface.
    /// They are number `count` of the row, and their lower faces are from `at` on in the fields; `rigid` is U
    /// at the first.
    #[inline(always)]
    fn flux<V: Vector<Number = f64>, const INNER: bool>(
        &self,
        along: usize,
        six: Six,
        rigid: &[f64; 8],
        at: usize,
        count: V,
        weight: V,
    ) -> V {
        let (zero, half) = (V::constant(0.0), V::constant(0.5));
        let none = V::constant(-0.5);
        if none.mask_below(weight) == 0 {
            return zero;
        }
        let axis = &self.axes[along];
        let [q, c] = [self.component, along].map(|of| self.velocity.components[of]);
        let [from, to, below, above, far_below, far_above];
        let [first, second];
        if INNER {
            let next = if along == 0 { 1 } else { axis.next };
            // SAFETY: row and plane are in the box, and a vector ends with the line of `Planes`, which is no more than
            // `MOST` longer than the box: up to three faces from there all is in the lists, says `inner`.
            unsafe {
                from = take(q, at, 0);
                to = take(q, at, next);
                below = take(q, at, -next);
                above = take(q, at, 2 * next);
                far_below = take(q, at, -2 * next);
                far_above = take(q, at, 3 * next);
                if along == self.component {
                    [first, second] = [from, to];
                } else {
                    first = take(c, at, next);
                    second = take(c, at, next - axis.across);
                }
            }
        } else {
            [from, to, below, above, far_below, far_above] = six.carried.load::<V, R>(q, at);
            [first, second] = axis.carrying.load::<V, R>(c, at);
        }
        let both = from + to;
        let (mean, carrier) = (half * both, half * (first + second));
        let outer = V::constant(-8.0).mul_add(below + above, far_below + far_above);
        let sixth = both.mul_add(V::constant(7.0), outer);
        let mut smoother = carrier * V::constant(1.0 / 60.0) * sixth;
        if !INNER {
            // What was read beyond the ends may be anything.
            smoother = count.where_below(V::constant(six.end), smoother, zero);
            smoother = count.where_below(V::constant(six.start), zero, smoother);
        }
        let mut flux = smoother;
        // Beyond the band links are open.
        if zero.mask_below(weight) != 0 {
            // From the first link of the row on U changes evenly.
            let by = &self.rigid[1];
            let [own, along] = [2 * along, 2 * along + 1];
            let mean = mean - count.mul_add(V::constant(by[own]), V::constant(rigid[own]));
            let relative =
                carrier - count.mul_add(V::constant(by[along]), V::constant(rigid[along]));
            flux = (mean * relative).mul_add(weight, smoother);
        }
        let flux = flux * V::constant(axis.inverse);
        none.where_below(weight, flux, zero)
    }
}

/// Vector of the entries of a list some way from a place.
///
/// # Safety
/// They are in the list.
#[inline(always)]
unsafe fn take<V: Vector, R: Real>(list: &[R], at: usize, offset: isize) -> V {
    let at = at.wrapping_add_signed(offset);
    // SAFETY: as the caller has promised.
    V::load_from(unsafe { list.get_unchecked(at..at + V::WIDTH) })
}

impl<'a> Six<'a> {
    #[inline(always)]
    fn all(axis: &'a Axis) -> Six<'a> {
        Six {
            start: f64::NEG_INFINITY,
            end: f64::INFINITY,
            carried: &axis.carried,
        }
    }
}

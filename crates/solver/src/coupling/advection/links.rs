//! The links next to one grain: fluxes between neighbouring faces of a component, plane by plane.
//!
//! Legend: q component carried, c velocity that carries it, d signed distance of a link, U rigid velocity.

use std::ops::Range;

use glam::DVec3;

use super::{Stand, View};
use crate::coupling::aperture::surplus;
use crate::coupling::locate::Body;
use crate::coupling::places::PAD;
use crate::grid::{FACE_OFFSET, Mesh};
use crate::math::Real;
use crate::math::lanes::{MOST, Stencil, Vector};

/// The plane of a component at hand, in rows without gaps; there is a row before the first and one after
/// the last. What is written one row after the other is not read before a plane is done: the processor would
/// wait for it, as rows begin anywhere.
#[derive(Default)]
pub struct Planes {
    line: usize,
    /// Which rows of each plane have faces near.
    rows: Vec<Range<i32>>,
    /// Signed distances [m] in this plane and the next, infinite where no link may end.
    distance: [Vec<f64>; 2],
    /// What the links along x bring, and what leaves along y, and along z from this plane and the one
    /// before [m/s^2].
    x: Vec<f64>,
    y: Vec<f64>,
    z: [Vec<f64>; 2],
}

impl Planes {
    /// Makes room for a box, before the first plane; registers of `width` reach beyond its rows.
    fn begin(&mut self, body: &Body, width: usize) {
        self.line = body.size.x as usize + width;
        let count = self.line * (body.size.y as usize + 2) + MOST;
        let [here, next] = &mut self.distance;
        let [z, before] = &mut self.z;
        for list in [here, next, &mut self.x, &mut self.y, z, before] {
            list.resize(count, 0.0);
        }
        // Nothing comes from before the first plane, and along x where there are no links.
        before.fill(0.0);
        self.x.fill(0.0);
    }
    /// Part of a list in which plane `k` and those beside it have links.
    fn about(&self, k: i32) -> Range<usize> {
        let from = (k - 1).max(0) as usize;
        let to = (k + 2).min(self.rows.len() as i32) as usize;
        let (mut first, mut last) = (i32::MAX, i32::MIN);
        for rows in self.rows[from..to].iter().filter(|rows| !rows.is_empty()) {
            (first, last) = (first.min(rows.start), last.max(rows.end));
        }
        if first > last {
            return 0..0;
        }
        // One more row on each side.
        first as usize * self.line..(last + 2) as usize * self.line
    }
    fn place(&self, i: i32, j: i32) -> usize {
        i as usize + (j + 1) as usize * self.line
    }
}

/// The links of one component.
pub struct Lines<'a, R> {
    body: &'a Body,
    velocity: &'a View<'a, R>,
    component: usize,
    band: f64,
    /// Faces that are unknowns, along each axis.
    unknowns: [Range<i32>; 3],
    /// Whether all faces about the box are, so that all links have six in line.
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
    /// The link's own two alone, three times.
    alone: Stencil<6>,
    /// 1/h along the link [1/m].
    inverse: f64,
}

/// A row of unknowns near the grain.
#[derive(Clone, Copy)]
struct Row {
    /// Along x: the first in the box, and the one after the last.
    start: i32,
    end: i32,
    j: i32,
    k: i32,
    /// Place of the first in the lists of [`Body`].
    listed: usize,
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
        let size = self.body.size;
        planes.begin(self.body, V::WIDTH);
        let rows = |k| {
            let near = |j: &i32| self.row(*j, k).is_some();
            let first = (0..size.y).find(near);
            let last = (0..size.y).rev().find(near);
            first
                .zip(last)
                .map_or(0..0, |(first, last)| first..last + 1)
        };
        planes.rows.clear();
        planes.rows.extend((0..size.z).map(rows));
        self.unfold::<V>(0, planes);
        for k in 0..size.z {
            ahead(self.component, [k, size.z]);
            self.unfold::<V>(k + 1, planes);
            let (near, rows) = (planes.rows[k as usize].clone(), planes.about(k));
            planes.y[rows.clone()].fill(0.0);
            planes.z[(k % 2) as usize][rows].fill(0.0);
            for row in near.clone().filter_map(|j| self.row(j, k)) {
                if self.inner {
                    self.send::<V, true>(row, planes);
                } else {
                    self.send::<V, false>(row, planes);
                }
            }
            for row in near.clone().filter_map(|j| self.row(j, k)) {
                self.receive::<V>(row, planes, to);
            }
        }
    }

    /// Row (j, k), if any unknown in it is near.
    #[inline(always)]
    fn row(&self, j: i32, k: i32) -> Option<Row> {
        let [x, y, z] = &self.unknowns;
        let span = &self.body.spans[self.component][(j + self.body.size.y * k) as usize];
        let (start, end) = (span.start.max(x.start), span.end.min(x.end));
        let known = start < end && y.contains(&j) && z.contains(&k);
        let listed = span
            .first
            .wrapping_add_signed((start - span.start) as isize);
        known.then_some(Row {
            start,
            end,
            j,
            k,
            listed,
        })
    }

    /// Takes the distances of a plane from the list.
    #[inline(always)]
    fn unfold<V: Vector<Number = f64>>(&self, k: i32, planes: &mut Planes) {
        let which = (k % 2) as usize;
        let rows = planes.about(k);
        planes.distance[which][rows].fill(f64::INFINITY);
        if k >= self.body.size.z {
            return;
        }
        let list = &self.body.distance[self.component];
        for row in (0..self.body.size.y).filter_map(|j| self.row(j, k)) {
            let (count, to) = (row.end - row.start, planes.place(row.start, row.j));
            for n in (0..count).step_by(V::WIDTH) {
                let left = V::constant(f64::from(count - n));
                let n = n as usize;
                V::ramp()
                    .where_below(
                        left,
                        V::load_from(&list[row.listed + n..]),
                        V::constant(f64::INFINITY),
                    )
                    .store(&mut planes.distance[which][to + n..]);
            }
        }
    }

    /// Finds the fluxes of the links whose lower faces are in a row; `INNER` where all have six in line.
    #[inline(always)]
    fn send<V: Vector<Number = f64>, const INNER: bool>(&self, row: Row, planes: &mut Planes) {
        let at = self.velocity.row([row.j, row.k]);
        let at = at.wrapping_add(row.start as usize);
        let place = planes.place(row.start, row.j);
        let [this, other] = [row.k, row.k + 1].map(|k| (k % 2) as usize);
        let [a, b, c] = &self.axes;
        let six = if INNER {
            [Six::all(a), Six::all(b), Six::all(c)]
        } else {
            [self.six(0, row), self.six(1, row), self.six(2, row)]
        };
        let [x, y, z] = [row.start, row.j, row.k].map(f64::from);
        let [first, by_x, by_y, by_z] = &self.rigid;
        let mut rigid = [0.0; 8];
        for n in 0..8 {
            rigid[n] = first[n] + x * by_x[n] + y * by_y[n] + z * by_z[n];
        }
        let (half, mut before) = (V::constant(0.5), V::constant(0.0));
        for n in (0..(row.end - row.start) as usize).step_by(V::WIDTH) {
            let (at, place) = (at.wrapping_add(n), place + n);
            let count = V::constant(n as f64) + V::ramp();
            let here = V::load(&planes.distance[this][place..]);
            if self.axes[0].exists {
                let d = half * (here + V::load(&planes.distance[this][place + 1..]));
                let flux = self.flux::<V, INNER>(0, six[0], &rigid, at, count, d);
                (flux.behind(before) - flux).store(&mut planes.x[place..]);
                before = flux;
            }
            if self.axes[1].exists {
                let d = half * (here + V::load(&planes.distance[this][place + planes.line..]));
                let flux = self.flux::<V, INNER>(1, six[1], &rigid, at, count, d);
                flux.store(&mut planes.y[place..]);
            }
            if self.axes[2].exists {
                let d = half * (here + V::load(&planes.distance[other][place..]));
                let flux = self.flux::<V, INNER>(2, six[2], &rigid, at, count, d);
                flux.store(&mut planes.z[this][place..]);
            }
        }
    }

    /// Sums what comes to a row and what leaves it.
    #[inline(always)]
    fn receive<V: Vector<Number = f64>>(&self, row: Row, planes: &Planes, to: &mut [f64]) {
        let place = planes.place(row.start, row.j);
        let [this, before] = [row.k, row.k + 1].map(|k| (k % 2) as usize);
        for n in (0..(row.end - row.start) as usize).step_by(V::WIDTH) {
            let place = place + n;
            let y = V::load(&planes.y[place - planes.line..]) - V::load(&planes.y[place..]);
            let z = V::load(&planes.z[before][place..]) - V::load(&planes.z[this][place..]);
            // What is written beyond the row the next one overwrites.
            (V::load(&planes.x[place..]) + y + z).store(&mut to[row.listed + n..]);
        }
    }

    /// Near the ends of the grid there are no six faces.
    fn six(&self, along: usize, row: Row) -> Six<'_> {
        let (axis, range) = (&self.axes[along], &self.unknowns[along]);
        let place = [row.start, row.j, row.k][along];
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
        d: V,
    ) -> V {
        let (zero, half) = (V::constant(0.0), V::constant(0.5));
        let (inside, outside) = (V::constant(-self.band), V::constant(2.0 * self.band));
        if inside.mask_below(d) & d.mask_below(outside) == 0 {
            return zero;
        }
        let axis = &self.axes[along];
        let [q, c] = [self.component, along].map(|of| self.velocity.components[of]);
        let [from, to, below, above, far_below, far_above] = six.carried.load::<V, R>(q, at);
        let [first, second] = axis.carrying.load::<V, R>(c, at);
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
        if d.mask_below(V::constant(self.band)) != 0 {
            // From the first link of the row on U changes evenly.
            let by = &self.rigid[1];
            let [own, along] = [2 * along, 2 * along + 1];
            let mean = mean - count.mul_add(V::constant(by[own]), V::constant(rigid[own]));
            let relative =
                carrier - count.mul_add(V::constant(by[along]), V::constant(rigid[along]));
            flux = (mean * relative).mul_add(surplus(d, self.band), smoother);
        }
        let flux = flux * V::constant(axis.inverse);
        let flux = d.where_below(outside, flux, zero);
        inside.where_below(d, flux, zero)
    }
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

//! What each link next to a grain weighs, plane by plane: how far from the surface it is, taken from the distances of
//! its two faces. In singles, as they are.
//!
//! Legend: d signed distance of a link.

use std::ops::Range;

use crate::immersed::aperture::surplus;
use crate::immersed::locate::Body;
use crate::math::Aligned;
use grainwake_simd::{Kernel, MOST, Vector, dispatch};

/// The plane of a component at hand and the next, in rows that begin on registers; there is a row before the first
/// and one after the last.
#[derive(Default)]
pub struct Planes {
    /// From one row to the next.
    pub line: usize,
    /// Which rows have faces near, in this plane and the next.
    pub rows: [Range<i32>; 2],
    /// Their signed distances [m], infinite where no link may end.
    distance: [Aligned<f32>; 2],
    /// Weights of the links along each axis: [`surplus`], negative where a link is not near the surface.
    pub weight: [Aligned<f32>; 3],
    /// What left the row before along y, and the plane before along z [m/s^2]. None of it reaches rows that have no
    /// faces near.
    pub y: Aligned<f64>,
    pub z: Aligned<f64>,
}

impl Planes {
    /// Makes room for a box, before the first plane.
    pub fn begin(&mut self, body: &Body) {
        // One face more is no link's. `View::reaches` counts on no more than `MOST` beyond the box.
        self.line = (body.size.x as usize + 1).next_multiple_of(MOST);
        let count = self.line * (body.size.y as usize + 2);
        for list in self.distance.iter_mut().chain(&mut self.weight) {
            list.make_room(count + MOST);
        }
        for (list, count) in [(&mut self.y, self.line), (&mut self.z, count)] {
            list.make_room(count);
            list[..count].fill(0.0);
        }
    }
    /// Place of the first face of row `j`.
    #[inline(always)]
    pub fn place(&self, j: i32) -> usize {
        (j + 1) as usize * self.line
    }
}

/// Faces of a row that are near.
pub struct Near {
    /// Along x: the first in the box, and the one after the last.
    pub start: usize,
    pub end: usize,
    /// Place of the first in the lists of [`Body`].
    pub listed: usize,
}

/// The unknowns of row (j, k) that are near, if any.
#[inline(always)]
pub fn near(
    body: &Body,
    [x, y, z]: &[Range<i32>; 3],
    component: usize,
    [j, k]: [i32; 2],
) -> Option<Near> {
    let span = &body.spans[component][(j + body.size.y * k) as usize];
    let (start, end) = (span.start.max(x.start), span.end.min(x.end));
    if start >= end || j < y.start || j >= y.end || k < z.start || k >= z.end {
        return None;
    }
    Some(Near {
        start: start as usize,
        end: end as usize,
        listed: span.place(start),
    })
}

/// Weighs the links of a component whose lower faces are in plane `k`, after those of the plane before; plane -1 comes
/// first.
pub fn weigh(
    unknowns: &[Range<i32>; 3],
    body: &Body,
    component: usize,
    band: f64,
    k: i32,
    planes: &mut Planes,
) {
    dispatch(Weigh {
        unknowns,
        body,
        component,
        band,
        k,
        planes,
    });
}

/// The weights of a plane.
struct Weigh<'a> {
    unknowns: &'a [Range<i32>; 3],
    body: &'a Body,
    component: usize,
    band: f64,
    k: i32,
    planes: &'a mut Planes,
}

impl Kernel for Weigh<'_> {
    type Number = f32;
    #[inline(always)]
    fn run<V: Vector<Number = f32>>(mut self) {
        self.unfold::<V>();
        if self.k >= 0 {
            self.weigh::<V>();
        }
    }
}

impl Weigh<'_> {
    /// Takes the distances of the next plane from the list.
    #[inline(always)]
    fn unfold<V: Vector<Number = f32>>(&mut self) {
        let (body, k) = (self.body, self.k + 1);
        let which = (k % 2) as usize;
        let line = self.planes.line;
        let distance = &mut self.planes.distance[which][..line * (body.size.y as usize + 2) + MOST];
        let far = V::constant(f64::INFINITY);
        for n in (0..distance.len()).step_by(V::WIDTH) {
            far.store(&mut distance[n..]);
        }
        let (mut first, mut last) = (0, 0);
        let list = &body.distance[self.component][..];
        let rows = if k < body.size.z { body.size.y } else { 0 };
        for j in 0..rows {
            let Some(near) = near(body, self.unknowns, self.component, [j, k]) else {
                continue;
            };
            if last == 0 {
                first = j;
            }
            last = j + 1;
            let (count, to) = (near.end - near.start, (j + 1) as usize * line + near.start);
            for n in (0..count).step_by(V::WIDTH) {
                let left = V::constant((count - n) as f64);
                // What is written beyond the row the next one overwrites.
                V::ramp()
                    .where_below(left, V::load(&list[near.listed + n..]), far)
                    .store(&mut distance[to + n..]);
            }
        }
        self.planes.rows[which] = first..last;
    }

    /// Weighs the links of this plane.
    #[inline(always)]
    fn weigh<V: Vector<Number = f32>>(&mut self) {
        let Planes {
            line,
            rows,
            distance,
            weight,
            ..
        } = &mut *self.planes;
        let [this, other] = [self.k, self.k + 1].map(|k| (k % 2) as usize);
        let (here, above) = (&distance[this][..], &distance[other][..]);
        let [x, y, z] = weight;
        let weight = [&mut x[..], &mut y[..], &mut z[..]];
        let (half, zero, none) = (V::constant(0.5), V::constant(0.0), V::constant(-1.0));
        let [inside, band, outside] = [-1.0, 1.0, 2.0].map(|of| of * self.band);
        let rows = &rows[this];
        let (first, last) = (rows.start + 1, rows.end + 1);
        for place in (first as usize * *line..last as usize * *line).step_by(V::WIDTH) {
            let own = V::load(&here[place..]);
            let next = [
                V::load(&here[place + 1..]),
                V::load(&here[place + *line..]),
                V::load(&above[place..]),
            ];
            for axis in 0..3 {
                let d = half * (own + next[axis]);
                let mut found = zero;
                if d.mask_below(V::constant(band)) != 0 {
                    // Open links have none, whatever others are in the vector: rounding would leave some at the
                    // end of the band.
                    let surplus = d.where_below(V::constant(band), surplus(d, self.band), zero);
                    found = V::constant(inside).where_below(d, surplus, none);
                }
                d.where_below(V::constant(outside), found, none)
                    .store(&mut weight[axis][place..]);
            }
        }
    }
}

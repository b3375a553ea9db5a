//! Weights of the links next to a grain, plane by plane, in single precision like the distances.
//!
//! The distance d of a link is the mean of those of its two faces. The weight is the inverse-aperture
//! excess for |d| < eps, 0 for eps <= d < 2 eps, and -1 elsewhere.

use std::ops::Range;

use crate::immersed::geometry::LocatedBody;
use crate::immersed::geometry::aperture::inverse_aperture_excess;
use crate::math::Aligned;
use grainwake_simd::{Kernel, MAX_LANES, Vector, dispatch};

/// The current plane of a component and the next, in rows aligned to registers. One row precedes the
/// first, and one follows the last.
#[derive(Default)]
pub struct LinkPlanes {
    /// Entries from one row to the next.
    pub row_length: usize,
    /// Rows with faces near the grain, in even and in odd planes.
    pub rows: [Range<i32>; 2],
    /// Signed distances of the faces [m] in even and in odd planes, infinite where no link may end.
    distance: [Aligned<f32>; 2],
    /// Weights of the links of the current plane, by axis.
    pub weight: [Aligned<f32>; 3],
    /// Fluxes along y out of the row before [m/s^2]. Fluxes never enter rows without faces near.
    pub flux_y: Aligned<f64>,
    /// Fluxes along z out of the plane before [m/s^2].
    pub flux_z: Aligned<f64>,
}

impl LinkPlanes {
    /// Makes room for the box of a grain and clears the fluxes.
    pub fn reset(&mut self, body: &LocatedBody) {
        // The face after the last of the box ends the last link.
        self.row_length = (body.size.x as usize + 1).next_multiple_of(MAX_LANES);
        let count = self.row_length * (body.size.y as usize + 2);
        for list in self.distance.iter_mut().chain(&mut self.weight) {
            list.make_room(count + MAX_LANES);
        }
        for (list, count) in [
            (&mut self.flux_y, self.row_length),
            (&mut self.flux_z, count),
        ] {
            list.make_room(count);
            list[..count].fill(0.0);
        }
    }
    /// Entry of the first face of row `j`.
    #[inline(always)]
    pub fn first_entry(&self, j: i32) -> usize {
        (j + 1) as usize * self.row_length
    }
}

/// Unknown faces of a row within reach of the grain.
pub struct NearFaces {
    /// First index along x, and the index after the last.
    pub start: usize,
    pub end: usize,
    /// Entry of the first in [`LocatedBody::distance`].
    pub first: usize,
}

/// Unknown faces of row (j, k) within reach, if any; `x`, `y` and `z` are the unknowns along each axis.
#[inline(always)]
pub fn near_faces(
    body: &LocatedBody,
    [x, y, z]: &[Range<i32>; 3],
    component: usize,
    [j, k]: [i32; 2],
) -> Option<NearFaces> {
    let span = &body.spans[component][(j + body.size.y * k) as usize];
    let (start, end) = (span.start.max(x.start), span.end.min(x.end));
    if start >= end || j < y.start || j >= y.end || k < z.start || k >= z.end {
        return None;
    }
    Some(NearFaces {
        start: start as usize,
        end: end as usize,
        first: span.entry(start),
    })
}

/// Weighs the links whose lower faces are in plane `k`. To be called for plane -1 first, then for one
/// plane after the other; `dofs` are the unknowns along each axis.
pub fn weigh_links(
    dofs: &[Range<i32>; 3],
    body: &LocatedBody,
    component: usize,
    eps: f64,
    k: i32,
    planes: &mut LinkPlanes,
) {
    dispatch(WeighLinks {
        dofs,
        body,
        component,
        eps,
        k,
        planes,
    });
}

struct WeighLinks<'a> {
    dofs: &'a [Range<i32>; 3],
    body: &'a LocatedBody,
    component: usize,
    eps: f64,
    k: i32,
    planes: &'a mut LinkPlanes,
}

impl Kernel for WeighLinks<'_> {
    type Number = f32;
    #[inline(always)]
    fn run<V: Vector<Number = f32>>(mut self) {
        self.read_next_plane::<V>();
        if self.k >= 0 {
            self.weigh::<V>();
        }
    }
}

impl WeighLinks<'_> {
    /// Copies the distances of the next plane from the list.
    #[inline(always)]
    fn read_next_plane<V: Vector<Number = f32>>(&mut self) {
        let (body, k) = (self.body, self.k + 1);
        let which = (k % 2) as usize;
        let row_length = self.planes.row_length;
        let distance =
            &mut self.planes.distance[which][..row_length * (body.size.y as usize + 2) + MAX_LANES];
        let far = V::constant(f64::INFINITY);
        for n in (0..distance.len()).step_by(V::WIDTH) {
            far.store(&mut distance[n..]);
        }
        let (mut first, mut last) = (0, 0);
        let list = &body.distance[self.component][..];
        let rows = if k < body.size.z { body.size.y } else { 0 };
        for j in 0..rows {
            let Some(near) = near_faces(body, self.dofs, self.component, [j, k]) else {
                continue;
            };
            if last == 0 {
                first = j;
            }
            last = j + 1;
            let (count, to) = (
                near.end - near.start,
                (j + 1) as usize * row_length + near.start,
            );
            for n in (0..count).step_by(V::WIDTH) {
                let left = V::constant((count - n) as f64);
                // Entries beyond the row are overwritten by the next.
                V::ramp()
                    .select_below(left, V::load(&list[near.first + n..]), far)
                    .store(&mut distance[to + n..]);
            }
        }
        self.planes.rows[which] = first..last;
    }

    /// Weighs the links of this plane.
    #[inline(always)]
    fn weigh<V: Vector<Number = f32>>(&mut self) {
        let LinkPlanes {
            row_length,
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
        let [inside, band, outside] = [-1.0, 1.0, 2.0].map(|half_widths| half_widths * self.eps);
        let rows = &rows[this];
        let (first, last) = (rows.start + 1, rows.end + 1);
        let row_length = *row_length;
        for entry in (first as usize * row_length..last as usize * row_length).step_by(V::WIDTH) {
            let own = V::load(&here[entry..]);
            let next = [
                V::load(&here[entry + 1..]),
                V::load(&here[entry + row_length..]),
                V::load(&above[entry..]),
            ];
            for axis in 0..3 {
                let d = half * (own + next[axis]);
                let mut of_near = zero;
                if d.mask_below(V::constant(band)) != 0 {
                    // Zero for open links, where the series would leave round-off.
                    let excess = inverse_aperture_excess(d, self.eps);
                    let excess = d.select_below(V::constant(band), excess, zero);
                    of_near = V::constant(inside).select_below(d, excess, none);
                }
                d.select_below(V::constant(outside), of_near, none)
                    .store(&mut weight[axis][entry..]);
            }
        }
    }
}

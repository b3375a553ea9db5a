//! Links next to a grain: their weights, plane by plane, in single precision like the distances,
//! their rigid velocities, slopes of the velocity at them, and the velocity in the box around the
//! grain.
//!
//! The weight of a link is 1 / A' - 1 for |d| < eps, 0 for eps <= d < 2 eps, and -1 elsewhere,
//! which marks links without correction. `immersed::reference` has the scalar form.
//!
//! Legend: d signed distance of a link, the mean of the distances of its two faces; eps half-width
//! of the band; A' limited aperture at d.

use std::ops::Range;

use glam::{DVec3, IVec3};

use super::geometry::aperture::{forcing_reach, inverse_aperture_excess};
use super::geometry::{LocatedBody, PAD};
use crate::dem::RigidState;
use crate::flow::OldState;
use crate::grid::{FACE_OFFSET, Mesh};
use crate::math::{Aligned, Real};
use grainwake_simd::{Kernel, MAX_LANES, Stencil, Vector, dispatch};

/// Weight where there is no link.
pub(super) const NO_LINK: f64 = -1.0;

/// The current plane of a component and the next, in rows aligned to registers. One row precedes
/// the first, and one follows the last.
#[derive(Default)]
pub struct LinkPlanes {
    /// Entries from one row to the next.
    pub row_length: usize,
    /// Signed distances of the faces [m] in even and in odd planes, infinite where no link may end.
    distance: [Aligned<f32>; 2],
    /// Weights of the links of the current plane, by axis.
    pub weight: [Aligned<f32>; 3],
    /// Fluxes along y out of the previous row [m/s^2]; zero before a row without listed faces.
    pub flux_y: Aligned<f64>,
    /// Fluxes along z out of the previous plane [m/s^2].
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
        for (list, count) in [(&mut self.flux_y, self.row_length), (&mut self.flux_z, count)] {
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

/// Returns the indices along x of the unknown faces of row (j, k) within reach, if any, and their
/// first entry in [`LocatedBody::distance`]; `x`, `y` and `z` are the indices of the unknowns along
/// each axis.
#[inline(always)]
pub fn listed_faces(
    body: &LocatedBody,
    [x, y, z]: &[Range<i32>; 3],
    component: usize,
    [j, k]: [i32; 2],
) -> Option<(Range<usize>, usize)> {
    let span = &body.spans[component][(j + body.size.y * k) as usize];
    let (start, end) = (span.start.max(x.start), span.end.min(x.end));
    if start >= end || j < y.start || j >= y.end || k < z.start || k >= z.end {
        return None;
    }
    Some((start as usize..end as usize, span.entry(start)))
}

/// Computes the weights of the links whose lower faces are in plane `k`. Must be called for the
/// planes -1, 0, 1, ... in order; `unknowns` are the indices of the unknowns along each axis, `eps`
/// [m] the half-width of the band.
pub fn compute_link_weights(
    unknowns: &[Range<i32>; 3],
    body: &LocatedBody,
    component: usize,
    eps: f64,
    k: i32,
    planes: &mut LinkPlanes,
) {
    dispatch(ComputeLinkWeights { unknowns, body, component, eps, k, planes });
}

struct ComputeLinkWeights<'a> {
    unknowns: &'a [Range<i32>; 3],
    body: &'a LocatedBody,
    component: usize,
    eps: f64,
    k: i32,
    planes: &'a mut LinkPlanes,
}

impl Kernel for ComputeLinkWeights<'_> {
    type Number = f32;
    #[inline(always)]
    fn run<V: Vector<Number = f32>>(mut self) {
        self.read_next_plane();
        if self.k >= 0 {
            self.compute_weights::<V>();
        }
    }
}

impl ComputeLinkWeights<'_> {
    /// Copies the distances of the plane above from the list.
    #[inline(always)]
    fn read_next_plane(&mut self) {
        let (body, k) = (self.body, self.k + 1);
        let row_length = self.planes.row_length;
        let length = row_length * (body.size.y as usize + 2) + MAX_LANES;
        let distance = &mut self.planes.distance[(k % 2) as usize][..length];
        distance.fill(f32::INFINITY);
        let list = &body.distance[self.component][..];
        let rows = if k < body.size.z { body.size.y } else { 0 };
        for j in 0..rows {
            let listed = listed_faces(body, self.unknowns, self.component, [j, k]);
            if let Some((listed, first)) = listed {
                let row = &mut distance[(j + 1) as usize * row_length..];
                row[listed.clone()].copy_from_slice(&list[first..][..listed.len()]);
            }
        }
    }

    /// Computes the weights of the links of this plane.
    #[inline(always)]
    fn compute_weights<V: Vector<Number = f32>>(&mut self) {
        let LinkPlanes { row_length, distance, weight, .. } = &mut *self.planes;
        let [this, next] = [self.k, self.k + 1].map(|k| (k % 2) as usize);
        let (this, above) = (&distance[this][..], &distance[next][..]);
        let weight = weight.each_mut().map(|weight| &mut weight[..]);
        let (half, zero, no_link) = (V::constant(0.5), V::constant(0.0), V::constant(NO_LINK));
        let limits = [-self.eps, self.eps, forcing_reach(self.eps)];
        let [inside, band, outside] = limits.map(V::constant);
        let rows = *row_length..*row_length * (self.body.size.y as usize + 1);
        for entry in rows.step_by(V::WIDTH) {
            let d_0 = V::load(&this[entry..]);
            let d_1 = [
                V::load(&this[entry + 1..]),
                V::load(&this[entry + *row_length..]),
                V::load(&above[entry..]),
            ];
            for axis in 0..3 {
                let d = half * (d_0 + d_1[axis]);
                let mut w = zero;
                // Most vectors of a box lie beyond the band, where no series is needed.
                if d.mask_below(band) != 0 {
                    let excess = inverse_aperture_excess(d, self.eps);
                    w = inside.select_below(d, d.select_below(band, excess, zero), no_link);
                }
                d.select_below(outside, w, no_link).store(&mut weight[axis][entry..]);
            }
        }
    }
}

/// Rigid velocity at the middles of the links of one component. It is linear in the indices
/// (i, j, k) of the lower face of a link.
pub struct RigidLinks {
    /// U_q and U_c [m/s] of link (0, 0, 0) along each axis.
    first: [[f64; 2]; 3],
    /// Changes of U_q and U_c from a link to the next along x, y and z.
    pub change: [[[f64; 2]; 3]; 3],
}

impl RigidLinks {
    pub fn new(
        mesh: &Mesh,
        kinematics: &RigidState,
        lowest: IVec3,
        component: usize,
    ) -> RigidLinks {
        let omega = kinematics.velocity.angular;
        let change = DVec3::AXES.map(|axis| omega.cross(axis * mesh.spacing));
        let face = lowest.as_dvec3() + (DVec3::from_array(FACE_OFFSET[component]) - 1.0);
        let first = [0, 1, 2].map(|along| {
            let middle = face + 0.5 * DVec3::AXES[along];
            let velocity = kinematics.velocity_at(mesh.origin + mesh.spacing * middle);
            [component, along].map(|of| velocity[of])
        });
        let change = change.map(|u| [0, 1, 2].map(|along| [component, along].map(|of| u[of])));
        RigidLinks { first, change }
    }

    /// U_q and U_c [m/s] of the first link of row (j, k) along each axis.
    #[inline(always)]
    pub fn first_of_row(&self, [j, k]: [i32; 2]) -> [[f64; 2]; 3] {
        let ([y, z], [_, by_y, by_z]) = ([j, k].map(f64::from), &self.change);
        [0, 1, 2].map(|along| {
            [0, 1].map(|of| self.first[along][of] + y * by_y[along][of] + z * by_z[along][of])
        })
    }
}

/// Slopes of the advected and the advecting component in the middle of a link along each axis,
/// relative to the grain.
pub struct LinkSlopes([[Slope; 2]; 3]);

/// Sum of the first two faces less that of the last two, times the factor [1/m], less the slope of
/// the rigid velocity [1/s].
#[derive(Clone, Copy)]
struct Slope {
    faces: Stencil<4>,
    factor: f64,
    rigid: f64,
}

impl LinkSlopes {
    /// Slopes at the links along axis `along` between faces of `component`; `strides` [entries] are
    /// those of the velocity.
    pub fn new(
        mesh: &Mesh,
        strides: [usize; 3],
        rigid: &RigidLinks,
        [along, component]: [usize; 2],
    ) -> LinkSlopes {
        let strides = strides.map(|stride| stride as isize);
        let next = strides[along];
        // The two faces of each component at a link.
        let below = if along == component { 0 } else { next - strides[component] };
        let faces = [[0, next], [below, next]];
        let slope = |axis: usize, of: usize| {
            let ([a, b], step, h) = (faces[of], strides[axis], mesh.spacing[axis]);
            // A difference of both along this axis, central differences around both along others.
            let (faces, width) = match b - a == step {
                true => ([b, b, a, a], h),
                false => ([a + step, b + step, a - step, b - step], 2.0 * h),
            };
            let rigid = rigid.change[axis][along][of] / h;
            Slope { faces: Stencil::new(faces), factor: 0.5 / width, rigid }
        };
        LinkSlopes([0, 1, 2].map(|axis| [slope(axis, 0), slope(axis, 1)]))
    }

    /// Scalar product of both gradients and sum of their squares [1/s^2] at the links whose lower
    /// faces lie from position `at` on.
    #[inline(always)]
    pub fn products<V: Vector<Number = f64>, R: Real>(&self, of: [&[R]; 2], at: usize) -> [V; 2] {
        // Without closures, which would not be inlined in a kernel.
        let [mut product, mut square] = [V::constant(0.0); 2];
        for [advected, advecting] in &self.0 {
            let (q, c) = (advected.load::<V, R>(of[0], at), advecting.load::<V, R>(of[1], at));
            product = q.mul_add(c, product);
            square = c.mul_add(c, q.mul_add(q, square));
        }
        [product, square]
    }
}

impl Slope {
    #[inline(always)]
    fn load<V: Vector<Number = f64>, R: Real>(&self, values: &[R], at: usize) -> V {
        let [a, b, c, d] = self.faces.load::<V, R>(values, at);
        ((a + b) - (c + d)).mul_add(V::constant(self.factor), V::constant(-self.rigid))
    }
}

/// Velocity in the padded box around a grain [m/s], either in the fields or copied.
pub struct BoxVelocity<'a, R> {
    pub components: [&'a [R]; 3],
    /// Entries from one face to the next along each axis.
    pub strides: [usize; 3],
    /// Position of the lowest cell of the box, modulo the range of `usize` if it is not in memory.
    origin: usize,
}

impl<'a, R: Real> BoxVelocity<'a, R> {
    /// Refers to the fields if they hold the padded box with constant strides, else fills `copies`.
    pub fn new(
        known: &OldState<'a, R>,
        body: &LocatedBody,
        copies: &'a mut [Vec<R>; 3],
    ) -> BoxVelocity<'a, R> {
        let (layout, velocity) = (known.mesh.layout(), known.velocity);
        let periodic = known.boundaries.periodic();
        // Links end at walls, so only periodic edges and rows shorter than a register need a copy.
        let direct = layout.cells[0] >= MAX_LANES
            && (0..3).all(|axis| {
                let high = body.lowest[axis] + body.size[axis] + PAD - 1;
                !periodic[axis] || body.lowest[axis] >= PAD && high <= layout.cells[axis] as i32 + 1
            });
        if direct {
            let strides = layout.strides();
            let along = |axis: usize| (body.lowest[axis] as usize).wrapping_mul(strides[axis]);
            return BoxVelocity {
                components: [0, 1, 2].map(|axis| velocity.component(axis)),
                strides,
                origin: along(0).wrapping_add(along(1)).wrapping_add(along(2)),
            };
        }
        for (axis, copy) in copies.iter_mut().enumerate() {
            body.index_map.copy(velocity.component(axis), copy);
            copy.resize(copy.len() + MAX_LANES, R::default());
        }
        let wide = (body.size + 2 * PAD).to_array().map(|n| n as usize);
        let strides = [1, wide[0], wide[0] * wide[1]];
        BoxVelocity {
            components: copies.each_ref().map(|copy| &copy[..]),
            strides,
            origin: PAD as usize * strides.iter().sum::<usize>(),
        }
    }

    /// Position of face 0 of row (j, k) of the box.
    #[inline(always)]
    pub fn row(&self, [j, k]: [i32; 2]) -> usize {
        let [_, line, plane] = self.strides;
        self.origin.wrapping_add(j as usize * line + k as usize * plane)
    }
}

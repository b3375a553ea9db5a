//! Correction of the second-order central advection scheme at the links near a grain, plane by
//! plane.
//!
//! A link joins two neighbouring faces of the same component. Three terms correct its flux:
//!
//! 1. A face value near the surface represents the open part of the face only, q = A u. The product
//!    of two such values carries A^2 u u where the flux is A u u. The flux relative to the grain is
//!    therefore divided by the limited aperture A' = A + 0.2 (1 - A)^2 of the link.
//! 2. The boundary layer is about one cell thick and moves with the grain. Second-order central
//!    differences advect such a profile at about two thirds of its speed. Within two half-widths of
//!    the band around the surface the sixth-order mean of six faces replaces the mean of two.
//! 3. Velocities near the surface are averages over the band, and the average of a product exceeds
//!    the product of the averages: next to a linear profile by the variance of the band times the
//!    product of the gradients. Three quarters of this are added, less where the profile is steep,
//!    since it is not linear over the band there (`docs/decisions/0028-averaged-products.md`).
//!
//! The correction adds to the flux over h
//!
//! ```text
//! (1/A' - 1) (q_mean - U_q) (c - U_c) / h
//! c (7 (q_0 + q_1) - 8 (q_-1 + q_2) + (q_-2 + q_3)) / (60 h)
//! 0.75 sigma^2 grad(q - U_q) . grad(c - U_c) / (1 + (G eps^2 / (7 nu))^2) / h
//! ```
//!
//! with G^2 the sum of the squares of both gradients. The second term is left out at the ends of
//! the grid, where fewer than six faces are in line.
//! |(1/A' - 1) (c - U_c)| is limited to 100 nu / h: through a face that is almost closed, a jet out
//! of the grain would otherwise accelerate itself without bound
//! (`docs/decisions/0023-jets-out-of-closed-faces.md`).
//! All are fluxes between two faces, so momentum is conserved
//! (`docs/decisions/0003-advection-next-to-grains.md`). `links.rs` finds the links,
//! `immersed::reference` has the scalar form.
//!
//! Legend: q advected component, c advecting velocity, U rigid velocity at the middle of the link,
//! A and A' aperture and limited aperture of the link, h spacing along the link, eps and sigma^2
//! half-width and variance of the band, nu kinematic viscosity.

use std::ops::Range;

use super::geometry::aperture::band_variance;
use super::geometry::{FaceRow, LocatedBody};
use super::links::{
    BoxVelocity, LinkPlanes, LinkSlopes, NO_LINK, RigidLinks, compute_link_weights, listed_faces,
};
use crate::dem::RigidState;
use crate::flow::{OldState, Prediction};
use crate::grid::Mesh;
use crate::math::Real;
use grainwake_simd::{Kernel, Stencil, Vector, dispatch};

/// Largest Reynolds number |(1/A' - 1) (c - U_c)| h / nu of the first term.
pub const LARGEST_EXCESS: f64 = 100.0;

/// Part of the flux that averages over the band leave out, which the third term adds.
pub const AVERAGED_PART: f64 = 0.75;

/// Reynolds number G eps^2 / nu of the gradients at which the third term is halved.
pub const STEEP: f64 = 7.0;

/// Change of the tendency of each face near a grain [m/s^2], by component, in the order of
/// [`LocatedBody::distance`].
pub type AdvectionCorrection = [Vec<f64>; 3];

/// Buffers of one thread.
#[derive(Default)]
pub struct AdvectionScratch<R> {
    copies: [Vec<R>; 3],
    planes: LinkPlanes,
}

/// Fills the `correction` for a grain at the location `body` that moves with `kinematics`; `eps`
/// [m] is the half-width of the band.
pub fn find_correction<R: Real>(
    eps: f64,
    kinematic_viscosity: f64,
    known: &OldState<R>,
    kinematics: &RigidState,
    body: &LocatedBody,
    scratch: &mut AdvectionScratch<R>,
    correction: &mut AdvectionCorrection,
) {
    let (mesh, parameters) = (known.mesh, [eps, kinematic_viscosity]);
    let velocity = BoxVelocity::new(known, body, &mut scratch.copies);
    for (component, correction) in correction.iter_mut().enumerate() {
        correction.resize(body.distance[component].len(), 0.0);
        let links = ComponentLinks::new(parameters, mesh, kinematics, body, &velocity, component);
        dispatch(CorrectComponent { links, planes: &mut scratch.planes, correction });
    }
}

/// Adds a component of the correction to a part of the prediction.
pub fn add_correction<R: Real>(
    body: &LocatedBody,
    correction: &AdvectionCorrection,
    component: usize,
    prediction: &mut Prediction<R>,
) {
    let (rows, correction) = (&body.rows[component][..], &correction[component][..]);
    dispatch(AddCorrection { rows, correction, prediction });
}

struct AddCorrection<'a, 'b, R> {
    rows: &'a [FaceRow],
    correction: &'a [f64],
    prediction: &'a mut Prediction<'b, R>,
}

impl<R: Real> Kernel for AddCorrection<'_, '_, R> {
    type Number = f64;
    #[inline(always)]
    fn run<V: Vector<Number = f64>>(self) {
        let part = self.prediction.range().clone();
        for row in self.rows.iter().filter(|row| part.contains(&row.at)) {
            let correction = &self.correction[row.first..];
            self.prediction.add_tendency::<V>(row.at, row.count, correction);
        }
    }
}

/// Writes the correction of all faces of one component.
struct CorrectComponent<'a, R> {
    links: ComponentLinks<'a, R>,
    planes: &'a mut LinkPlanes,
    correction: &'a mut [f64],
}

impl<R: Real> Kernel for CorrectComponent<'_, R> {
    type Number = f64;
    #[inline(always)]
    fn run<V: Vector<Number = f64>>(self) {
        let CorrectComponent { links, planes, correction } = self;
        let ComponentLinks { body, component, eps, ref unknowns, .. } = links;
        planes.reset(body);
        for k in -1..body.size.z {
            compute_link_weights(unknowns, body, component, eps, k, planes);
            let rows = if k < 0 { 0 } else { body.size.y };
            for j in 0..rows {
                links.correct_row::<V>([j, k], planes, correction);
            }
        }
    }
}

/// Links of one component.
struct ComponentLinks<'a, R> {
    body: &'a LocatedBody,
    velocity: &'a BoxVelocity<'a, R>,
    component: usize,
    /// Half-width of the band [m].
    eps: f64,
    /// Part of the variance of the band that the third term takes [m^2].
    variance: f64,
    /// (eps^2 / (7 nu))^2 [s^2].
    steepness: f64,
    /// Indices of the unknown faces along each axis.
    unknowns: [Range<i32>; 3],
    axes: [LinkAxis; 3],
    rigid: RigidLinks,
}

/// Links along one axis.
struct LinkAxis {
    /// Whether the grid has more than one cell along the axis.
    exists: bool,
    /// The six faces in line with a link, relative to its lower face, q_0 and q_1 first.
    six_faces: Stencil<6>,
    /// q_0 and q_1 three times, for links without six faces in line.
    two_faces: Stencil<6>,
    /// The two faces of the advecting component, relative to the lower face.
    advecting: Stencil<2>,
    slopes: LinkSlopes,
    /// 1 / h [1/m].
    per_spacing: f64,
    /// Largest |(1/A' - 1) (c - U_c)| [m/s].
    largest_excess: f64,
}

impl<'a, R: Real> ComponentLinks<'a, R> {
    fn new(
        [eps, nu]: [f64; 2],
        mesh: &Mesh,
        kinematics: &RigidState,
        body: &'a LocatedBody,
        velocity: &'a BoxVelocity<'a, R>,
        component: usize,
    ) -> ComponentLinks<'a, R> {
        let rigid = RigidLinks::new(mesh, kinematics, body.lowest, component);
        let axes = [0, 1, 2].map(|along| {
            let [next, across] = [along, component].map(|axis| velocity.strides[axis] as isize);
            LinkAxis {
                exists: mesh.is_resolved(along),
                six_faces: Stencil::new([0, next, -next, 2 * next, -2 * next, 3 * next]),
                two_faces: Stencil::new([0, next, 0, next, 0, next]),
                advecting: match along == component {
                    true => Stencil::new([0, next]),
                    false => Stencil::new([next, next - across]),
                },
                slopes: LinkSlopes::new(mesh, velocity.strides, &rigid, [along, component]),
                per_spacing: 1.0 / mesh.spacing[along],
                largest_excess: LARGEST_EXCESS * nu / mesh.spacing[along],
            }
        });
        ComponentLinks {
            body,
            velocity,
            component,
            eps,
            variance: AVERAGED_PART * band_variance(eps),
            steepness: (eps * eps / (STEEP * nu)).powi(2),
            unknowns: [0, 1, 2].map(|axis| body.index_map.unknown_range(component, axis)),
            axes,
            rigid,
        }
    }

    /// Computes the fluxes of the links whose lower faces are in row (j, k). Writes the correction
    /// of these faces: fluxes in, from the previous row and plane, less fluxes out.
    #[inline(always)]
    fn correct_row<V: Vector<Number = f64>>(
        &self,
        [j, k]: [i32; 2],
        planes: &mut LinkPlanes,
        correction: &mut [f64],
    ) {
        let listed = listed_faces(self.body, &self.unknowns, self.component, [j, k]);
        let Some((listed, first_listed)) = listed else {
            return;
        };
        let (at, first) = (self.velocity.row([j, k]), planes.first_entry(j));
        let [a, b, c] = &self.axes;
        let index = [0, j, k];
        let faces = |along| self.advected_faces(along, index);
        let advected = [faces(0), faces(1), faces(2)];
        let rigid = self.rigid.first_of_row([j, k]);
        let row_length = planes.row_length;
        let LinkPlanes { weight, flux_y, flux_z, .. } = planes;
        let [wx, wy, wz] = weight;
        let (wx, wy, wz) =
            (&wx[first..][..row_length], &wy[first..][..row_length], &wz[first..][..row_length]);
        let (fy, fz) = (&mut flux_y[..row_length], &mut flux_z[first..][..row_length]);
        let zero = V::constant(0.0);
        let (mut n, mut last_flux, mut index) = (0, zero, V::ramp());
        while n + V::WIDTH <= row_length {
            let at = at.wrapping_add(n);
            let mut sum = zero;
            if a.exists {
                let flux = self.flux::<V>(0, advected[0], rigid[0], at, index, &wx[n..]);
                sum = flux.shift(last_flux) - flux;
                last_flux = flux;
            }
            if b.exists {
                let flux = self.flux::<V>(1, advected[1], rigid[1], at, index, &wy[n..]);
                sum = sum + (V::load(&fy[n..]) - flux);
                flux.store(&mut fy[n..]);
            }
            if c.exists {
                let flux = self.flux::<V>(2, advected[2], rigid[2], at, index, &wz[n..]);
                sum = sum + (V::load(&fz[n..]) - flux);
                flux.store(&mut fz[n..]);
            }
            // Lanes whose faces are listed.
            let (start, end) = (listed.start.max(n), listed.end.min(n + V::WIDTH));
            if start < end {
                let entry = first_listed + (start - listed.start);
                sum.store_from(start - n, &mut correction[entry..entry + (end - start)]);
            }
            n += V::WIDTH;
            index = index + V::constant(V::WIDTH as f64);
        }
    }

    /// Faces to load for the links along an axis of the row with `index`; first index along x of
    /// the links that have six faces in line, and the index after the last.
    #[inline(always)]
    fn advected_faces(&self, along: usize, index: [i32; 3]) -> (&Stencil<6>, [f64; 2]) {
        let (axis, range, index) = (&self.axes[along], &self.unknowns[along], index[along]);
        let [start, end] = [range.start + 2 - index, range.end - 3 - index];
        if along == 0 {
            (&axis.six_faces, [start, end].map(f64::from))
        } else if start <= 0 && 0 < end {
            (&axis.six_faces, [f64::NEG_INFINITY, f64::INFINITY])
        } else {
            (&axis.two_faces, [0.0; 2])
        }
    }

    /// Correction of the flux through links along an axis, over h [m/s^2]; zero where the weight is
    /// -1. The links have the indices `index` in their row, and six faces in line from `start` to
    /// `end`; their lower faces lie from position `at` on. `u_q` and `u_c` are U_q and U_c of the
    /// first link of the row.
    #[inline(always)]
    fn flux<V: Vector<Number = f64>>(
        &self,
        along: usize,
        (advected, [start, end]): (&Stencil<6>, [f64; 2]),
        [u_q, u_c]: [f64; 2],
        at: usize,
        index: V,
        weights: &[f32],
    ) -> V {
        let (zero, half) = (V::constant(0.0), V::constant(0.5));
        let weight = V::load_from(weights);
        // The weight is NO_LINK = -1 where there is no link, and at least 0 elsewhere.
        let between = V::constant(0.5 * NO_LINK);
        if between.mask_below(weight) == 0 {
            return zero;
        }
        let axis = &self.axes[along];
        let [q, c] = [self.component, along].map(|of| self.velocity.components[of]);
        let [q_0, q_1, below, above, far_below, far_above] = advected.load::<V, R>(q, at);
        let [c_0, c_1] = axis.advecting.load::<V, R>(c, at);
        let both = q_0 + q_1;
        let (q_mean, c_mean) = (half * both, half * (c_0 + c_1));
        let outer = V::constant(-8.0).mul_add(below + above, far_below + far_above);
        let sixth = both.mul_add(V::constant(7.0), outer);
        let higher_order = c_mean * V::constant(1.0 / 60.0) * sixth;
        // Values read beyond the ends of the grid are arbitrary.
        let higher_order = index.select_below(V::constant(end), higher_order, zero);
        let higher_order = index.select_below(V::constant(start), zero, higher_order);
        let mut flux = higher_order;
        // Links outside the band are open: 1/A' - 1 is zero.
        if zero.mask_below(weight) != 0 {
            let [change_q, change_c] = self.rigid.change[0][along].map(V::constant);
            let u_q = index.mul_add(change_q, V::constant(u_q));
            let u_c = index.mul_add(change_c, V::constant(u_c));
            let (q_relative, c_relative) = (q_mean - u_q, c_mean - u_c);
            flux = (q_relative * c_relative).mul_add(weight, higher_order);
            let (limit, excess) = (V::constant(axis.largest_excess), weight * c_relative);
            let size = excess.abs();
            if limit.mask_below(size) != 0 {
                let limited = excess.max(zero - limit).min(limit);
                let limited = q_relative.mul_add(limited, higher_order);
                flux = limit.select_below(size, limited, flux);
            }
        }
        let flux =
            (flux + self.averaged_part::<V>(axis, [q, c], at)) * V::constant(axis.per_spacing);
        between.select_below(weight, flux, zero)
    }

    /// Third term of the flux through links along an axis, times h [m^2/s^2].
    #[inline(always)]
    fn averaged_part<V: Vector<Number = f64>>(
        &self,
        axis: &LinkAxis,
        [q, c]: [&[R]; 2],
        at: usize,
    ) -> V {
        let [product, square] = axis.slopes.products::<V, R>([q, c], at);
        let reduction = square.mul_add(V::constant(self.steepness), V::constant(1.0));
        (product * V::constant(self.variance)).div(reduction)
    }
}

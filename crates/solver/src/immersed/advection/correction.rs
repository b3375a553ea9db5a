//! Correction of the second-order central advection scheme at the links near a grain.
//!
//! A link joins two neighbouring faces of the same component. Two terms correct its flux:
//!
//! 1. A face value near the surface represents the open part of the face only, q = A u. The product
//!    of two such values carries A^2 u u where the flux is A u u. The flux relative to the grain is
//!    therefore divided by the aperture A of the link.
//! 2. The boundary layer is about one cell thick and moves with the grain. Second-order central
//!    differences advect such a profile at about two thirds of its speed. Within two half-widths of
//!    the band around the surface the sixth-order mean of six faces replaces the mean of two.
//!
//! Both are fluxes between two faces, so momentum is conserved
//! (`docs/decisions/0003-advection-next-to-grains.md`). `weights.rs` finds the links, `links.rs`
//! has the formula of the flux, `immersed::reference` the scalar form.

use super::box_velocity::BoxVelocity;
use super::links::ComponentLinks;
use super::weights::LinkPlanes;
use crate::flow::{OldState, Prediction};
use crate::grid::Mesh;
use crate::immersed::geometry::{FaceRow, LocatedBody};
use crate::immersed::kinematics::GrainKinematics;
use crate::math::Real;
use grainwake_simd::{Kernel, Vector, dispatch};

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
    known: &OldState<R>,
    kinematics: &GrainKinematics,
    body: &LocatedBody,
    scratch: &mut AdvectionScratch<R>,
    correction: &mut AdvectionCorrection,
) {
    dispatch(FindCorrection {
        eps,
        mesh: known.mesh,
        kinematics,
        body,
        velocity: BoxVelocity::new(known, body, &mut scratch.copies),
        planes: &mut scratch.planes,
        correction,
    });
}

/// Adds a component of the correction to a part of the prediction.
pub fn add_correction<R: Real>(
    body: &LocatedBody,
    correction: &AdvectionCorrection,
    component: usize,
    prediction: &mut Prediction<R>,
) {
    dispatch(AddCorrection {
        rows: &body.rows[component],
        correction: &correction[component],
        prediction,
    });
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

struct FindCorrection<'a, R> {
    eps: f64,
    mesh: &'a Mesh,
    kinematics: &'a GrainKinematics,
    body: &'a LocatedBody,
    velocity: BoxVelocity<'a, R>,
    planes: &'a mut LinkPlanes,
    correction: &'a mut AdvectionCorrection,
}

impl<R: Real> Kernel for FindCorrection<'_, R> {
    type Number = f64;
    #[inline(always)]
    fn run<V: Vector<Number = f64>>(self) {
        let FindCorrection { eps, mesh, kinematics, body, velocity, planes, correction } = self;
        for (component, correction) in correction.iter_mut().enumerate() {
            correction.resize(body.distance[component].len(), 0.0);
            ComponentLinks::new(eps, mesh, kinematics, body, &velocity, component)
                .correct::<V>(planes, correction);
        }
    }
}

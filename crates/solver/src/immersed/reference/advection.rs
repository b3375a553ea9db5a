//! Correction of the advection at the links near a grain.
//!
//! Legend: d signed distance of a link, A aperture, q advected component, c advecting velocity, U
//! rigid velocity at the middle of the link, h spacing along the link.

use glam::{DVec3, IVec3};

use super::Reference;
use crate::dem::RigidState;
use crate::flow::OldState;
use crate::immersed::advection::{AVERAGED_PART, LARGEST_EXCESS, STEEP};
use crate::immersed::geometry::aperture::reference::inverse_aperture_excess;
use crate::immersed::geometry::aperture::{band_variance, forcing_reach};

impl Reference {
    /// Correction of the advection of a face [m/s^2] next to grain `index`: flux in through the
    /// lower links less flux out through the upper links.
    pub fn correction(
        &self,
        index: usize,
        known: &OldState<f64>,
        kinematics: &RigidState,
        component: usize,
        face: IVec3,
    ) -> f64 {
        let along = |axis: usize| {
            let flux = |lower| self.flux(index, known, kinematics, component, axis, lower);
            flux(face - IVec3::AXES[axis]) - flux(face)
        };
        (0..3).map(along).sum()
    }

    /// Weight 1 / A' - 1 of the link along `axis` from the face `lower` to the next; 0 for open
    /// links, `None` for links without correction.
    pub fn link_weight(
        &self,
        index: usize,
        component: usize,
        axis: usize,
        lower: IVec3,
    ) -> Option<f64> {
        let faces = [lower, lower + IVec3::AXES[axis]];
        if !faces.iter().all(|face| self.is_unknown(component, *face)) {
            return None;
        }
        let [d_0, d_1] = faces.map(|face| self.distance(index, component, face));
        let d = 0.5 * (d_0? + d_1?);
        if d <= -self.eps || d >= forcing_reach(self.eps) {
            return None;
        }
        Some(if d < self.eps { inverse_aperture_excess(d, self.eps) } else { 0.0 })
    }

    /// Correction of the flux through the link along `axis` from the face `lower` to the next, over
    /// h [m/s^2].
    fn flux(
        &self,
        index: usize,
        known: &OldState<f64>,
        kinematics: &RigidState,
        component: usize,
        axis: usize,
        lower: IVec3,
    ) -> f64 {
        let Some(weight) = self.link_weight(index, component, axis, lower) else {
            return 0.0;
        };
        let (h, e) = (self.mesh.spacing[axis], IVec3::AXES[axis]);
        let u = |of: usize, face: IVec3| known.velocity.component(of)[self.at(face)];
        let q = |n: i32| u(component, lower + n * e);
        let c = match axis == component {
            true => 0.5 * (u(axis, lower) + u(axis, lower + e)),
            false => 0.5 * (u(axis, lower + e) + u(axis, lower + e - IVec3::AXES[component])),
        };
        let six_faces = (-2..=3).all(|n| self.is_unknown(component, lower + n * e));
        let sixth_order = match six_faces {
            true => 7.0 * (q(0) + q(1)) - 8.0 * (q(-1) + q(2)) + (q(-2) + q(3)),
            false => 0.0,
        };
        let x_0 = self.position(component, lower);
        let middle = self.nearest_image(index, x_0).lever_arm + 0.5 * h * e.as_dvec3();
        let rigid = kinematics.velocity.at(middle);
        let largest = LARGEST_EXCESS * self.kinematic_viscosity / h;
        let excess = (weight * (c - rigid[axis])).clamp(-largest, largest);
        let spin = kinematics.velocity.angular;
        let averaged = self.averaged_part(known, spin, component, axis, lower);
        (excess * (0.5 * (q(0) + q(1)) - rigid[component]) + c / 60.0 * sixth_order + averaged) / h
    }

    /// Flux relative to a grain with this spin that averages over the band leave out, times h
    /// [m^2/s^2].
    fn averaged_part(
        &self,
        known: &OldState<f64>,
        spin: DVec3,
        component: usize,
        axis: usize,
        lower: IVec3,
    ) -> f64 {
        let u = |of: usize, face: IVec3| known.velocity.component(of)[self.at(face)];
        let e = IVec3::AXES[axis];
        let advected = [lower, lower + e];
        let advecting = match axis == component {
            true => advected,
            false => [lower + e - IVec3::AXES[component], lower + e],
        };
        // Slope of a component along `k` in the middle between two of its faces: the difference of
        // both if they lie along k, else the mean of the central differences around each.
        let slope = |of: usize, [a, b]: [IVec3; 2], k: usize| {
            let step = IVec3::AXES[k];
            let rigid = spin.cross(DVec3::AXES[k])[of];
            let difference = if b - a == step {
                u(of, b) - u(of, a)
            } else {
                0.25 * (u(of, a + step) + u(of, b + step) - u(of, a - step) - u(of, b - step))
            };
            difference / self.mesh.spacing[k] - rigid
        };
        let slopes = [0, 1, 2].map(|k| [slope(component, advected, k), slope(axis, advecting, k)]);
        let product: f64 = slopes.iter().map(|[q, c]| q * c).sum();
        let square: f64 = slopes.iter().flatten().map(|s| s * s).sum();
        let reynolds = square.sqrt() * self.eps * self.eps / self.kinematic_viscosity;
        AVERAGED_PART * band_variance(self.eps) * product / (1.0 + (reynolds / STEEP).powi(2))
    }
}

//! Weights of forced faces, their gain of velocity, and the impulse on the fluid.
//!
//! Legend: d signed distance, n normal, m open depth, M its integral, s weight of the rigid
//! velocity, c closed fraction, C total closed fraction, phi solid fraction, A aperture, U and
//! U_old new and old rigid velocity, J impulse, h spacing, nu kinematic viscosity, p pressure.

use glam::{DVec3, IVec3};

use super::Reference;
use crate::flow::OldState;
use crate::immersed::Scheme;
use crate::immersed::geometry::aperture::forcing_reach;
use crate::immersed::geometry::aperture::reference::{aperture, open_depth, open_depth_integral};
use crate::math::RigidVelocity;

/// Forcing of a face by one grain.
#[derive(Clone, Copy, Default)]
pub struct Weights {
    /// Weight s of the rigid velocity.
    pub weight: f64,
    /// Closed fraction c.
    pub closed_fraction: f64,
    /// Closed fraction C of all grains together.
    pub total_closed_fraction: f64,
    /// Solid fraction phi.
    pub solid_fraction: f64,
}

impl Reference {
    /// Drag coefficient times dt, closed and solid fraction, of a face at the distance `d` and the
    /// mean distance `mean` [m] from a surface with the normal `n`.
    ///
    /// With the discrete Laplacian L of a function of the distance, drag = nu L m / m, and the
    /// closed fraction is 1 - (L M - M L m / m) at the mean distance in the aperture scheme. In the
    /// paper's scheme drag / (1 + drag) is the solid fraction of a cell cut by a plane.
    fn drag(&self, d: f64, mean: f64, n: DVec3) -> [f64; 3] {
        let (eps, h) = (self.eps, self.mesh.spacing);
        if self.scheme == Scheme::Paper {
            let solid_fraction = (0.5 - d / n.abs().dot(h)).clamp(0.0, 1.0);
            return [solid_fraction / (1.0 - solid_fraction), 0.0, 0.0];
        }
        let laplacian = |f: fn(f64, f64) -> f64, d: f64| -> f64 {
            let second = |a: usize| {
                let step = h[a] * n[a];
                (f(d + step, eps) + f(d - step, eps) - 2.0 * f(d, eps)) / h[a].powi(2)
            };
            (0..3).map(second).sum()
        };
        let drag = |d| laplacian(open_depth, d).max(0.0) / open_depth(d, eps);
        let open =
            laplacian(open_depth_integral, mean) - drag(mean) * open_depth_integral(mean, eps);
        let drag = drag(d);
        let closed_fraction = 1.0 - open.clamp(0.0, 1.0);
        [self.kinematic_viscosity * self.dt * drag, closed_fraction, 1.0 - aperture(d, eps)]
    }

    /// Weights of grain `index` on a face at `x`: s = drag / (1 + drag of all grains).
    pub fn weights(&self, index: usize, x: DVec3) -> Weights {
        let eps = self.eps;
        let d = self.nearest_image(index, x).distance;
        let [mut all_drag, mut total_closed_fraction, mut total_solid_fraction] = [0.0; 3];
        let mut forcing = [0.0; 3];
        for other in 0..self.grains.len() {
            let image = self.nearest_image(other, x);
            // A face deep inside another, nearer grain is forced by that grain alone.
            if image.distance <= -eps && image.distance < d {
                return Weights::default();
            }
            if image.distance < forcing_reach(eps) {
                let [drag, closed_fraction, solid_fraction] =
                    self.drag(image.distance, image.mean_distance, image.normal);
                all_drag += drag;
                total_closed_fraction += closed_fraction;
                total_solid_fraction += solid_fraction;
                if other == index {
                    forcing = [drag, closed_fraction, solid_fraction];
                }
            }
        }
        let [drag, closed_fraction, solid_fraction] = forcing;
        if d <= -eps && self.scheme == Scheme::Aperture {
            let [weight, closed_fraction, total_closed_fraction, solid_fraction] = [1.0; 4];
            return Weights { weight, closed_fraction, total_closed_fraction, solid_fraction };
        }
        Weights {
            weight: if drag.is_finite() { drag / (1.0 + all_drag) } else { 1.0 },
            closed_fraction: closed_fraction / total_closed_fraction.max(1.0),
            total_closed_fraction: total_closed_fraction.min(1.0),
            solid_fraction: solid_fraction / total_solid_fraction.max(1.0),
        }
    }

    /// Velocity that a face gains by the rigidity of grain `index` [m/s] (Eqs 4b, 4c), which had
    /// the velocity U_old and an acceleration in the previous step and has U; `predicted` is u* of
    /// the face [m/s].
    pub fn gain(
        &self,
        index: usize,
        known: &OldState<f64>,
        predicted: f64,
        [old, acceleration, new]: [RigidVelocity; 3],
        component: usize,
        face: IVec3,
    ) -> f64 {
        let (h, e) = (self.mesh.spacing, IVec3::AXES[component]);
        let dt = if self.scheme == Scheme::Aperture { self.dt } else { 0.0 };
        let x = self.position(component, face);
        let lever_arm = self.nearest_image(index, x).lever_arm;
        let Weights {
            weight: s,
            closed_fraction: c,
            total_closed_fraction: all,
            solid_fraction: phi,
        } = self.weights(index, x);
        // p~ = p - dt U_old . grad p, at half a spacing above and below the face.
        let moved = |cell: IVec3, lever_arm: DVec3| {
            let (at, velocity) = (self.at(cell), old.at(lever_arm));
            let along = |a: usize| {
                let stride = self.mesh.layout().strides()[a];
                velocity[a] * (known.pressure[at + stride] - known.pressure[at - stride])
                    / (2.0 * h[a])
            };
            known.pressure[at] - dt * (0..3).map(along).sum::<f64>()
        };
        let half = 0.5 * h * DVec3::AXES[component];
        let rise = moved(face, lever_arm + half) - moved(face - e, lever_arm - half);
        let removed = dt / h[component] * rise - dt * known.body_acceleration[component];
        let rest_gain = c * removed - s * (predicted + all * removed);
        let change = phi * (new - old).at(lever_arm)[component]
            + (c - phi) * dt * acceleration.at(lever_arm)[component];
        rest_gain + s * new.at(lever_arm)[component] + (1.0 - s) * change
    }

    /// Impulse J on the fluid by grain `index`, linear [N s] and angular [N m s]: the sum over the
    /// faces of fluid mass times gain.
    pub fn impulse(
        &self,
        index: usize,
        known: &OldState<f64>,
        predicted: [&[f64]; 3],
        motion: [RigidVelocity; 3],
        fluid_density: f64,
    ) -> [DVec3; 2] {
        let fluid_mass = fluid_density * self.mesh.cell_volume();
        let [mut linear, mut angular] = [DVec3::ZERO; 2];
        for component in 0..3 {
            for face in self.faces(component) {
                let image = self.nearest_image(index, self.position(component, face));
                if image.distance < forcing_reach(self.eps) {
                    let u = predicted[component][self.at(face)];
                    let gain = self.gain(index, known, u, motion, component, face);
                    let impulse = fluid_mass * gain * DVec3::AXES[component];
                    linear += impulse;
                    angular += image.lever_arm.cross(impulse);
                }
            }
        }
        [linear, angular]
    }
}

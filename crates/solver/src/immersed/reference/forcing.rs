//! Weights of forced faces, their gain of velocity, and the impulse on the fluid.
//!
//! Legend: d signed distance, n normal, m open depth, M its integral, s weight of the rigid
//! velocity, c closed fraction, C total closed fraction, phi solid fraction, A aperture, U and
//! U_old new and old rigid velocity, J impulse, h spacing, nu kinematic viscosity, p pressure.

use glam::{DVec3, IVec3};

use super::Reference;
use super::geometry::NearestImage;
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

/// Weight of the correction for a gap between two walls: 1 if they are parallel, 0 in a corner.
fn opposed(one: &NearestImage, other: &NearestImage) -> f64 {
    (-one.normal.dot(other.normal)).max(0.0)
}

impl Reference {
    /// L f(d) with the discrete Laplacian L, at the distance `d` [m] from a wall with the normal
    /// `n`.
    fn laplacian(&self, f: fn(f64, f64) -> f64, d: f64, n: DVec3) -> f64 {
        let (eps, h) = (self.eps, self.mesh.spacing);
        let second = |a: usize| {
            let step = h[a] * n[a];
            (f(d + step, eps) + f(d - step, eps) - 2.0 * f(d, eps)) / h[a].powi(2)
        };
        (0..3).map(second).sum()
    }

    /// Drag coefficient times dt, closed and solid fraction, of a face near the surface `image`.
    ///
    /// The drag is nu L m / m, and the closed fraction is 1 - (L M - M L m / m) at the mean
    /// distance in the aperture scheme. In the paper's scheme drag / (1 + drag) is the solid
    /// fraction of a cell cut by a plane.
    fn drag(&self, image: &NearestImage) -> [f64; 3] {
        let (eps, d, mean, n) = (self.eps, image.distance, image.mean_distance, image.normal);
        if self.scheme == Scheme::Paper {
            let solid_fraction = (0.5 - d / n.abs().dot(self.mesh.spacing)).clamp(0.0, 1.0);
            return [solid_fraction / (1.0 - solid_fraction), 0.0, 0.0];
        }
        let drag = |d| self.laplacian(open_depth, d, n).max(0.0) / open_depth(d, eps);
        let open = self.laplacian(open_depth_integral, mean, n)
            - drag(mean) * open_depth_integral(mean, eps);
        let drag = self.kinematic_viscosity * self.dt * drag(d);
        [drag, 1.0 - open.clamp(0.0, 1.0), 1.0 - aperture(d, eps)]
    }

    /// Part of the open depth m(d_1) over the surface `one` that the surface `other` takes [m]:
    /// m(-d_2) between parallel walls, none in a corner.
    fn depth_taken(&self, one: &NearestImage, other: &NearestImage) -> f64 {
        opposed(one, other) * open_depth(-other.distance, self.eps)
    }

    /// Pressure weight between two walls, less the weight 1 - c_1 - c_2 that the sum over single
    /// walls would give. In a gap of the width w the parabola y (w - y) / 2, averaged over the
    /// band, is an exact solution.
    fn opening(&self, [one, other]: [&NearestImage; 2]) -> f64 {
        let (eps, [x, y]) = (self.eps, [one, other].map(|image| image.mean_distance));
        let width = x + y;
        let (m, big_m) = (|d| open_depth(d, eps), |d| open_depth_integral(d, eps));
        let parabola = |d: f64| {
            // y (w - y) / 2 = w r(y) / 2 - r(y)^2 / 2 + w r(y - w) / 2 + r(y - w)^2 / 2 with the
            // ramp r(y) = max(y, 0); its average replaces r by m and r^2 / 2 by M.
            0.5 * width * (m(d) + m(d - width)) - big_m(d) + big_m(d - width)
        };
        let depths = [m(x) - m(-y), m(y) - m(-x)];
        if width <= 0.0 || depths.iter().any(|depth| *depth < 1e-9 * eps) {
            return 0.0;
        }
        let shear = |d, image: &NearestImage| self.laplacian(open_depth, d, image.normal);
        let [shear_x, shear_y] = [shear(x, one), shear(y, other)];
        let driven = |d, image: &NearestImage| self.laplacian(open_depth_integral, d, image.normal);
        // m(-d) = m(d) - d, M(-d) = d^2 / 2 + 2 M(0) - M(d), and L d = 0, L d^2 / 2 = 1.
        let curvature = 0.5 * width * (shear_x + shear_y) - driven(x, one) + 1.0 - driven(y, other);
        let drag = shear_x / depths[0] + shear_y / depths[1];
        let weight = (drag * parabola(x) - curvature).clamp(0.0, 1.0);
        let [c_1, c_2] = [one, other].map(|image| self.drag(image)[1]);
        opposed(one, other) * (weight - (1.0 - c_1 - c_2))
    }

    /// Weights of grain `index` on a face at `x`: s = drag / (1 + drag of all grains).
    pub fn weights(&self, index: usize, x: DVec3) -> Weights {
        let eps = self.eps;
        let own = self.nearest_image(index, x);
        let images = (0..self.grains.len()).map(|other| (other, self.nearest_image(other, x)));
        let near: Vec<(usize, NearestImage)> =
            images.filter(|(_, image)| image.distance < forcing_reach(eps)).collect();
        // A face deep inside another, nearer grain is forced by that grain alone.
        if near.iter().any(|(_, other)| other.distance <= -eps && other.distance < own.distance) {
            return Weights::default();
        }
        if own.distance <= -eps && self.scheme == Scheme::Aperture {
            let [weight, closed_fraction, total_closed_fraction, solid_fraction] = [1.0; 4];
            return Weights { weight, closed_fraction, total_closed_fraction, solid_fraction };
        }
        let [mut all_drag, mut all_closed, mut all_solid, mut open] = [0.0; 4];
        let mut forcing = [0.0; 3];
        for (i, (grain, image)) in near.iter().enumerate() {
            let [mut drag, closed_fraction, solid_fraction] = self.drag(image);
            if self.scheme == Scheme::Aperture && drag > 0.0 {
                let depth = open_depth(image.distance, eps);
                let others = near.iter().enumerate().filter(|(j, _)| *j != i);
                let taken: f64 = others.map(|(_, (_, other))| self.depth_taken(image, other)).sum();
                drag *= depth / (depth - taken).max(0.1 * depth);
                open +=
                    near[..i].iter().map(|(_, other)| self.opening([other, image])).sum::<f64>();
            }
            all_drag += drag;
            all_closed += closed_fraction;
            all_solid += solid_fraction;
            if *grain == index {
                forcing = [drag, closed_fraction, solid_fraction];
            }
        }
        let [drag, closed_fraction, solid_fraction] = forcing;
        let limited =
            |part: f64, all: f64, limit: f64| if all > 0.0 { part / all * limit } else { 0.0 };
        let total_closed_fraction = (all_closed - open).clamp(0.0, 1.0);
        Weights {
            weight: if drag.is_finite() { drag / (1.0 + all_drag) } else { 1.0 },
            closed_fraction: limited(closed_fraction, all_closed, total_closed_fraction),
            total_closed_fraction,
            solid_fraction: limited(solid_fraction, all_solid, all_solid.min(1.0)),
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

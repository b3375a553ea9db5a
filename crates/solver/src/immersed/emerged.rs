//! Part of a grain beyond a free surface: it has neither buoyancy nor displaced fluid.
//!
//! The integrals over the part are sums over sub-volumes of the grain. For each velocity component
//! a, the momentum equations of the fluid hold up to the last faces of that component: up to the
//! surface, or half a cell below it for the component normal to it. The displaced fluid that the
//! equations of motion must not count is therefore
//!
//! E = rho sum_a integral over R_a of q_a q_a^T, with q_a = (e_a, r x e_a),
//!
//! where R_a is the part of the grain beyond these faces.
//!
//! Legend: e_a unit vector of axis a, r vector from the centroid, rho density of the fluid.

use std::collections::HashMap;
use std::sync::Arc;

use glam::DVec3;
use grainwake_shape::Shape;

use crate::dem::Grain;
use crate::math::{Load, Matrix6, Pose, RigidVelocity, Vector6, multiply6};

/// Sub-volumes along each axis of the box around a grain.
const SUBDIVISIONS: usize = 32;

/// Sub-volumes of a grain, in its own frame.
#[derive(Debug)]
pub struct Subvolumes {
    /// Centres [m] and volumes [m^3]; the sum of the volumes is the volume of the grain.
    parts: Vec<(DVec3, f64)>,
    /// Edge lengths of a whole sub-volume [m].
    edges: DVec3,
}

impl Subvolumes {
    /// Divides the box around `shape`; a sub-volume cut by the surface counts in part.
    pub fn of(shape: &Shape) -> Subvolumes {
        let edges = (shape.upper() - shape.lower()) / SUBDIVISIONS as f64;
        let width = edges.max_element();
        let mut parts = Vec::new();
        for n in 0..SUBDIVISIONS.pow(3) {
            let index = [1, SUBDIVISIONS, SUBDIVISIONS.pow(2)].map(|step| n / step % SUBDIVISIONS);
            let index = DVec3::from_array(index.map(|i| i as f64));
            let centre = shape.lower() + edges * (index + 0.5);
            let fraction = (0.5 - shape.distance(centre) / width).clamp(0.0, 1.0);
            if fraction > 0.0 {
                parts.push((centre, fraction));
            }
        }
        let scale = shape.volume() / parts.iter().map(|(_, volume)| volume).sum::<f64>();
        let mut mean = DVec3::ZERO;
        for (centre, volume) in &mut parts {
            *volume *= scale;
            mean += *centre * (*volume / shape.volume());
        }
        // The origin of the frame is the centroid, exactly.
        parts.iter_mut().for_each(|(centre, _)| *centre -= mean);
        Subvolumes { parts, edges }
    }

    /// Sub-volumes of each of `grains`; equal shapes share theirs.
    pub fn of_all(grains: &[Grain]) -> Vec<Arc<Subvolumes>> {
        let mut known: HashMap<*const Shape, Arc<Subvolumes>> = HashMap::new();
        let each = grains.iter().map(|grain| {
            let shape = known.entry(Arc::as_ptr(&grain.shape));
            shape.or_insert_with(|| Arc::new(Subvolumes::of(&grain.shape))).clone()
        });
        each.collect()
    }
}

/// Part of a grain beyond a free surface.
#[derive(Clone, Copy, Debug, Default)]
pub struct EmergedPart {
    /// Volume [m^3].
    pub volume: f64,
    /// Integral over the part of the vector from the centroid of the grain [m^4].
    pub moment: DVec3,
    /// E / rho, the inertia to be left out of the displaced fluid [m^3, m^4, m^5].
    pub inertia: Matrix6,
}

impl EmergedPart {
    /// Part of a grain at `pose` beyond the plane at `coordinate` [m] along `axis`, in the
    /// direction `outward` (-1 or 1); `spacing` [m] is that of the grid along the axis.
    pub fn new(
        subvolumes: &Subvolumes,
        pose: Pose,
        (axis, outward): (usize, f64),
        coordinate: f64,
        spacing: f64,
    ) -> EmergedPart {
        let orientation = pose.orientation;
        let normal = orientation.conjugate() * (outward * DVec3::AXES[axis]);
        // Extent of a sub-volume along the normal of the plane.
        let extent = normal.abs().dot(subvolumes.edges);
        let height = outward * (pose.position[axis] - coordinate);
        let mut part = EmergedPart::default();
        for (centre, volume) in &subvolumes.parts {
            let beyond = height + normal.dot(*centre);
            let emerged = |limit: f64| volume * (0.5 + (beyond - limit) / extent).clamp(0.0, 1.0);
            let (whole, normal_part) = (emerged(0.0), emerged(-0.5 * spacing));
            if normal_part == 0.0 {
                continue;
            }
            let r = orientation * *centre;
            part.volume += whole;
            part.moment += whole * r;
            for a in 0..3 {
                let weight = if a == axis { normal_part } else { whole };
                let q = RigidVelocity { linear: DVec3::AXES[a], angular: r.cross(DVec3::AXES[a]) }
                    .to_vector();
                for (row, left) in part.inertia.iter_mut().zip(q) {
                    for (entry, right) in row.iter_mut().zip(q) {
                        *entry += weight * left * right;
                    }
                }
            }
        }
        part
    }
}

/// Effects of the part of a grain beyond a free surface.
#[derive(Clone, Copy, Debug)]
pub struct EmergedLoads {
    /// Inertia of the fluid that this part does not displace.
    pub inertia: Matrix6,
    /// Rate of change of the momentum of this fluid at constant velocities, by its rotation.
    turning: Load,
    /// Load of the pressure at the surface.
    pub pressure: Load,
}

impl EmergedLoads {
    /// Effects of `part` under the load of the `pressure` at the surface; `omega` [rad/s] is the
    /// angular velocity at the middle of the step.
    pub fn new(
        part: &EmergedPart,
        pressure: Load,
        omega: DVec3,
        fluid_density: f64,
    ) -> EmergedLoads {
        let inertia = part.inertia.map(|row| row.map(|entry| fluid_density * entry));
        let row = |n: usize| DVec3::from_slice(&inertia[n][3..]).dot(omega);
        let turning = Load {
            force: fluid_density * omega.cross(omega.cross(part.moment)),
            torque: omega.cross(DVec3::new(row(3), row(4), row(5))),
        };
        EmergedLoads { inertia, turning, pressure }
    }

    /// Change of the momentum of this fluid if the velocities change by `change` in `dt` [s].
    pub fn momentum(&self, change: RigidVelocity, dt: f64) -> Vector6 {
        let mut momentum = multiply6(&self.inertia, &change.to_vector());
        let turning = [self.turning.force, self.turning.torque];
        for (n, momentum) in momentum.iter_mut().enumerate() {
            *momentum += dt * turning[n / 3][n % 3];
        }
        momentum
    }
}

#[cfg(test)]
mod tests {
    use glam::DQuat;
    use grainwake_shape::{ShapeOptions, analytic};

    use super::*;

    fn relative(found: f64, expected: f64) -> f64 {
        (found / expected - 1.0).abs()
    }

    #[test]
    fn the_cap_of_a_sphere_has_its_volume_and_centroid() {
        let pi = std::f64::consts::PI;
        let shape = Shape::sphere(1.0, 200);
        let subvolumes = Subvolumes::of(&shape);
        let grain = Grain::new(shape, 1.0)
            .with_orientation(DQuat::from_scaled_axis(DVec3::new(0.3, -0.5, 0.8)));
        for height in [0.4, 1.0, 1.5] {
            // The plane cuts off a cap of this height at the lower side along y.
            let part = EmergedPart::new(&subvolumes, grain.pose, (1, -1.0), height - 1.0, 1e-9);
            let volume = pi * height * height * (3.0 - height) / 3.0;
            let centroid = -0.75 * (2.0 - height) * (2.0 - height) / (3.0 - height);
            assert!(relative(part.volume, volume) < 0.01, "{height}: {}", part.volume);
            assert!((part.moment.y / part.volume - centroid).abs() < 0.01, "{height}: {part:?}");
            assert!(relative(part.inertia[0][0], volume) < 0.01);
        }
    }

    #[test]
    fn a_grain_beyond_the_surface_leaves_out_its_whole_inertia() {
        let shape = analytic::ellipsoid(1.0, 0.7, 0.5, &ShapeOptions::default()).unwrap();
        let subvolumes = Subvolumes::of(&shape);
        let grain = Grain::new(shape, 1.0)
            .with_position(DVec3::new(0.0, 0.0, 5.0))
            .with_orientation(DQuat::from_scaled_axis(DVec3::new(0.3, -0.5, 0.8)));
        let part = EmergedPart::new(&subvolumes, grain.pose, (2, 1.0), 0.0, 0.1);
        let volume = grain.shape.volume();
        assert!(relative(part.volume, volume) < 1e-12);
        assert!(part.moment.length() < 1e-12);
        let inertia = grain.inertia();
        for row in 0..3 {
            assert!(relative(part.inertia[row][row], volume) < 1e-12);
            for column in 0..3 {
                let found = part.inertia[3 + row][3 + column];
                let difference = found - inertia.col(column)[row];
                assert!(difference.abs() < 0.01 * inertia.col(row)[row], "{row} {column}");
            }
        }
    }
}

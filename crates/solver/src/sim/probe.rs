//! Velocity and vorticity at cells and points, from the faces of the staggered grid.

use glam::DVec3;

use crate::flow::Boundaries;
use crate::grid::{FACE_OFFSET, FaceVector, Mesh};
use crate::math::Real;

/// Velocity field with its ghosts and the grid it lives on.
pub(super) struct Probe<'a, R> {
    pub velocity: &'a FaceVector<R>,
    pub mesh: &'a Mesh,
    pub boundaries: &'a Boundaries,
}

impl<R: Real> Probe<'_, R> {
    /// Component of the face at a position in memory [m/s].
    fn face(&self, component: usize, at: usize) -> f64 {
        self.velocity.component(component)[at].wide()
    }

    /// Mean of the two faces along each axis of cell (i, j, k), counted from 0 [m/s].
    pub fn velocity_at(&self, cell: [usize; 3]) -> DVec3 {
        let layout = self.mesh.layout();
        let [i, j, k] = cell.map(|i| i + 1);
        let (at, strides) = (layout.index(i, j, k), layout.strides());
        let mean = |axis: usize| 0.5 * (self.face(axis, at) + self.face(axis, at + strides[axis]));
        DVec3::new(mean(0), mean(1), mean(2))
    }

    /// Vorticity [1/s] at the centre of cell (i, j, k), counted from 0: mean over the four edges
    /// along each axis.
    pub fn vorticity_at(&self, cell: [usize; 3]) -> DVec3 {
        let h = self.mesh.spacing;
        let layout = self.mesh.layout();
        let strides = layout.strides();
        let [i, j, k] = cell.map(|i| i + 1);
        let at = layout.index(i, j, k);
        // On the edge normal to b and c at the lower corner of a cell: d u_c / d b - d u_b / d c.
        let edge = |b: usize, c: usize, at: usize| {
            let derivative = |component: usize, along: usize| {
                let below = self.face(component, at - strides[along]);
                (self.face(component, at) - below) / h[along]
            };
            derivative(c, b) - derivative(b, c)
        };
        let mean = |b: usize, c: usize| {
            let (next_b, next_c) = (strides[b], strides[c]);
            0.25 * (edge(b, c, at)
                + edge(b, c, at + next_b)
                + edge(b, c, at + next_c)
                + edge(b, c, at + next_b + next_c))
        };
        DVec3::new(mean(1, 2), mean(2, 0), mean(0, 1))
    }

    /// Velocity [m/s] at a point by trilinear interpolation of each component; `None` outside the
    /// box.
    pub fn interpolate_velocity(&self, x: DVec3) -> Option<DVec3> {
        let mut velocity = DVec3::ZERO;
        for component in 0..3 {
            velocity[component] = self.interpolate(component, x)?;
        }
        Some(velocity)
    }

    fn interpolate(&self, component: usize, x: DVec3) -> Option<f64> {
        let mesh = self.mesh;
        let strides = mesh.layout().strides();
        let (mut lowest, mut weight, mut flat) = (0, [0.0; 3], [false; 3]);
        for axis in 0..3 {
            let n = mesh.cells[axis];
            if n == 1 {
                lowest += strides[axis];
                flat[axis] = true;
                continue;
            }
            let mut s = (x[axis] - mesh.origin[axis]) / mesh.spacing[axis];
            if self.boundaries.is_periodic(axis) {
                s = s.rem_euclid(n as f64);
            }
            if !(0.0..=n as f64).contains(&s) {
                return None;
            }
            let s = s - FACE_OFFSET[component][axis] + 1.0;
            let i = (s.floor() as usize).min(n);
            lowest += i * strides[axis];
            weight[axis] = s - i as f64;
        }
        let mut value = 0.0;
        for corner in 0..8usize {
            let (mut share, mut at) = (1.0, lowest);
            for axis in 0..3 {
                let upper = corner >> axis & 1 == 1;
                if flat[axis] && upper {
                    share = 0.0;
                } else if upper {
                    share *= weight[axis];
                    at += strides[axis];
                } else {
                    share *= 1.0 - weight[axis];
                }
            }
            if share != 0.0 {
                value += share * self.face(component, at);
            }
        }
        Some(value)
    }
}

//! Reading the fields: values at cells and points.

use glam::DVec3;

use super::Simulation;
use crate::dem::Grain;
use crate::grid::{FACE_OFFSET, GlobalCell};

/// Cells near a surface are cut into so many along each axis.
const PARTS: usize = 4;

impl Simulation {
    /// Cell-centred velocity [m/s] of cell (i, j, k), counted from 0; zero without fluid.
    pub fn velocity_at(&self, cell: [usize; 3]) -> DVec3 {
        let Some(fluid) = &self.fluid else {
            return DVec3::ZERO;
        };
        let layout = self.setup.mesh.layout();
        let [i, j, k] = cell.map(|i| i + 1);
        let (at, strides) = (layout.index(i, j, k), layout.strides());
        let mean = |axis: usize| {
            0.5 * (fluid.velocity(axis, at) + fluid.velocity(axis, at + strides[axis]))
        };
        DVec3::new(mean(0), mean(1), mean(2))
    }
    /// Vorticity [1/s] at the centre of cell (i, j, k), counted from 0: mean of the four edges.
    pub fn vorticity_at(&self, cell: [usize; 3]) -> DVec3 {
        let Some(fluid) = &self.fluid else {
            return DVec3::ZERO;
        };
        let h = self.setup.mesh.spacing;
        let layout = self.setup.mesh.layout();
        let strides = layout.strides();
        let [i, j, k] = cell.map(|i| i + 1);
        let at = layout.index(i, j, k);
        // Edge (b, c) at the lower corner of a cell: d u_c / d b - d u_b / d c.
        let edge = |b: usize, c: usize, at: usize| {
            let rise = |component: usize, along: usize| {
                let q = |at: usize| fluid.velocity(component, at);
                (q(at) - q(at - strides[along])) / h[along]
            };
            rise(c, b) - rise(b, c)
        };
        let mean = |b: usize, c: usize| {
            let (up, across) = (strides[b], strides[c]);
            0.25 * (edge(b, c, at)
                + edge(b, c, at + up)
                + edge(b, c, at + across)
                + edge(b, c, at + up + across))
        };
        DVec3::new(mean(1, 2), mean(2, 0), mean(0, 1))
    }
    /// Dynamic pressure [Pa] of cell (i, j, k), counted from 0.
    pub fn pressure_at(&self, cell: [usize; 3]) -> f64 {
        let [i, j, k] = cell.map(|i| i + 1);
        let density = self.setup.fluid.map_or(0.0, |fluid| fluid.density);
        let at = self.setup.mesh.layout().index(i, j, k);
        let pressure = self.fluid.as_ref().map(|fluid| fluid.pressure(at));
        density * pressure.unwrap_or(0.0)
    }
    /// Part of the volume of cell (i, j, k), counted from 0, that is solid. Cells near a surface are cut
    /// into smaller ones, and each of these by the plane through the nearest surface.
    pub fn solid_fraction_at(&self, cell: [usize; 3]) -> f64 {
        let mesh = &self.setup.mesh;
        let x = mesh.position([0.5; 3], GlobalCell(cell.map(|i| i + 1)));
        let extent = mesh.extent();
        // A box of one cell along an axis is seen in its middle plane.
        let parts = mesh.cells.map(|n| if n > 1 { PARTS } else { 1 });
        let edge = DVec3::from_array([0, 1, 2].map(|axis| {
            let resolved = mesh.cells[axis] > 1;
            if resolved { mesh.spacing[axis] } else { 0.0 }
        }));
        let mut near: Vec<(&Grain, DVec3)> = Vec::new();
        for grain in &self.setup.grains {
            let mut arm = x - grain.pose.position;
            for axis in 0..3 {
                if self.setup.boundaries.is_periodic(axis) && mesh.cells[axis] > 1 {
                    arm[axis] -= (arm[axis] / extent[axis]).round() * extent[axis];
                }
            }
            let reach = grain.shape.bounding_radius() + mesh.spacing.length();
            if arm.length_squared() > reach * reach {
                continue;
            }
            let back = grain.pose.orientation.conjugate();
            let (d, _) = grain.shape.distance_and_gradient(back * arm);
            // The distance changes by no more than the way to the farthest corner.
            if d <= -0.5 * edge.length() {
                return 1.0;
            }
            if d < 0.5 * edge.length() {
                near.push((grain, arm));
            }
        }
        if near.is_empty() {
            return 0.0;
        }
        let part = edge / DVec3::from_array(parts.map(|n| n as f64));
        let thinnest = (0..3)
            .filter(|axis| part[*axis] > 0.0)
            .map(|axis| part[axis])
            .fold(f64::INFINITY, f64::min);
        let place =
            |i: usize, axis: usize| (i as f64 + 0.5 - 0.5 * parts[axis] as f64) * part[axis];
        let mut sum = 0.0;
        for (i, j, k) in (0..parts[0])
            .flat_map(|i| (0..parts[1]).flat_map(move |j| (0..parts[2]).map(move |k| (i, j, k))))
        {
            let offset = DVec3::new(place(i, 0), place(j, 1), place(k, 2));
            let share = near.iter().map(|(grain, arm)| {
                let turn = grain.pose.orientation;
                let point = turn.conjugate() * (*arm + offset);
                let (d, gradient) = grain.shape.distance_and_gradient(point);
                let normal = turn * gradient.normalize_or_zero();
                let width = normal.abs().dot(part).max(thinnest);
                (0.5 - d / width).clamp(0.0, 1.0)
            });
            sum += share.fold(0.0, f64::max);
        }
        sum / parts.iter().product::<usize>() as f64
    }

    /// Velocity [m/s] at a point by trilinear interpolation of each component; `None` outside the
    /// box or without fluid.
    pub fn interpolate_velocity(&self, x: DVec3) -> Option<DVec3> {
        let fluid = self.fluid.as_ref()?;
        let mesh = &self.setup.mesh;
        let layout = mesh.layout();
        let strides = layout.strides();
        let mut velocity = DVec3::ZERO;
        for (component, offset) in FACE_OFFSET.iter().enumerate() {
            let mut at = 0;
            let mut weight = [0.0; 3];
            let mut flat = [false; 3];
            for axis in 0..3 {
                let n = mesh.cells[axis];
                if n == 1 {
                    at += strides[axis];
                    flat[axis] = true;
                    continue;
                }
                let mut s = (x[axis] - mesh.origin[axis]) / mesh.spacing[axis];
                if self.setup.boundaries.is_periodic(axis) {
                    s = s.rem_euclid(n as f64);
                }
                if !(0.0..=n as f64).contains(&s) {
                    return None;
                }
                let s = s - offset[axis] + 1.0;
                let i = (s.floor() as usize).min(n);
                at += i * strides[axis];
                weight[axis] = s - i as f64;
            }
            for corner in 0..8usize {
                let (mut share, mut here) = (1.0, at);
                for axis in 0..3 {
                    let upper = corner >> axis & 1 == 1;
                    if flat[axis] && upper {
                        share = 0.0;
                    } else if upper {
                        share *= weight[axis];
                        here += strides[axis];
                    } else {
                        share *= 1.0 - weight[axis];
                    }
                }
                if share != 0.0 {
                    velocity[component] += share * fluid.velocity(component, here);
                }
            }
        }
        Some(velocity)
    }
}

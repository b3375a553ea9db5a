//! Velocity, vorticity and pressure at cells and points, from the staggered grid.
//!
//! Interpolation is trilinear, each component between its own faces and the pressure between cell
//! centres. Half a cell next to a side of the box has values on one side only. There a velocity
//! that the side prescribes is the second value; all others are extrapolated from the two nearest
//! values. Linear fields are therefore exact in the whole box.

use glam::DVec3;

use crate::flow::{Boundaries, Boundary};
use crate::grid::{FACE_OFFSET, FaceVector, Mesh};
use crate::math::Real;

/// Offset of a cell centre from the lower corner in units of the spacing.
const CENTRE_OFFSET: [f64; 3] = [0.5; 3];

/// Grid of the box, on whose values points are interpolated.
#[derive(Clone, Copy)]
pub(super) struct SampledGrid<'a> {
    pub mesh: &'a Mesh,
    pub boundaries: &'a Boundaries,
}

/// Value next to a point along one axis.
#[derive(Clone, Copy)]
enum Node {
    /// Layer of the grid, counted from 1; 0 and n + 1 are the neighbours across a periodic box.
    Layer(usize),
    /// Value that the side of the box prescribes.
    Side(f64),
}

/// The two values next to a point along one axis.
#[derive(Clone, Copy)]
struct Segment {
    nodes: [Node; 2],
    /// Weight of the second value.
    weight: f64,
}

impl SampledGrid<'_> {
    /// Interpolates the values at `offset` in the cells; `side` gives the value that a side of an
    /// axis prescribes. `None` outside the box.
    fn interpolate(
        self,
        offset: [f64; 3],
        x: DVec3,
        side: impl Fn(usize, usize) -> Option<f64>,
        value: impl Fn([usize; 3]) -> f64,
    ) -> Option<f64> {
        let mut segments = [Segment { nodes: [Node::Layer(1); 2], weight: 0.0 }; 3];
        for axis in 0..3 {
            segments[axis] = self.segment(axis, offset[axis], x[axis], |s| side(axis, s))?;
        }
        let mut sum = 0.0;
        for corner in 0..8usize {
            let (mut share, mut cell, mut prescribed) = (1.0, [1; 3], None);
            for (axis, Segment { nodes, weight }) in segments.iter().enumerate() {
                let upper = corner >> axis & 1;
                share *= if upper == 1 { *weight } else { 1.0 - weight };
                match nodes[upper] {
                    Node::Layer(layer) => cell[axis] = layer,
                    Node::Side(value) => prescribed = prescribed.or(Some(value)),
                }
            }
            if share != 0.0 {
                sum += share * prescribed.unwrap_or_else(|| value(cell));
            }
        }
        Some(sum)
    }

    /// The values next to a coordinate [m] along `axis`; `None` outside the box.
    fn segment(
        self,
        axis: usize,
        offset: f64,
        coordinate: f64,
        side: impl Fn(usize) -> Option<f64>,
    ) -> Option<Segment> {
        let n = self.mesh.cells[axis];
        let layers = |i: usize, weight: f64| Segment { nodes: [i, i + 1].map(Node::Layer), weight };
        if n == 1 {
            // The value of a flat axis is that of its only layer.
            return Some(layers(1, 0.0));
        }
        let periodic = self.boundaries.is_periodic(axis);
        let mut s = (coordinate - self.mesh.origin[axis]) / self.mesh.spacing[axis];
        if periodic {
            s = s.rem_euclid(n as f64);
        }
        if !(0.0..=n as f64).contains(&s) {
            return None;
        }
        let s = s - offset + 1.0;
        let i = (s.floor() as usize).min(n);
        if periodic || offset == 0.0 || (1..n).contains(&i) {
            return Some(layers(i, s - i as f64));
        }
        // Half a cell next to a side.
        Some(match (i, side(usize::from(i > 0))) {
            (0, Some(value)) => {
                Segment { nodes: [Node::Side(value), Node::Layer(1)], weight: 2.0 * (s - 0.5) }
            }
            (0, None) => layers(1, s - 1.0),
            (_, Some(value)) => {
                Segment { nodes: [Node::Layer(n), Node::Side(value)], weight: 2.0 * (s - n as f64) }
            }
            (_, None) => layers(n - 1, s - (n - 1) as f64),
        })
    }

    /// Interpolates values at the cell centres; `value` takes a cell (i, j, k), counted from 0.
    /// `None` outside the box.
    pub fn interpolate_cells(self, x: DVec3, value: impl Fn([usize; 3]) -> f64) -> Option<f64> {
        let cells = self.mesh.cells;
        let across = |layer: usize, n: usize| (layer + n - 1) % n;
        let inside = |cell: [usize; 3]| [0, 1, 2].map(|axis| across(cell[axis], cells[axis]));
        self.interpolate(CENTRE_OFFSET, x, |_, _| None, |cell| value(inside(cell)))
    }
}

/// Velocity field with its ghosts and its grid.
pub(super) struct Probe<'a, R> {
    pub velocity: &'a FaceVector<R>,
    pub grid: SampledGrid<'a>,
}

impl<R: Real> Probe<'_, R> {
    /// Component of the face at a position in memory [m/s].
    fn face(&self, component: usize, at: usize) -> f64 {
        self.velocity.component(component)[at].wide()
    }

    /// Mean of the two faces along each axis of cell (i, j, k), counted from 0 [m/s].
    pub fn velocity_at(&self, cell: [usize; 3]) -> DVec3 {
        let layout = self.grid.mesh.layout();
        let [i, j, k] = cell.map(|i| i + 1);
        let (at, strides) = (layout.index(i, j, k), layout.strides());
        let mean = |axis: usize| 0.5 * (self.face(axis, at) + self.face(axis, at + strides[axis]));
        DVec3::new(mean(0), mean(1), mean(2))
    }

    /// Vorticity [1/s] at the centre of cell (i, j, k), counted from 0: mean over the four edges
    /// along each axis.
    pub fn vorticity_at(&self, cell: [usize; 3]) -> DVec3 {
        let h = self.grid.mesh.spacing;
        let layout = self.grid.mesh.layout();
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

    /// Velocity [m/s] at a point; `None` outside the box.
    pub fn interpolate_velocity(&self, x: DVec3) -> Option<DVec3> {
        let layout = self.grid.mesh.layout();
        let mut velocity = DVec3::ZERO;
        for component in 0..3 {
            let side = |axis: usize, side: usize| match self.grid.boundaries.0[axis][side] {
                Boundary::Wall { velocity } | Boundary::Inflow { velocity } => {
                    Some(velocity[component])
                }
                _ => None,
            };
            let face = |[i, j, k]: [usize; 3]| self.face(component, layout.index(i, j, k));
            velocity[component] = self.grid.interpolate(FACE_OFFSET[component], x, side, face)?;
        }
        Some(velocity)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SLIP: [Boundary; 2] = [Boundary::Slip; 2];

    /// Deviation of the interpolated velocity from `field` in the whole box, corners and sides
    /// included. Ghosts that a side fills are NaN, so that a stencil must not read them.
    fn largest_error(boundaries: Boundaries, field: impl Fn(DVec3) -> DVec3) -> f64 {
        let mesh = Mesh {
            cells: [4, 5, 3],
            spacing: DVec3::new(0.1, 0.2, 0.3),
            origin: DVec3::new(-0.2, 1.0, 0.5),
        };
        let layout = mesh.layout();
        let mut velocity = FaceVector::<f64>::zeros(&mesh);
        velocity.fill(DVec3::NAN);
        for component in 0..3 {
            let mut upper = mesh.cells;
            upper[component] += 1;
            let values = velocity.component_mut(component);
            for k in 1..=upper[2] {
                for j in 1..=upper[1] {
                    for i in 1..=upper[0] {
                        let offset = FACE_OFFSET[component];
                        let x = mesh.position(offset, [i, j, k]);
                        values[layout.index(i, j, k)] = field(x)[component];
                    }
                }
            }
            for axis in (0..3).filter(|axis| boundaries.is_periodic(*axis)) {
                layout.wrap(velocity.component_mut(component), axis);
            }
        }
        let grid = SampledGrid { mesh: &mesh, boundaries: &boundaries };
        let probe = Probe { velocity: &velocity, grid };
        let mut largest = 0.0_f64;
        for n in 0..11 * 11 * 11 {
            let part = DVec3::new((n % 11) as f64, (n / 11 % 11) as f64, (n / 121) as f64) / 10.0;
            let x = mesh.origin + part * mesh.extent();
            let found = probe.interpolate_velocity(x).unwrap();
            let error = (found - field(x)).abs().max_element();
            assert!(error.is_finite(), "{x}: {found}");
            largest = largest.max(error);
        }
        assert!(probe.interpolate_velocity(mesh.upper() + 1e-3).is_none());
        largest
    }

    #[test]
    fn linear_velocities_are_exact_up_to_free_sides() {
        let field = |x: DVec3| {
            DVec3::new(
                1.0 + 2.0 * x.x - 3.0 * x.y + 0.5 * x.z,
                -2.0 + x.x + x.y + x.z,
                0.3 - x.x + 4.0 * x.y - 7.0 * x.z,
            )
        };
        let error = largest_error(Boundaries([SLIP; 3]), field);
        assert!(error < 1e-13, "{error:e}");
    }

    #[test]
    fn a_shear_flow_is_exact_up_to_its_walls() {
        // The walls along z move with the fluid at their heights.
        let shear = |x: DVec3| DVec3::new(3.0 * (x.z - 0.5), -2.0 * (x.z - 0.5), 0.0);
        let wall = |z: f64| Boundary::Wall { velocity: shear(DVec3::new(0.0, 0.0, z)) };
        let periodic = [Boundary::Periodic; 2];
        let walls = [wall(0.5), wall(1.4)];
        let error = largest_error(Boundaries([periodic, periodic, walls]), shear);
        assert!(error < 1e-13, "{error:e}");
    }

    #[test]
    fn linear_values_at_cells_are_exact_in_the_whole_box() {
        let mesh = Mesh {
            cells: [4, 1, 3],
            spacing: DVec3::new(0.1, 0.2, 0.3),
            origin: DVec3::new(-0.2, 1.0, 0.5),
        };
        let boundaries = Boundaries([SLIP, [Boundary::Periodic; 2], SLIP]);
        let grid = SampledGrid { mesh: &mesh, boundaries: &boundaries };
        let field = |x: DVec3| 4.0 - x.x + 2.0 * x.z;
        let value = |cell: [usize; 3]| field(mesh.position(CENTRE_OFFSET, cell.map(|i| i + 1)));
        for part in [DVec3::ZERO, DVec3::splat(0.37), DVec3::ONE] {
            let x = mesh.origin + part * mesh.extent();
            let found = grid.interpolate_cells(x, value).unwrap();
            assert!((found - field(x)).abs() < 1e-13, "{x}: {found}");
        }
    }
}

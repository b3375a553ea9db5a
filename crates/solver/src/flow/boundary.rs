//! What happens at each of the six faces of the box (Eq. 4a).

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::grid::{Centre, FaceVector, Field, Mesh};
use crate::poisson::Ends;

/// Condition on one face of the box.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Boundary {
    /// The opposite face is its neighbour; both faces of the axis must say so.
    Periodic,
    /// No-slip wall moving in its own plane at `velocity` [m/s] (zero: a wall at rest).
    Wall {
        /// Velocity of the wall [m/s]; its normal component must be zero.
        velocity: DVec3,
    },
    /// Frictionless wall.
    Slip,
    /// Flat stress-free lid; for the flow the same as `Slip`, but grains may not lean on it.
    FreeSurface,
    /// Fluid enters at this velocity [m/s].
    Inflow {
        /// Velocity of the entering fluid [m/s].
        velocity: DVec3,
    },
    /// Convective outflow, corrected so that the box keeps its mass.
    Outflow,
}

impl Boundary {
    /// A no-slip wall at rest.
    pub const WALL: Boundary = Boundary::Wall {
        velocity: DVec3::ZERO,
    };

    /// Whether a grain is stopped by this face.
    pub fn is_solid(&self) -> bool {
        matches!(self, Boundary::Wall { .. } | Boundary::Slip)
    }
}

/// The six faces: `[axis][0]` lower, `[axis][1]` upper.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Boundaries(pub [[Boundary; 2]; 3]);

impl Boundaries {
    /// Whether `axis` is periodic.
    pub fn is_periodic(&self, axis: usize) -> bool {
        self.0[axis][0] == Boundary::Periodic
    }

    /// Axes whose lower boundary face is given, not an unknown.
    pub fn walled(&self) -> [bool; 3] {
        [0, 1, 2].map(|axis| !self.is_periodic(axis))
    }

    /// Conditions on the pressure that go with the faces.
    pub fn pressure_ends(&self) -> [Ends; 3] {
        [0, 1, 2].map(|axis| {
            if self.is_periodic(axis) {
                Ends::Periodic
            } else {
                Ends::Neumann
            }
        })
    }

    /// Sets the normal velocity on every face where it is given; outflow faces keep theirs.
    pub fn set_normal(&self, velocity: &mut FaceVector) {
        let layout = velocity.x.layout();
        self.for_sides(|axis, side, boundary| {
            let face = if side == 0 { 1 } else { layout.cells[axis] + 1 };
            let normal = velocity.component_mut(axis);
            match boundary {
                Boundary::Periodic => layout.wrap(normal, axis),
                Boundary::Outflow => {}
                Boundary::Wall { .. } | Boundary::Slip | Boundary::FreeSurface => {
                    layout.map_layer(normal, axis, face, face, |_| 0.0);
                }
                Boundary::Inflow { velocity: given } => {
                    layout.map_layer(normal, axis, face, face, |_| given[axis]);
                }
            }
        });
    }

    /// Fills the ghost layers of a velocity whose interior and boundary faces are set.
    pub fn fill_ghosts(&self, velocity: &mut FaceVector) {
        let layout = velocity.x.layout();
        self.for_sides(|axis, side, boundary| {
            let n = layout.cells[axis];
            let (ghost, inner) = if side == 0 { (0, 1) } else { (n + 1, n) };
            for component in 0..3 {
                let q = velocity.component_mut(component);
                match boundary {
                    Boundary::Periodic => layout.wrap(q, axis),
                    // The boundary face itself is set; only the lower side has a ghost beyond it,
                    // and no interior face reads that.
                    _ if component == axis && side == 1 => {}
                    _ if component == axis => {
                        layout.map_layer(q, axis, inner, ghost, |value| value)
                    }
                    Boundary::Wall { velocity: given } | Boundary::Inflow { velocity: given } => {
                        // A parabola through the wall: the shear at the wall is of second order.
                        let wall = given[component];
                        if n == 1 {
                            layout.map_layer(q, axis, inner, ghost, |near| 2.0 * wall - near);
                        } else {
                            let next = if side == 0 { 2 } else { n - 1 };
                            layout.map_layers(q, axis, [inner, next], ghost, |[near, next]| {
                                (8.0 * wall - 6.0 * near + next) / 3.0
                            });
                        }
                    }
                    Boundary::Slip | Boundary::FreeSurface | Boundary::Outflow => {
                        layout.map_layer(q, axis, inner, ghost, |value| value);
                    }
                }
            }
        });
    }

    /// Fills the ghost layers of the pressure or its increment: zero normal gradient or periodic.
    pub fn fill_pressure(&self, pressure: &mut Field<Centre>) {
        for axis in 0..3 {
            let n = pressure.layout().cells[axis];
            if self.is_periodic(axis) {
                pressure.wrap(axis);
            } else {
                pressure.copy_layer(axis, 1, 0);
                pressure.copy_layer(axis, n, n + 1);
            }
        }
    }

    /// Moves the outflow faces of `next` by convection, d q / dt + C d q / d n = 0 with C the mean
    /// speed through the face, then shifts them all by one speed so that inflow equals outflow.
    /// `next` has its other boundary faces set. Without an outflow nothing is done.
    pub fn convect_outflow(&self, mesh: &Mesh, now: &FaceVector, next: &mut FaceVector, dt: f64) {
        let (mut net, mut open) = (0.0, 0.0);
        self.for_sides(|axis, side, boundary| {
            let n = mesh.cells[axis];
            let (face, inner) = if side == 0 { (1, 2) } else { (n + 1, n) };
            let outward = if side == 0 { -1.0 } else { 1.0 };
            let faces = BoundaryFaces::new(mesh, axis, face, inner);
            if boundary == Boundary::Outflow {
                let old = now.component(axis);
                let speed = (outward * faces.sum(old) / faces.count as f64).max(0.0);
                let courant = (speed * dt / mesh.spacing[axis]).min(1.0);
                let new = next.component_mut(axis);
                faces.each(|at, inside| new[at] = old[at] - courant * (old[at] - old[inside]));
                open += faces.area();
            }
            if boundary != Boundary::Periodic {
                net +=
                    outward * faces.sum(next.component(axis)) * faces.area() / faces.count as f64;
            }
        });
        if open > 0.0 {
            let shift = net / open;
            self.for_sides(|axis, side, boundary| {
                if boundary == Boundary::Outflow {
                    let face = if side == 0 { 1 } else { mesh.cells[axis] + 1 };
                    let outward = if side == 0 { -1.0 } else { 1.0 };
                    let new = next.component_mut(axis);
                    BoundaryFaces::new(mesh, axis, face, face)
                        .each(|at, _| new[at] -= outward * shift);
                }
            });
        }
    }

    fn for_sides(&self, mut f: impl FnMut(usize, usize, Boundary)) {
        for axis in 0..3 {
            for side in 0..2 {
                f(axis, side, self.0[axis][side]);
            }
        }
    }
}

/// The faces of one side of the box and their inner neighbours in memory.
struct BoundaryFaces {
    start: usize,
    inward: isize,
    steps: [usize; 2],
    counts: [usize; 2],
    count: usize,
    face_area: f64,
}

impl BoundaryFaces {
    fn new(mesh: &Mesh, axis: usize, face: usize, inner: usize) -> BoundaryFaces {
        let layout = mesh.layout();
        let mut first = [1; 3];
        first[axis] = face;
        let [a, b] = [(axis + 1) % 3, (axis + 2) % 3];
        let strides = layout.strides();
        BoundaryFaces {
            start: layout.index(first[0], first[1], first[2]),
            inward: (inner as isize - face as isize) * strides[axis] as isize,
            steps: [strides[a], strides[b]],
            counts: [mesh.cells[a], mesh.cells[b]],
            count: mesh.cells[a] * mesh.cells[b],
            face_area: mesh.spacing[a] * mesh.spacing[b],
        }
    }
    fn area(&self) -> f64 {
        self.count as f64 * self.face_area
    }
    fn each(&self, mut f: impl FnMut(usize, usize)) {
        for b in 0..self.counts[1] {
            for a in 0..self.counts[0] {
                let at = self.start + a * self.steps[0] + b * self.steps[1];
                f(at, at.wrapping_add_signed(self.inward));
            }
        }
    }
    fn sum(&self, values: &[f64]) -> f64 {
        let mut sum = 0.0;
        self.each(|at, _| sum += values[at]);
        sum
    }
}

//! Normal velocity on open sides of the box: convective outflow, and faces that a grain covers
//! while it crosses the side.
//!
//! An outflow face follows dq/dt + C dq/dn = 0. A face of an outflow or of a free surface that a
//! grain covers has the velocity of the grain. All faces left open are then shifted by one
//! velocity, so that inflow equals outflow: those of the outflows, or of the free surfaces if there
//! is no outflow. Fluid thus passes through a free surface in place of a grain that crosses it; the
//! surface itself stays flat and at its height.
//!
//! Legend: q normal velocity, n outward direction, C the mean outward velocity of the side, or that
//! of the fastest grain close to it if larger.

use super::{Boundaries, Boundary, Flow};
use crate::grid::Mesh;
use crate::math::Real;

/// One of the six sides of the box.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BoxSide {
    /// Axis of the normal.
    pub axis: usize,
    /// 0 lower, 1 upper.
    pub side: usize,
}

impl BoxSide {
    /// All six sides.
    pub fn all() -> impl Iterator<Item = BoxSide> {
        (0..6).map(|k| BoxSide { axis: k / 2, side: k % 2 })
    }
    /// Outward direction along the axis, -1 or 1.
    pub fn outward(self) -> f64 {
        if self.side == 0 { -1.0 } else { 1.0 }
    }
    /// Coordinate of the side along its axis [m].
    pub fn coordinate(self, mesh: &Mesh) -> f64 {
        if self.side == 0 { mesh.origin[self.axis] } else { mesh.upper()[self.axis] }
    }
    /// The condition on this side.
    pub fn boundary(self, boundaries: &Boundaries) -> Boundary {
        boundaries.0[self.axis][self.side]
    }
}

/// Face of an open side that a grain covers, in whole or in part.
#[derive(Clone, Copy, Debug)]
pub struct CoveredFace {
    /// Side of the box.
    pub side: BoxSide,
    /// Indices of the face along the two axes after that of the normal, counted from 1.
    pub indices: [usize; 2],
    /// Covered fraction, 0 to 1.
    pub fraction: f64,
    /// Normal velocity of the grain at the face [m/s].
    pub velocity: f64,
}

impl<R: Real> Flow<R> {
    /// Sets the outward speed [m/s] of the fastest grain close to each side, by axis and side.
    pub fn set_crossing_speeds(&mut self, speeds: [[f64; 2]; 3]) {
        self.crossing_speeds = speeds;
    }

    /// Sets the outflow faces of the prediction over `dt` [s] and balances the volume. The other
    /// boundary faces must have been set.
    pub(super) fn convect_outflow(&mut self, dt: f64) {
        let has_outflow = |side: BoxSide| side.boundary(&self.boundaries) == Boundary::Outflow;
        if !BoxSide::all().any(has_outflow) {
            return;
        }
        for side in BoxSide::all().filter(|side| has_outflow(*side)) {
            let axis = side.axis;
            let faces = BoundaryFaces::new(&self.mesh, side);
            let old = self.velocity.component(axis);
            let mean = side.outward() * faces.sum(old) / faces.count as f64;
            let speed = mean.max(self.crossing_speeds[axis][side.side]);
            let courant = (speed * dt / self.mesh.spacing[axis]).clamp(0.0, 1.0);
            let new = self.predicted.component_mut(axis);
            faces.each(|at, inside| {
                let (value, inside) = (old[at].wide(), old[inside].wide());
                new[at] = R::of(value - courant * (value - inside));
            });
        }
        self.balance_volume(&[]);
    }

    /// Gives the `covered` faces of the prediction the velocity of their grain, and balances the
    /// volume.
    pub fn cover_boundary(&mut self, covered: &[CoveredFace]) {
        for face in covered {
            let at = BoundaryFaces::new(&self.mesh, face.side).at(face.indices);
            let new = &mut self.predicted.component_mut(face.side.axis)[at];
            let open = new.wide();
            *new = R::of(open + face.fraction * (face.velocity - open));
        }
        if !covered.is_empty() {
            self.balance_volume(covered);
        }
    }

    /// Shifts the faces that no grain covers by one velocity, so that inflow equals outflow: those
    /// of the outflows, or of the free surfaces if there is no outflow.
    fn balance_volume(&mut self, covered: &[CoveredFace]) {
        let of = |side: BoxSide| side.boundary(&self.boundaries);
        let has_outflow = BoxSide::all().any(|side| of(side) == Boundary::Outflow);
        let balancing = if has_outflow { Boundary::Outflow } else { Boundary::FreeSurface };
        let (mut net, mut open) = (0.0, 0.0);
        for side in BoxSide::all().filter(|side| of(*side) != Boundary::Periodic) {
            let faces = BoundaryFaces::new(&self.mesh, side);
            let flux = faces.sum(self.predicted.component(side.axis)) * faces.face_area;
            net += side.outward() * flux;
            if of(side) == balancing {
                let closed = covered.iter().filter(|face| face.side == side);
                let closed: f64 = closed.map(|face| face.fraction).sum();
                open += (faces.count as f64 - closed) * faces.face_area;
            }
        }
        if open <= 0.0 {
            return;
        }
        let shift = net / open;
        for side in BoxSide::all().filter(|side| side.boundary(&self.boundaries) == balancing) {
            let faces = BoundaryFaces::new(&self.mesh, side);
            let new = self.predicted.component_mut(side.axis);
            let shift = side.outward() * shift;
            faces.each(|at, _| new[at] = R::of(new[at].wide() - shift));
            for face in covered.iter().filter(|face| face.side == side) {
                let at = faces.at(face.indices);
                new[at] = R::of(new[at].wide() + face.fraction * shift);
            }
        }
    }

    /// Pressure over density [m^2/s^2] in the cells inside the `covered` faces, less its mean over
    /// the cells inside the open part of their side; the faces are those of one side.
    pub fn pressure_below(&self, covered: &[CoveredFace]) -> Vec<f64> {
        let Some(first) = covered.first() else { return Vec::new() };
        let faces = BoundaryFaces::new(&self.mesh, first.side);
        // A face has the index of the cell above it.
        let cell = faces.inward.min(0);
        let pressure = |at: usize| self.pressure[at.wrapping_add_signed(cell)].wide();
        let (mut sum, mut open) = (0.0, faces.count as f64);
        faces.each(|at, _| sum += pressure(at));
        for face in covered {
            sum -= face.fraction * pressure(faces.at(face.indices));
            open -= face.fraction;
        }
        let mean = if open > 0.0 { sum / open } else { 0.0 };
        covered.iter().map(|face| pressure(faces.at(face.indices)) - mean).collect()
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
    fn new(mesh: &Mesh, side: BoxSide) -> BoundaryFaces {
        let (layout, axis) = (mesh.layout(), side.axis);
        let mut first = [1; 3];
        first[axis] += side.side * mesh.cells[axis];
        let [a, b] = [(axis + 1) % 3, (axis + 2) % 3];
        let strides = layout.strides();
        BoundaryFaces {
            start: layout.index(first[0], first[1], first[2]),
            inward: (1 - 2 * side.side as isize) * strides[axis] as isize,
            steps: [strides[a], strides[b]],
            counts: [mesh.cells[a], mesh.cells[b]],
            count: mesh.cells[a] * mesh.cells[b],
            face_area: mesh.spacing[a] * mesh.spacing[b],
        }
    }
    /// Position in memory of the face with the given indices along the two axes, counted from 1.
    fn at(&self, [a, b]: [usize; 2]) -> usize {
        self.start + (a - 1) * self.steps[0] + (b - 1) * self.steps[1]
    }
    fn each(&self, mut f: impl FnMut(usize, usize)) {
        for b in 1..=self.counts[1] {
            for a in 1..=self.counts[0] {
                let at = self.at([a, b]);
                f(at, at.wrapping_add_signed(self.inward));
            }
        }
    }
    fn sum<R: Real>(&self, values: &[R]) -> f64 {
        let mut sum = 0.0;
        self.each(|at, _| sum += values[at].wide());
        sum
    }
}

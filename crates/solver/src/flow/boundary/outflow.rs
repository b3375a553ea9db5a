//! Convective outflow.
//!
//! Legend: q normal velocity, n outward direction, C mean outward velocity of the face.

use super::{Boundaries, Boundary};
use crate::grid::{FaceVector, Mesh};
use crate::math::Real;

impl Boundaries {
    /// Sets the outflow faces of `next` from `now`, `dt` [s] earlier, by dq/dt + C dq/dn = 0, then
    /// shifts all of them by one velocity so that inflow equals outflow. The other boundary faces
    /// of `next` must be set.
    pub(crate) fn convect_outflow<R: Real>(
        &self,
        mesh: &Mesh,
        now: &FaceVector<R>,
        next: &mut FaceVector<R>,
        dt: f64,
    ) {
        if !self.0.iter().flatten().any(|side| *side == Boundary::Outflow) {
            return;
        }
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
                faces.each(|at, inside| {
                    let (value, inside) = (old[at].wide(), old[inside].wide());
                    new[at] = R::of(value - courant * (value - inside));
                });
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
                        .each(|at, _| new[at] = R::of(new[at].wide() - outward * shift));
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
    fn sum<R: Real>(&self, values: &[R]) -> f64 {
        let mut sum = 0.0;
        self.each(|at, _| sum += values[at].wide());
        sum
    }
}

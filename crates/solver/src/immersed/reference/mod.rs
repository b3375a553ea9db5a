//! Coupling in plain scalar loops, beside the equations. The kernels are tested against it
//! (`tests`).
//!
//! The files follow the layers: [`geometry`], [`forcing`], [`advection`], [`rigid_body`]. The
//! scalar forms of aperture and open depth are in [`super::geometry::aperture::reference`].
//!
//! Faces and cells are counted from 1 along each axis, as in the mesh.

mod advection;
mod forcing;
mod geometry;
mod rigid_body;
mod tests;

use glam::{DVec3, IVec3};

use super::Scheme;
use crate::dem::Grain;
use crate::flow::Boundaries;
use crate::grid::{FACE_OFFSET, Mesh};

/// Grains on a grid and the parameters of a step.
struct Reference {
    mesh: Mesh,
    boundaries: Boundaries,
    grains: Vec<Grain>,
    scheme: Scheme,
    /// Half-width of the band [m].
    eps: f64,
    /// Kinematic viscosity [m^2/s].
    kinematic_viscosity: f64,
    /// Length of the step [s].
    dt: f64,
}

impl Reference {
    /// Position of a face of `component` [m].
    fn position(&self, component: usize, face: IVec3) -> DVec3 {
        let offset = DVec3::from_array(FACE_OFFSET[component]);
        self.mesh.origin + self.mesh.spacing * (face.as_dvec3() - 1.0 + offset)
    }

    /// Whether a face is an unknown: walls prescribe the velocity of the faces on them.
    fn is_unknown(&self, component: usize, face: IVec3) -> bool {
        (0..3).all(|axis| {
            let first = if axis == component { 2 } else { 1 };
            let cells = self.mesh.cells[axis] as i32;
            self.boundaries.is_periodic(axis) || (first..=cells).contains(&face[axis])
        })
    }

    /// All unknown faces of `component`, each once.
    fn faces(&self, component: usize) -> Vec<IVec3> {
        let [nx, ny, nz] = self.mesh.cells.map(|n| n as i32);
        let mut faces = Vec::new();
        for k in 1..=nz {
            for j in 1..=ny {
                faces.extend((1..=nx).map(|i| IVec3::new(i, j, k)));
            }
        }
        faces.retain(|face| self.is_unknown(component, *face));
        faces
    }

    /// Position in memory of a face or cell, across periodic edges.
    fn at(&self, face: IVec3) -> usize {
        let [i, j, k] = [0, 1, 2].map(|axis| {
            let cells = self.mesh.cells[axis] as i32;
            match self.boundaries.is_periodic(axis) {
                true => (face[axis] - 1).rem_euclid(cells) as usize + 1,
                false => face[axis] as usize,
            }
        });
        self.mesh.layout().index(i, j, k)
    }
}

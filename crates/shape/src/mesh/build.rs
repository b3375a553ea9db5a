//! A shape from a closed mesh.

use super::{MeshDistance, TriangleMesh};
use crate::assemble::{Body, ShapeOptions, assemble};
use crate::error::{Result, ShapeError};
use crate::limits::SourceFile;
use crate::provenance::Provenance;
use crate::roundness::Surface;
use crate::{Shape, mass, principal};
use glam::DQuat;

/// How a mesh is turned into a shape.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshOptions {
    /// Resolution, nodes and bounds.
    pub shape: ShapeOptions,
    /// Turn a mesh whose faces all point inwards.
    pub flip: bool,
}

/// Shape of a closed mesh in metres: exact mass properties give the principal frame, and the
/// distances to the triangles are sampled in it, the exact ones near the surface.
pub fn shape_from_mesh(
    mesh: &TriangleMesh,
    source: &SourceFile,
    options: &MeshOptions,
) -> Result<Shape> {
    let mut provenance = Provenance::new("mesh").with("faces", mesh.triangles.len());
    provenance.source.clone_from(&source.name);
    provenance.source_sha256.clone_from(&source.sha256);
    let turned;
    let closed = match mesh.check_closed() {
        Ok(()) => mesh,
        Err(ShapeError::InsideOut { .. }) if options.flip => {
            let mut copy = mesh.clone();
            copy.triangles.iter_mut().for_each(|t| t.swap(1, 2));
            provenance = provenance.with("flip", true);
            turned = copy;
            &turned
        }
        Err(error) => return Err(error),
    };
    closed.check_crossings()?;
    from_closed(closed, Surface::Exact, provenance, &options.shape)
}

/// Shape of a mesh; its frame and bounds are found here, `provenance` tells the rest.
pub(crate) fn from_closed(
    mesh: &TriangleMesh,
    mut surface: Surface,
    mut provenance: Provenance,
    options: &ShapeOptions,
) -> Result<Shape> {
    let mass = mass::of_mesh(mesh);
    let axes = principal::axes(mass.second, mass.volume, |axes| {
        mass::third_moments(mesh, mass.centroid, axes)
    });
    let local = mesh.in_frame(mass.centroid, axes);
    let (lower, upper) = local.bounds();
    let distance = MeshDistance::new(&local)?;
    if let Surface::Scanned { cuts, .. } = &mut surface {
        let to_frame = axes.transpose();
        for place in cuts {
            *place = to_frame * (*place - mass.centroid);
        }
    }
    provenance.centroid = mass.centroid;
    provenance.rotation = DQuat::from_mat3(&axes);
    let body = Body {
        distance,
        lower,
        upper,
        volume: Some(mass.volume),
        area: Some(mesh.area()),
        surface,
    };
    assemble(&body, provenance, options)
}

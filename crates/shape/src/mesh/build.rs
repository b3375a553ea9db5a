//! Construction of a shape from a closed mesh.

use super::{MeshDistance, TriangleMesh};
use crate::assemble::{Body, ShapeOptions, assemble};
use crate::error::{Result, ShapeError};
use crate::limits::SourceFile;
use crate::provenance::Provenance;
use crate::roundness::Surface;
use crate::{Shape, mass, principal};
use glam::DQuat;

/// Options for converting a mesh to a shape.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshOptions {
    /// Resolution, nodes and quality bounds.
    pub shape: ShapeOptions,
    /// Whether to invert a mesh with inward normals.
    pub flip: bool,
}

/// Builds the shape of a closed mesh [m]. Exact mass properties define the principal frame, in
/// which the distances to the triangles are sampled, exactly near the surface.
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
        Err(error) => return Err(error.in_file(&source.name)),
    };
    closed.check_crossings().map_err(|error| error.in_file(&source.name))?;
    from_closed(closed, Surface::Exact, provenance, &options.shape)
}

/// Builds the shape of a mesh; determines its frame and bounds and completes `provenance`.
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

//! Construction of a shape from a closed mesh.

use super::{MeshDistance, TriangleMesh};
use crate::assemble::{Body, DEFAULT_CELLS, ShapeOptions, assemble};
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
///
/// # Errors
/// Options out of their range, a surface that is open or crosses itself, normals that point inwards
/// without `flip`, a size that no grain has, or too few cells for the quality check.
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
        Err(error) => return Err(error.in_file(&source.path.to_string_lossy())),
    };
    closed.check_crossings().map_err(|error| error.in_file(&source.path.to_string_lossy()))?;
    let built = from_closed(closed, Surface::Exact, provenance.clone(), &options.shape);
    built.map_err(|error| {
        with_enough_cells(error, closed, &options.shape).in_file(&source.path.to_string_lossy())
    })
}

/// Numbers of cells that are tried on a mesh that a given number resolves too poorly, relative to
/// that number.
const MORE: [f64; 4] = [1.25, 1.5, 2.0, 3.0];

/// Completes the error of a mesh that fails the quality check by the number of cells that passes.
fn with_enough_cells(error: ShapeError, mesh: &TriangleMesh, given: &ShapeOptions) -> ShapeError {
    let ShapeError::Quality { file, defect, reason, .. } = error else {
        return error;
    };
    let present = given.cells.unwrap_or(DEFAULT_CELLS) as f64;
    let passes = |cells: &usize| {
        let more = ShapeOptions { cells: Some(*cells), roundness: false, ..given.clone() };
        from_closed(mesh, Surface::Exact, Provenance::new("mesh"), &more).is_ok()
    };
    let cells = MORE.map(|share| (share * present).ceil() as usize).into_iter().find(passes);
    ShapeError::Quality { file, defect, reason, cells }
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
    let scanned = matches!(surface, Surface::Scanned { .. });
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
        corners: (!scanned).then_some(local.vertices),
        surface,
    };
    assemble(&body, provenance, options)
}

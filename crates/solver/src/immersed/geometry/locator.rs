//! Location of grains on the grid: boxes of cells, distances and lists of faces.

use glam::{DMat3, DVec3};

use super::distances::{DistanceScratch, FillLists};
use super::index_map::UnknownFaces;
use super::lists::{BandFaces, FaceRun, LocatedBody};
use super::narrow_band::NarrowBandShapes;
use super::neighbours::{NeighbourGrain, NeighbourSearch};
use crate::dem::Grain;
use crate::flow::Boundaries;
use crate::grid::Mesh;
use grainwake_simd::dispatch;

/// Buffers of one thread.
#[derive(Default)]
pub struct LocateScratch {
    /// Faces in the forcing band of the grain located last.
    pub band: BandFaces,
    distances: DistanceScratch,
}

/// Half-width of the band in mean spacings of the grid. With a narrower band the force on a grain
/// depends more on where the grid lies; a wider one smooths thin boundary layers
/// (`docs/decisions/0018-pressure-weight.md`).
const BAND_HALF_WIDTH: f64 = 1.25;

/// Geometry of all grains on one grid.
pub struct Locator {
    mesh: Mesh,
    unknown_faces: UnknownFaces,
    /// Half-width of the band around the surface [m].
    eps: f64,
    /// Distance from the surface up to which a grain affects faces [m].
    reach: f64,
    shapes: NarrowBandShapes,
    neighbours: NeighbourSearch,
}

impl Locator {
    /// Samples the shapes of `grains` for a grid.
    pub fn new(mesh: &Mesh, boundaries: &Boundaries, grains: &[Grain]) -> Locator {
        let axes = mesh.resolved_axes();
        let spacings: Vec<f64> = axes.map(|axis| mesh.spacing[axis]).collect();
        let eps = BAND_HALF_WIDTH * spacings.iter().sum::<f64>() / spacings.len().max(1) as f64;
        // Two band half-widths, and half a link along the axis of the largest spacing.
        let reach = 2.0 * eps + 0.5 * spacings.iter().copied().fold(0.0, f64::max);
        Locator {
            mesh: *mesh,
            unknown_faces: UnknownFaces::new(mesh, boundaries),
            eps,
            reach,
            shapes: NarrowBandShapes::new(grains, eps, reach),
            neighbours: NeighbourSearch::default(),
        }
    }

    /// Half-width of the band around the surface [m].
    pub fn eps(&self) -> f64 {
        self.eps
    }

    /// Distance from the surface up to which a grain affects faces [m].
    pub fn reach(&self) -> f64 {
        self.reach
    }

    /// Narrow-band shapes of the grains.
    pub fn shapes(&self) -> &NarrowBandShapes {
        &self.shapes
    }

    /// Memory held [bytes].
    pub fn bytes(&self) -> usize {
        self.shapes.bytes()
    }

    /// Finds the neighbours of all grains, before [`Locator::locate`]. `displacement(i)` [m] leads
    /// from the last pose of grain i, whose faces count as well; 0 if they do not.
    pub fn find_neighbours(&mut self, grains: &[Grain], displacement: impl Fn(usize) -> f64) {
        self.neighbours.update(&self.mesh, &self.unknown_faces, self.reach, grains, displacement);
    }

    /// Neighbours of grain `index`.
    pub fn neighbours(&self, index: usize) -> &[NeighbourGrain] {
        self.neighbours.of(index)
    }

    /// Locates grain `index`: lists the faces within reach in `body`, and those in the forcing band
    /// in `runs`, with their distances and normals in `scratch.band`.
    pub fn locate(
        &self,
        index: usize,
        grain: &Grain,
        body: &mut LocatedBody,
        runs: &mut [Vec<FaceRun>; 3],
        scratch: &mut LocateScratch,
    ) {
        body.position = grain.pose.position;
        self.set_box(grain, body);
        dispatch(FillLists {
            mesh: &self.mesh,
            eps: self.eps,
            reach: self.reach,
            grain,
            index,
            shapes: &self.shapes,
            neighbours: self.neighbours.of(index),
            body,
            runs,
            band: &mut scratch.band,
            scratch: &mut scratch.distances,
        });
    }

    /// Sets the box of cells around a grain.
    fn set_box(&self, grain: &Grain, body: &mut LocatedBody) {
        let mesh = &self.mesh;
        let to_space = DMat3::from_quat(grain.pose.orientation);
        let (lower, upper) = (grain.shape.lower(), grain.shape.upper());
        let middle = grain.pose.position + to_space * (0.5 * (lower + upper));
        let half = 0.5 * (upper - lower);
        let [x, y, z] = [to_space.x_axis, to_space.y_axis, to_space.z_axis].map(DVec3::abs);
        let span = x * half.x + y * half.y + z * half.z;
        for axis in 0..3 {
            let (h, n) = (mesh.spacing[axis], mesh.cells[axis] as i32);
            if n == 1 {
                (body.lowest[axis], body.size[axis]) = (1, 1);
                continue;
            }
            // Limited so that positions do not overflow in an unstable run before it is stopped.
            let cell = |x: f64| ((x - mesh.origin[axis]) / h).floor().clamp(-1e9, 1e9) as i32;
            let from = cell(middle[axis] - span[axis] - self.reach);
            let to = cell(middle[axis] + span[axis] + self.reach);
            body.lowest[axis] = from + 1;
            body.size[axis] = to + 2 - body.lowest[axis];
        }
        self.unknown_faces.map(body.lowest, body.size, &mut body.index_map);
        body.planes = body.index_map.plane_range();
    }
}

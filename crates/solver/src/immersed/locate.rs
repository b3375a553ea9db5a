//! Where the grains lie on the grid: signed distances at the faces near each grain, and the list
//! of faces that its rigidity acts on.

use std::ops::Range;

use glam::{DMat3, DVec3, IVec3};

use super::Scheme;
use super::forced::Forced;
use super::hold::Holding;
use super::measure::{Measure, Scratch};
use super::near::NearShapes;
use super::places::{Places, Unknowns};
use super::rivals::{Neighbours, Rival};
use crate::dem::Grain;
use crate::flow::Boundaries;
use crate::grid::{Layout, Mesh};
use grainwake_simd::dispatch;

/// The faces of a row along x that matter.
#[derive(Clone, Copy, Debug, Default)]
pub struct Span {
    /// Places along x, counted from the side of the box: the first, and the one after the last.
    pub start: i32,
    pub end: i32,
    /// Place of the first in the lists of [`Body`].
    pub first: usize,
}

impl Span {
    /// Place of the face at `i` in the lists of [`Body`].
    #[inline(always)]
    pub fn place(&self, i: i32) -> usize {
        self.first + (i - self.start) as usize
    }
}

/// Neighbouring faces of a row that advection beside the grain may push.
#[derive(Clone, Copy, Debug)]
pub struct PushRow {
    /// Position in memory of the first.
    pub at: usize,
    /// Its place in the lists of [`Body`].
    pub first: usize,
    /// Number of faces.
    pub count: usize,
}

/// One grain on the grid.
#[derive(Clone, Debug, Default)]
pub struct Body {
    /// Where its centroid was found [m].
    pub position: DVec3,
    /// Lower corner of the box of cells about the grain; counted from 1, may lie across a periodic edge.
    pub first: IVec3,
    /// Cells of the box.
    pub size: IVec3,
    /// Signed distance [m] at faces near the grain for each component, row by row; infinite where another
    /// grain is nearer. Some entries more follow the last.
    pub distance: [Vec<f32>; 3],
    /// Which faces of each row of the box these are.
    pub spans: [Vec<Span>; 3],
    /// Where the box lies in memory.
    pub places: Places,
    /// From its first to its last plane there.
    pub planes: Range<usize>,
    /// Where those faces lie.
    pub rows: [Vec<PushRow>; 3],
}

impl Body {
    /// Whether faces of the box may lie in a part of a field.
    pub fn lies_in(&self, part: &Range<usize>, layout: Layout) -> bool {
        self.planes.start < part.end && part.start < self.planes.end + layout.plane()
    }

    /// Memory held [bytes].
    pub fn bytes(&self) -> usize {
        let distances: usize = self.distance.iter().map(Vec::capacity).sum();
        let spans: usize = self.spans.iter().map(Vec::capacity).sum();
        let rows: usize = self.rows.iter().map(Vec::capacity).sum();
        size_of::<f32>() * distances
            + self.places.bytes()
            + size_of::<Span>() * spans
            + size_of::<PushRow>() * rows
    }
}

/// What is found of a grain.
pub struct Found<'a> {
    pub body: &'a mut Body,
    pub forced: &'a mut Forced,
}

/// Where to look for grains and how.
pub struct Locator {
    mesh: Mesh,
    unknowns: Unknowns,
    scheme: Scheme,
    kinematic_viscosity: f64,
    /// Half-width of the band [m].
    eps: f64,
    /// How far from its surface a grain matters [m].
    reach: f64,
    shapes: NearShapes,
    neighbours: Neighbours,
}

impl Locator {
    pub fn new(
        mesh: &Mesh,
        boundaries: &Boundaries,
        scheme: Scheme,
        kinematic_viscosity: f64,
        grains: &[Grain],
    ) -> Locator {
        let flat = mesh.cells.map(|n| n == 1);
        let resolved: Vec<f64> = (0..3)
            .filter(|&axis| !flat[axis])
            .map(|axis| mesh.spacing[axis])
            .collect();
        let eps = resolved.iter().sum::<f64>() / resolved.len().max(1) as f64;
        // Links run along axes of more than one cell.
        let reach = 2.0 * eps + 0.5 * resolved.iter().copied().fold(0.0, f64::max);
        Locator {
            mesh: *mesh,
            unknowns: Unknowns::new(mesh, boundaries),
            scheme,
            kinematic_viscosity,
            eps,
            reach,
            shapes: NearShapes::new(grains, eps, reach),
            neighbours: Neighbours::default(),
        }
    }

    /// Half-width of the band about the surface [m].
    pub fn band(&self) -> f64 {
        self.eps
    }

    /// How far from its surface a grain matters [m].
    pub fn reach(&self) -> f64 {
        self.reach
    }

    /// Memory held [bytes].
    pub fn bytes(&self) -> usize {
        self.shapes.bytes()
    }

    /// Finds which grains may share faces, before [`Locator::locate`]; grain i also those that it had near where
    /// it was, `travel(i)` [m] from here.
    pub fn find_neighbours(&mut self, grains: &[Grain], travel: impl Fn(usize) -> f64) {
        let (mesh, unknowns) = (&self.mesh, &self.unknowns);
        self.neighbours
            .find(mesh, unknowns, self.reach, grains, travel);
    }

    /// Whether no other grain has faces near that are near this one, here or where both were.
    pub fn is_alone(&self, index: usize) -> bool {
        self.neighbours.has_none(index)
    }

    /// Finds grain `index` for a step of length `dt` [s], and the faces that it forces.
    pub fn locate(
        &self,
        grains: &[Grain],
        index: usize,
        dt: f64,
        Found { body, forced }: Found,
        scratch: &mut Scratch,
        ahead: impl Fn(usize, [i32; 2]),
    ) {
        let holding = Holding {
            scheme: self.scheme,
            eps: self.eps,
            spacing: self.mesh.spacing,
            // Singles hold what it is multiplied with.
            diffusion: (dt * self.kinematic_viscosity).min(1e20 * self.eps * self.eps),
        };
        let (mesh, shapes, grain) = (&self.mesh, &self.shapes, &grains[index]);
        let rivals = self.neighbours.of(index, mesh, shapes, grains);
        body.position = grain.pose.position;
        self.place(grain, body);
        dispatch(Measure {
            mesh,
            holding: &holding,
            reach: self.reach,
            grain,
            shape: shapes.of(index),
            rivals: &rivals,
            body,
            forced: &mut *forced,
            scratch: &mut *scratch,
            ahead,
        });
        self.hold(&rivals, &holding, forced, scratch);
    }

    /// The box of cells about a grain.
    fn place(&self, grain: &Grain, body: &mut Body) {
        let mesh = &self.mesh;
        let turn = DMat3::from_quat(grain.pose.orientation);
        let (lower, upper) = (grain.shape.lower(), grain.shape.upper());
        let middle = grain.pose.position + turn * (0.5 * (lower + upper));
        let half = 0.5 * (upper - lower);
        let span =
            turn.x_axis.abs() * half.x + turn.y_axis.abs() * half.y + turn.z_axis.abs() * half.z;
        for axis in 0..3 {
            let (h, n) = (mesh.spacing[axis], mesh.cells[axis] as i32);
            if n == 1 {
                (body.first[axis], body.size[axis]) = (1, 1);
                continue;
            }
            // Grains that a failing run has thrown far away must not overflow before it is stopped.
            let cell = |x: f64| ((x - mesh.origin[axis]) / h).floor().clamp(-1e9, 1e9) as i32;
            let from = cell(middle[axis] - span[axis] - self.reach);
            let to = cell(middle[axis] + span[axis] + self.reach);
            body.first[axis] = from + 1;
            body.size[axis] = to + 2 - body.first[axis];
        }
        self.unknowns.map(body.first, body.size, &mut body.places);
        body.planes = body.places.planes();
    }

    /// Finds what holds the faces near the surface of a grain.
    fn hold(
        &self,
        rivals: &[Rival],
        holding: &Holding,
        forced: &mut Forced,
        scratch: &mut Scratch,
    ) {
        let Scratch { faces, shared, .. } = scratch;
        faces.hold(holding, forced);
        let near = 2.0 * self.eps;
        if !shared.is_empty() {
            forced.closed_by_all.extend_from_slice(&forced.closed);
        }
        for &(place, x) in &*shared {
            let own = faces.at(place, holding);
            let mut all = own;
            for rival in rivals {
                let (there, slope) = rival.distance_and_gradient(x, near);
                if there < near {
                    let normal = rival.grain.pose.orientation * slope.normalize_or_zero();
                    all = all + holding.of(there, normal);
                }
            }
            forced.share[place] = own.share(all) as f32;
            forced.closed[place] = (own.closed / all.closed.max(1.0)) as f32;
            forced.closed_by_all[place] = all.closed.min(1.0) as f32;
        }
    }
}

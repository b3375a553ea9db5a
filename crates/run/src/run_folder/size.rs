//! Size of the files of a run before it starts, from the case.
//!
//! Tables and networks of contacts are left out. A pair that lands counts as having four events
//! besides its two landings.

use grainwake_formats::{diagnostics, grains, probes};
use grainwake_shape::{Field, Shape};
use grainwake_solver::grid::Mesh;
use grainwake_solver::sim::events::StopWhen;
use grainwake_solver::sim::{CELL_FIELDS, SAME_TIME, Setup};

use super::scaled::ScaledColumns;
use super::surfaces::{MAX_TRIANGLES, MERGED_PER_SQUARE, merged_edge};
use crate::plan::{ProbePlace, RunPlan};

/// Bytes of a number in a table with its separator, mean of the tables of the studies.
const BYTES_PER_CELL: f64 = 18.5;
/// Bytes of a point with its velocity and of a triangle with its grain in a file of surfaces.
const BYTES_PER_POINT: f64 = 24.0;
const BYTES_PER_TRIANGLE: f64 = 20.0;
/// Points of the surface of a sphere, as in `Shape::surface_mesh`.
const SPHERE_POINTS: f64 = 3458.0;
/// Points of a sampled surface over its area in squares of the grid (grains of the studies).
const POINTS_PER_SQUARE: f64 = 1.8;
/// Numbers of the state per cell, ghosts included.
const NUMBERS_PER_CELL: f64 = 7.0;
/// Bytes of the state of a grain with few contacts.
const BYTES_PER_GRAIN: f64 = 400.0;

/// Returns the size of the outputs of a run that ends at `end` [s], and of its grain files of
/// `grain_files` bytes.
pub fn output_bytes(setup: &Setup, plan: &RunPlan, end: f64, grain_files: usize) -> f64 {
    let periods = |interval: f64| (end / interval * (1.0 + SAME_TIME)).floor();
    let outputs = |interval: f64| if interval > 0.0 { periods(interval) + 1.0 } else { 0.0 };
    // A landing that is not expected before the end does not stop the run.
    let stops = plan.stop.is_some_and(|stop| stop.when != StopWhen::Landing || end < plan.end);
    // Slices and surfaces are also written at events, of which a run that stops has some, and at
    // the last state, unless it is that of another output.
    let at_events = match setup.grains.len() {
        1 if stops && plan.at_events => 1.0,
        2 if stops && plan.at_events => 6.0,
        _ => 0.0,
    };
    let is_between = |interval: f64| end > periods(interval) * interval * (1.0 + SAME_TIME);
    let with_end = |interval: f64| {
        let is_further = interval > 0.0 && (stops || is_between(interval));
        outputs(interval) + at_events + if is_further { 1.0 } else { 0.0 }
    };
    let grains = setup.grains.len() as f64;
    let row = |header: &str| {
        let header = ScaledColumns::of(header, plan.scales.as_ref()).header(header);
        header.split(',').count() as f64 * BYTES_PER_CELL
    };
    let per_time = grains * row(grains::HEADER) + row(diagnostics::HEADER);
    let mut bytes = grain_files as f64 + outputs(plan.tables) * per_time;
    for probe in &plan.probes {
        bytes += outputs(probe.every)
            * match &probe.place {
                ProbePlace::Points(points) => points.len() as f64 * row(probes::POINTS_HEADER),
                ProbePlace::Plane { .. } => row(probes::PLANE_HEADER),
            };
    }
    bytes += with_end(plan.surfaces) * surface_bytes(setup);
    if setup.fluid.is_some() {
        let cells = setup.mesh.cells.map(|n| n as f64);
        let components: usize = CELL_FIELDS.iter().map(|field| field.components).sum();
        let per_cell = 4.0 * components as f64;
        let all = per_cell * cells.iter().product::<f64>();
        let slices: f64 = plan.planes.iter().map(|plane| all / cells[plane.axis]).sum();
        bytes += outputs(plan.fields) * all + with_end(plan.slices) * slices;
    }
    bytes
}

/// Returns the size of the checkpoints that a run holds at a time.
pub fn checkpoint_bytes(setup: &Setup, plan: &RunPlan) -> f64 {
    let with_ghosts = |mesh: &Mesh| mesh.cells.iter().map(|n| (n + 2) as f64).product::<f64>();
    let cells = setup.fluid.map_or(0.0, |_| {
        with_ghosts(&setup.mesh) + setup.refined_mesh().as_ref().map_or(0.0, with_ghosts)
    });
    let state = cells * NUMBERS_PER_CELL * setup.precision.bytes() as f64
        + setup.grains.len() as f64 * BYTES_PER_GRAIN;
    plan.kept_during_run() as f64 * state
}

/// Returns the size of a file of the surfaces of all grains.
pub(crate) fn surface_bytes(setup: &Setup) -> f64 {
    let count = setup.grains.len();
    let points = |shape: &Shape| {
        let squares = |edge: f64| shape.surface_area() / edge.powi(2);
        let points = match shape.field() {
            Field::Sampled(field) => POINTS_PER_SQUARE * squares(field.spacing()),
            _ => SPHERE_POINTS,
        };
        // A closed surface has twice as many triangles as points.
        if 2.0 * points * count as f64 <= MAX_TRIANGLES as f64 {
            return points;
        }
        let faces = squares(merged_edge(shape, count));
        points.min(MERGED_PER_SQUARE * faces)
    };
    let all: f64 = setup.grains.iter().map(|grain| points(&grain.shape)).sum();
    all * (BYTES_PER_POINT + 2.0 * BYTES_PER_TRIANGLE)
}

//! Memory that a run needs, compared with the memory that is free.

use std::collections::BTreeSet;
use std::sync::Arc;

use grainwake_shape::available_memory;
use grainwake_solver::grid::Mesh;
use grainwake_solver::immersed::narrow_band_bytes;
use grainwake_solver::sim::Setup;

use crate::error::RunError;
use crate::plan::RunPlan;
use crate::run_folder::surface_bytes;

/// Numbers of the fields and of the Poisson solver per cell. `grainwake bench` measures the bytes.
const NUMBERS_PER_CELL: f64 = 13.75;
/// Numbers of the copy of a refined box while it moves, per cell.
const NUMBERS_PER_COPIED_CELL: f64 = 7.0;
/// Bytes of the forced faces of a grain over the square of its diameter in cells, from
/// `grainwake bench --grains 300`.
const BYTES_PER_SURFACE_CELL: f64 = 1200.0;
/// Bytes of a surface node with its patches and their place in the contact search.
const BYTES_PER_NODE: f64 = 400.0;

/// Bytes of a grain in the time step and in the outputs, without its shape; from heaps of 1000 and
/// 4000 grains.
const BYTES_PER_GRAIN: f64 = 11_000.0;
/// Bytes that a file of surfaces takes in memory while it is written, over its size.
const BYTES_PER_SURFACE_BYTE: f64 = 2.7;

/// Returns the sum of the squares of the diameters in cells, to which the work and memory of the
/// coupling are proportional.
pub(crate) fn surface_cells(setup: &Setup) -> f64 {
    let spacing = setup.finest_spacing().min_element();
    let across = |diameter: f64| diameter / spacing;
    setup.grains.iter().map(|grain| across(grain.shape.equivalent_diameter()).powi(2)).sum()
}

/// Returns the memory of a simulation: fields, grains with their forced faces, shapes and the
/// distances sampled around them [bytes]. With the plan of a run, also that of its files of
/// surfaces.
pub(crate) fn needed(setup: &Setup, plan: Option<&RunPlan>) -> u64 {
    let refined = setup.refined_mesh();
    // The number of cells of an absurd box exceeds any integer.
    let count = |mesh: &Mesh| mesh.cells.iter().map(|n| *n as f64).product::<f64>();
    let refined_cells = refined.as_ref().map_or(0.0, count);
    let finest = refined.as_ref().unwrap_or(&setup.mesh);
    let mut bytes = setup.grains.len() as f64 * BYTES_PER_GRAIN;
    if plan.is_some_and(|plan| plan.surfaces > 0.0) {
        bytes += surface_bytes(setup) * BYTES_PER_SURFACE_BYTE;
    }
    if setup.fluid.is_some() {
        let numbers = (count(&setup.mesh) + refined_cells) * NUMBERS_PER_CELL
            + refined_cells * NUMBERS_PER_COPIED_CELL;
        bytes += numbers * setup.precision.bytes() as f64;
        bytes += surface_cells(setup) * BYTES_PER_SURFACE_CELL;
    }
    // Grains of equal shape share it.
    let mut seen = BTreeSet::new();
    for grain in &setup.grains {
        let shape = &grain.shape;
        if seen.insert(Arc::as_ptr(shape).addr()) {
            bytes += shape.bytes() as f64 + shape.nodes().len() as f64 * BYTES_PER_NODE;
            if setup.fluid.is_some() {
                bytes += narrow_band_bytes(finest, shape);
            }
        }
    }
    bytes as u64
}

/// Compares the memory of a simulation, and of the outputs of a run, with the memory that is free.
///
/// # Errors
/// [`RunError::Memory`] with both figures.
pub fn admit_memory(setup: &Setup, plan: Option<&RunPlan>) -> Result<(), RunError> {
    let needed = needed(setup, plan);
    match available_memory() {
        Some(free) if needed > free => Err(RunError::Memory { needed, free }),
        _ => Ok(()),
    }
}

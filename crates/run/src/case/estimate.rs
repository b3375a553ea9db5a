//! Estimates before a run: Galileo number, settling speed, steps, memory, disk space, wall time.

use super::blockage::blockage;
use super::settling::{LONGER_UP_TO, expected_time_step, galileo, impact_speed, is_free};
use super::settling::{is_limited_beside_held_grains, landing_time};
use super::settling::{settling_reynolds, smallest_diameter, terminal_speed};
use crate::RunPlan;
use crate::memory::{self, surface_cells};
use crate::run_folder::{checkpoint_bytes, output_bytes};
use glam::DVec3;
use grainwake_shape::{Field, available_memory};
use grainwake_solver::dem::Grain;
use grainwake_solver::flow::Boundary;
use grainwake_solver::sim::Setup;
use grainwake_solver::sim::events::StopWhen;

/// Time of a step on one thread [ns per cell and byte of a number], from `grainwake bench`.
const NS_PER_CELL_BYTE: f64 = 3.0;
/// Time of a cell of the refined box over that of another cell: values pass to and from the box.
/// Chosen so that the processor time of the 65 first members of
/// `studies/dkt-morphology/members.toml` is met.
const REFINED_CELL: f64 = 2.0;
/// Time of the coupling in a step on one thread [ns per square of the diameter in cells], from the
/// `passes` of `cases/dkt-pair/quick.toml` (12,000) and `cases/periodic-suspension/case.toml`
/// (15,000). Spheres take half, grains that touch three times as much.
const NS_PER_SURFACE_CELL: f64 = 12_000.0;
/// Time of a contact sub-step on one thread for a sphere, and for another grain with its surface
/// nodes [ns], measured with heaps; rocks take half, boxes twice as much. Grains without contact
/// take much less.
const NS_PER_SPHERE: f64 = 1200.0;
const NS_PER_GRAIN: f64 = 5000.0;
const NS_PER_NODE: f64 = 2.0;

/// Derived numbers and warnings. The JSON names are stable.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Estimate {
    /// Cells of the grid.
    pub cells: usize,
    /// Cells of the refined box at the start, if there is one.
    pub refined_cells: Option<usize>,
    /// Time at which the run is expected to end [s]: `end`, or the landing of the last grain with
    /// `stop = "landing"`.
    pub expected_end_s: f64,
    /// Steps expected until then.
    pub steps: u64,
    /// Time step expected at the settling speed and the speeds of prescribed motions [s].
    pub time_step_s: f64,
    /// Memory expected [bytes].
    pub memory_bytes: u64,
    /// Free memory of this machine, if known [bytes].
    pub memory_free_bytes: Option<u64>,
    /// Size of the run folder without checkpoints [bytes]: tables, VTK files and grain files.
    pub disk_bytes: u64,
    /// Size of the checkpoints during the run [bytes].
    pub checkpoint_bytes: u64,
    /// Largest Galileo number of the grains.
    pub galileo: Option<f64>,
    /// Index of the free grain with that Galileo number.
    pub galileo_grain: Option<usize>,
    /// Settling Reynolds number of the equal-volume sphere at that Galileo number.
    pub reynolds: Option<f64>,
    /// Largest Reynolds number of a grain at the start: of its motion relative to the fluid or to
    /// an inflow, or of its spin.
    pub start_reynolds: Option<f64>,
    /// Settling speed of that sphere [m/s].
    pub settling_speed_m_per_s: Option<f64>,
    /// Cells across the smallest equivalent diameter, on the refined grid if there is one.
    pub cells_per_diameter: Option<f64>,
    /// Cells across the shortest axis of the thinnest grain.
    pub cells_across_shortest_axis: Option<f64>,
    /// Relative error of the drag expected on this grid at the larger Reynolds number, see
    /// [`drag_error`].
    pub drag_error: Option<f64>,
    /// Part of the cross-section that the largest grain blocks, normal to gravity or, if none
    /// settles, to the motion of grains or fluid.
    pub blockage: Option<f64>,
    /// Duration of a contact of two equal grains, shortest [s].
    pub contact_time_s: Option<f64>,
    /// Sub-steps of the contact in one step.
    pub contact_substeps: Option<f64>,
    /// Part of the wall-clock time that contact takes.
    pub contact_share: f64,
    /// Wall-clock time expected [s], for the given threads.
    pub wall_s: f64,
    /// Warnings about settings that impair the results.
    pub warnings: Vec<String>,
}

impl Estimate {
    /// Estimates a run on `threads` threads with grain files of `grain_files` bytes, without
    /// warnings.
    pub(super) fn of(
        setup: &Setup,
        plan: &RunPlan,
        threads: usize,
        grain_files: usize,
    ) -> Estimate {
        let g = setup.gravity.length();
        let fluid = setup.fluid.as_ref();
        let largest = fluid.and_then(|fluid| {
            let free = setup.grains.iter().enumerate().filter(|(_, grain)| is_free(grain));
            let numbers = free.map(|(index, grain)| (index, grain, galileo(grain, fluid, g)));
            // The first of equal grains.
            numbers.rev().max_by(|a, b| a.2.total_cmp(&b.2))
        });
        let galileo = largest.map(|(_, _, galileo)| galileo);
        let speed =
            (largest.zip(fluid)).map(|((_, grain, _), fluid)| terminal_speed(grain, fluid, g));
        let landing = plan.stop.as_ref().filter(|stop| stop.when == StopWhen::Landing);
        let landing = landing.and_then(|stop| Some(landing_time(setup)? + stop.hold));
        let expected_end_s = landing.map_or(plan.end, |landing| landing.min(plan.end));
        let allowed = expected_time_step(setup, speed.unwrap_or(0.0), expected_end_s);
        // Whole numbers of equal steps lead from output to output.
        let interval = plan.intervals().fold(f64::INFINITY, f64::min);
        let held = is_limited_beside_held_grains(setup, allowed);
        let longest = if held { LONGER_UP_TO * allowed } else { allowed };
        let steps_of_interval = (interval / longest - 1e-9).ceil().max(1.0);
        let time_step_s = if interval.is_finite() { interval / steps_of_interval } else { allowed };
        let steps = (expected_end_s / time_step_s).ceil().max(1.0);

        let cells = setup.mesh.cell_count();
        let refined_cells = setup.refined_mesh().map(|mesh| mesh.cell_count());
        let contact_time_s = contact_time(setup);
        let contact_substeps = contact_time_s
            .map(|t| (time_step_s / (t / setup.contact.substeps_per_contact)).max(1.0));
        let seconds = |ns: f64| ns * 1e-9 / threads.max(1) as f64;
        let field_bytes = fluid.map_or(0.0, |_| {
            let cells = cells as f64 + REFINED_CELL * refined_cells.unwrap_or(0) as f64;
            cells * setup.precision.bytes() as f64
        });
        // In a fluid the sub-steps of a contact are taken twice (decision 0014).
        let passes = if fluid.is_some() { 2.0 } else { 1.0 };
        let substep_ns = setup.grains.iter().map(|grain| match grain.shape.field() {
            Field::Sphere(_) => NS_PER_SPHERE,
            _ => NS_PER_GRAIN + NS_PER_NODE * grain.shape.nodes().len() as f64,
        });
        let contact_s = seconds(substep_ns.sum()) * passes * contact_substeps.unwrap_or(1.0);
        let coupling_ns = fluid.map_or(0.0, |_| NS_PER_SURFACE_CELL * surface_cells(setup));
        let step_s = seconds(field_bytes * NS_PER_CELL_BYTE + coupling_ns);
        let smallest = smallest_diameter(&setup.grains);
        let cells_per_diameter =
            (fluid.is_some() && smallest.is_finite()).then(|| smallest / largest_edge(setup));
        let reynolds = galileo.map(settling_reynolds);
        let start_reynolds = start_reynolds(setup);
        let mut estimate = Estimate {
            cells,
            refined_cells,
            expected_end_s,
            steps: steps as u64,
            time_step_s,
            memory_bytes: memory::needed(setup, Some(plan)),
            memory_free_bytes: available_memory(),
            disk_bytes: output_bytes(setup, plan, expected_end_s, grain_files) as u64,
            checkpoint_bytes: checkpoint_bytes(setup, plan) as u64,
            galileo,
            galileo_grain: largest.map(|(index, ..)| index),
            reynolds,
            start_reynolds,
            settling_speed_m_per_s: speed,
            cells_per_diameter,
            cells_across_shortest_axis: (fluid.is_some() && smallest.is_finite())
                .then(|| shortest_axis(setup) / largest_edge(setup)),
            drag_error: None,
            blockage: blockage(setup, expected_end_s),
            contact_time_s,
            contact_substeps,
            contact_share: contact_s / (step_s + contact_s).max(f64::MIN_POSITIVE),
            wall_s: steps * (step_s + contact_s),
            warnings: Vec::new(),
        };
        let numbers = cells_per_diameter.zip(estimate.largest_reynolds());
        estimate.drag_error = numbers.map(|(n, re)| drag_error(n, re));
        estimate
    }

    /// Returns the larger of the Reynolds numbers of settling and at the start.
    pub fn largest_reynolds(&self) -> Option<f64> {
        self.reynolds.into_iter().chain(self.start_reynolds).reduce(f64::max)
    }
}

/// Returns the longest edge of the finest cells, along axes with more than one cell [m].
fn largest_edge(setup: &Setup) -> f64 {
    let spacing = setup.finest_spacing();
    let edges = (0..3).filter(|axis| setup.mesh.is_resolved(*axis)).map(|axis| spacing[axis]);
    edges.reduce(f64::max).unwrap_or(spacing.max_element())
}

/// Returns the largest Reynolds number of a grain at the start, with the larger of two speeds: that
/// relative to the fluid or to an inflow, and that of its surface by its spin; none without fluid,
/// and where a formula gives the velocity of the fluid.
fn start_reynolds(setup: &Setup) -> Option<f64> {
    let fluid = setup.fluid.filter(|_| setup.prescription.initial_velocity.is_none())?;
    let inflows = setup.boundaries.0.as_flattened().iter().filter_map(|boundary| match boundary {
        Boundary::Inflow { velocity } => Some(*velocity),
        _ => None,
    });
    let speeds: Vec<DVec3> = inflows.chain([fluid.initial_velocity]).collect();
    let of = |grain: &Grain| {
        let relative = speeds.iter().map(|velocity| grain.velocity.distance(*velocity));
        let diameter = grain.shape.equivalent_diameter();
        let speed = relative.fold(0.5 * diameter * grain.angular_velocity.length(), f64::max);
        speed * diameter / fluid.kinematic_viscosity
    };
    setup.grains.iter().map(of).reduce(f64::max)
}

/// Error of the drag where the boundary layer is resolved, at 8 cells per diameter
/// (`docs/accuracy.md`: 1.3 % at 8 and 0.2 % at 16 cells, Re 100).
const RESOLVED_DRAG_ERROR: f64 = 0.02;

/// Relative error of the drag with `n` cells per diameter at a Reynolds number, where the boundary
/// layer is not resolved. It bounds the errors at 8, 12 and 16 cells in `docs/accuracy.md`: 7.6,
/// 4.6 and 1.2 % at Re 350.
pub(super) fn thin_layer_drag_error(n: f64, reynolds: f64) -> f64 {
    0.0048 * reynolds / n.powf(1.4)
}

/// Relative error of the drag expected with `n` cells per diameter at a Reynolds number: a bound of
/// the errors measured in `docs/accuracy.md`, Re 20 to 350, from 8 cells on.
fn drag_error(n: f64, reynolds: f64) -> f64 {
    let resolved = RESOLVED_DRAG_ERROR * 8.0 / n;
    resolved.max(thin_layer_drag_error(n, reynolds))
}

/// Returns a relative error of the drag as text, "5.9 %". Beyond 30 % the formula is no measure,
/// and the text is "more than 30 %".
pub fn drag_error_text(error: f64, decimals: usize) -> String {
    if error > 0.3 { "more than 30 %".into() } else { format!("{:.decimals$} %", 100.0 * error) }
}

/// Largest number of cells per diameter that is advised.
const MOST_CELLS: u32 = 100_000;

/// Smallest number of cells per diameter, 8 or more, with which the expected error of the drag is
/// at most `error`.
pub fn cells_for_drag_error(error: f64, reynolds: f64) -> u32 {
    (8..MOST_CELLS).find(|n| drag_error(f64::from(*n), reynolds) <= error).unwrap_or(MOST_CELLS)
}

/// Returns the shortest principal extent of a grain [m].
fn shortest_axis(setup: &Setup) -> f64 {
    let extents = setup.grains.iter().map(|grain| grain.shape.morphology().c);
    extents.fold(f64::INFINITY, f64::min)
}

/// Returns the shortest contact time of two equal grains [s]; none for a single grain that is held
/// or has no walls around it.
fn contact_time(setup: &Setup) -> Option<f64> {
    let walls = setup.boundaries.0.iter().flatten().any(Boundary::is_solid);
    let touches = setup.grains.len() > 1 || walls && setup.grains.iter().any(is_free);
    let of = |grain: &Grain| {
        let speed = impact_speed(grain, setup.fluid.as_ref(), setup.gravity, &setup.mesh);
        setup.contact.contact_time(grain, speed)
    };
    let times = setup.grains.iter().map(of);
    times.reduce(f64::min).filter(|time| touches && time.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn expected_errors_bound_the_measured_ones() {
        // Reynolds number, cells per diameter, measured error of the drag (docs/accuracy.md).
        let measured = [
            (20.0, 8.0, 0.001),
            (50.0, 8.0, 0.008),
            (100.0, 8.0, 0.013),
            (100.0, 16.0, 0.003),
            (100.0, 24.0, 0.001),
            (100.0, 32.0, 0.001),
            (150.0, 8.0, 0.005),
            (300.0, 8.0, 0.0464),
            (350.0, 8.0, 0.0756),
            (300.0, 12.0, 0.0276),
            (350.0, 12.0, 0.0456),
            (300.0, 16.0, 0.0056),
            (350.0, 16.0, 0.0121),
        ];
        for (reynolds, n, error) in measured {
            let expected = drag_error(n, reynolds);
            assert!(expected >= error && expected < 0.094, "Re {reynolds}, {n} cells: {expected}");
        }
        assert_eq!(drag_error_text(drag_error(8.0, 350.0), 1), "9.1 %");
        assert_eq!(drag_error_text(drag_error(8.0, 10_900.0), 1), "more than 30 %");
        assert_eq!(cells_for_drag_error(0.05, 100.0), 8);
        assert_eq!(cells_for_drag_error(0.02, 100.0), 10);
        assert_eq!(cells_for_drag_error(0.05, 300.0), 12);
        assert_eq!(cells_for_drag_error(0.02, 300.0), 22);
    }
}

//! What to expect of a case before it runs: Galileo number, settling speed, steps, memory, time.

use glam::DVec3;

use super::readable::quantity;
use super::{Case, warnings};
use grainwake_solver::dem::{Dof, Grain};
use grainwake_solver::flow::{Boundary, FluidParams};
use grainwake_solver::grid::Mesh;
use grainwake_solver::sim::{Setup, StepRule};

/// Numbers of the fields and the solver per cell, for the estimate; `grainwake bench` measures the
/// bytes.
const NUMBERS_PER_CELL: f64 = 13.75;
/// Time of a step on one thread [ns per cell and byte of a number], for the estimate; `grainwake
/// bench` measures it.
const NS_PER_CELL_BYTE: f64 = 3.0;
/// Time of a sub-step of contact on one thread [ns per surface node], for the estimate: of heaps. Grains apart
/// cost next to nothing.
const NS_PER_NODE: f64 = 25.0;

/// Smallest density of a free grain over that of the fluid: tested for spheres, flat and long
/// grains. At a tenth of it some become unstable.
pub(super) const LIGHTEST_FREE: f64 = 0.01;

/// Galileo number sqrt(|rho_p / rho_f - 1| g d^3) / nu of a grain.
pub fn galileo(grain: &Grain, fluid: &FluidParams, g: f64) -> f64 {
    let d = grain.shape.equivalent_diameter();
    ((grain.density / fluid.density - 1.0).abs() * g * d.powi(3)).sqrt() / fluid.kinematic_viscosity
}

/// Drag coefficient of a sphere, Schiller and Naumann (0.44 from Re 1000 on).
pub fn sphere_drag(reynolds: f64) -> f64 {
    if reynolds >= 1000.0 {
        0.44
    } else {
        24.0 / reynolds * (1.0 + 0.15 * reynolds.powf(0.687))
    }
}

/// Reynolds number at which an unbounded sphere of this Galileo number settles:
/// C_D Re^2 = 4/3 Ga^2.
pub fn settling_reynolds(galileo: f64) -> f64 {
    let wanted = 4.0 / 3.0 * galileo * galileo;
    if wanted <= 0.0 {
        return 0.0;
    }
    let (mut low, mut high) = (1e-12_f64, 1e9_f64);
    for _ in 0..200 {
        let middle = (low * high).sqrt();
        if sphere_drag(middle) * middle * middle < wanted {
            low = middle
        } else {
            high = middle
        }
    }
    (low * high).sqrt()
}

/// Settling speed of the equal-volume sphere [m/s].
pub fn terminal_speed(grain: &Grain, fluid: &FluidParams, g: f64) -> f64 {
    settling_reynolds(galileo(grain, fluid, g)) * fluid.kinematic_viscosity
        / grain.shape.equivalent_diameter()
}

/// Speed at which a grain may hit a wall [m/s]: 1.5 times its settling speed, without fluid the
/// speed after falling through the box; at least its speed at the start.
pub(super) fn impact_speed(
    grain: &Grain,
    fluid: Option<&FluidParams>,
    gravity: DVec3,
    mesh: &Mesh,
) -> f64 {
    let g = gravity.length();
    let height = (mesh.extent() * gravity.normalize_or_zero()).length();
    let falling = match fluid {
        Some(fluid) => 1.5 * terminal_speed(grain, fluid, g),
        None => (2.0 * g * height).sqrt(),
    };
    falling.max(grain.velocity.length())
}

/// Derived numbers and warnings. The JSON names are stable.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Estimate {
    /// Cells of the grid.
    pub cells: usize,
    /// Steps expected until `end`.
    pub steps: u64,
    /// Time step expected at the settling speed [s].
    pub time_step_s: f64,
    /// Memory expected [bytes].
    pub memory_bytes: u64,
    /// Largest Galileo number of the grains.
    pub galileo: Option<f64>,
    /// The free grain that has it.
    pub galileo_grain: Option<usize>,
    /// Settling Reynolds number of the equal-volume sphere at that Galileo number.
    pub reynolds: Option<f64>,
    /// Settling speed of that sphere [m/s].
    pub settling_speed_m_per_s: Option<f64>,
    /// Cells across the smallest equal-volume diameter.
    pub cells_per_diameter: Option<f64>,
    /// Blocked part of the cross-section normal to gravity, largest grain.
    pub blockage: Option<f64>,
    /// Duration of a contact of two equal grains, shortest [s].
    pub contact_time_s: Option<f64>,
    /// Sub-steps of the contact in one step.
    pub contact_substeps: Option<f64>,
    /// Wall-clock time expected [s], for the given threads.
    pub wall_s: f64,
    /// What may spoil the results.
    pub warnings: Vec<String>,
}

impl Estimate {
    /// Estimates a case for a run on `threads` threads.
    pub fn of(case: &Case, threads: usize) -> Estimate {
        let setup = &case.setup;
        let g = setup.gravity.length();
        let fluid = setup.fluid.as_ref();
        let moving = |grain: &Grain| grain.translation == Dof::Free;
        let fastest = fluid.and_then(|f| {
            let grains = setup.grains.iter().enumerate();
            // Of equal ones the first.
            grains
                .filter(|(_, grain)| moving(grain))
                .rev()
                .max_by(|a, b| galileo(a.1, f, g).total_cmp(&galileo(b.1, f, g)))
                .map(|(index, grain)| (index, grain, f))
        });
        let galileo = fastest.map(|(_, grain, f)| galileo(grain, f, g));
        let speed = fastest.map(|(_, grain, f)| terminal_speed(grain, f, g));
        let smallest = setup
            .grains
            .iter()
            .map(|g| g.shape.equivalent_diameter())
            .fold(f64::INFINITY, f64::min);
        let plan = &case.plan;
        let outputs = [plan.tables, plan.slices, plan.fields, plan.surfaces];
        let allowed = time_step(setup, speed.unwrap_or(0.0));
        let time_step_s = outputs
            .into_iter()
            .filter(|interval| *interval > 0.0)
            .fold(allowed, f64::min);
        let steps = (case.plan.end / time_step_s).ceil();
        let cells = setup.mesh.cell_count();
        let contact_time_s = contact_time(setup);
        let wet = fluid.is_some();
        let field_bytes = cells as f64 * setup.precision.bytes() as f64;
        let seconds_per_step = if wet {
            field_bytes * NS_PER_CELL_BYTE * 1e-9 / threads.max(1) as f64
        } else {
            0.0
        };
        let nodes = setup.grains.iter().map(|g| g.shape.nodes().len());
        let seconds_per_substep =
            nodes.sum::<usize>() as f64 * NS_PER_NODE * 1e-9 / threads.max(1) as f64;
        let substeps = contact_time_s
            .map(|t| (time_step_s / (t / setup.contact.substeps_per_contact)).max(1.0));
        let mut estimate = Estimate {
            cells,
            steps: steps as u64,
            time_step_s,
            memory_bytes: if wet {
                (field_bytes * NUMBERS_PER_CELL) as u64
            } else {
                0
            },
            galileo,
            galileo_grain: fastest.map(|(index, ..)| index),
            reynolds: galileo.map(settling_reynolds),
            settling_speed_m_per_s: speed,
            cells_per_diameter: (wet && smallest.is_finite())
                .then(|| smallest / setup.mesh.spacing.max_element()),
            blockage: blockage(setup),
            contact_time_s,
            contact_substeps: substeps,
            wall_s: steps * (seconds_per_step + seconds_per_substep * substeps.unwrap_or(1.0)),
            warnings: Vec::new(),
        };
        estimate.warnings = warnings::all(case, &estimate);
        if time_step_s < 0.5 * allowed {
            let message = format!(
                "an output every {} makes the steps shorter than the {} they could have: make [output] intervals longer",
                quantity(time_step_s, "s"),
                quantity(allowed, "s")
            );
            estimate.warnings.push(message);
        }
        estimate
    }
}

/// The step that the rule allows once the grains settle [s].
pub(super) fn settled_time_step(setup: &Setup) -> f64 {
    let g = setup.gravity.length();
    let speeds = setup.grains.iter().filter(|g| g.translation == Dof::Free);
    let speed = setup.fluid.as_ref().map_or(0.0, |f| {
        speeds
            .map(|grain| terminal_speed(grain, f, g))
            .fold(0.0, f64::max)
    });
    time_step(setup, speed)
}

/// The step that the rule allows at `speed` [s].
pub(super) fn time_step(setup: &Setup, speed: f64) -> f64 {
    let axes = setup.mesh.resolved_axes();
    let h: Vec<f64> = axes.map(|axis| setup.mesh.spacing[axis]).collect();
    match setup.step {
        StepRule::Fixed(step) => step,
        StepRule::Limits {
            cfl,
            viscous,
            max_step,
        } => {
            let Some(fluid) = &setup.fluid else {
                return max_step;
            };
            let lids = setup.boundaries.0.iter().flatten().map(|b| match b {
                Boundary::Wall { velocity } | Boundary::Inflow { velocity } => {
                    velocity.abs().element_sum()
                }
                _ => 0.0,
            });
            let given = setup
                .prescription
                .initial_speed(&setup.mesh)
                .unwrap_or(fluid.initial_velocity.abs().element_sum());
            // Next to a settling grain the fluid is somewhat faster than the grain.
            let speed = lids.fold((1.4 * speed).max(given), f64::max);
            let smallest = h.iter().copied().fold(f64::INFINITY, f64::min);
            let inverse_squares: f64 = h.iter().map(|h| h.powi(-2)).sum();
            (cfl * smallest / speed)
                .min(viscous / (fluid.kinematic_viscosity * inverse_squares))
                .min(max_step)
        }
    }
}

fn contact_time(setup: &Setup) -> Option<f64> {
    let of = |grain: &Grain| {
        let speed = impact_speed(grain, setup.fluid.as_ref(), setup.gravity, &setup.mesh);
        setup.contact.contact_time(grain, speed)
    };
    let times = setup.grains.iter().map(of);
    (times.reduce(f64::min)).filter(|time| setup.grains.len() > 1 && time.is_finite())
}

/// Cross-section of the largest grain over that of the box, normal to gravity.
fn blockage(setup: &Setup) -> Option<f64> {
    let largest = setup
        .grains
        .iter()
        .map(|g| g.shape.equivalent_diameter())
        .fold(0.0, f64::max);
    let down = setup.gravity.try_normalize()?;
    setup.fluid.as_ref().filter(|_| largest > 0.0)?;
    let extent = setup.mesh.extent();
    let along = (extent * down.abs()).element_sum();
    Some(std::f64::consts::FRAC_PI_4 * largest * largest * along / extent.element_product())
}

/// Longest step from which a run starts if none is given [s]: gravity moves a grain by a cell
/// (dry: a fiftieth of its diameter) from rest in it.
pub(super) fn default_max_step(
    mesh_spacing: DVec3,
    grains: &[Grain],
    gravity: DVec3,
    dry: bool,
    end: f64,
) -> f64 {
    let g = gravity.length();
    let smallest = grains
        .iter()
        .map(|g| g.shape.equivalent_diameter())
        .fold(f64::INFINITY, f64::min);
    let length = if dry {
        smallest / 50.0
    } else {
        mesh_spacing.min_element()
    };
    let step = if g > 0.0 && length.is_finite() {
        (2.0 * length / g).sqrt()
    } else {
        end / 100.0
    };
    step.min(end)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settling_numbers_of_the_paper() {
        // Ga 198 settles at Re 271 by Schiller and Naumann.
        let re = settling_reynolds(198.1);
        assert!((re - 271.0).abs() < 3.0, "{re}");
        // Stokes limit: Re = Ga^2 / 18.
        let re = settling_reynolds(0.1);
        assert!((re / (0.01 / 18.0) - 1.0).abs() < 0.01, "{re}");
        assert_eq!(settling_reynolds(0.0), 0.0);
    }
}

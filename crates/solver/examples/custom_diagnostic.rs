//! Diagnostic computed from views of the velocity: kinetic energy of a Taylor-Green vortex.
//!
//! Prints the energy every 20 steps next to the exact solution exp(-4 nu k^2 t). Run with
//! `cargo run --release -p grainwake-solver --example custom_diagnostic`.

use std::f64::consts::PI;

use grainwake_solver::flow::{Boundary, FluidParams};
use grainwake_solver::grid::{Axis, FieldView, Mesh};
use grainwake_solver::math::Formula;
use grainwake_solver::sim::{AnyFieldView, Prescription, Setup, Simulation};

const VISCOSITY: f64 = 0.01;
const DENSITY: f64 = 1.0;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let vortex = ["sin(2*PI*x) * cos(2*PI*y)", "-cos(2*PI*x) * sin(2*PI*y)", "0"];
    let velocity = Formula::parse(vortex.map(String::from), &["x", "y", "z"])?;
    // One cell along z makes the flow two-dimensional.
    let setup = Setup::new(Mesh::cubic([64, 64, 1], 1.0 / 64.0))
        .with_boundaries([[Boundary::Periodic; 2]; 3])
        .with_fluid(FluidParams::new(DENSITY, VISCOSITY))
        .with_prescription(Prescription {
            initial_velocity: Some(velocity),
            ..Prescription::default()
        });
    let mut sim = Simulation::new(setup)?;
    let initial = kinetic_energy(&sim);
    println!("time [s]  energy [J]    energy / initial   exact");
    while sim.time() < 1.0 {
        for _ in 0..20 {
            sim.step(f64::INFINITY)?;
        }
        let energy = kinetic_energy(&sim);
        let exact = (-16.0 * VISCOSITY * PI.powi(2) * sim.time()).exp();
        println!("{:8.4}  {energy:.6e}  {:16.6}  {exact:.6}", sim.time(), energy / initial);
    }
    Ok(())
}

/// Kinetic energy of the fluid [J]: each face of a periodic box carries the volume of one cell.
fn kinetic_energy(sim: &Simulation) -> f64 {
    let axes = [Axis::X, Axis::Y, Axis::Z];
    let views = axes.into_iter().filter_map(|axis| sim.velocity(axis));
    let squares: f64 = views
        .map(|view| match view {
            AnyFieldView::Single(view) => sum_of_squares(view, sim.mesh()),
            AnyFieldView::Double(view) => sum_of_squares(view, sim.mesh()),
        })
        .sum();
    0.5 * DENSITY * sim.mesh().cell_volume() * squares
}

/// Sum of u^2 over the faces of the cells; the last face along the axis repeats the first.
fn sum_of_squares<R: Copy + Into<f64>>(view: FieldView<R>, mesh: &Mesh) -> f64 {
    let [nx, ny, nz] = mesh.cells;
    let mut sum = 0.0;
    for (k, j) in (0..nz).flat_map(|k| (0..ny).map(move |j| (k, j))) {
        for value in &view.row(k, j)[..nx] {
            let value: f64 = (*value).into();
            sum += value * value;
        }
    }
    sum
}

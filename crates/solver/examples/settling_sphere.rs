//! Glass sphere of 1 mm settling in water between walls.
//!
//! Prints height and velocity in time, and compares the final velocity with the drag law of
//! Schiller and Naumann for an unbounded fluid; walls make the sphere slower. Run with
//! `cargo run --release -p grainwake-solver --example settling_sphere`.

use grainwake_solver::dem::Grain;
use grainwake_solver::flow::FluidParams;
use grainwake_solver::glam::DVec3;
use grainwake_solver::grid::Mesh;
use grainwake_solver::shape::Shape;
use grainwake_solver::sim::{Setup, Simulation};

const DIAMETER: f64 = 1e-3;
const DENSITY: f64 = 2500.0;
const WATER: f64 = 1000.0;
const VISCOSITY: f64 = 1e-5;
const GRAVITY: f64 = 9.81;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // 8 cells across the sphere in a box of 5 x 5 x 12 diameters.
    let mesh = Mesh::cubic([40, 40, 96], DIAMETER / 8.0);
    let start = mesh.extent() * DVec3::new(0.5, 0.5, 0.9);
    let sphere = Grain::new(Shape::sphere(0.5 * DIAMETER, 600), DENSITY).with_position(start);
    let setup = Setup::new(mesh)
        .with_fluid(FluidParams::new(WATER, VISCOSITY))
        .with_gravity(DVec3::new(0.0, 0.0, -GRAVITY))
        .with_grains([sphere]);
    let mut sim = Simulation::new(setup)?;

    println!("time [ms]  height [mm]  velocity [mm/s]");
    for output in 1..=10 {
        sim.advance_to(10e-3 * f64::from(output))?;
        let grain = &sim.grains()[0];
        println!(
            "{:9.1}  {:11.3}  {:15.2}",
            1e3 * sim.time(),
            1e3 * grain.pose.position.z,
            1e3 * grain.velocity.z
        );
    }
    let speed = -sim.grains()[0].velocity.z;
    println!("Reynolds number {:.1}", speed * DIAMETER / VISCOSITY);
    println!("velocity over that in an unbounded fluid {:.3}", speed / terminal_speed());
    Ok(())
}

/// Terminal speed by C_D = 24/Re (1 + 0.15 Re^0.687) [m/s].
fn terminal_speed() -> f64 {
    let stokes = (DENSITY / WATER - 1.0) * GRAVITY * DIAMETER.powi(2) / (18.0 * VISCOSITY);
    let mut speed = stokes;
    for _ in 0..100 {
        let reynolds = speed * DIAMETER / VISCOSITY;
        speed = 0.5 * (speed + stokes / (1.0 + 0.15 * reynolds.powf(0.687)));
    }
    speed
}

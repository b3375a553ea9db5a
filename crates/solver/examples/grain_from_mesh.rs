//! Grain made of a closed surface mesh, dropped on the floor of a dry box.
//!
//! Takes an STL, OBJ or PLY file in millimetres, or generates an octahedron. Run with
//! `cargo run --release -p grainwake-solver --example grain_from_mesh -- [MESH]`.

use std::path::Path;

use grainwake_solver::dem::{ContactParams, Grain};
use grainwake_solver::flow::Boundary;
use grainwake_solver::glam::{DQuat, DVec3};
use grainwake_solver::grid::Mesh;
use grainwake_solver::shape::mesh::{MeshOptions, TriangleMesh, read_mesh, shape_from_mesh};
use grainwake_solver::shape::{ReadLimits, SourceFile};
use grainwake_solver::sim::{Setup, Simulation, StepRule};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (surface, source) = match std::env::args().nth(1) {
        Some(path) => read_mesh(Path::new(&path), 1e-3, &ReadLimits::default())?,
        None => (octahedron([1.0e-3, 0.8e-3, 0.6e-3]), SourceFile::default()),
    };
    let shape = shape_from_mesh(&surface, &source, &MeshOptions::default())?;
    println!("volume of the mesh  {:.6e} m3", surface.signed_volume());
    println!("volume of the shape {:.6e} m3", shape.volume());
    println!("equivalent diameter {:.4} mm", 1e3 * shape.equivalent_diameter());

    let size = 8.0 * shape.bounding_radius();
    let grain = Grain::new(shape, 2650.0)
        .with_position(DVec3::new(0.5, 0.5, 0.4) * size)
        .with_orientation(DQuat::from_rotation_x(0.5));
    let contact = ContactParams { restitution: 0.5, ..ContactParams::default() };
    let setup = Setup::new(Mesh::cubic([8; 3], size / 8.0))
        .with_boundaries([[Boundary::WALL; 2]; 3])
        .with_gravity(DVec3::new(0.0, 0.0, -9.81))
        .with_contact(contact)
        .with_grains([grain])
        .with_step(StepRule::Fixed(1e-4));
    let mut sim = Simulation::new(setup)?;
    println!("time [ms]  height [mm]  kinetic energy [nJ]  contacts");
    for output in 1..=10 {
        sim.advance_to(0.02 * f64::from(output))?;
        let grain = &sim.grains()[0];
        println!(
            "{:9.1}  {:11.4}  {:19.4}  {:8}",
            1e3 * sim.time(),
            1e3 * grain.pose.position.z,
            1e9 * grain.kinetic_energy(),
            sim.contacts().len()
        );
    }
    Ok(())
}

/// Octahedron with these semi-axes [m]; faces are counter-clockwise seen from outside.
fn octahedron([a, b, c]: [f64; 3]) -> TriangleMesh {
    let vertices = [(a, 0.0, 0.0), (0.0, b, 0.0), (0.0, 0.0, c)];
    let vertices = vertices.map(DVec3::from);
    let mut triangles = Vec::new();
    for octant in 0..8u32 {
        // Vertices 0 to 2 lie on the positive half-axes, 3 to 5 on the negative ones.
        let [x, y, z] = [0, 1, 2].map(|axis| axis + 3 * (octant >> axis & 1));
        let mirrored = octant.count_ones() % 2 == 1;
        triangles.push(if mirrored { [x, z, y] } else { [x, y, z] });
    }
    TriangleMesh { vertices: vertices.into_iter().chain(vertices.map(|v| -v)).collect(), triangles }
}

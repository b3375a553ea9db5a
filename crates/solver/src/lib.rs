//! CFD-iDEM: incompressible flow resolved around grains of real shape, coupled to an image-based
//! discrete element method.
//!
//! A [`sim::Setup`] describes grid, fluid, grains and boundaries; [`sim::Simulation`] advances it
//! in time. Units are SI. Vectors are in the space frame unless a name says otherwise.
//!
//! ```
//! use grainwake_solver::dem::Grain;
//! use grainwake_solver::flow::FluidParams;
//! use grainwake_solver::glam::DVec3;
//! use grainwake_solver::grid::{Axis, Mesh};
//! use grainwake_solver::shape::Shape;
//! use grainwake_solver::sim::{Setup, Simulation};
//!
//! // A glass sphere of 1 mm in a box of water of 3 x 3 x 4 mm, with 8 cells per diameter.
//! let shape = Shape::sphere(0.5e-3, 600);
//! let sphere = Grain::new(shape, 2500.0).with_position(DVec3::new(1.5e-3, 1.5e-3, 3e-3));
//! let setup = Setup::new(Mesh::cubic([24, 24, 32], 0.125e-3))
//!     .with_fluid(FluidParams::new(1000.0, 1e-6))
//!     .with_gravity(DVec3::new(0.0, 0.0, -9.81))
//!     .with_grains([sphere]);
//! let mut simulation = Simulation::new(setup)?;
//! simulation.advance_to(5e-3)?;
//! assert!(simulation.grains()[0].velocity.z < -0.01);
//! let w = simulation.velocity(Axis::Z).expect("the set-up has a fluid");
//! println!("{} m/s at {} m", w.get([16, 12, 12]), w.position([16, 12, 12]));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! `examples/` has longer programs: a settling sphere, a grain from a mesh, a custom diagnostic.
//!
//! Modules import downwards only: `math` < `grid` < `poisson` < `flow`; `math` < `dem`; `flow` and
//! `dem` < `immersed` < `sim`.

pub mod dem;
pub mod flow;
pub mod grid;
pub mod immersed;
pub mod math;
mod poisson;
pub mod sim;

pub use glam;
pub use grainwake_shape as shape;

//! CFD-iDEM: incompressible flow resolved around real grains, coupled to an image-based DEM.
//!
//! Layers, each importing only from those above it in this list:
//! `math` -> `grid` -> `poisson`, `dem` -> `flow` -> `immersed` -> `sim` -> `case`, `output`.

pub mod case;
pub mod dem;
pub mod flow;
pub mod grid;
pub mod immersed;
pub mod math;
pub mod output;
mod poisson;
pub mod sim;

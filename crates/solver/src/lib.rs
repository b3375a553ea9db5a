//! CFD-iDEM: incompressible flow resolved around real grains, coupled to an image-based DEM.
//!
//! Layers, each importing only from those above it in this list:
//! `math` -> `grid` -> `poisson`, `dem` -> `flow` -> `immersed` -> `sim`.

pub mod dem;
pub mod flow;
pub mod grid;
pub mod immersed;
pub mod math;
mod poisson;
pub mod sim;

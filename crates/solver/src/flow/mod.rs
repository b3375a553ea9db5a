//! Incompressible Navier-Stokes on the staggered grid (Eqs 1-4), without grains.
//!
//! Adams-Bashforth for advection and diffusion, incremental pressure correction, one direct
//! Poisson solve a step.

mod boundary;
mod measures;
mod params;
mod prediction;
mod project;
mod solver;
mod tendency;

pub use boundary::{Boundaries, Boundary};
pub(crate) use measures::FlowMeasures;
pub use params::FluidParams;
pub(crate) use prediction::{OldState, Prediction};
pub(crate) use solver::Flow;

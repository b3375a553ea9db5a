//! Incompressible Navier-Stokes on the staggered grid (Eqs 1-4). Knows no grain.

mod boundary;
mod params;

pub use boundary::{Boundaries, Boundary};
pub use params::{Advection, FluidParams};

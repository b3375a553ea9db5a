//! Correction of the advection at links that a grain cuts or is close to; see `correction.rs`.

mod box_velocity;
mod correction;
mod links;
mod weights;

pub use correction::{AdvectionCorrection, AdvectionScratch, add_correction, find_correction};
#[cfg(test)]
pub use weights::{LinkPlanes, compute_link_weights};

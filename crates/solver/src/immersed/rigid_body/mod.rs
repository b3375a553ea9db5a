//! Motion of a grain together with the fluid that responds to it.

mod system;
mod virtual_mass;

pub use system::RigidBodySystem;

//! Equations of motion of a grain together with the impulse of the fluid (Eqs 4b, 4c, 5).

mod system;
mod virtual_mass;

pub use system::RigidBodySystem;

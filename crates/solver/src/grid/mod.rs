//! The uniform staggered (MAC) grid.

mod mesh;

pub use mesh::{Axis, Mesh};

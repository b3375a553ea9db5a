//! The uniform staggered (MAC) grid: geometry, typed fields, loops in a fixed order.

mod field;
mod loops;
mod mesh;

pub use field::{Centre, FACE_OFFSET, FaceVector, FaceX, FaceY, FaceZ, Field, Layout, Location};
pub use loops::{Columns, Run, for_chunks, for_columns, for_planes_of, for_runs, ordered_sum};
pub use mesh::{Axis, Mesh};

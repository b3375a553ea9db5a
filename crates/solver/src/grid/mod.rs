//! The uniform staggered (MAC) grid: geometry, typed fields, loops in a fixed order.

mod field;
mod layout;
mod loops;
mod mesh;
mod shared_rows;
mod view;

pub(crate) use field::{Centre, FACE_OFFSET, FaceVector, Field};
#[cfg(test)]
pub(crate) use field::{FaceZ, Location};
pub(crate) use layout::Layout;
pub(crate) use loops::{
    Columns, PlaneRange, for_chunks, for_columns, for_plane_ranges, for_planes_of, for_slabs,
};
pub use mesh::{Axis, GlobalCell, LocalCell, Mesh, Slab};
pub(crate) use shared_rows::SharedRows;
pub use view::FieldView;

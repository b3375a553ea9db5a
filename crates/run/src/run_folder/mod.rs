//! The run folder: its files, its lock, and the rules for starting in a folder that is not empty.

pub mod checkpoint;
mod compare;
mod folder;
pub mod lock;
pub mod provenance;
mod surfaces;
mod tables;
mod vtk_output;

pub use folder::{Existing, RESOLVED};

pub(crate) use compare::differing;
pub(crate) use folder::{Content, admit, clear, create, lock_folder};
pub(crate) use tables::Tables;
pub(crate) use vtk_output::VtkOutput;

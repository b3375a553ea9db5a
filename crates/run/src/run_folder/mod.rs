//! The run folder: its files, its lock, and the rules for starting in a folder that is not empty.

pub mod checkpoint;
mod compare;
mod contacts;
mod extra;
mod folder;
pub mod lock;
mod parent;
mod probes;
pub mod provenance;
mod scaled;
mod size;
mod surfaces;
mod tables;
mod vtk_output;

pub use folder::{Existing, RESOLVED};
pub use parent::Parent;

pub(crate) use compare::differing;
pub(crate) use extra::ExtraTable;
pub(crate) use folder::{
    Content, admit, admit_parent, clear, create, lock_folder, remove_if_there, same_parent,
    start_lost,
};
pub(crate) use size::{checkpoint_bytes, output_bytes, surface_bytes};
pub(crate) use tables::Tables;
pub(crate) use vtk_output::{VtkOutput, contact_files};

//! File formats of Grainwake. Each format has one type that is written and read here:
//!
//! | file | module |
//! |---|---|
//! | `slices/*.vti`, `fields/*.vti` (VTK image data) | [`vti`] |
//! | `grains/*.vtp` (VTK polygonal data) | [`vtp`] |
//! | `contacts.csv`, `contacts/*.vtp` (VTK polygonal data) | [`contacts`] |
//! | `run.pvd` (ParaView collection) | [`pvd`] |
//! | `grains.csv`, `diagnostics.csv` | [`grains`], [`diagnostics`], [`table`] |
//! | tables of poses | [`poses`] |
//! | `probes/*.csv` | [`probes`] |
//! | `events.jsonl` | [`events`] |
//! | `summary.json` | [`summary`] |
//! | `.grain` files and checkpoints (binary encoding) | [`codec`] |
//!
//! [`disk`] makes every change on the disk. The crate knows no shape, no solver and no case file.

pub mod bounded_file;
pub mod codec;
pub mod contacts;
pub mod diagnostics;
pub mod disk;
mod error;
pub mod events;
pub mod grains;
mod polygonal;
pub mod poses;
pub mod probes;
pub mod pvd;
pub mod summary;
pub mod table;
pub mod vti;
mod vtk_xml;
pub mod vtp;

pub use error::{FormatError, read_text};

/// Makes a type display the name that serde gives its value in files.
#[macro_export]
macro_rules! display_as_serialized {
    ($type:ty) => {
        impl std::fmt::Display for $type {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                serde::Serialize::serialize(self, f)
            }
        }
    };
}

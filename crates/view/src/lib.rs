//! Interactive 3-D page of run folders.
//!
//! [`Viewer`] reads run folders (never the simulation). [`save`] writes one self-contained page
//! that works from disk; [`server::Server`] serves the same page on 127.0.0.1 and follows runs that
//! are still going. The page is made in `web/` with three.js (MIT licence, notice in the bundle)
//! and embedded, so that a build needs no npm.
//!
//! | module | job |
//! |---|---|
//! | `packed` | arrays of numbers as text |
//! | `meshes`, `poses`, `slices` | grains, their motion, fields |
//! | `frame_cache` | encoded slices, for the next request of a run |
//! | `document` | JSON of a run and of the list of runs |
//! | `viewer` | run folders and their current state |
//! | `page` | HTML page with its content security policy |
//! | [`server`] | HTTP on 127.0.0.1 with fixed routes |

mod document;
mod error;
mod frame_cache;
mod meshes;
mod packed;
mod page;
mod poses;
pub mod server;
mod slices;
mod viewer;

use std::path::Path;

pub use document::{StudyRow, StudyTable};
pub use error::ViewError;
pub use viewer::{Source, Viewer};

/// Writes one self-contained page with the present state of all runs; returns notes on missing
/// parts.
///
/// # Errors
/// If no run can be read, or the file cannot be written.
pub fn save(viewer: &mut Viewer, file: &Path) -> Result<Vec<String>, ViewError> {
    let index = viewer.index(false);
    let (runs, notes) = viewer.all_runs()?;
    let text = page::saved(&index, &runs, &viewer.all_pictures()?);
    grainwake_report::write_file(file, text.as_bytes())
        .map_err(|source| ViewError::Write { file: file.to_owned(), source })?;
    Ok(notes)
}

//! `run.pvd`: the pictures of a run in order of time, for ParaView and PyVista.

use std::io;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::file::write_whole;

/// One picture of the run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Picture {
    /// Simulated time [s].
    pub time: f64,
    /// What it shows, "grains" or "slice y-grain0"; one part of the collection.
    pub group: String,
    /// File, relative to the run folder.
    pub file: String,
}

/// Writes the collection; pictures are listed in order of time, then of group.
pub(super) fn write(path: &Path, pictures: &[Picture]) -> io::Result<()> {
    let mut order: Vec<&Picture> = pictures.iter().collect();
    order.sort_by(|a, b| {
        a.time
            .total_cmp(&b.time)
            .then_with(|| a.group.cmp(&b.group))
    });
    let mut groups: Vec<&str> = pictures.iter().map(|p| p.group.as_str()).collect();
    groups.sort_unstable();
    groups.dedup();
    write_whole(path, false, |out| {
        writeln!(out, "<?xml version=\"1.0\"?>")?;
        writeln!(
            out,
            "<VTKFile type=\"Collection\" version=\"1.0\" byte_order=\"LittleEndian\">\n<Collection>"
        )?;
        for p in order {
            let part = groups.iter().position(|g| *g == p.group).unwrap_or(0);
            writeln!(
                out,
                "<DataSet timestep=\"{:?}\" group=\"{}\" part=\"{part}\" file=\"{}\"/>",
                p.time, p.group, p.file
            )?;
        }
        writeln!(out, "</Collection>\n</VTKFile>")
    })
}

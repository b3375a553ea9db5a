//! ParaView collections (`run.pvd`): the slices, fields and surfaces of a run in order of time.

use std::io;
use std::path::Path;

use roxmltree::Document;
use serde::{Deserialize, Serialize};

use crate::bounded_file::{SETTINGS, read_text};
use crate::disk::write_atomically;

/// Entry of a collection: one VTK file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Entry {
    /// Simulated time [s].
    pub time: f64,
    /// Content, "grains" or "slice y-grain0"; each group is one part of the collection.
    pub group: String,
    /// Path relative to the run folder.
    pub file: String,
}

/// Writes a collection in order of time, then of group.
///
/// # Errors
/// Errors of the operating system.
pub fn write(path: &Path, entries: &[Entry]) -> io::Result<()> {
    let mut sorted: Vec<&Entry> = entries.iter().collect();
    sorted.sort_by(|a, b| (a.time.total_cmp(&b.time)).then_with(|| a.group.cmp(&b.group)));
    let mut groups: Vec<&str> = entries.iter().map(|entry| entry.group.as_str()).collect();
    groups.sort_unstable();
    groups.dedup();
    write_atomically(path, false, |out| {
        writeln!(
            out,
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" \
             byte_order=\"LittleEndian\">\n<Collection>"
        )?;
        for entry in sorted {
            let part = groups.iter().position(|group| *group == entry.group);
            writeln!(
                out,
                "<DataSet timestep=\"{:?}\" group=\"{}\" part=\"{}\" file=\"{}\"/>",
                entry.time,
                entry.group,
                part.unwrap_or(0),
                entry.file
            )?;
        }
        writeln!(out, "</Collection>\n</VTKFile>")
    })
}

/// Reads a collection; elements without a file or a time are skipped.
///
/// # Errors
/// A description of the damage, or the error of the operating system.
pub fn read(path: &Path) -> Result<Vec<Entry>, String> {
    let text = read_text(path, SETTINGS).map_err(|error| error.to_string())?;
    let document = Document::parse(&text).map_err(|error| format!("not XML: {error}"))?;
    let elements = document.descendants().filter(|node| node.has_tag_name("DataSet"));
    Ok(elements
        .filter_map(|node| {
            Some(Entry {
                time: node.attribute("timestep")?.parse().ok()?,
                group: node.attribute("group").unwrap_or_default().to_owned(),
                file: node.attribute("file")?.to_owned(),
            })
        })
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_collection_survives_a_round_trip_in_order_of_time() {
        let entry = |time, group: &str| Entry {
            time,
            group: group.into(),
            file: format!("{group}/{time}.vti"),
        };
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.pvd");
        write(&path, &[entry(0.2, "fields"), entry(0.1, "grains")]).unwrap();
        let expected = [entry(0.1, "grains"), entry(0.2, "fields")];
        assert_eq!(read(&path).unwrap(), expected);
    }
}

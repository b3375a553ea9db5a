//! ParaView collections (`run.pvd`): the slices, fields and surfaces of a run in order of time.

use std::collections::BTreeMap;
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
/// Every time lists every group in the same order, so that each block that a reader makes keeps its
/// content and type. A group without a file at a time repeats its last file before, or else its
/// first one.
///
/// # Errors
/// Errors of the operating system.
pub fn write(path: &Path, entries: &[Entry]) -> io::Result<()> {
    let mut times: Vec<f64> = entries.iter().map(|entry| entry.time).collect();
    times.sort_by(f64::total_cmp);
    times.dedup();
    let mut groups: BTreeMap<&str, Vec<&Entry>> = BTreeMap::new();
    for entry in entries {
        groups.entry(&entry.group).or_default().push(entry);
    }
    // The sort is stable: of two files at one time, the first written comes first.
    groups.values_mut().for_each(|files| files.sort_by(|a, b| a.time.total_cmp(&b.time)));
    groups.values_mut().for_each(|files| files.dedup_by(|a, b| a.time == b.time));
    write_atomically(path, false, |out| {
        writeln!(
            out,
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" \
             byte_order=\"LittleEndian\">\n<Collection>"
        )?;
        for time in times {
            for (part, (group, files)) in groups.iter().enumerate() {
                let after = files.partition_point(|entry| entry.time <= time);
                let entry = files[after.saturating_sub(1)];
                let repeated = if entry.time == time { "" } else { " repeated=\"1\"" };
                writeln!(
                    out,
                    "<DataSet timestep=\"{time:?}\" group=\"{group}\" part=\"{part}\" \
                     name=\"{group}\" file=\"{}\"{repeated}/>",
                    entry.file
                )?;
            }
        }
        writeln!(out, "</Collection>\n</VTKFile>")
    })
}

/// Reads a collection; repeated files, and elements without a file or a time, are skipped.
///
/// # Errors
/// A description of the damage, or the error of the operating system.
pub fn read(path: &Path) -> Result<Vec<Entry>, String> {
    let text = read_text(path, SETTINGS).map_err(|error| error.to_string())?;
    let document = Document::parse(&text).map_err(|error| format!("not XML: {error}"))?;
    let elements = document.descendants().filter(|node| node.has_tag_name("DataSet"));
    let elements = elements.filter(|node| node.attribute("repeated").is_none());
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

    #[test]
    fn every_time_lists_every_group_in_the_same_order() {
        let entry =
            |time, group: &str, file: &str| Entry { time, group: group.into(), file: file.into() };
        let entries = [
            entry(0.0, "grains", "g0"),
            entry(0.0, "slice", "s0"),
            entry(0.1, "grains", "g1"),
            entry(0.15, "slice", "kiss"),
            entry(0.15, "fields", "f1"),
            // Written at an interval and at an event.
            entry(0.2, "slice", "s2"),
            entry(0.2, "slice", "landing"),
            entry(0.2, "grains", "g2"),
        ];
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.pvd");
        write(&path, &entries).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        let document = Document::parse(&text).unwrap();
        let sets = document.descendants().filter(|node| node.has_tag_name("DataSet"));
        let attributes = ["timestep", "part", "name", "file"];
        let found: Vec<String> = sets
            .map(|node| attributes.map(|key| node.attribute(key).unwrap_or("?")).join(" "))
            .collect();
        let expected = [
            "0.0 0 fields f1",
            "0.0 1 grains g0",
            "0.0 2 slice s0",
            "0.1 0 fields f1",
            "0.1 1 grains g1",
            "0.1 2 slice s0",
            "0.15 0 fields f1",
            "0.15 1 grains g1",
            "0.15 2 slice kiss",
            "0.2 0 fields f1",
            "0.2 1 grains g2",
            "0.2 2 slice s2",
        ];
        assert_eq!(found, expected);
        // Readers of this program see each file once, at its own time.
        let own = read(&path).unwrap();
        let own: Vec<_> = own.iter().map(|entry| (entry.time, entry.file.as_str())).collect();
        let files = [(0.0, "g0"), (0.0, "s0"), (0.1, "g1"), (0.15, "f1"), (0.15, "kiss")];
        assert_eq!(own[..5], files);
        assert_eq!(own[5..], [(0.2, "g2"), (0.2, "s2")]);
    }
}

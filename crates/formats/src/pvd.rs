//! ParaView collections (`run.pvd`): the slices, fields and surfaces of a run in order of time.

use std::collections::BTreeMap;
use std::fs::OpenOptions;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use roxmltree::Document;
use serde::{Deserialize, Serialize};

use crate::bounded_file::{SETTINGS, read_text};
use crate::disk::{Output, write_atomically};

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

/// End of the file.
const END: &str = "</Collection>\n</VTKFile>\n";

/// Collection that grows with a run: in order of time, then of group.
///
/// Every time lists every group in the same order, so that each block that a reader makes keeps its
/// content and type. A group without a file at a time repeats its last file before, or else its
/// first one.
#[derive(Debug)]
pub struct Collection {
    path: PathBuf,
    /// Number of entries in the file.
    listed: usize,
    /// Last file of each group.
    last: BTreeMap<String, String>,
    /// Last time [s].
    time: f64,
    /// Length of the file without its end [bytes]; none before it is written and after an error.
    length: Option<u64>,
}

impl Collection {
    /// Collection of this file, which is written by the first update.
    pub fn new(path: &Path) -> Collection {
        let last = BTreeMap::new();
        Collection { path: path.into(), listed: 0, last, time: f64::NEG_INFINITY, length: None }
    }

    /// Adds the entries that were appended to `entries` since the last update. The file is
    /// complete afterwards.
    ///
    /// A later time is appended, which takes the same time for a file of any length. A new group
    /// or an earlier time changes what is listed, and the file is written again.
    ///
    /// # Errors
    /// Errors of the operating system. The next update writes the file again.
    pub fn update(&mut self, entries: &[Entry]) -> io::Result<()> {
        let new = entries.get(self.listed..).unwrap_or_default();
        let length = self.length.take().filter(|length| {
            let is_later = |e: &Entry| e.time > self.time && e.time == new[0].time;
            let is_known = |e: &Entry| self.last.contains_key(&e.group);
            // Another program may have changed the file.
            let complete = length + END.len() as u64;
            new.iter().all(|entry| is_later(entry) && is_known(entry))
                && std::fs::metadata(&self.path).is_ok_and(|file| file.len() == complete)
        });
        self.length = Some(match length {
            Some(length) if new.is_empty() => length,
            Some(length) => self.append(length, new)?,
            None => self.write(entries)?,
        });
        self.listed = entries.len();
        Ok(())
    }

    /// Replaces the end of the file, at `length` [bytes], by entries of one later time and the
    /// end, and returns its new length without the end.
    fn append(&mut self, length: u64, new: &[Entry]) -> io::Result<u64> {
        self.time = new[0].time;
        let mut text = String::new();
        for (part, (group, file)) in self.last.iter_mut().enumerate() {
            let entry = new.iter().find(|entry| entry.group == *group);
            if let Some(entry) = entry {
                file.clone_from(&entry.file);
            }
            list(&mut text, self.time, part, group, file, entry.is_none());
        }
        let added = text.len() as u64;
        text.push_str(END);
        let mut out = Output::open(&self.path, OpenOptions::new().write(true))?;
        out.seek(length)?;
        // One write: a program that is killed leaves the file before or after it.
        if let Err(error) = out.write_all(text.as_bytes()) {
            // Best-effort repair; the first error is reported.
            let _ = out.set_len(length).and_then(|()| out.seek(length));
            let _ = out.write_all(END.as_bytes());
            return Err(error);
        }
        Ok(length + added)
    }

    /// Writes the whole file and returns its length without the end [bytes].
    fn write(&mut self, entries: &[Entry]) -> io::Result<u64> {
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
        let mut text = "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" \
                        byte_order=\"LittleEndian\">\n<Collection>\n"
            .to_owned();
        for time in &times {
            for (part, (group, files)) in groups.iter().enumerate() {
                let after = files.partition_point(|entry| entry.time <= *time);
                let entry = files[after.saturating_sub(1)];
                list(&mut text, *time, part, group, &entry.file, entry.time != *time);
            }
        }
        self.time = times.last().copied().unwrap_or(f64::NEG_INFINITY);
        let last = |(group, files): (&str, Vec<&Entry>)| {
            Some((group.to_owned(), files.last()?.file.clone()))
        };
        self.last = groups.into_iter().filter_map(last).collect();
        write_atomically(&self.path, false, |out| {
            out.write_all(text.as_bytes())?;
            out.write_all(END.as_bytes())
        })?;
        Ok(text.len() as u64)
    }
}

/// Adds the line of a file at a time [s] to the text of a collection.
fn list(text: &mut String, time: f64, part: usize, group: &str, file: &str, is_repeated: bool) {
    let repeated = if is_repeated { " repeated=\"1\"" } else { "" };
    *text += &format!(
        "<DataSet timestep=\"{time:?}\" group=\"{group}\" part=\"{part}\" name=\"{group}\" \
         file=\"{file}\"{repeated}/>\n"
    );
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
    use crate::disk::faults::{Fault, inject};

    #[test]
    fn a_collection_survives_a_round_trip_in_order_of_time() {
        let entry = |time, group: &str| Entry {
            time,
            group: group.into(),
            file: format!("{group}/{time}.vti"),
        };
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.pvd");
        let entries = [entry(0.2, "fields"), entry(0.1, "grains")];
        Collection::new(&path).update(&entries).unwrap();
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
        Collection::new(&path).update(&entries).unwrap();
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

    /// Files of two groups, of which one comes late; the last file is of an earlier time.
    fn growing() -> Vec<Entry> {
        let entry = |n: usize, group: &str, file: String| Entry {
            time: 0.25 * n as f64,
            group: group.into(),
            file,
        };
        let mut entries = Vec::new();
        for n in 0..12 {
            entries.push(entry(n, "grains", format!("g{n}")));
            if n % 3 == 2 {
                entries.push(entry(n, "fields", format!("f{n}")));
            }
        }
        entries.push(entry(10, "fields", "kiss".into()));
        entries
    }

    #[test]
    fn a_collection_that_grows_equals_the_whole_one_and_is_not_written_again() {
        let folder = tempfile::tempdir().unwrap();
        let [path, whole] = ["run.pvd", "whole.pvd"].map(|name| folder.path().join(name));
        let text = |path| std::fs::read_to_string(path).unwrap();
        let (entries, mut collection) = (growing(), Collection::new(&path));
        let mut appended = 0;
        for (n, at) in entries.iter().map(|entry| entry.time).enumerate() {
            if entries.get(n + 1).is_some_and(|next| next.time == at && next.group == "fields") {
                continue;
            }
            // A file that is written again has a new node; the open one keeps its content.
            let before = std::fs::File::open(&path);
            collection.update(&entries[..=n]).unwrap();
            Collection::new(&whole).update(&entries[..=n]).unwrap();
            assert_eq!(text(&path), text(&whole));
            let held = before.map(|file| io::read_to_string(file).unwrap());
            appended += usize::from(held.is_ok_and(|held| held == text(&path)));
        }
        // All but the first update, that of the new group, and that of the earlier time.
        assert_eq!(appended, 10);
        // A file cut off by another program is written again.
        std::fs::write(&path, "").unwrap();
        collection.update(&entries).unwrap();
        assert_eq!(text(&path), text(&whole));
    }

    #[test]
    fn a_collection_is_complete_after_a_write_that_fails() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.pvd");
        let text = || std::fs::read_to_string(&path).unwrap();
        let (entries, mut collection) = (growing(), Collection::new(&path));
        collection.update(&entries[..4]).unwrap();
        let before = text();
        for change in 0..2 {
            let fault = inject(folder.path(), Fault::Error, change);
            collection.update(&entries[..5]).unwrap_err();
            drop(fault);
            assert_eq!(text(), before);
            collection.update(&entries[..4]).unwrap();
        }
        collection.update(&entries[..5]).unwrap();
        Collection::new(&path).update(&entries[..5]).unwrap();
        assert!(text().len() > before.len() && read(&path).unwrap().len() == 5);
    }
}

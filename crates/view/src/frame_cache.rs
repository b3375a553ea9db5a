//! Encoded frames of slices, and those that are kept for the next request of the same run.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use serde::Serialize;

use crate::packed::Packed;

/// Largest size of all frames [bytes]: several runs at the limits of a served page.
const LIMIT: usize = 256 << 20;

/// Slice at one time.
#[derive(Clone, Debug, Serialize)]
pub struct Frame {
    /// Time [s].
    pub time: f64,
    /// Cells along the two axes of the plane, in the order x, y, z.
    pub cells: [usize; 2],
    /// Lower corner [m]; along the normal, the middle of the layer.
    pub corner: [f64; 3],
    /// Edge of the cells along the two axes [m].
    pub spacing: [f64; 2],
    /// Values of the codes 0 and 255 of each field.
    pub ranges: [[f64; 2]; 7],
    /// Codes, all of the first field, then of the next; missing fields are 0.
    pub codes: Packed,
}

/// File, layer and coarsening of a frame.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct FrameKey {
    /// File.
    pub file: PathBuf,
    /// Axis of the middle layer of a full field; `None` for a slice.
    pub middle: Option<usize>,
    /// Cells of the run along an edge of a cell of the frame.
    pub coarsening: usize,
}

/// Length and time of the last change of a file. `grainwake run --force` writes another file of the
/// same name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stamp(u64, SystemTime);

impl Stamp {
    /// Returns the stamp of a file, before it is read; `None` if it is unknown.
    pub fn of(file: &Path) -> Option<Stamp> {
        let data = std::fs::metadata(file).ok()?;
        Some(Stamp(data.len(), data.modified().ok()?))
    }
}

struct Entry {
    stamp: Stamp,
    frame: Frame,
    /// Pass that used the frame last.
    pass: u64,
}

/// Frames of the runs shown last, within a bound of the memory.
pub struct FrameCache {
    frames: HashMap<FrameKey, Entry>,
    pass: u64,
    limit: usize,
}

impl FrameCache {
    /// Creates an empty cache.
    pub fn new() -> FrameCache {
        FrameCache { frames: HashMap::new(), pass: 0, limit: LIMIT }
    }

    /// Begins a pass through the frames of one run.
    pub fn begin(&mut self) {
        self.pass += 1;
    }

    /// Returns a frame if its file has not changed since.
    pub fn get(&mut self, key: &FrameKey, stamp: Option<Stamp>) -> Option<Frame> {
        let entry = self.frames.get_mut(key).filter(|entry| Some(entry.stamp) == stamp)?;
        entry.pass = self.pass;
        Some(entry.frame.clone())
    }

    /// Keeps a frame in place of an earlier one; a file without a stamp is read every time.
    pub fn insert(&mut self, key: FrameKey, stamp: Option<Stamp>, frame: Frame) {
        if let Some(stamp) = stamp {
            self.frames.insert(key, Entry { stamp, frame, pass: self.pass });
        }
    }

    /// Ends a pass: removes the frames of the run folder that it has not used, then those of the
    /// runs shown longest ago until the rest is within the limit.
    pub fn end(&mut self, run: &Path) {
        let now = self.pass;
        self.frames.retain(|key, entry| entry.pass == now || !key.file.starts_with(run));
        while self.bytes() > self.limit {
            let Some(oldest) = self.frames.values().map(|entry| entry.pass).min() else {
                break;
            };
            self.frames.retain(|_, entry| entry.pass != oldest);
        }
    }

    fn bytes(&self) -> usize {
        self.frames.values().map(|entry| size_of::<Frame>() + entry.frame.codes.text_bytes()).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(time: f64) -> Frame {
        Frame {
            time,
            cells: [1, 1],
            corner: [0.0; 3],
            spacing: [1.0; 2],
            ranges: [[0.0; 2]; 7],
            codes: Packed::bytes(&[0; 7]),
        }
    }

    fn key(file: &Path) -> FrameKey {
        FrameKey { file: file.to_owned(), middle: None, coarsening: 1 }
    }

    #[test]
    fn a_frame_counts_until_its_file_changes() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("y_000000.vti");
        std::fs::write(&path, "old").unwrap();
        let (mut cache, key) = (FrameCache::new(), key(&path));
        cache.begin();
        cache.insert(key.clone(), Stamp::of(&path), frame(1.0));
        assert_eq!(cache.get(&key, Stamp::of(&path)).unwrap().time, 1.0);
        // The same length, at a later time; then another length at the same time.
        let file = std::fs::File::options().append(true).open(&path).unwrap();
        let modified = file.metadata().unwrap().modified().unwrap();
        file.set_modified(modified + std::time::Duration::from_millis(1)).unwrap();
        assert!(cache.get(&key, Stamp::of(&path)).is_none());
        std::fs::write(&path, "longer").unwrap();
        file.set_modified(modified).unwrap();
        assert!(cache.get(&key, Stamp::of(&path)).is_none());
        std::fs::remove_file(&path).unwrap();
        assert!(cache.get(&key, Stamp::of(&path)).is_none(), "there is no file");
    }

    #[test]
    fn frames_that_a_run_no_longer_has_are_removed() {
        let stamp = Some(Stamp(1, SystemTime::UNIX_EPOCH));
        let [kept, gone, other] = ["a/1", "a/2", "b/1"].map(|file| key(Path::new(file)));
        let mut cache = FrameCache::new();
        for (run, keys) in [("b", &[&other][..]), ("a", &[&kept, &gone]), ("a", &[&kept])] {
            cache.begin();
            keys.iter().for_each(|key| cache.insert((*key).clone(), stamp, frame(0.0)));
            cache.end(Path::new(run));
        }
        assert!(cache.get(&kept, stamp).is_some() && cache.get(&other, stamp).is_some());
        assert!(cache.get(&gone, stamp).is_none());
    }

    #[test]
    fn the_runs_shown_longest_ago_give_way() {
        let stamp = Some(Stamp(1, SystemTime::UNIX_EPOCH));
        let keys = ["a/1", "b/1", "c/1"].map(|file| key(Path::new(file)));
        let mut cache = FrameCache::new();
        cache.begin();
        cache.insert(keys[0].clone(), stamp, frame(0.0));
        // Two frames and a half.
        cache.limit = 5 * cache.bytes() / 2;
        cache.end(Path::new("a"));
        for (shown, run) in [(1, "b"), (0, "a"), (2, "c")] {
            cache.begin();
            if cache.get(&keys[shown], stamp).is_none() {
                cache.insert(keys[shown].clone(), stamp, frame(0.0));
            }
            cache.end(Path::new(run));
        }
        let known = keys.each_ref().map(|key| cache.get(key, stamp).is_some());
        assert_eq!(known, [true, false, true]);
        assert!(cache.bytes() <= cache.limit);
    }
}

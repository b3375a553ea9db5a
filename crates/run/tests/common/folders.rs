//! Run folders as maps of files, for the tests of faults.

use std::collections::BTreeMap;
use std::path::Path;

/// Files below a folder with their contents, without times, the provenance and the lock.
pub fn contents(run: &Path) -> BTreeMap<String, Vec<u8>> {
    fn collect(folder: &Path, run: &Path, found: &mut BTreeMap<String, Vec<u8>>) {
        for path in std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
            if path.is_dir() {
                collect(&path, run, found);
            } else {
                let name = path.strip_prefix(run).unwrap().to_string_lossy().into_owned();
                found.insert(name, std::fs::read(&path).unwrap());
            }
        }
    }
    let mut found = BTreeMap::new();
    collect(run, run, &mut found);
    found.remove("run.lock");
    found.remove("provenance.json").expect("a provenance");
    let summary = found.get_mut("summary.json").expect("a summary");
    let text = String::from_utf8(summary.clone()).unwrap();
    let times = ["\"wall_s\"", "\"cpu_s\""];
    let lines = text.lines().filter(|line| !times.iter().any(|name| line.contains(name)));
    *summary = lines.collect::<Vec<_>>().join("\n").into_bytes();
    found
}

/// Copies a folder.
pub fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for path in std::fs::read_dir(from).unwrap().map(|entry| entry.unwrap().path()) {
        let target = to.join(path.file_name().unwrap());
        if path.is_dir() {
            copy(&path, &target);
        } else {
            std::fs::copy(&path, target).unwrap();
        }
    }
}

/// Returns a temporary folder, in memory if the system has such: to wait for a disk adds nothing to
/// planned faults.
pub fn folder_in_memory() -> tempfile::TempDir {
    let memory = Path::new("/dev/shm");
    let folder = if memory.is_dir() { tempfile::tempdir_in(memory) } else { tempfile::tempdir() };
    folder.unwrap()
}

/// Returns a number from the environment.
pub fn setting(name: &str, default: u64) -> u64 {
    std::env::var(name).map_or(default, |value| value.parse().expect(name))
}

//! Readers of run folders against damaged bytes: a refusal or a result, never a panic. The sound
//! files are the seeds of the fuzz target `tables`. `PROPTEST_CASES` sets the number of cases.

use std::path::Path;

use grainwake_formats::summary::Summary;
use grainwake_formats::table::Table;
use grainwake_formats::{events, grains, poses, pvd, vti, vtp};
use proptest::prelude::*;
use proptest::sample::Index;

/// Reads the file with this name; none if it has no reader in this crate.
fn read(path: &Path) -> Option<Result<(), String>> {
    let notes = &mut Vec::new();
    let folder = path.parent().unwrap();
    Some(match path.file_name().unwrap().to_str().unwrap() {
        "grains.csv" => grains::read(path, notes).map(drop).map_err(|e| e.to_string()),
        "diagnostics.csv" | "contacts.csv" => {
            Table::read(path, notes).map(drop).map_err(|e| e.to_string())
        }
        "events.jsonl" => events::read(path, notes).map(drop).map_err(|e| e.to_string()),
        "summary.json" => Summary::read(folder).map(drop).map_err(|e| e.to_string()),
        "run.pvd" => pvd::read(path).map(drop),
        "slice.vti" => vti::read(path).map(drop).map_err(|e| e.to_string()),
        "grains.vtp" => vtp::read(path).map(drop),
        "poses.csv" => {
            poses::read(path, poses::Origin::Own, Some(0.01)).map(drop).map_err(|e| e.to_string())
        }
        _ => return None,
    })
}

/// Names and contents of the sound files; the seeds begin with a byte that chooses the reader.
fn sound() -> Vec<(String, Vec<u8>)> {
    let seeds = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/seeds/tables");
    let paths = std::fs::read_dir(seeds).unwrap().map(|entry| entry.unwrap().path());
    let named = paths.map(|path| {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        (name, std::fs::read(path).unwrap()[1..].to_vec())
    });
    named.collect()
}

#[test]
fn sound_files_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let mut readers = 0;
    for (name, bytes) in sound() {
        let path = folder.path().join(&name);
        std::fs::write(&path, bytes).unwrap();
        if let Some(result) = read(&path) {
            readers += 1;
            assert_eq!(result, Ok(()), "{name}");
        }
    }
    assert_eq!(readers, 9);
}

fn config() -> ProptestConfig {
    let default = ProptestConfig::default();
    let asked = std::env::var_os("PROPTEST_CASES").is_some();
    let cases = if asked { default.cases } else { 200 };
    ProptestConfig { cases, failure_persistence: None, ..default }
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn damaged_files_are_refused_or_read(
        changes in prop::collection::vec((any::<Index>(), any::<u8>()), 1..6),
        repeated in prop::option::weighted(0.3, (any::<Index>(), any::<Index>())),
        cut in prop::option::weighted(0.3, any::<Index>()),
    ) {
        let folder = tempfile::tempdir().unwrap();
        for (name, mut bytes) in sound() {
            for (at, value) in &changes {
                let at = at.index(bytes.len());
                bytes[at] = *value;
            }
            if let Some((from, to)) = &repeated {
                let (from, to) = (from.index(bytes.len()), to.index(bytes.len()));
                let part = bytes[from.min(to)..from.max(to)].to_vec();
                bytes.splice(to..to, part);
            }
            if let Some(cut) = &cut {
                bytes.truncate(cut.index(bytes.len()));
            }
            let path = folder.path().join(&name);
            std::fs::write(&path, bytes).unwrap();
            if let Some(Err(message)) = read(&path) {
                prop_assert!(!message.is_empty());
            }
        }
    }
}

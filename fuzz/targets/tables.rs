//! Files of run folders and study folders; the first byte chooses the file.

#![no_main]

mod folder;

use grainwake_formats::{events, grains, poses, pvd, summary::Summary, table::Table, vti, vtp};
use grainwake_report::run_folder::RunFolder;
use grainwake_run::provenance::Provenance;
use grainwake_study::Plan;
use libfuzzer_sys::fuzz_target;

const FILES: [&str; 12] = [
    "grains.csv",
    "diagnostics.csv",
    "events.jsonl",
    "summary.json",
    "provenance.json",
    "case.resolved.toml",
    "run.pvd",
    "slice.vti",
    "grains.vtp",
    "poses.csv",
    "study.json",
    "contacts.csv",
];

fuzz_target!(|bytes: &[u8]| {
    let Some((kind, bytes)) = bytes.split_first() else { return };
    let name = FILES[usize::from(*kind) % FILES.len()];
    let path = folder::file(name, bytes);
    let notes = &mut Vec::new();
    match name {
        "grains.csv" => drop(grains::read(&path, notes)),
        "diagnostics.csv" | "contacts.csv" => drop(Table::read(&path, notes)),
        "events.jsonl" => drop(events::read(&path, notes)),
        "summary.json" => drop(Summary::read(folder::folder())),
        "provenance.json" => drop(Provenance::read(folder::folder())),
        "run.pvd" => drop(pvd::read(&path)),
        "slice.vti" => drop(vti::read(&path)),
        "grains.vtp" => drop(vtp::read(&path)),
        "poses.csv" => drop(poses::read(&path, poses::Origin::Own, Some(0.01))),
        "study.json" => drop(Plan::read_or_rebuild(folder::folder())),
        _ => {}
    }
    // The folder as a whole, with all that is in it so far.
    drop(RunFolder::open(folder::folder()));
});

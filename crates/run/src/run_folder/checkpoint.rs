//! Checkpoints: the whole state in one file, checksummed, synced, renamed. Unless the case keeps
//! more, two are kept during a run, and the last one after its end.
//!
//! Layout, little-endian: 8 bytes signature, u32 version, u64 length of the record, the record
//! (JSON), the state of the simulation (`Simulation::save`), SHA-256 of all preceding bytes.

use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use grainwake_formats::codec::{Decoder, Encoder};
use grainwake_formats::disk::{self, sync_folder, write_atomically};
use grainwake_formats::pvd::Entry;
use grainwake_formats::summary;
use grainwake_solver::sim::Simulation;
use grainwake_solver::sim::events::TrackerState;

use super::ExtraTable;
use super::provenance::Provenance;
use super::tables::{self, Lengths};
use crate::contact_events::{PairEvents, WallEvents};
use crate::contact_work::ContactWork;
use crate::error::{Context, RunError};
use crate::number_format::quantity;
use crate::overlaps::Overlaps;

const SIGNATURE: &[u8; 8] = b"GWCKPT\r\n";
const VERSION: u32 = 7;
const CHECKSUM: u64 = 32;
/// Folder of the checkpoints in a run folder.
pub const FOLDER: &str = "checkpoint";
/// Name of the file that marks a folder whose run is being removed.
pub const REMOVAL: &str = ".removal";

/// State of a run besides the simulation. It holds no wall-clock time: two runs of a case write
/// identical bytes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Hash of the case.
    pub digest: String,
    /// Simulated time [s].
    pub time: f64,
    /// Steps taken.
    pub steps: u64,
    /// Lengths of the tables.
    pub lengths: Lengths,
    /// Index of the next output of each series: tables, slices, fields, surfaces, contacts, then
    /// the extra tables.
    pub next: Vec<u64>,
    /// VTK files written.
    #[serde(rename = "pictures")]
    pub vtk_files: Vec<Entry>,
    /// Step with which the run began: 0, or that of the parent.
    #[serde(default)]
    pub first_step: u64,
    /// Largest |div u| so far [1/s].
    pub max_divergence: f64,
    /// Largest CFL number so far.
    pub max_cfl: f64,
    /// Overlaps so far.
    #[serde(default)]
    pub overlaps: Overlaps,
    /// Contact sub-steps and pairs so far.
    #[serde(default)]
    pub contact_work: ContactWork,
    /// Time of the last row of the tables [s].
    pub last_row: Option<f64>,
    /// Times of the last rows of the extra tables [s].
    #[serde(default)]
    pub last_extra_rows: Vec<Option<f64>>,
    /// State of the event tracker.
    pub tracker: TrackerState,
    /// Contacts of grains with walls.
    #[serde(default)]
    pub wall_events: WallEvents,
    /// Contacts between three and more grains.
    #[serde(default, rename = "meetings")]
    pub contact_events: PairEvents,
}

impl Record {
    /// Returns the record of a run of the case with this hash, before its first step.
    pub(crate) fn new(digest: &str, sim: &Simulation, tracker: &TrackerState) -> Record {
        Record {
            digest: digest.into(),
            time: sim.time(),
            steps: sim.steps(),
            lengths: Lengths::default(),
            next: Vec::new(),
            vtk_files: Vec::new(),
            first_step: sim.steps(),
            max_divergence: sim.max_divergence(),
            max_cfl: 0.0,
            overlaps: Overlaps::default(),
            contact_work: ContactWork::default(),
            last_row: None,
            last_extra_rows: Vec::new(),
            tracker: tracker.clone(),
            wall_events: WallEvents::default(),
            contact_events: PairEvents::default(),
        }
    }
}

/// Writer that hashes what it passes on.
struct HashWriter<'a> {
    out: &'a mut dyn Write,
    hash: Sha256,
}

impl Write for HashWriter<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.out.write_all(bytes)?;
        self.hash.update(bytes);
        Ok(bytes.len())
    }
    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

fn name(steps: u64) -> String {
    format!("step-{steps:010}.ckpt")
}

/// Returns the checkpoints in a run folder, newest first.
pub fn list(run: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(run.join(FOLDER)).into_iter().flatten().flatten();
    let mut paths: Vec<PathBuf> =
        entries.map(|e| e.path()).filter(|p| p.extension().is_some_and(|e| e == "ckpt")).collect();
    paths.sort_by(|a, b| b.cmp(a));
    paths
}

/// Writes a checkpoint and removes all but the newest `kept`.
pub(crate) fn write(
    run: &Path,
    record: &Record,
    sim: &Simulation,
    kept: usize,
) -> Result<(), RunError> {
    let folder = run.join(FOLDER);
    let path = folder.join(name(record.steps));
    let json = serde_json::to_vec(record).map_err(io::Error::from).context("write", &path)?;
    write_atomically(&path, true, |out| {
        let mut hashed = HashWriter { out, hash: Sha256::new() };
        let mut encoder = Encoder::new(&mut hashed);
        encoder.raw(SIGNATURE)?;
        encoder.u32(VERSION)?;
        encoder.bytes(&json)?;
        sim.save(&mut hashed)?;
        let HashWriter { out, hash } = hashed;
        out.write_all(&hash.finalize())
    })
    .and_then(|()| sync_folder(&folder))
    .context("write", &path)?;
    keep(run, kept)
}

/// Removes all checkpoints but the newest `count`.
pub(crate) fn keep(run: &Path, count: usize) -> Result<(), RunError> {
    for old in list(run).into_iter().skip(count) {
        disk::remove_file(&old).context("remove", &old)?;
    }
    Ok(())
}

/// Verifies the checksum of a checkpoint and reads its record; the reader is at the state.
pub(super) fn open(path: &Path) -> Result<(Record, BufReader<File>), String> {
    let mut file = File::open(path).map_err(in_words)?;
    let length = file.metadata().map_err(in_words)?.len();
    let body = length.checked_sub(CHECKSUM).ok_or("it is cut off")?;
    let mut hash = Sha256::new();
    let mut buffer = vec![0; 1 << 18];
    let mut left = body;
    while left > 0 {
        let part = buffer.len().min(usize::try_from(left).unwrap_or(usize::MAX));
        file.read_exact(&mut buffer[..part]).map_err(in_words)?;
        hash.update(&buffer[..part]);
        left -= part as u64;
    }
    let mut checksum = [0; CHECKSUM as usize];
    file.read_exact(&mut checksum).map_err(in_words)?;
    if hash.finalize().as_slice() != checksum {
        return Err("its checksum does not match: it is damaged or cut off".into());
    }
    file.seek(SeekFrom::Start(0)).map_err(in_words)?;
    let mut input = BufReader::with_capacity(1 << 18, file);
    let mut signature = [0; 8];
    input.read_exact(&mut signature).map_err(in_words)?;
    let mut decoder = Decoder::new(&mut input);
    if &signature != SIGNATURE || decoder.u32().map_err(in_words)? != VERSION {
        return Err(format!("it is not a checkpoint of version {VERSION}"));
    }
    let json = decoder.bytes().map_err(in_words)?;
    let record = serde_json::from_slice(&json).map_err(|e| e.to_string())?;
    Ok((record, input))
}

/// Reads a checkpoint of the case with this hash into `sim`.
pub(super) fn read(path: &Path, digest: &str, sim: &mut Simulation) -> Result<Record, String> {
    let (record, mut input) = open(path)?;
    if record.digest != digest {
        return Err("it belongs to another case".into());
    }
    sim.restore(&mut input).map_err(in_words)?;
    if sim.time().to_bits() != record.time.to_bits() || sim.steps() != record.steps {
        return Err("its record and its state differ".into());
    }
    Ok(record)
}

/// Describes an error while reading a checkpoint.
fn in_words(error: io::Error) -> String {
    match error.kind() {
        io::ErrorKind::UnexpectedEof => "it is cut off".to_owned(),
        _ => error.to_string(),
    }
}

/// Reads a checkpoint of the run in the folder `run`, with these extra tables, into `sim`.
fn read_own(
    path: &Path,
    run: &Path,
    digest: &str,
    extra: &[ExtraTable],
    sim: &mut Simulation,
) -> Result<Record, String> {
    let (record, _) = open(path)?;
    if let Some(lacking) = record.lengths.lacking(run, extra) {
        return Err(format!("the tables do not reach it: {lacking}"));
    }
    read(path, digest, sim)
}

/// Restores the newest valid checkpoint that the tables reach; `note` receives the faults of newer
/// ones. None if the run was interrupted before its first checkpoint.
///
/// # Errors
/// [`RunError::NoCheckpoint`] if there are checkpoints and none is valid, or if there is none and
/// the run has results.
pub(crate) fn restore(
    run: &Path,
    digest: &str,
    extra: &[ExtraTable],
    sim: &mut Simulation,
    note: &mut dyn FnMut(&str),
) -> Result<Option<Record>, RunError> {
    let mut reasons = Vec::new();
    for path in list(run) {
        match read_own(&path, run, digest, extra, sim) {
            Ok(record) => {
                for reason in &reasons {
                    note(&format!(
                        "warning: {reason}; continuing from the checkpoint before it (t = {})",
                        quantity(record.time, "s")
                    ));
                }
                return Ok(Some(record));
            }
            Err(reason) => reasons.push(format!("{}: {reason}", path.display())),
        }
    }
    // A checkpoint after a step writes its cost into the provenance.
    let has_stepped = Provenance::read(run).is_some_and(|own| own.cost().wall_s > 0.0);
    let has_results =
        run.join(summary::FILE).exists() || has_stepped || tables::has_later_rows(run);
    if reasons.is_empty() && has_results && !run.join(REMOVAL).exists() {
        reasons.push("the folder has none; they may have been removed".to_owned());
    }
    if reasons.is_empty() {
        Ok(None)
    } else {
        Err(RunError::NoCheckpoint {
            folder: run.join(FOLDER),
            reasons,
            remedy: "To start over, run again with --force instead of --resume",
        })
    }
}

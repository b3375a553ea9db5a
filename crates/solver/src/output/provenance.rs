//! `provenance.json`: with what, where and when a run was made.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::error::{Context, RunError};
use super::file::write_whole;

/// Where a run comes from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Provenance {
    /// Name of the program; also tells a run folder from other folders.
    pub program: String,
    /// Its version.
    pub version: String,
    /// Its commit, where known when it was built.
    pub commit: Option<String>,
    /// SHA-256 of what decides the results.
    pub case_sha256: String,
    /// Each time the run was started or resumed.
    pub sessions: Vec<Session>,
}

/// One session of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Session {
    /// Date and time of its start, with the offset from UTC.
    pub started: String,
    /// The command.
    pub command: Vec<String>,
    /// Processor.
    pub cpu: String,
    /// Operating system and architecture.
    pub system: String,
    /// Threads.
    pub threads: usize,
    /// Step from which it went on.
    pub from_step: u64,
    /// Wall-clock time up to its last checkpoint or its end [s].
    pub wall_s: f64,
}

/// Name of the file in a run folder.
pub const FILE: &str = "provenance.json";
/// What `program` says.
pub const PROGRAM: &str = "grainwake";

/// Commit that the program was built from, where known.
pub fn commit() -> Option<&'static str> {
    option_env!("GRAINWAKE_COMMIT").filter(|c| !c.is_empty())
}

impl Provenance {
    /// Of a new run.
    pub fn new(digest: &str) -> Provenance {
        Provenance {
            program: PROGRAM.into(),
            version: env!("CARGO_PKG_VERSION").into(),
            commit: commit().map(str::to_owned),
            case_sha256: digest.into(),
            sessions: Vec::new(),
        }
    }
    /// Of an existing run folder; none where there is none or it cannot be read.
    pub fn read(run: &Path) -> Option<Provenance> {
        let text = std::fs::read_to_string(run.join(FILE)).ok()?;
        serde_json::from_str(&text)
            .ok()
            .filter(|p: &Provenance| p.program == PROGRAM)
    }
    /// Writes it.
    pub(super) fn write(&self, run: &Path) -> Result<(), RunError> {
        let path = run.join(FILE);
        write_whole(&path, false, |out| {
            serde_json::to_writer_pretty(&mut *out, self)?;
            writeln!(out)
        })
        .context("write", &path)
    }
    /// Wall-clock time of all sessions [s].
    pub fn wall_s(&self) -> f64 {
        self.sessions.iter().map(|s| s.wall_s).sum()
    }
}

impl Session {
    /// A session that starts now.
    pub fn now(command: &[String], threads: usize, from_step: u64) -> Session {
        Session {
            started: jiff::Zoned::now()
                .strftime("%Y-%m-%dT%H:%M:%S%:z")
                .to_string(),
            command: command.to_vec(),
            cpu: cpu(),
            system: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
            threads,
            from_step,
            wall_s: 0.0,
        }
    }
}

fn cpu() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = text.lines().find_map(|line| {
        line.strip_prefix("model name")?
            .split_once(':')
            .map(|(_, n)| n.trim().to_string())
    });
    name.unwrap_or_else(|| "unknown".into())
}

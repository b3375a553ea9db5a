//! Provenance of a run (`provenance.json`): program, machine, command and time.

use std::path::Path;

use serde::{Deserialize, Serialize};

use grainwake_formats::summary::{Cost, write_json};

use crate::error::{Context, RunError};

/// Provenance of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Provenance {
    /// Name of the program; it marks a folder as a run folder.
    pub program: String,
    /// Version of the program.
    pub version: String,
    /// Commit of the program, if known at build time.
    pub commit: Option<String>,
    /// SHA-256 of everything that affects the results.
    pub case_sha256: String,
    /// Run and checkpoint that the run started from; none if it started at t = 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub parent: Option<ParentRun>,
    /// Program that stepped the run and may have controlled its grains: "Python"; none for a run of
    /// the case alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub controlled_from: Option<String>,
    /// Sessions: the first start and each resumption.
    pub sessions: Vec<Session>,
}

/// Run from whose checkpoint another run started.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ParentRun {
    /// Absolute path of its folder at the start.
    pub folder: String,
    /// Version of the program that began it.
    pub version: String,
    /// Commit of that program, if known.
    pub commit: Option<String>,
    /// SHA-256 of everything that affects its results.
    pub case_sha256: String,
    /// Simulated time of the checkpoint [s].
    pub checkpoint_time: f64,
    /// Steps taken up to the checkpoint.
    pub checkpoint_step: u64,
    /// Run that the parent itself started from.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub parent: Option<Box<ParentRun>>,
}

/// Session of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Session {
    /// Start, with the offset from UTC.
    pub started: String,
    /// Command line.
    pub command: Vec<String>,
    /// Processor.
    pub cpu: String,
    /// Operating system and architecture.
    pub system: String,
    /// Threads.
    pub threads: usize,
    /// First time step.
    pub from_step: u64,
    /// Computing time up to the last checkpoint or the end.
    #[serde(flatten)]
    pub cost: Cost,
}

/// Name of the file in a run folder.
pub const FILE: &str = "provenance.json";
/// Value of `program`.
pub const PROGRAM: &str = "grainwake";

/// Returns the commit that the program was built from, if known.
pub fn commit() -> Option<&'static str> {
    option_env!("GRAINWAKE_COMMIT").filter(|c| !c.is_empty())
}

impl ParentRun {
    /// Returns a comment for `case.resolved.toml`, which alone describes a start at t = 0.
    pub(crate) fn comment(&self) -> String {
        let ParentRun { folder, checkpoint_time: time, checkpoint_step: step, .. } = self;
        let folder = folder.escape_debug();
        format!("# Started from step {step} of another run: --from \"{folder}@{time:e}\"\n")
    }
}

impl Provenance {
    /// Returns the provenance of a new run.
    pub fn new(digest: &str) -> Provenance {
        Provenance {
            program: PROGRAM.into(),
            version: env!("CARGO_PKG_VERSION").into(),
            commit: commit().map(str::to_owned),
            case_sha256: digest.into(),
            parent: None,
            controlled_from: None,
            sessions: Vec::new(),
        }
    }
    /// Reads the provenance of a run folder; none if it is absent or damaged.
    pub fn read(run: &Path) -> Option<Provenance> {
        let text = std::fs::read_to_string(run.join(FILE)).ok()?;
        serde_json::from_str(&text).ok().filter(|p: &Provenance| p.program == PROGRAM)
    }
    /// Writes the provenance into the folder of a run.
    pub(crate) fn write(&self, run: &Path) -> Result<(), RunError> {
        let path = run.join(FILE);
        write_json(&path, true, self).context("write", &path)
    }
    /// Returns the computing time of all sessions.
    pub fn cost(&self) -> Cost {
        let mut sessions = self.sessions.iter().map(|session| &session.cost);
        let mut total = sessions.next().cloned().unwrap_or_default();
        sessions.for_each(|cost| total += cost);
        total
    }
}

impl Session {
    /// Returns a session that starts now.
    pub fn now(command: &[String], threads: usize, from_step: u64) -> Session {
        Session {
            started: jiff::Zoned::now().strftime("%Y-%m-%dT%H:%M:%S%:z").to_string(),
            command: command.to_vec(),
            cpu: cpu(),
            system: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
            threads,
            from_step,
            // A session that ends early counts with no time.
            cost: Cost { cpu_s: Some(0.0), ..Cost::default() },
        }
    }
}

fn cpu() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = text.lines().find_map(|line| {
        line.strip_prefix("model name")?.split_once(':').map(|(_, n)| n.trim().to_string())
    });
    name.unwrap_or_else(|| "unknown".into())
}

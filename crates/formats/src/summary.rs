//! Results of a run (`summary.json`).

use std::io;
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::bounded_file::{SETTINGS, read_text};
use crate::disk::write_atomically;
use crate::events::Event;

/// Name of the file in a run folder; it is written last.
pub const FILE: &str = "summary.json";

/// Results of a run. The JSON names are stable; the names of a pair's results are at the top level.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Steps taken.
    pub steps: u64,
    /// Simulated time at the end [s].
    pub end_time_s: f64,
    /// Computing time of all sessions.
    #[serde(flatten)]
    pub cost: Cost,
    /// Events in the order of their confirmation.
    pub events: Vec<Event>,
    /// Largest |div u| after any step [1/s].
    pub max_divergence: f64,
    /// Largest CFL number of any step.
    pub max_cfl: f64,
    /// Largest overlap of any contact, over the smaller equivalent diameter.
    #[serde(default)]
    pub max_overlap: f64,
    /// Mean overlap over all contacts and steps, over the smaller equivalent diameter.
    #[serde(default)]
    pub mean_overlap: f64,
    /// Contact sub-steps.
    #[serde(default)]
    pub substeps: SubstepCounts,
    /// Touching pairs, walls included.
    #[serde(default)]
    pub contact_pairs: PairCounts,
    /// Scales of the dimensionless columns of the tables, if they have them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scales: Option<Scales>,
    /// Reason of the end.
    pub ended_by: EndReason,
    /// Results of a pair.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub pair: Option<PairSummary>,
    /// Each grain.
    pub grains: Vec<GrainSummary>,
}

/// Computing time.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Cost {
    /// Wall-clock time [s].
    pub wall_s: f64,
    /// CPU time of all threads [s]; none if it is unknown.
    #[serde(default)]
    pub cpu_s: Option<f64>,
    /// Times of the passes of a step, of the outputs and of the rest.
    #[serde(default)]
    pub passes: Vec<PassTime>,
}

/// Computing time of one pass.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PassTime {
    /// Name: "predict", "contact", "output" and so on.
    pub name: String,
    /// Wall-clock time [s].
    pub wall_s: f64,
    /// CPU time of all threads [s]; none if it is unknown.
    pub cpu_s: Option<f64>,
}

impl std::ops::AddAssign<&Cost> for Cost {
    /// Adds the time of another session; the CPU time is unknown if it is unknown for one of them.
    fn add_assign(&mut self, other: &Cost) {
        let sum = |a: Option<f64>, b: Option<f64>| Some(a? + b?);
        self.cpu_s = sum(self.cpu_s, other.cpu_s);
        self.wall_s += other.wall_s;
        for pass in &other.passes {
            match self.passes.iter_mut().find(|known| known.name == pass.name) {
                Some(known) => {
                    known.wall_s += pass.wall_s;
                    known.cpu_s = sum(known.cpu_s, pass.cpu_s);
                }
                None => self.passes.push(pass.clone()),
            }
        }
    }
}

/// Scales of dimensionless columns.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scales {
    /// Length [m].
    pub length_m: f64,
    /// Time [s].
    pub time_s: f64,
    /// Velocity [m/s].
    pub velocity_m_per_s: f64,
    /// Density [kg/m3].
    pub density_kg_per_m3: f64,
}

/// Number of contact sub-steps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SubstepCounts {
    /// Sub-steps in all steps.
    pub total: u64,
    /// Most sub-steps in a step.
    pub largest_per_step: u64,
}

/// Number of touching pairs, walls included.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PairCounts {
    /// Mean over the steps.
    pub mean: f64,
    /// Most pairs in a step.
    pub largest: u64,
}

/// Reason of the end of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum EndReason {
    /// The end time was reached.
    End,
    /// The grains landed.
    Landing,
    /// The grains came to rest.
    Rest,
    /// The grains separated.
    Separation,
}

crate::display_as_serialized!(EndReason);

/// Results of a pair.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PairSummary {
    /// First contact [s].
    pub kiss_time_s: Option<f64>,
    /// Start of the tumbling: the line of centres passes 45 degrees after the kiss [s].
    pub tumble_time_s: Option<f64>,
    /// Last separation; none while the grains are together [s].
    pub separation_time_s: Option<f64>,
    /// Number of times the upper grain has passed the lower one.
    pub role_changes: usize,
    /// Phase at the end.
    pub phase: String,
}

/// Results of one grain.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GrainSummary {
    /// Diameter of the sphere of equal volume [m].
    pub equivalent_diameter_m: f64,
    /// Density [kg/m3].
    pub density: f64,
    /// Largest speed along gravity after any step [m/s].
    pub peak_settling_speed_m_per_s: f64,
    /// First contact with the floor [s].
    pub landing_time_s: Option<f64>,
    /// Centroid at the end [m]; none if the grain has left the box.
    pub position_m: Option<[f64; 3]>,
}

impl Summary {
    /// Reads the summary of a finished run from its folder.
    ///
    /// # Errors
    /// `InvalidData` for a damaged file, or errors of the operating system.
    pub fn read(run: &Path) -> io::Result<Summary> {
        let text = read_text(&run.join(FILE), SETTINGS)?;
        serde_json::from_str(&text).map_err(io::Error::from)
    }

    /// Writes the summary into the folder of a run, durably.
    ///
    /// # Errors
    /// Errors of the operating system.
    pub fn write(&self, run: &Path) -> io::Result<()> {
        write_json(&run.join(FILE), true, self)
    }
}

/// Writes a value as indented JSON with a final line break; with `sync`, durably.
///
/// # Errors
/// Errors of the operating system.
pub fn write_json(path: &Path, sync: bool, value: &impl Serialize) -> io::Result<()> {
    write_atomically(path, sync, |out| {
        serde_json::to_writer_pretty(&mut *out, value)?;
        writeln!(out)
    })
}

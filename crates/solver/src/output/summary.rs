//! `summary.json`: what came out of a run.

use serde::{Deserialize, Serialize};

use crate::sim::events::Event;

/// Results of a run. The JSON names are stable; those of a pair stand at the top level.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Steps taken.
    pub steps: u64,
    /// Simulated time at the end [s].
    pub end_time_s: f64,
    /// Wall-clock time of all sessions [s].
    pub wall_s: f64,
    /// What happened, in the order in which it became certain.
    pub events: Vec<Event>,
    /// Largest |div u| after any step [1/s].
    pub max_divergence: f64,
    /// Largest CFL number of any step.
    pub max_cfl: f64,
    /// Why the run ended: "end", "landing", "rest" or "separation".
    pub ended_by: String,
    /// Results of a pair.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub pair: Option<PairSummary>,
    /// Each grain.
    pub grains: Vec<GrainSummary>,
}

/// Results of a pair.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PairSummary {
    /// First contact [s].
    pub kiss_time_s: Option<f64>,
    /// Start of the tumbling: the line of centres passes 45 degrees after the kiss [s].
    pub tumble_time_s: Option<f64>,
    /// Last parting; none while the grains are together [s].
    pub separation_time_s: Option<f64>,
    /// How often the upper grain has passed the lower one.
    pub role_changes: usize,
    /// Phase at the end.
    pub phase: String,
}

/// One grain.
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
    /// Centroid at the end [m].
    pub position_m: [f64; 3],
}

//! What a run writes and when it ends. Times are simulated seconds unless said otherwise.

use crate::sim::events::StopWhen;

/// The plan of a run, validated. An interval of zero turns that output off.
#[derive(Clone, Debug, PartialEq)]
pub struct RunPlan {
    /// End of the run [s].
    pub end: f64,
    /// Ends the run earlier.
    pub stop: Option<Stop>,
    /// A run whose steps fall below this, though no output asks for it, has become unstable [s].
    pub smallest_step: f64,
    /// Interval of the rows of the tables [s].
    pub tables: f64,
    /// Interval of the slices [s].
    pub slices: f64,
    /// Interval of the full fields [s].
    pub fields: f64,
    /// Interval of the posed grain surfaces [s].
    pub surfaces: f64,
    /// Slices and surfaces also at events.
    pub at_events: bool,
    /// Slice planes.
    pub planes: Vec<Plane>,
    /// Wall-clock time between checkpoints [s].
    pub checkpoint_interval: f64,
    /// Steps between checkpoints.
    pub checkpoint_steps: u64,
}

/// Ends a run `hold` seconds after something has happened, or has become true to stay.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stop {
    /// What.
    pub when: StopWhen,
    /// How long to go on [s].
    pub hold: f64,
}

/// A slice plane, one cell thick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Axis of its normal.
    pub axis: usize,
    /// Where along that axis.
    pub place: Place,
}

/// Where a plane lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Place {
    /// At this coordinate [m].
    At(f64),
    /// Through the centroid of this grain.
    Grain(usize),
}

impl Plane {
    /// Name in file names, "y-grain0" or "y-mid1".
    pub fn name(&self, index: usize) -> String {
        let axis = ["x", "y", "z"][self.axis];
        match self.place {
            Place::Grain(grain) => format!("{axis}-grain{grain}"),
            Place::At(_) => format!("{axis}-plane{index}"),
        }
    }
}

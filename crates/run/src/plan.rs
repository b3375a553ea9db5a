//! Outputs and end of a run. Times are simulated times unless stated otherwise.

use glam::DVec3;
use grainwake_formats::summary::Scales;

use grainwake_solver::sim::SAME_TIME;
use grainwake_solver::sim::events::StopWhen;

/// Validated plan of a run. An interval of zero turns an output off.
#[derive(Clone, Debug, PartialEq)]
pub struct RunPlan {
    /// End of the run [s].
    pub end: f64,
    /// Condition of an earlier end.
    pub stop: Option<Stop>,
    /// Shortest plausible time step [s]: a shorter one, unless an output requires it, means
    /// instability.
    pub smallest_step: f64,
    /// Interval of the rows of the tables [s].
    pub tables: f64,
    /// Interval of the slices [s].
    pub slices: f64,
    /// Interval of the full fields [s].
    pub fields: f64,
    /// Interval of the grain surfaces [s].
    pub surfaces: f64,
    /// Whether slices and surfaces are also written at events.
    pub at_events: bool,
    /// Slice planes.
    pub planes: Vec<Plane>,
    /// Interval of the rows of `contacts.csv` [s].
    pub contacts: f64,
    /// Interval of the VTK files of the contacts [s].
    pub contact_network: f64,
    /// Whether contacts with walls are events.
    pub wall_events: bool,
    /// Points, lines and planes sampled over time.
    pub probes: Vec<Probe>,
    /// Scales of the dimensionless columns, if the tables have them.
    pub scales: Option<Scales>,
    /// Wall-clock time between checkpoints [s].
    pub checkpoint_interval: f64,
    /// Steps between checkpoints.
    pub checkpoint_steps: u64,
    /// Number of checkpoints to keep, if given.
    pub checkpoint_keep: Option<usize>,
}

impl RunPlan {
    /// Returns whether the end is reached at this time [s].
    pub fn at_end(&self, time: f64) -> bool {
        time >= self.end * (1.0 - SAME_TIME)
    }
    /// Returns the number of checkpoints kept during the run: at least two, in case the newest one
    /// is damaged.
    pub(crate) fn kept_during_run(&self) -> usize {
        self.checkpoint_keep.map_or(2, |kept| kept.max(2))
    }
    /// Returns the number of checkpoints kept after the end: by default one, which suffices to
    /// continue to a later end.
    pub(crate) fn kept_after_end(&self) -> usize {
        self.checkpoint_keep.unwrap_or(1)
    }
    /// Returns the intervals of all outputs that are turned on [s].
    pub fn intervals(&self) -> impl Iterator<Item = f64> {
        let tables = [self.tables, self.contacts];
        let files = [self.slices, self.fields, self.surfaces, self.contact_network];
        let probes = self.probes.iter().map(|probe| probe.every);
        tables.into_iter().chain(files).chain(probes).filter(|interval| *interval > 0.0)
    }
}

/// Points or a plane whose state is written to a table of its own.
#[derive(Clone, Debug, PartialEq)]
pub struct Probe {
    /// Name of the table.
    pub name: String,
    /// Interval of its rows [s].
    pub every: f64,
    /// Points or plane.
    pub place: ProbePlace,
}

/// Place of a probe.
#[derive(Clone, Debug, PartialEq)]
pub enum ProbePlace {
    /// Points [m].
    Points(Vec<DVec3>),
    /// Plane across the box.
    Plane {
        /// Axis of its normal.
        axis: usize,
        /// Coordinate along that axis [m].
        at: f64,
    },
}

/// Stop condition: the run ends `hold` seconds after the condition became true for good.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stop {
    /// Condition.
    pub when: StopWhen,
    /// Time to continue [s].
    pub hold: f64,
}

/// Slice plane, one cell thick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Axis of its normal.
    pub axis: usize,
    /// Position along that axis.
    pub position: PlanePosition,
}

/// Position of a plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PlanePosition {
    /// Coordinate [m].
    At(f64),
    /// Centroid of a grain.
    Grain(usize),
}

impl Plane {
    /// Returns the name in file names, "y-grain0" or "y-plane1".
    pub fn name(&self, index: usize) -> String {
        let axis = ["x", "y", "z"][self.axis];
        match self.position {
            PlanePosition::Grain(grain) => format!("{axis}-grain{grain}"),
            PlanePosition::At(_) => format!("{axis}-plane{index}"),
        }
    }
}

//! Studies: many runs of one case, and what they say together.
//!
//! A study file expands a base case along axes into [`Model`]s ([`Study::read`]); [`Plan::of`]
//! resolves each into a [`Run`] with a stable name and a hash of its case and of the program;
//! [`carry_out`] runs what is missing, several at once, each from its last checkpoint. A study
//! folder holds `study.json` (the plan), `runs/NAME/` (ordinary run folders), and what is made of
//! them.

mod claims;
pub mod correlation;
mod error;
mod fall;
pub mod figure;
mod file;
pub mod judge;
mod measure;
mod model;
mod motion;
mod offset;
mod page;
mod plan;
mod raw;
mod report;
mod runner;
mod select;
mod settling;
mod state;
pub mod stats;
mod table;
pub mod words;

pub use claims::{Analysis, Claim, Condition, Correlations, FigurePlan, Sign, Test};
pub use error::StudyError;
pub use file::{Ensemble, Study};
pub use measure::{Measures, Pair, QUANTITIES};
pub use model::{Model, Setting};
pub use motion::{HISTORIES, Motion};
pub use plan::{MEASURED, Manifest, Plan, Run};
pub use report::{Rendered, render};
pub use runner::{Options, Outcome, Watcher, carry_out};
pub use select::Selection;
pub use settling::{Fallen, SETTLING, Settling};
pub use state::{State, state};
pub use table::{GRAINS, Row, columns, csv_of, table, write_table};

/// Subfolder of a study folder that holds the run folders.
pub const RUNS: &str = "runs";
/// The plan of a study, in its folder.
pub const MANIFEST: &str = "study.json";

//! Parameter studies: many runs of one case, their measured values and statistics over the runs.
//!
//! The modules import downwards only, in this order from bottom to top:
//!
//! | module | job |
//! |---|---|
//! | [`mod@format`] | text form of values |
//! | [`plan`] | study file to models, models to runs with a stable name and hash |
//! | [`run`] | state of a run, time of its steps, job queue that executes and resumes runs |
//! | [`measure`] | one run folder to measured values, and the table of all runs |
//! | [`analysis`] | statistics over runs, right-censored observations, verdicts on claims |
//! | [`page`] | figures and report page |
//!
//! A study folder holds `study.json` (the plan), `runs/NAME/` (run folders), the tables and the
//! report.

pub mod analysis;
mod error;
pub mod format;
pub mod measure;
pub mod page;
pub mod plan;
pub mod run;

pub use analysis::{correlation, factor_mean, kissing, observation, statistics, survival, verdict};
pub use error::StudyError;
pub use measure::cost::{Cost, expected_cost, one_per_grid};
pub use measure::pair::{PairHistory, PairMeasures};
pub use measure::record::{RunRecord, note_on_unmeasured, records};
pub use measure::settling::{GrainSettling, SettlingMeasures};
pub use measure::table::{columns, to_csv, write_tables};
pub use measure::trajectory::Trajectory;
pub use page::{StudyReportFiles, render};
pub use plan::claims::{
    Analysis, Claim, Condition, Correlations, FigureRequest, Kissing, Range, Sign, Test,
};
pub use plan::expand::{Model, Setting};
pub use plan::file::{Ensemble, Study};
pub use plan::selection::Selection;
pub use plan::{MANIFEST, Plan, RUNS, Run};
pub use run::state::{Archive, RunState, StateKind, refuse_to_replace, run_state};
pub use run::step_time::{StepTime, time_steps};
pub use run::{Options, Outcome, RESTORE, StudyObserver, execute};

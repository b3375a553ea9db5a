//! The record of a run: its state, its factors and its measured values.

use std::path::Path;

use glam::DVec3;
use grainwake_formats::summary::{self, Summary};
use grainwake_report::run_folder::RunFolder;
use grainwake_run::provenance::Provenance;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::mean;
use super::pair::PairMeasures;
use super::settling::SettlingMeasures;
use crate::error::{StudyError, read_rows};
use crate::plan::{Factors, Levels, Plan, Run, TABLE};
use crate::run::state::{RunState, StateKind, folder_state};

/// A run and its measured values. The JSON names are stable.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RunRecord {
    /// Name of the run.
    pub name: String,
    /// Name of the model.
    pub model: String,
    /// Index in the ensemble.
    pub member: usize,
    /// Level on each axis.
    pub levels: Levels,
    /// Numerical factors.
    pub factors: Factors,
    /// State.
    pub state: StateKind,
    /// Reason of a failed, stale or damaged run, or what is wrong with the files of a finished
    /// one.
    pub remark: Option<String>,
    /// Hash of the case, the end condition and the program.
    pub id: String,
    /// Mean equivalent diameter d of the grains [m].
    pub diameter_m: Option<f64>,
    /// Gravity [m/s2].
    #[serde(default)]
    pub gravity_m_per_s2: Option<[f64; 3]>,
    /// Lengths of the box along its periodic axes [m].
    #[serde(default, skip_serializing_if = "no_periods")]
    pub periods_m: [Option<f64>; 3],
    /// First contact [s].
    pub kiss_time_s: Option<f64>,
    /// Number of time steps.
    pub steps: Option<u64>,
    /// Simulated time [s].
    pub end_time_s: Option<f64>,
    /// Wall-clock time [s].
    pub wall_s: Option<f64>,
    /// Threads of the last session.
    pub threads: Option<usize>,
    /// Largest |div u| after any time step [1/s].
    pub max_divergence: Option<f64>,
    /// Measured values of a pair; of finished runs only.
    pub pair: Option<PairMeasures>,
    /// Measured values of a single grain, or of three and more; of finished runs only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub settling: Option<SettlingMeasures>,
}

impl RunRecord {
    /// Reads the record of a run from its folder.
    pub fn read(run: &Run, study: &Path) -> RunRecord {
        let (state, folder) = (folder_state(run, study), run.folder(study));
        let by_program = || Some(run.id_by(&Provenance::read(&folder)?));
        let id = if state == RunState::Finished { by_program() } else { None };
        let mut record = RunRecord {
            name: run.name.clone(),
            model: run.model.clone(),
            member: run.member,
            levels: run.levels.clone(),
            factors: run.factors.clone(),
            state: state.kind(),
            id: id.unwrap_or_else(|| run.id.clone()),
            ..RunRecord::default()
        };
        match state {
            RunState::Failed(why) => record.remark = Some(why),
            RunState::Stale(why) => record.remark = Some(why.into()),
            RunState::Damaged(why) => record.remark = Some(why),
            RunState::Finished => record.measure(&folder),
            RunState::Missing | RunState::Unfinished => {}
        }
        record
    }

    /// Fills in the measured values of a finished run.
    fn measure(&mut self, folder: &Path) {
        match Summary::read(folder) {
            Ok(summary) => {
                self.diameter_m = mean(summary.grains.iter().map(|g| g.equivalent_diameter_m));
                self.kiss_time_s = summary.pair.as_ref().and_then(|p| p.kiss_time_s);
                self.steps = Some(summary.steps);
                self.end_time_s = Some(summary.end_time_s);
                self.wall_s = Some(summary.cost.wall_s);
                self.max_divergence = Some(summary.max_divergence);
            }
            Err(error) => {
                let file = folder.join(summary::FILE);
                self.remark = Some(format!("{} cannot be read: {error}", file.display()));
            }
        }
        self.threads = Provenance::read(folder).and_then(|p| Some(p.sessions.last()?.threads));
        match RunFolder::open(folder) {
            Ok(run) => {
                self.gravity_m_per_s2 = run.facts.gravity.map(|g| g.to_array());
                self.periods_m = run.periods();
                let short = run.short_tables().into_iter().next();
                let incomplete = short.is_some();
                self.remark = self.remark.take().or(short);
                if incomplete {
                    return;
                }
                self.pair = PairMeasures::from_run(&run);
                self.settling = SettlingMeasures::from_run(&run);
                if self.pair.is_none() && self.settling.is_none() {
                    self.remark = self.remark.take().or_else(|| run.notes.first().cloned());
                }
            }
            Err(error) => self.remark = Some(error.to_string()),
        }
    }

    /// Returns whether the run finished, but its files could not be read or lack rows.
    pub fn unmeasured(&self) -> bool {
        self.finished() && self.remark.is_some()
    }

    /// Returns the unit vector against gravity, and sqrt(d/g) [s].
    pub fn up_and_time(&self) -> Option<(DVec3, f64)> {
        let gravity = DVec3::from_array(self.gravity_m_per_s2?);
        let size = gravity.length();
        let diameter = self.diameter_m.filter(|d| *d > 0.0)?;
        (size > 0.0).then(|| (-gravity / size, (diameter / size).sqrt()))
    }

    /// Returns whether the run reached its end.
    pub fn finished(&self) -> bool {
        self.state == StateKind::Finished
    }

    /// Returns a measured quantity or a factor by name.
    pub fn get(&self, name: &str) -> Option<f64> {
        self.measured(name).or_else(|| self.factors.get(name).copied())
    }

    /// Returns a measured quantity by name.
    pub fn measured(&self, name: &str) -> Option<f64> {
        let of_pair = self.pair.as_ref().and_then(|pair| pair.get(name));
        of_pair.or_else(|| self.settling.as_ref()?.get(name))
    }

    /// Returns whether a quantity is only a lower bound: the pair was still in contact when a grain
    /// landed or left the box, or the run ended.
    pub fn is_lower_bound(&self, quantity: &str) -> bool {
        let Some(pair) = self.pair.as_ref().filter(|pair| pair.parted == Some(false)) else {
            return false;
        };
        match quantity {
            "contact_stage" => true,
            "kissing_stage" => pair.tumble_time.is_none(),
            _ => false,
        }
    }
}

fn no_periods(periods: &[Option<f64>; 3]) -> bool {
    periods.iter().all(Option::is_none)
}

/// Returns a note about the finished runs without anything to measure; none if there are none.
pub fn note_on_unmeasured<'a>(records: impl IntoIterator<Item = &'a RunRecord>) -> Option<String> {
    let measured = |r: &RunRecord| r.pair.is_some() || r.settling.is_some();
    let bare = |r: &&RunRecord| r.finished() && r.remark.is_none() && !measured(r);
    let names: Vec<&str> = records.into_iter().filter(bare).map(|r| r.name.as_str()).collect();
    let (first, others) = names.split_first()?;
    let who = match others.len() {
        0 => format!("run {first} has"),
        n => format!("{} runs have", n + 1),
    };
    Some(format!(
        "{who} no measured values, because gravity is zero or no grain moves by a tenth of its \
         diameter; the tables of each run are in its folder"
    ))
}

/// Reads the records of all runs of a study.
///
/// A run without a folder keeps its values in `table.json`, so that run folders may be removed. So
/// does a finished run whose files are damaged; its remark names the damage.
///
/// # Errors
/// [`StudyError::Damaged`] for a damaged `table.json`.
pub fn records(plan: &Plan, study: &Path) -> Result<Vec<RunRecord>, StudyError> {
    let kept: Vec<RunRecord> = read_rows(&study.join(TABLE))?;
    let read = |run: &Run| {
        let record = RunRecord::read(run, study);
        let unknown =
            matches!(record.state, StateKind::Missing | StateKind::Damaged) || record.unmeasured();
        let same = |old: &&RunRecord| {
            old.name == run.name && old.finished() && run.ids().any(|id| *id == old.id)
        };
        match kept.iter().find(same).filter(|_| unknown) {
            Some(old) => RunRecord {
                levels: record.levels,
                factors: record.factors,
                remark: record.remark.or_else(|| old.remark.clone()),
                ..old.clone()
            },
            None => record,
        }
    };
    Ok(plan.runs.par_iter().map(read).collect())
}

//! The table of a study: one row for each run.

use std::collections::BTreeMap;
use std::path::Path;

use glam::DVec3;
use grainwake_report::run_folder::RunFolder;
use grainwake_solver::output::provenance::Provenance;
use grainwake_solver::output::read_summary;
use serde::{Deserialize, Serialize};

use crate::measure::pair::PairMeasures;
use crate::measure::settling::SettlingMeasures;
use crate::plan::{Manifest, Run};
use crate::run::state::{RunState, state_of_version};

/// A run and what came out of it. The JSON names are stable.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunRecord {
    /// Name of the run.
    pub name: String,
    /// Name of its model.
    pub model: String,
    /// Number in the ensemble.
    pub member: usize,
    /// Name of its value on each axis.
    pub levels: BTreeMap<String, String>,
    /// Numbers that belong to it.
    pub factors: BTreeMap<String, f64>,
    /// "finished", "unfinished", "missing", "failed" or "stale".
    pub state: String,
    /// Why it failed or is stale.
    pub remark: Option<String>,
    /// Hash of its case, its end and the program.
    pub id: String,
    /// Equal-volume diameter d [m].
    pub diameter_m: Option<f64>,
    /// Gravity [m/s2].
    #[serde(default)]
    pub gravity_m_per_s2: Option<[f64; 3]>,
    /// First contact [s].
    pub kiss_time_s: Option<f64>,
    /// Steps taken.
    pub steps: Option<u64>,
    /// Simulated time [s].
    pub end_time_s: Option<f64>,
    /// Wall-clock time [s].
    pub wall_s: Option<f64>,
    /// Threads of its last session.
    pub threads: Option<usize>,
    /// Largest |div u| after any step [1/s].
    pub max_divergence: Option<f64>,
    /// What was measured on the pair; only of a finished run.
    pub pair: Option<PairMeasures>,
    /// What was measured on a single grain, or on three and more; only of a finished run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub settling: Option<SettlingMeasures>,
}

impl RunRecord {
    /// Looks at a run in a study folder, as its plan has it.
    pub fn of(run: &Run, manifest: &Manifest, study: &Path) -> RunRecord {
        let found = state_of_version(run, study, &manifest.version, manifest.commit.as_deref());
        let folder = run.folder(study);
        let mut row = RunRecord {
            name: run.name.clone(),
            model: run.model.clone(),
            member: run.member,
            levels: run.levels.clone(),
            factors: run.factors.clone(),
            state: found.word().into(),
            remark: None,
            id: run.id.clone(),
            diameter_m: None,
            gravity_m_per_s2: None,
            kiss_time_s: None,
            steps: None,
            end_time_s: None,
            wall_s: None,
            threads: None,
            max_divergence: None,
            pair: None,
            settling: None,
        };
        match &found {
            RunState::Failed(why) => row.remark = Some(why.clone()),
            RunState::Stale(why) => row.remark = Some((*why).into()),
            _ => {}
        }
        if found != RunState::Finished {
            return row;
        }
        if let Ok(summary) = read_summary(&folder) {
            let mean = summary
                .grains
                .iter()
                .map(|g| g.equivalent_diameter_m)
                .sum::<f64>();
            row.diameter_m =
                (!summary.grains.is_empty()).then(|| mean / summary.grains.len() as f64);
            row.kiss_time_s = summary.pair.as_ref().and_then(|p| p.kiss_time_s);
            row.steps = Some(summary.steps);
            row.end_time_s = Some(summary.end_time_s);
            row.wall_s = Some(summary.wall_s);
            row.max_divergence = Some(summary.max_divergence);
        }
        row.threads = Provenance::read(&folder).and_then(|p| Some(p.sessions.last()?.threads));
        match RunFolder::open(&folder) {
            Ok(run) => {
                row.gravity_m_per_s2 = run.facts.gravity.map(|g| g.to_array());
                row.pair = PairMeasures::of(&run);
                row.settling = SettlingMeasures::of(&run);
            }
            Err(error) => row.remark = Some(error.to_string()),
        }
        row
    }

    /// Against gravity, and sqrt(d/g) [s].
    pub fn up_and_time(&self) -> Option<(DVec3, f64)> {
        let gravity = DVec3::from_array(self.gravity_m_per_s2?);
        let size = gravity.length();
        let diameter = self.diameter_m.filter(|d| *d > 0.0)?;
        (size > 0.0).then(|| (-gravity / size, (diameter / size).sqrt()))
    }

    /// Whether the run came to its end.
    pub fn finished(&self) -> bool {
        self.state == RunState::Finished.word()
    }

    /// A quantity, a factor or a number of the run by name.
    pub fn get(&self, name: &str) -> Option<f64> {
        self.measured(name)
            .or_else(|| self.factors.get(name).copied())
    }

    /// A measured quantity by name.
    pub fn measured(&self, name: &str) -> Option<f64> {
        let of_pair = self.pair.as_ref().and_then(|pair| pair.get(name));
        of_pair.or_else(|| self.settling.as_ref()?.get(name))
    }
}

/// The table of all runs.
pub fn records(manifest: &Manifest, study: &Path) -> Vec<RunRecord> {
    use rayon::prelude::*;
    let rows: Vec<RunRecord> = manifest
        .runs
        .par_iter()
        .map(|run| RunRecord::of(run, manifest, study))
        .collect();
    let kept: BTreeMap<String, RunRecord> = kept(study)
        .into_iter()
        .map(|r| (r.name.clone(), r))
        .collect();
    // A study folder that was thinned out keeps its results in the table.
    let known = |row: RunRecord| match kept.get(&row.name) {
        Some(old)
            if row.state == RunState::Missing.word() && old.id == row.id && old.finished() =>
        {
            old.clone()
        }
        _ => row,
    };
    rows.into_iter().map(known).collect()
}

fn kept(study: &Path) -> Vec<RunRecord> {
    let text = std::fs::read_to_string(study.join("table.json")).unwrap_or_default();
    serde_json::from_str(&text).unwrap_or_default()
}

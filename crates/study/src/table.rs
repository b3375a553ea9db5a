//! The table of a study: one row for each run.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use glam::DVec3;
use grainwake_report::run_folder::RunFolder;
use grainwake_solver::output::provenance::Provenance;
use grainwake_solver::output::read_summary;
use serde::{Deserialize, Serialize};

use crate::error::{StudyError, write_whole};
use crate::measure::{Measures, QUANTITIES};
use crate::plan::{Manifest, Run};
use crate::settling::{Fallen, SETTLING, Settling};
use crate::state::{State, state_for};

/// Table of each grain of the runs that are no pairs, in the study folder.
pub const GRAINS: &str = "settling.csv";

/// A run and what came out of it. The JSON names are stable.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
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
    pub pair: Option<Measures>,
    /// What was measured on a single grain, or on three and more; only of a finished run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub settling: Option<Settling>,
}

impl Row {
    /// Looks at a run in a study folder, as its plan has it.
    pub fn of(run: &Run, manifest: &Manifest, study: &Path) -> Row {
        let found = state_for(run, study, &manifest.version, manifest.commit.as_deref());
        let folder = run.folder(study);
        let mut row = Row {
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
            State::Failed(why) => row.remark = Some(why.clone()),
            State::Stale(why) => row.remark = Some((*why).into()),
            _ => {}
        }
        if found != State::Finished {
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
                row.pair = Measures::of(&run);
                row.settling = Settling::of(&run);
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
        self.state == State::Finished.word()
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
pub fn table(manifest: &Manifest, study: &Path) -> Vec<Row> {
    use rayon::prelude::*;
    let rows: Vec<Row> = manifest
        .runs
        .par_iter()
        .map(|run| Row::of(run, manifest, study))
        .collect();
    let kept: BTreeMap<String, Row> = kept(study)
        .into_iter()
        .map(|r| (r.name.clone(), r))
        .collect();
    // A study folder that was thinned out keeps its results in the table.
    let known = |row: Row| match kept.get(&row.name) {
        Some(old) if row.state == State::Missing.word() && old.id == row.id && old.finished() => {
            old.clone()
        }
        _ => row,
    };
    rows.into_iter().map(known).collect()
}

fn kept(study: &Path) -> Vec<Row> {
    let text = std::fs::read_to_string(study.join("table.json")).unwrap_or_default();
    serde_json::from_str(&text).unwrap_or_default()
}

/// Writes `table.json` and `table.csv` into a study folder.
///
/// # Errors
/// If they cannot be written.
pub fn write_table(rows: &[Row], study: &Path) -> Result<(), StudyError> {
    let json = study.join("table.json");
    let text = serde_json::to_string_pretty(rows).map_err(|error| StudyError::Io {
        action: "write",
        path: json.clone(),
        source: error.into(),
    })?;
    write_whole(&json, text.as_bytes())?;
    if rows.iter().any(|row| row.settling.is_some()) {
        write_whole(&study.join(GRAINS), grains_csv(rows).as_bytes())?;
    }
    write_whole(&study.join("table.csv"), csv_of(rows).as_bytes())
}

/// Names of the measured quantities that runs of these kinds have, in order.
pub fn columns(rows: &[Row]) -> Vec<&'static str> {
    let settling = rows.iter().any(|row| row.settling.is_some());
    let pairs = !settling || rows.iter().any(|row| row.pair.is_some());
    let mut out: Vec<&str> = Vec::new();
    if pairs {
        out.extend(QUANTITIES);
    }
    if settling {
        let more = SETTLING
            .into_iter()
            .filter(|q| !QUANTITIES.contains(q) || !pairs);
        out.extend(more);
    }
    out
}

/// A row for each grain of the runs that are no pairs, SI units.
fn grains_csv(rows: &[Row]) -> String {
    let mut out = csv::Writer::from_writer(Vec::new());
    // Writing to memory does not fail.
    let _ = out.write_record([
        "run",
        "model",
        "member",
        "grain",
        "diameter_m",
        "peak_speed_m_per_s",
        "peak_reynolds",
        "final_speed_m_per_s",
        "final_reynolds",
        "speed_change",
        "mean_speed_m_per_s",
        "landing_time_s",
        "drift_m",
        "long_axis_deg",
        "turned_deg",
    ]);
    let each = |row: &Row| row.settling.as_ref().map(|s| s.each.clone());
    for row in rows {
        for Fallen {
            grain,
            diameter_m,
            peak_speed_m_per_s,
            peak_reynolds,
            final_speed_m_per_s,
            final_reynolds,
            speed_change,
            mean_speed_m_per_s,
            landing_time_s,
            drift_m,
            long_axis_deg,
            turned_deg,
        } in each(row).unwrap_or_default()
        {
            let numbers = [
                Some(diameter_m),
                Some(peak_speed_m_per_s),
                peak_reynolds,
                final_speed_m_per_s,
                final_reynolds,
                speed_change,
                mean_speed_m_per_s,
                landing_time_s,
                Some(drift_m),
                long_axis_deg,
                Some(turned_deg),
            ];
            let names = [row.name.clone(), row.model.clone()];
            let counts = [row.member, grain].map(|n| n.to_string());
            let cells = names.into_iter().chain(counts);
            let _ = out.write_record(cells.chain(numbers.map(number)));
        }
    }
    String::from_utf8(out.into_inner().unwrap_or_default()).unwrap_or_default()
}

/// The table as comma-separated text; what is not known is empty.
pub fn csv_of(rows: &[Row]) -> String {
    let union = |names: fn(&Row) -> Vec<String>| -> BTreeSet<String> {
        rows.iter().flat_map(names).collect()
    };
    let axes = union(|r| r.levels.keys().cloned().collect());
    let factors = union(|r| r.factors.keys().cloned().collect());
    let quantities = columns(rows);
    let pairs = quantities.contains(&"kiss_time");
    let plain = [
        "diameter_m",
        "kiss_time_s",
        "steps",
        "end_time_s",
        "wall_s",
        "threads",
        "max_divergence",
        "id",
        "remark",
    ];
    let plain = plain
        .into_iter()
        .filter(|name| pairs || *name != "kiss_time_s");
    let mut out = csv::Writer::from_writer(Vec::new());
    // Writing to memory does not fail; a row of another length cannot come about.
    let header = ["run", "model", "member", "state"]
        .map(str::to_owned)
        .into_iter();
    let header = header
        .chain(axes.iter().cloned())
        .chain(factors.iter().cloned());
    let header = header
        .chain(quantities.iter().map(|q| (*q).to_owned()))
        .chain(plain.map(str::to_owned));
    let _ = out.write_record(header);
    for row in rows {
        let mut cells = vec![
            row.name.clone(),
            row.model.clone(),
            row.member.to_string(),
            row.state.clone(),
        ];
        cells.extend(
            axes.iter()
                .map(|a| row.levels.get(a).cloned().unwrap_or_default()),
        );
        cells.extend(factors.iter().map(|f| number(row.factors.get(f).copied())));
        cells.extend(quantities.iter().map(|q| number(row.measured(q))));
        cells.push(row.diameter_m.map_or(String::new(), |v| format!("{v:e}")));
        cells.extend(pairs.then(|| number(row.kiss_time_s)));
        cells.extend([
            row.steps.map_or(String::new(), |v| v.to_string()),
            number(row.end_time_s),
            row.wall_s.map_or(String::new(), |v| format!("{v:.1}")),
            row.threads.map_or(String::new(), |v| v.to_string()),
            row.max_divergence
                .map_or(String::new(), |v| format!("{v:.1e}")),
            row.id.clone(),
            row.remark.clone().unwrap_or_default(),
        ]);
        let _ = out.write_record(&cells);
    }
    String::from_utf8(out.into_inner().unwrap_or_default()).unwrap_or_default()
}

/// Six significant digits, without trailing zeros.
fn number(value: Option<f64>) -> String {
    let Some(value) = value else {
        return String::new();
    };
    let rounded: f64 = format!("{value:.5e}").parse().unwrap_or(value);
    rounded.to_string()
}

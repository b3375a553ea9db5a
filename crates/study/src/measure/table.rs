//! Tables of a study folder: `table.json`, `table.csv`, `settling.csv`.

use std::collections::BTreeSet;
use std::path::Path;

use crate::error::{StudyError, write_whole};
use crate::measure::record::RunRecord;
use crate::measure::settling::GrainSettling;
use crate::plan::quantities::{PAIR_QUANTITIES, SETTLING_QUANTITIES};

/// Table of the grains of all runs that are not pairs, in the study folder.
pub const SETTLING_TABLE: &str = "settling.csv";

/// Writes `table.json` and `table.csv` into a study folder.
///
/// # Errors
/// If they cannot be written.
pub fn write_tables(rows: &[RunRecord], study: &Path) -> Result<(), StudyError> {
    let json = study.join("table.json");
    let text = serde_json::to_string_pretty(rows).map_err(|error| StudyError::Io {
        action: "write",
        path: json.clone(),
        source: error.into(),
    })?;
    write_whole(&json, text.as_bytes())?;
    if rows.iter().any(|row| row.settling.is_some()) {
        write_whole(&study.join(SETTLING_TABLE), grains_csv(rows).as_bytes())?;
    }
    write_whole(&study.join("table.csv"), to_csv(rows).as_bytes())
}

/// Names of the measured quantities that runs of these kinds have, in order.
pub fn columns(rows: &[RunRecord]) -> Vec<&'static str> {
    let settling = rows.iter().any(|row| row.settling.is_some());
    let pairs = !settling || rows.iter().any(|row| row.pair.is_some());
    let mut out: Vec<&str> = Vec::new();
    if pairs {
        out.extend(PAIR_QUANTITIES);
    }
    if settling {
        let more = SETTLING_QUANTITIES
            .into_iter()
            .filter(|q| !PAIR_QUANTITIES.contains(q) || !pairs);
        out.extend(more);
    }
    out
}

/// A row for each grain of the runs that are no pairs, SI units.
fn grains_csv(rows: &[RunRecord]) -> String {
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
    let each = |row: &RunRecord| row.settling.as_ref().map(|s| s.each.clone());
    for row in rows {
        for GrainSettling {
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
pub fn to_csv(rows: &[RunRecord]) -> String {
    let union = |names: fn(&RunRecord) -> Vec<String>| -> BTreeSet<String> {
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

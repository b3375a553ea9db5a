//! Tables of a study folder: `table.json`, `table.csv`, `settling.csv`.

use std::collections::BTreeSet;
use std::path::Path;

use serde_json::Value;

use super::record::RunRecord;
use super::settling::GrainSettling;
use super::unique;
use crate::error::{At, StudyError, read_rows, write_file, write_json};
use crate::format::rounded;
use crate::plan::quantities::{FIRST_COLUMNS, LAST_COLUMNS, PAIR_QUANTITIES, SETTLING_QUANTITIES};
use crate::plan::{EARLIER_TABLE, TABLE};

/// Table of the grains of all runs that are not pairs, in the study folder.
pub const SETTLING_TABLE: &str = "settling.csv";

/// Columns of [`SETTLING_TABLE`]; from the fifth on they are fields of [`GrainSettling`].
const SETTLING_HEADER: &str = "run,model,member,grain,diameter_m,peak_speed_m_per_s,peak_reynolds,\
    final_speed_m_per_s,final_reynolds,speed_change,mean_speed_m_per_s,landing_time_s,drift_m,\
    long_axis_deg,turned_deg";

/// Writes `table.json`, `table.csv` and, if a run is not a pair, `settling.csv`. Finished runs of
/// the last `table.json` that the records lack are kept in `table.earlier.json`.
///
/// # Errors
/// If a file cannot be written, or a table is damaged.
pub fn write_tables(records: &[RunRecord], study: &Path) -> Result<(), StudyError> {
    keep_finished_runs(records, study)?;
    write_json(&study.join(TABLE), &records)?;
    if records.iter().any(|record| record.settling.is_some()) {
        write_csv(&study.join(SETTLING_TABLE), settling_rows(records))?;
    }
    write_csv(&study.join("table.csv"), rows(records))
}

/// Adds the finished runs of `table.json` that the records lack to `table.earlier.json`. The rows
/// are copied as they are, whatever program wrote them.
fn keep_finished_runs(records: &[RunRecord], study: &Path) -> Result<(), StudyError> {
    fn key(row: &Value) -> [Option<&str>; 2] {
        ["name", "id"].map(|key| row[key].as_str())
    }
    let mut lost: Vec<Value> = read_rows(&study.join(TABLE))?;
    let present: BTreeSet<_> =
        records.iter().map(|r| [r.name.as_str(), r.id.as_str()].map(Some)).collect();
    lost.retain(|row| row["state"] == "finished" && !present.contains(&key(row)));
    if lost.is_empty() {
        return Ok(());
    }
    let file = study.join(EARLIER_TABLE);
    let mut kept: Vec<Value> = read_rows(&file)?;
    kept.retain(|row| lost.iter().all(|other| key(other) != key(row)));
    kept.append(&mut lost);
    write_json(&file, &kept)
}

/// Writes rows of cells as comma-separated values.
pub(crate) fn write_csv(
    file: &Path,
    rows: impl IntoIterator<Item = Vec<String>>,
) -> Result<(), StudyError> {
    write_file(file, csv_text(rows).at("write", file)?.as_bytes())
}

fn csv_text(rows: impl IntoIterator<Item = Vec<String>>) -> std::io::Result<String> {
    let mut out = csv::Writer::from_writer(Vec::new());
    for row in rows {
        out.write_record(row)?;
    }
    let bytes = out.into_inner().map_err(csv::IntoInnerError::into_error)?;
    String::from_utf8(bytes).map_err(std::io::Error::other)
}

/// Returns the measured quantities that runs of these kinds have, in table order.
pub fn columns(records: &[RunRecord]) -> Vec<&'static str> {
    let settling = records.iter().any(|record| record.settling.is_some());
    let pairs = !settling || records.iter().any(|record| record.pair.is_some());
    let of_pairs = PAIR_QUANTITIES.into_iter().filter(|_| pairs);
    let new = |q: &&str| settling && !(pairs && PAIR_QUANTITIES.contains(q));
    of_pairs.chain(SETTLING_QUANTITIES.into_iter().filter(new)).collect()
}

/// Header and one row per grain of the runs that are not pairs, in SI units.
fn settling_rows(records: &[RunRecord]) -> Vec<Vec<String>> {
    let mut rows = vec![SETTLING_HEADER.split(',').map(str::to_owned).collect()];
    let row = |record: &RunRecord, grain: &GrainSettling| {
        let values = serde_json::to_value(grain).unwrap_or_default();
        let value = |name: &str| number(values.get(name).and_then(serde_json::Value::as_f64));
        let indices = [record.member, grain.grain].map(|n| n.to_string());
        let names = [record.name.clone(), record.model.clone()];
        let cells = names.into_iter().chain(indices);
        cells.chain(SETTLING_HEADER.split(',').skip(4).map(value)).collect()
    };
    for record in records {
        let grains = record.settling.iter().flat_map(|s| &s.each);
        rows.extend(grains.map(|grain| row(record, grain)));
    }
    rows
}

/// Returns `table.csv`: one row per run; unknown values are empty.
pub fn to_csv(records: &[RunRecord]) -> String {
    csv_text(rows(records)).unwrap_or_default()
}

fn rows(records: &[RunRecord]) -> Vec<Vec<String>> {
    let axes = unique(records.iter().flat_map(|r| r.levels.keys()));
    let factors = unique(records.iter().flat_map(|r| r.factors.keys()));
    let quantities = columns(records);
    let pairs = quantities.contains(&"kiss_time");
    let mut header = FIRST_COLUMNS.to_vec();
    header.extend(axes.iter().chain(&factors).map(|name| name.as_str()));
    header.extend(&quantities);
    header.extend(LAST_COLUMNS.split(',').filter(|name| pairs || *name != "kiss_time_s"));
    let row = |r: &RunRecord| {
        let member = r.member.to_string();
        let mut cells = vec![r.name.clone(), r.model.clone(), member, r.state.to_string()];
        cells.extend(axes.iter().map(|a| r.levels.get(a).cloned().unwrap_or_default()));
        cells.extend(factors.iter().map(|f| text(r.factors.get(f), f64::to_string)));
        cells.extend(quantities.iter().map(|q| number(r.measured(q))));
        cells.push(text(r.diameter_m, |v| format!("{v:e}")));
        cells.extend(pairs.then(|| number(r.kiss_time_s)));
        cells.push(text(r.steps, |v| v.to_string()));
        cells.push(number(r.end_time_s));
        cells.push(text(r.wall_s, |v| format!("{v:.1}")));
        cells.push(text(r.threads, |v| v.to_string()));
        cells.push(text(r.max_divergence, |v| format!("{v:.1e}")));
        cells.extend([r.id.clone(), r.remark.clone().unwrap_or_default()]);
        cells
    };
    let header = header.into_iter().map(str::to_owned).collect();
    std::iter::once(header).chain(records.iter().map(row)).collect()
}

fn text<T>(value: Option<T>, form: impl Fn(T) -> String) -> String {
    value.map_or(String::new(), form)
}

fn number(value: Option<f64>) -> String {
    text(value, |v| rounded(v).to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_and_factors_keep_the_order_of_the_study_file() {
        let levels = [("weight", "light"), ("grip", "rough")];
        let factors = [("density", 1500.0), ("angle", 30.0)];
        let record = RunRecord {
            levels: levels.map(|(axis, level)| (axis.to_owned(), level.to_owned())).into(),
            factors: factors.map(|(name, value)| (name.to_owned(), value)).into(),
            ..RunRecord::default()
        };
        // A model outside the axes comes first.
        let records = [RunRecord::default(), record];
        let text = serde_json::to_string(&records).unwrap();
        let again: Vec<RunRecord> = serde_json::from_str(&text).unwrap();
        let csv = to_csv(&again);
        assert!(csv.starts_with("run,model,member,state,weight,grip,density,angle,"), "{csv}");
        assert!(csv.lines().nth(2).unwrap().contains(",light,rough,1500,30,"), "{csv}");
    }
}

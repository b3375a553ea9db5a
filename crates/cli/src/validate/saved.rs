//! Saved results: `LEVEL.json` and `LEVEL.md`.

use std::path::Path;

use grainwake_formats::summary::Summary;
use grainwake_run::case::Case;
use grainwake_run::provenance::Provenance;
use grainwake_validation::{CheckResult, Suite};
use serde::{Deserialize, Serialize};

use super::table::table;
use crate::exit::Exit;

/// Contents of `LEVEL.json`.
#[derive(Default, Serialize, Deserialize)]
pub struct Saved {
    results: Vec<CheckResult>,
    runs: Vec<Source>,
}

impl Saved {
    /// Returns the value of a quantity of a run.
    pub fn value(&self, name: &str, run: &str, quantity: &str) -> Option<f64> {
        let of = |v: &&CheckResult| v.name == name && v.run == run && v.quantity == quantity;
        self.results.iter().find(of)?.value
    }
}

/// Provenance of the values of a run.
#[derive(Serialize, Deserialize)]
struct Source {
    name: String,
    run: String,
    commit: Option<String>,
    cpu: String,
    threads: usize,
    /// Cells of the grid; missing in results saved by earlier versions.
    #[serde(default)]
    cells: Option<u64>,
    steps: u64,
    wall_s: f64,
}

impl Source {
    /// Returns the wall-clock time per cell and step [ns].
    fn cost(&self) -> Option<f64> {
        let updates = self.cells? * self.steps;
        (updates > 0).then(|| 1e9 * self.wall_s / updates as f64)
    }
}

/// Adds the `results` of runs below `output` to the results in `folder`, and returns all results.
///
/// Earlier results of the same runs are replaced; the results are in the order of the `suites`.
pub fn add(
    folder: &Path,
    level: &str,
    results: &[CheckResult],
    output: &Path,
    suites: &[Suite],
) -> Result<Saved, Exit> {
    let json = folder.join(format!("{level}.json"));
    let mut saved = match std::fs::read_to_string(&json) {
        Ok(text) => serde_json::from_str(&text).map_err(Exit::at(&json))?,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Saved::default(),
        Err(error) => return Err(Exit::at(&json)(error)),
    };
    let key = |v: &CheckResult| (v.name.clone(), v.run.clone());
    let new: Vec<_> = results.iter().map(key).collect();
    saved.results.retain(|v| !new.contains(&key(v)));
    saved.results.extend(results.iter().cloned());
    saved.results.sort_by_key(|v| place(suites, &v.name, &v.run));
    saved.runs.retain(|r| !new.contains(&(r.name.clone(), r.run.clone())));
    let mut seen = Vec::new();
    for (name, run) in new {
        if seen.contains(&(name.clone(), run.clone())) {
            continue;
        }
        seen.push((name.clone(), run.clone()));
        let path = output.join(&name).join(&run);
        let (Some(provenance), Ok(summary)) = (Provenance::read(&path), Summary::read(&path))
        else {
            continue;
        };
        let session = provenance.sessions.last();
        saved.runs.push(Source {
            commit: provenance.commit.clone(),
            cpu: session.map_or_else(String::new, |s| s.cpu.clone()),
            threads: session.map_or(0, |s| s.threads),
            cells: None,
            steps: summary.steps,
            wall_s: summary.cost.wall_s,
            name,
            run,
        });
    }
    for run in &mut saved.runs {
        if run.cells.is_none() {
            run.cells = cells(suites, &run.name, &run.run);
        }
    }
    saved.runs.sort_by_key(|r| place(suites, &r.name, &r.run));
    std::fs::create_dir_all(folder).map_err(Exit::at(folder))?;
    std::fs::write(&json, serde_json::to_string_pretty(&saved)? + "\n").map_err(Exit::at(&json))?;
    let page = folder.join(format!("{level}.md"));
    std::fs::write(&page, markdown(level, &saved)).map_err(Exit::at(&page))?;
    Ok(saved)
}

/// Returns the sort key of a run: name of the suite, then position in it.
fn place(suites: &[Suite], name: &str, run: &str) -> (String, usize) {
    let suite = suites.iter().find(|s| s.name == name);
    let at = suite.and_then(|s| s.runs.iter().position(|r| r.name == run));
    (name.to_string(), at.unwrap_or(usize::MAX))
}

/// Returns the number of cells of a run.
fn cells(suites: &[Suite], name: &str, run: &str) -> Option<u64> {
    let suite = suites.iter().find(|s| s.name == name)?;
    let run = suite.runs.iter().find(|r| r.name == run)?;
    let case = Case::load(&run.case, &run.set).ok()?;
    Some(case.setup.mesh.cells.iter().map(|&n| n as u64).product())
}

fn markdown(level: &str, saved: &Saved) -> String {
    let mut text = format!(
        "# Results of the validations, level {level}\n\nWritten by `grainwake validate --level {level} \
         --save`. A row without a bound is context.\n\n{}\n\n## Runs\n\n| run | cells | steps | wall time [s] \
         | ns per cell and step | threads | commit | processor |\n|---|---|---|---|---|---|---|---|\n",
        table(&saved.results)
    );
    for run in &saved.runs {
        text += &format!(
            "| {}/{} | {} | {} | {:.0} | {} | {} | {} | {} |\n",
            run.name,
            run.run,
            run.cells.map_or_else(|| "-".into(), |n| n.to_string()),
            run.steps,
            run.wall_s,
            run.cost().map_or_else(|| "-".into(), |ns| format!("{ns:.0}")),
            run.threads,
            run.commit.as_deref().unwrap_or("unknown"),
            run.cpu
        );
    }
    text
}

//! Saved results: `LEVEL.json` and `LEVEL.md`.

use std::path::Path;

use grainwake_formats::disk::{self, write_atomically};
use grainwake_formats::summary::Summary;
use grainwake_report::write_file;
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
    disk::create_folder(folder).map_err(Exit::at(folder))?;
    let text = serde_json::to_string_pretty(&saved)? + "\n";
    // The file holds the results of hours: it reaches the disk before it replaces the earlier one.
    let written = write_atomically(&json, true, |out| out.write_all(text.as_bytes()));
    written.map_err(Exit::at(&json))?;
    let page = folder.join(format!("{level}.md"));
    write_file(&page, markdown(level, &saved).as_bytes()).map_err(Exit::at(&page))?;
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

#[cfg(test)]
mod tests {
    use grainwake_formats::disk::faults::{Fault, inject};

    use super::*;

    #[test]
    fn a_full_disk_keeps_the_earlier_results() {
        let folder = tempfile::tempdir().unwrap();
        let save = |run: &str| {
            let result = serde_json::json!({
                "name": "fall", "run": run, "quantity": "speed", "bound": "", "pass": true,
            });
            let result: CheckResult = serde_json::from_value(result).unwrap();
            add(folder.path(), "full", &[result], folder.path(), &[])
        };
        let [json, page] = ["full.json", "full.md"].map(|name| folder.path().join(name));
        save("slow").unwrap();
        let [results, text] = [&json, &page].map(|path| std::fs::read(path).unwrap());
        for at in 0.. {
            let planned = inject(folder.path(), Fault::Full, at);
            let done = save("fast");
            let struck = planned.struck();
            drop(planned);
            let Some(struck) = struck else {
                done.unwrap();
                // Folder, results, page.
                assert!(at >= 1 + 4 + 3, "only {at} changes can be made to fail");
                break;
            };
            assert!(done.is_err(), "{struck}");
            assert_eq!(std::fs::read(&page).unwrap(), text, "{struck}");
            let kept = std::fs::read(&json).unwrap();
            assert!(kept == results || struck.contains("full.md"), "{struck}");
        }
    }
}

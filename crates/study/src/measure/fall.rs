//! Settling speed against time, for figures of any run.

use std::path::Path;

use grainwake_report::run_folder::{History, histories};

use crate::measure::record::RunRecord;
use crate::measure::trajectory::HISTORIES;
use crate::plan::Run;

/// Settling speed against time, mean over the grains; until all have landed.
#[derive(Clone, Debug, PartialEq)]
pub struct SettlingCurve {
    /// Times [s] and speeds along gravity [m/s].
    pub points: Vec<(f64, f64)>,
}

impl SettlingCurve {
    /// Of a finished run: from its run folder, else from the thinned-out copy.
    pub fn read(run: &Run, row: &RunRecord, study: &Path) -> Option<SettlingCurve> {
        let whole = run.folder(study).join("grains.csv");
        let thin = study.join(HISTORIES).join(format!("{}.csv", run.name));
        let grains = [whole, thin]
            .iter()
            .find_map(|file| histories(file, &mut Vec::new()).ok())?;
        let (up, unit) = row.up_and_time()?;
        let grains: Vec<&History> = grains.iter().filter(|h| !h.is_empty()).collect();
        let landed = row.settling.as_ref().and_then(|s| s.last_landing);
        // The moment of the landing has the speed of the rebound.
        let until = landed.map_or(f64::INFINITY, |t| t * unit * (1.0 - 1e-6));
        let rows = grains.iter().map(|h| h.len()).min()?;
        let mean = |row: usize| {
            let sum: f64 = grains.iter().map(|h| -h.velocity[row].dot(up)).sum();
            sum / grains.len() as f64
        };
        let points = (0..rows)
            .map(|row| (grains[0].time[row], mean(row)))
            .take_while(|(time, _)| *time < until)
            .collect();
        Some(SettlingCurve { points })
    }
}

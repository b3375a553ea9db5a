//! Changes of grains before they were accepted: specks, cavities, rescued labels.

use grainwake_shape::scan::ScannedGrain;

use super::refused::named;
use crate::progress::count;

/// Share of filled cavities in the volume of a grain from which on the output names the grain.
const CAVITIES_TOLD: f64 = 1e-3;

/// Describes what was changed on grains: specks removed, cavities filled, and labels rescued, by
/// cure.
pub fn treated(grains: &[ScannedGrain]) -> Vec<String> {
    let mut lines = Vec::new();
    let cleaned: Vec<&ScannedGrain> = grains.iter().filter(|g| g.specks_removed() > 0.0).collect();
    let most = cleaned.iter().map(|g| g.specks_removed()).fold(0.0, f64::max);
    let labels: Vec<u32> = cleaned.iter().map(|g| g.label).collect();
    if !labels.is_empty() {
        lines.push(format!(
            "specks removed from {}, at most {:.2} % of the volume: {}",
            count(labels.len(), "grain"),
            100.0 * most.max(5e-5),
            named(&labels)
        ));
    }
    let hollow = grains.iter().filter(|g| g.cavities_filled() >= CAVITIES_TOLD);
    let hollow: Vec<&ScannedGrain> = hollow.collect();
    let most = hollow.iter().map(|g| g.cavities_filled()).fold(0.0, f64::max);
    let labels: Vec<u32> = hollow.iter().map(|g| g.label).collect();
    if !labels.is_empty() {
        lines.push(format!(
            "cavities filled in {}, at most {:.2} % of the volume: {}",
            count(labels.len(), "grain"),
            100.0 * most,
            named(&labels)
        ));
    }
    let mut cures: Vec<(String, Vec<u32>)> = Vec::new();
    for (cure, label) in grains.iter().filter_map(|g| Some((g.rescued?.to_string(), g.label))) {
        match cures.iter_mut().find(|(other, _)| *other == cure) {
            Some((_, labels)) => labels.push(label),
            None => cures.push((cure, vec![label])),
        }
    }
    lines.extend(cures.iter().map(|(cure, labels)| {
        format!("{} rescued with {cure}: {}", count(labels.len(), "grain"), named(labels))
    }));
    lines
}

//! Random offsets of the members of an ensemble.

use grainwake_run::case::{Case, Problem};
use sha2::{Digest, Sha256};

use super::expand::Model;
use super::file::{Ensemble, Study};
use crate::error::StudyError;

/// Returns the override that offsets a grain of an ensemble member in the plane normal to gravity.
///
/// # Errors
/// If the case has no grain of that index.
pub(crate) fn offset_override(
    study: &Study,
    model: &Model,
    ensemble: &Ensemble,
    member: usize,
    case: &Case,
    set: &[String],
) -> Result<String, StudyError> {
    let grains = &case.setup.grains;
    let index = ensemble.grain.unwrap_or(grains.len().saturating_sub(1));
    let Some(grain) = grains.get(index) else {
        let problem = Problem::new(format!(
            "the ensemble offsets grain {index}, but \"{}\" has {} grains",
            model.name,
            grains.len()
        ));
        let problem = problem.help("grains are numbered from 0");
        return Err(study.locate(problem, None, "").into());
    };
    let gravity = case.setup.gravity.abs();
    let vertical = if gravity.max_element() == 0.0 {
        2
    } else {
        (0..3).max_by(|i, j| gravity[*i].total_cmp(&gravity[*j])).unwrap_or(2)
    };
    let horizontal: Vec<usize> = (0..3).filter(|axis| *axis != vertical).collect();
    let (radius, angle) = uniform_on_disc(ensemble.seed, &model.name, member);
    let mut position = grain.pose.position;
    position[horizontal[0]] += ensemble.offset * radius * angle.cos();
    position[horizontal[1]] += ensemble.offset * radius * angle.sin();
    // A grain placed with `gap_above` has two coordinates; its height follows from the gap.
    let coordinates: Vec<String> = (0..3)
        .filter(|axis| *axis != vertical || !has_gap_above(model, set, index))
        .map(|axis| format!("{:e}", position[axis]))
        .collect();
    Ok(format!("grain.{index}.position=[{}]", coordinates.join(", ")))
}

/// Draws polar coordinates uniformly from the unit disc; equal arguments give equal results.
fn uniform_on_disc(seed: u64, model: &str, member: usize) -> (f64, f64) {
    let mut hash = Sha256::new();
    hash.update(seed.to_le_bytes());
    hash.update((member as u64).to_le_bytes());
    hash.update(model);
    let bytes = hash.finalize();
    let unit = |from: usize| {
        let mut eight = [0; 8];
        eight.copy_from_slice(&bytes[from..from + 8]);
        (u64::from_le_bytes(eight) >> 11) as f64 / (1u64 << 53) as f64
    };
    (unit(0).sqrt(), std::f64::consts::TAU * unit(8))
}

/// Returns whether the height of a grain follows from `gap_above`.
fn has_gap_above(model: &Model, set: &[String], grain: usize) -> bool {
    let text = std::fs::read_to_string(&model.base).unwrap_or_default();
    let table: toml::Table = text.parse().unwrap_or_default();
    let in_table = |table: &toml::Table| {
        let grains = table.get("grain")?.as_array()?;
        Some(grains.get(grain)?.get("gap_above").is_some())
    };
    let mut gap = in_table(&table).unwrap_or(false);
    for (key, value) in set.iter().filter_map(|item| item.split_once('=')) {
        if key.trim().starts_with(&format!("grain.{grain}.gap_above")) {
            gap = true;
        } else if key.trim() == "grain" {
            let whole: Option<toml::Table> = format!("grain = {value}").parse().ok();
            gap = whole.as_ref().and_then(in_table).unwrap_or(gap);
        }
    }
    gap
}

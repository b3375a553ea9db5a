//! Offsets of the members of an ensemble.

use glam::DVec3;
use grainwake_solver::case::{Case, Problem};
use sha2::{Digest, Sha256};

use crate::error::StudyError;
use crate::plan::expand::Model;
use crate::plan::file::{Ensemble, Study};

/// The override that offsets a member of an ensemble in the plane normal to gravity.
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
        return Err(study
            .locate(problem.help("grains count from 0"), None, "")
            .into());
    };
    let up = case.setup.gravity.abs();
    let axis = if up.max_element() == 0.0 {
        2
    } else {
        (0..3).max_by(|i, j| up[*i].total_cmp(&up[*j])).unwrap_or(2)
    };
    let flat: Vec<usize> = (0..3).filter(|a| *a != axis).collect();
    let (radius, angle) = disc(ensemble.seed, &model.name, member);
    let mut at: DVec3 = grain.pose.position;
    at[flat[0]] += ensemble.offset * radius * angle.cos();
    at[flat[1]] += ensemble.offset * radius * angle.sin();
    Ok(if stands_on_a_gap(model, set, index) {
        format!(
            "grain.{index}.position=[{:e}, {:e}]",
            at[flat[0]], at[flat[1]]
        )
    } else {
        format!(
            "grain.{index}.position=[{:e}, {:e}, {:e}]",
            at.x, at.y, at.z
        )
    })
}

/// An even draw from the unit disc, the same for the same arguments everywhere.
fn disc(seed: u64, model: &str, member: usize) -> (f64, f64) {
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

/// Whether the height of a grain follows from `gap_above`.
fn stands_on_a_gap(model: &Model, set: &[String], grain: usize) -> bool {
    let text = std::fs::read_to_string(&model.base).unwrap_or_default();
    let table: toml::Table = text.parse().unwrap_or_default();
    let of = |table: &toml::Table| {
        let list = table.get("grain")?.as_array()?;
        Some(list.get(grain)?.get("gap_above").is_some())
    };
    let mut gap = of(&table).unwrap_or(false);
    for item in set {
        let Some((key, value)) = item.split_once('=') else {
            continue;
        };
        if key.trim().starts_with(&format!("grain.{grain}.gap_above")) {
            gap = true;
        } else if key.trim() == "grain" {
            let whole: Option<toml::Table> = format!("grain = {value}").parse().ok();
            gap = whole.as_ref().and_then(of).unwrap_or(gap);
        }
    }
    gap
}

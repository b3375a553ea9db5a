//! Refused labels, grouped by reason, with the options that would accept them.

use super::cure::{Cure, cures};
use super::grain::{self, Context};
use super::regions::Region;
use super::{Progress, ScanOptions, report};
use crate::assemble::ShapeOptions;
use crate::error::{Defect, Result, ShapeError};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Maximum number of labels of a group on which options are tried.
const TRIED: usize = 12;

/// Refused labels with a common reason.
#[derive(Clone, Debug, PartialEq)]
pub struct Refusal {
    /// The reason, without the data of a single label.
    pub reason: String,
    /// The labels, in ascending order.
    pub labels: Vec<u32>,
    /// Number of voxels of the smallest and of the largest of these labels.
    pub voxels: [u64; 2],
    /// Result of the trials; `None` if no option can help, or none was tried.
    pub advice: Option<Advice>,
}

/// Result of trials on some labels of a group: the largest and others at regular intervals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Advice {
    /// Number of labels tried.
    pub tried: usize,
    /// Number of labels that the cure would accept.
    pub accepted: usize,
    /// The gentlest of the cures that accept the most labels; `None` if none accepts any.
    pub cure: Option<Cure>,
}

/// A label that was refused.
pub(super) struct Refused<'a> {
    pub label: u32,
    pub voxels: u64,
    pub why: &'a ShapeError,
}

/// Groups the refused labels by reason. With the option `advise`, cures are tried on each group.
pub(super) fn refusals(
    context: &Context,
    regions: &BTreeMap<u32, Region>,
    refused: &[Refused],
    progress: Progress,
) -> Result<Vec<Refusal>> {
    let mut groups: Vec<(String, Vec<&Refused>)> = Vec::new();
    for one in refused {
        let reason = reason(one.why);
        match groups.iter_mut().find(|(other, _)| *other == reason) {
            Some((_, group)) => group.push(one),
            None => groups.push((reason, vec![one])),
        }
    }
    groups
        .into_iter()
        .map(|(reason, group)| {
            let sizes = || group.iter().map(|r| r.voxels);
            let advice = match context.options.advise {
                true => advice(context, regions, &group, progress)?,
                false => None,
            };
            Ok(Refusal {
                reason,
                labels: group.iter().map(|r| r.label).collect(),
                voxels: [sizes().min().unwrap_or(0), sizes().max().unwrap_or(0)],
                advice,
            })
        })
        .collect()
}

/// Returns the reason without the data of a single label.
fn reason(why: &ShapeError) -> String {
    match why {
        ShapeError::CutByBorder { .. } => "cut by the image border".into(),
        ShapeError::CutByView { .. } => "cut by the edge of the field of view".into(),
        ShapeError::SeveralPieces { .. } => "each of several separate pieces".into(),
        ShapeError::TooFewVoxels { needed, .. } => format!("fewer than {needed} voxels"),
        ShapeError::Quality { defect: Defect::Broken, .. } => {
            "the smoothed surface falls into pieces".into()
        }
        ShapeError::Quality { defect: Defect::Surface, .. } => {
            "the sampled surface is not one closed surface".into()
        }
        ShapeError::Quality { defect: Defect::Gradient, .. } => {
            "the surface is too rough for its distance field".into()
        }
        ShapeError::Quality { defect: Defect::Volume, .. } => {
            "the distance field misses the volume".into()
        }
        ShapeError::Quality { defect: Defect::Axes, .. } => {
            "the distance field misses the principal axes".into()
        }
        other => other.to_string(),
    }
}

/// Tries cures on at most [`TRIED`] labels of a group until one accepts all of them.
fn advice(
    context: &Context,
    regions: &BTreeMap<u32, Region>,
    group: &[&Refused],
    progress: Progress,
) -> Result<Option<Advice>> {
    let options = context.options;
    let why = group.first().map(|one| one.why);
    let cures = why.map_or_else(Vec::new, |why| cures(why, options, context.smoothing()));
    if cures.is_empty() {
        return Ok(None);
    }
    let mut order: Vec<&&Refused> = group.iter().collect();
    order.sort_by_key(|r| (std::cmp::Reverse(r.voxels), r.label));
    let tried = order.len().min(TRIED);
    let labels: Vec<u32> = (0..tried).map(|n| order[n * order.len() / tried].label).collect();
    let quick = ScanOptions {
        shape: ShapeOptions { roundness: false, ..options.shape.clone() },
        ..options.clone()
    };
    let context = Context { options: &quick, ..*context };
    let mut best = Advice { tried, accepted: 0, cure: None };
    // A rescue has tried these cures already, except for several pieces.
    let known = options.rescue && cures.iter().all(|cure| !cure.largest_piece);
    for (n, cure) in cures.iter().enumerate().filter(|_| !known) {
        report(progress, "options", n as u64, cures.len() as u64)?;
        let accepts =
            |label: &&u32| grain::shape(&context, **label, &regions[*label], *cure).is_ok();
        let accepted = labels.par_iter().filter(accepts).count();
        if accepted > best.accepted {
            best = Advice { tried, accepted, cure: Some(*cure) };
        }
        if accepted == tried {
            break;
        }
    }
    Ok(Some(best))
}

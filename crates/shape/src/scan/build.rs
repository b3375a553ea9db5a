//! Construction of shapes from a volume.

use super::cure::{Cure, cures};
use super::grain::{self, Context};
use super::refusals::{Refusal, Refused, refusals};
use super::regions::{Region, regions, shared_surfaces};
use super::segments::{Masked, segment};
use super::volume::{Volume, Voxels};
use super::{Progress, ScanOptions, report};
use crate::error::{Result, ShapeError, first_few, within};
use crate::limits::SourceFile;
use crate::{Shape, specks};
use rayon::prelude::*;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicU64, Ordering};

/// Result for one label.
#[derive(Debug)]
pub struct ScannedGrain {
    /// Label in the image (after splitting: index of the piece).
    pub label: u32,
    /// Number of voxels.
    pub voxels: u64,
    /// Fraction of the voxel faces shared with another grain, where the surface is a cut.
    pub shared_surface: f64,
    /// The shape, or the reason why there is none.
    pub shape: Result<Shape>,
    /// Other options that the shape needed, if labels are rescued.
    pub rescued: Option<Cure>,
}

impl ScannedGrain {
    /// Returns the fraction of the volume that was removed as specks.
    pub fn specks_removed(&self) -> f64 {
        let parameters = self.shape.iter().flat_map(|shape| &shape.provenance().parameters);
        let removed = parameters.filter(|(name, _)| name.ends_with(specks::REMOVED));
        removed.filter_map(|(_, value)| value.parse::<f64>().ok()).fold(0.0, |sum, part| sum + part)
    }

    /// Returns the fraction of the volume of the grain that was a closed cavity.
    pub fn cavities_filled(&self) -> f64 {
        let Ok(shape) = &self.shape else {
            return 0.0;
        };
        let provenance = shape.provenance();
        let number = |name: &str| {
            let found = provenance.parameters.iter().find(|(key, _)| key == name);
            found.and_then(|(_, value)| value.parse::<f64>().ok()).unwrap_or(0.0)
        };
        let [solid, filled] = [grain::VOXELS, grain::CAVITIES].map(number);
        filled / (solid + filled).max(1.0)
    }
}

/// Result for a volume.
#[derive(Debug)]
pub struct Scan {
    /// The grains, ordered by label.
    pub grains: Vec<ScannedGrain>,
    /// The labels, 0 for background.
    pub labels: Volume,
    /// Grey value of the threshold, if one was applied.
    pub threshold: Option<f64>,
    /// Exterior of the field of view, if the image does not fill it.
    pub masked: Option<Masked>,
    /// The refused labels, grouped by reason.
    pub refusals: Vec<Refusal>,
}

/// Builds the shapes of the grains in a volume, ordered by label.
///
/// # Errors
/// Options out of their range, a volume that is empty or solid, and a label that is absent; the
/// error of one grain is returned with that grain.
pub fn shapes_from_volume(
    volume: &Volume,
    source: &SourceFile,
    options: &ScanOptions,
) -> Result<Vec<ScannedGrain>> {
    scan_volume(volume, source, options, &|_, _, _| ControlFlow::Continue(()))
        .map(|scan| scan.grains)
}

/// Builds the shapes of the grains and the label image, and reports progress.
///
/// # Errors
/// As [`shapes_from_volume`], and [`ShapeError::Interrupted`] if `progress` ends the work.
pub fn scan_volume(
    volume: &Volume,
    source: &SourceFile,
    options: &ScanOptions,
    progress: Progress,
) -> Result<Scan> {
    options.check()?;
    let dims = volume.dims;
    // Voxel indices share 32 bits with a flag.
    let (count, largest) = (dims.iter().product::<usize>(), f64::from((1u32 << 31) - 1));
    let reason = "must be below 2^31; crop the image, or bin it";
    within("number of voxels", count as f64, 0.0..=largest, reason)?;
    let segments = segment(volume, source, options, progress)?;
    let labels = &segments.labels;
    let regions = regions(dims, labels);
    if regions.is_empty() {
        return Err(ShapeError::EmptyVolume);
    }
    if regions.len() == 1 && regions.values().all(|r| r.voxels == labels.len() as u64) {
        return Err(ShapeError::SolidVolume);
    }
    let phase = options.divides() && options.threshold.is_none();
    let selected: Vec<_> = match options.label.filter(|_| !phase) {
        None => regions.iter().collect(),
        Some(label) => match regions.get_key_value(&label) {
            Some(one) => vec![one],
            None => {
                let present = first_few(regions.keys(), 10);
                let reason = format!("does not occur; labels present: {present}");
                return Err(ShapeError::parameter("label", label.into(), &reason));
            }
        },
    };
    let context = Context { dims, segments: &segments, source, options };
    let shared = shared_surfaces(dims, labels);
    let done = AtomicU64::new(0);
    let total = selected.len() as u64;
    let go_on = || report(progress, "shapes", done.load(Ordering::Relaxed), total);
    go_on()?;
    let grains: Vec<ScannedGrain> = selected
        .par_iter()
        .map(|(label, region)| {
            let (shape, rescued) = attempt(&context, **label, region, &go_on)?;
            done.fetch_add(1, Ordering::Relaxed);
            go_on()?;
            Ok(ScannedGrain {
                label: **label,
                voxels: region.voxels,
                shared_surface: shared.get(label).copied().unwrap_or(0.0),
                shape,
                rescued,
            })
        })
        .collect::<Result<_>>()?;
    let refused: Vec<Refused> = grains
        .iter()
        .filter_map(|grain| {
            let why = grain.shape.as_ref().err()?;
            Some(Refused { label: grain.label, voxels: grain.voxels, why })
        })
        .collect();
    let refusals = refusals(&context, &regions, &refused, progress)?;
    Ok(Scan {
        grains,
        labels: Volume { dims, voxels: Voxels::Labels(segments.labels) },
        threshold: segments.threshold,
        masked: segments.masked,
        refusals,
    })
}

/// Builds the shape of a label. If it is refused and labels are to be rescued, tries the cures, the
/// gentlest first. Which of several pieces is the grain remains a question for the user.
/// The outer error is that of `go_on`.
fn attempt(
    context: &Context,
    label: u32,
    region: &Region,
    go_on: &dyn Fn() -> Result<()>,
) -> Result<(Result<Shape>, Option<Cure>)> {
    let shape = grain::shape(context, label, region, Cure::default());
    let Some(why) = shape.as_ref().err().filter(|_| context.options.rescue) else {
        return Ok((shape, None));
    };
    let cures = cures(why, context.options, context.smoothing());
    for cure in cures.into_iter().filter(|cure| !cure.largest_piece) {
        go_on()?;
        if let Ok(rescued) = grain::shape(context, label, region, cure) {
            return Ok((Ok(rescued), Some(cure)));
        }
    }
    Ok((shape, None))
}

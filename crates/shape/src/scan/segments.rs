//! Segmentation: labels of the grains, and grey values for their surfaces.

use super::field_of_view::FieldOfView;
use super::grey::{Grey, LAYERS};
use super::threshold::median;
use super::volume::{LARGEST_LABEL, Volume, Voxels, is_label};
use super::watershed::{HALO, add_halo, separate};
use super::{Mask, Progress, ScanOptions, looks_grey, report, transform};
use crate::error::{Result, ShapeError};
use crate::grid::place;
use crate::limits::SourceFile;
use crate::runs::{fill_cavities, pieces};
use std::collections::{BTreeMap, BTreeSet};

/// Result of the segmentation.
pub(super) struct Segments {
    pub labels: Vec<u32>,
    /// Grey values, if surfaces are located by them.
    pub grey: Option<Grey>,
    pub threshold: Option<f64>,
    /// Labels at the edge of the field of view.
    pub cut_by_view: BTreeSet<u32>,
    pub masked: Option<Masked>,
    /// Voxels of each label that were cavities before the grains were separated.
    pub filled: BTreeMap<u32, u64>,
}

/// Exterior of the field of view of an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Masked {
    /// Grey value of the exterior.
    pub value: f32,
    /// Fraction of the image outside the field of view.
    pub share: f64,
}

/// Determines the grain of each voxel.
pub(super) fn segment(
    volume: &Volume,
    source: &SourceFile,
    options: &ScanOptions,
    progress: Progress,
) -> Result<Segments> {
    let dims = volume.dims;
    let values = match (&volume.voxels, options.threshold) {
        (Voxels::Labels(labels), None) => {
            let grey = looks_grey::values_if_grey(labels, dims).filter(|_| !options.labels);
            if let Some(values) = grey {
                let reason = format!(
                    "the image looks grey: it has {values} values whose voxels are scattered, \
                     unlike the labels of grains; give a threshold (--threshold otsu, otsu3, or a \
                     grey value), or state with --labels that the values are labels"
                );
                return Err(ShapeError::unsupported(source.name.as_ref(), reason));
            }
            let divided = match options.label.filter(|_| options.divides()) {
                None => divide(labels, dims, options, progress)?,
                Some(phase) => {
                    let phase: Vec<u32> = labels.iter().map(|l| u32::from(*l == phase)).collect();
                    divide(&phase, dims, options, progress)?
                }
            };
            let (divided, filled) = divided;
            return Ok(Segments {
                labels: divided,
                grey: None,
                threshold: None,
                cut_by_view: BTreeSet::new(),
                masked: None,
                filled,
            });
        }
        (Voxels::Grey(values), None) => {
            let first = values.iter().position(|v| !is_label(*v));
            let found = first.map_or(String::new(), |n| {
                let [i, j, k] = place(dims, n);
                format!(", such as {} at voxel x {i}, y {j}, z {k}", values[n])
            });
            let reason = format!(
                "the image has grey values{found}; labels are whole numbers from 0 to \
                 {LARGEST_LABEL}; give a threshold for grey values (--threshold otsu, otsu3, or a \
                 grey value)"
            );
            return Err(ShapeError::unsupported(source.name.as_ref(), reason));
        }
        (Voxels::Labels(v), _) => v.iter().map(|v| *v as f32).collect(),
        (Voxels::Grey(v), _) => v.clone(),
    };
    report(progress, "threshold", 0, 1)?;
    let clean = options.median.then(|| median(&values, dims));
    let filtered = clean.as_ref().unwrap_or(&values);
    let view = options.threshold.and_then(|t| FieldOfView::of(&values, dims, t));
    let outside = view.as_ref().map(|view| view.outside);
    let Some(cut) = options.threshold.and_then(|t| t.of(filtered, outside)) else {
        // All values are equal: black counts as empty.
        return Err(ShapeError::EmptyVolume);
    };
    let mut binary: Vec<u32> = filtered.iter().map(|v| u32::from(f64::from(*v) >= cut)).collect();
    drop(clean);
    if let Some(view) = &view {
        view.clear_outside(&mut binary);
    }
    let (labels, filled) = divide(&binary, dims, options, progress)?;
    let mut segments = Segments {
        cut_by_view: view.as_ref().map_or_else(BTreeSet::new, |view| view.cuts(&labels)),
        labels,
        grey: None,
        threshold: Some(cut),
        masked: view.map(|view| Masked { value: view.outside, share: view.share }),
        filled,
    };
    if options.sub_voxel && !is_mask(&values, outside) && segments.labels.iter().all(|l| *l < HALO)
    {
        let mut owner = segments.labels.clone();
        add_halo(&mut owner, dims, LAYERS);
        segments.grey = Some(Grey::new(dims, values, owner, outside));
    }
    Ok(segments)
}

/// Returns whether an image has at most two values inside the field of view, and therefore no
/// intermediate grey values.
fn is_mask(values: &[f32], outside: Option<f32>) -> bool {
    let mut inside = values.iter().filter(|v| Some(**v) != outside);
    let first = inside.next();
    let second = inside.clone().find(|v| Some(*v) != first);
    inside.all(|v| Some(v) == first || Some(v) == second)
}

/// Fills cavities, splits and separates according to the options. Returns the labels and, for each,
/// the number of filled voxels.
fn divide(
    labels: &[u32],
    dims: [usize; 3],
    options: &ScanOptions,
    progress: Progress,
) -> Result<(Vec<u32>, BTreeMap<u32, u64>)> {
    let mut filled = BTreeMap::new();
    let Some(neck) = options.separate else {
        let divided = if options.split { pieces(dims, |n| labels[n]).0 } else { labels.to_vec() };
        return Ok((divided, filled));
    };
    report(progress, "separate", 0, 1)?;
    let mut mask = Mask { dims, solid: labels.iter().map(|l| *l != 0).collect() };
    if mask.solid.iter().all(|s| *s) {
        return Err(ShapeError::SolidVolume);
    }
    fill_cavities(dims, &mut mask.solid);
    let divided = separate(&transform::to_void(&mask), dims, neck);
    for (_, label) in labels.iter().zip(&divided).filter(|(before, own)| **before == 0 && **own > 0)
    {
        *filled.entry(*label).or_default() += 1;
    }
    Ok((divided, filled))
}

//! Construction of shapes from a volume.

use super::field_of_view::FieldOfView;
use super::grain::{self, Context};
use super::grey::{Grey, LAYERS};
use super::regions::{regions, shared_surfaces};
use super::runs::{fill_cavities, pieces};
use super::threshold::median;
use super::volume::Voxels;
use super::watershed::{HALO, add_halo, separate};
use super::{Mask, Threshold, Volume, transform};
use crate::Shape;
use crate::assemble::ShapeOptions;
use crate::error::{Result, ShapeError, first_few, positive, within};
use crate::limits::SourceFile;
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::sync::atomic::{AtomicU64, Ordering};

/// Options for converting a volume to shapes.
#[derive(Clone, Debug, PartialEq)]
pub struct ScanOptions {
    /// Edge length of a voxel [m].
    pub voxel: f64,
    /// Label of a single grain; `None` for all labels. If a labelled image is to be split or
    /// separated, the label of the solid phase, and all grains are built.
    pub label: Option<u32>,
    /// Segmentation of solid and void; required for grey images, `None` for labels.
    pub threshold: Option<Threshold>,
    /// Whether to apply a median of 27 voxels before the threshold. Surfaces are located in the
    /// unfiltered image.
    pub median: bool,
    /// Whether to treat each connected piece of the solid voxels as a grain.
    pub split: bool,
    /// Separates touching grains. Two maxima of the distance from the void are two grains if the
    /// neck between them is narrower than this fraction of the smaller one (0.87 did best on
    /// rendered packings).
    pub separate: Option<f64>,
    /// Whether to locate surfaces by grey values, if available, instead of the mask.
    pub sub_voxel: bool,
    /// Whether to include grains at the image border, truncated there: for tight crops.
    pub pad: bool,
    /// Whether to keep the largest piece of a label with several pieces.
    pub largest_piece: bool,
    /// Standard deviation of the smoothing [voxels]; `None` for 1.1 with grey values and 1.5 with a
    /// mask.
    pub smoothing: Option<f64>,
    /// Resolution, nodes and bounds. Small grains get fewer cells: 1.25 times the number of voxels
    /// across them, but at least 24.
    pub shape: ShapeOptions,
}

impl ScanOptions {
    /// Returns the default options for this voxel edge length [m].
    pub fn new(voxel: f64) -> ScanOptions {
        ScanOptions {
            voxel,
            label: None,
            threshold: None,
            median: false,
            split: false,
            separate: None,
            sub_voxel: true,
            pad: false,
            largest_piece: false,
            smoothing: None,
            shape: ShapeOptions::default(),
        }
    }

    /// Returns the memory for an image of many grains [bytes per voxel], as measured, including a
    /// 16-bit file. Surfaces of a grain that fills the image need as much again.
    pub fn bytes_per_voxel(&self) -> u64 {
        match (self.threshold, self.separate) {
            (Some(_), _) => 22,
            (None, Some(_)) => 18,
            (None, None) => 9,
        }
    }

    /// Returns whether the labels of the grains are to be determined.
    fn divides(&self) -> bool {
        self.split || self.separate.is_some()
    }
}

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
}

/// Callback for progress: stage, completed steps, total steps.
pub type Progress<'a> = &'a (dyn Fn(&str, u64, u64) + Sync);

/// Builds the shapes of the grains in a volume, ordered by label. Errors of the whole volume are
/// returned directly, those of one grain with that grain.
pub fn shapes_from_volume(
    volume: &Volume,
    source: &SourceFile,
    options: &ScanOptions,
) -> Result<Vec<ScannedGrain>> {
    scan_volume(volume, source, options, &|_, _, _| {}).map(|scan| scan.grains)
}

/// Builds the shapes of the grains and the label image, and reports progress.
pub fn scan_volume(
    volume: &Volume,
    source: &SourceFile,
    options: &ScanOptions,
    progress: Progress,
) -> Result<Scan> {
    check(options)?;
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
    let context = Context {
        dims,
        segments: &segments,
        source,
        options,
    };
    let shared = shared_surfaces(dims, labels);
    let done = AtomicU64::new(0);
    let total = selected.len() as u64;
    progress("shapes", 0, total);
    let grains = selected
        .par_iter()
        .map(|(label, region)| {
            let shape = grain::shape(&context, **label, region);
            progress("shapes", done.fetch_add(1, Ordering::Relaxed) + 1, total);
            ScannedGrain {
                label: **label,
                voxels: region.voxels,
                shared_surface: shared.get(label).copied().unwrap_or(0.0),
                shape,
            }
        })
        .collect();
    Ok(Scan {
        grains,
        labels: Volume {
            dims,
            voxels: Voxels::Labels(segments.labels),
        },
        threshold: segments.threshold,
    })
}

fn check(options: &ScanOptions) -> Result<()> {
    positive("voxel size", options.voxel)?;
    if let Some(smoothing) = options.smoothing {
        let reason = "must lie between 0.5 and 5 voxels";
        within("smoothing", smoothing, 0.5..=5.0, reason)?;
    }
    if let Some(neck) = options.separate {
        let reason = "must lie between 0.3 and 1: neck over grain";
        within("separate", neck, 0.3..=1.0, reason)?;
    }
    if let Some(Threshold::Value(value)) = options.threshold {
        within("threshold", value, f64::MIN..=f64::MAX, "must be finite")?;
    }
    Ok(())
}

/// Result of the segmentation.
pub(super) struct Segments {
    pub labels: Vec<u32>,
    /// Grey values, if surfaces are located by them.
    pub grey: Option<Grey>,
    pub threshold: Option<f64>,
    /// Labels at the edge of the field of view.
    pub cut_by_view: BTreeSet<u32>,
}

fn segment(
    volume: &Volume,
    source: &SourceFile,
    options: &ScanOptions,
    progress: Progress,
) -> Result<Segments> {
    let dims = volume.dims;
    let values = match (&volume.voxels, options.threshold) {
        (Voxels::Labels(labels), None) => {
            let divided = match options.label.filter(|_| options.divides()) {
                None => divide(labels, dims, options, progress)?,
                Some(phase) => {
                    let phase: Vec<u32> = labels.iter().map(|l| u32::from(*l == phase)).collect();
                    divide(&phase, dims, options, progress)?
                }
            };
            return Ok(Segments {
                labels: divided,
                grey: None,
                threshold: None,
                cut_by_view: BTreeSet::new(),
            });
        }
        (Voxels::Grey(_), None) => {
            let reason = "the image has grey values, not labels; give a threshold (--threshold \
                          otsu, otsu3, or a grey value)";
            return Err(ShapeError::unsupported(source.name.as_ref(), reason));
        }
        (Voxels::Labels(v), _) => v.iter().map(|v| *v as f32).collect(),
        (Voxels::Grey(v), _) => v.clone(),
    };
    progress("threshold", 0, 1);
    let clean = options.median.then(|| median(&values, dims));
    let filtered = clean.as_ref().unwrap_or(&values);
    let cut = options.threshold.and_then(|t| t.of(filtered));
    let Some(cut) = cut else {
        // All values are equal: black counts as empty.
        return Err(ShapeError::EmptyVolume);
    };
    let binary: Vec<u32> = filtered
        .iter()
        .map(|v| u32::from(f64::from(*v) >= cut))
        .collect();
    drop(clean);
    let labels = divide(&binary, dims, options, progress)?;
    let view = FieldOfView::of(&values, dims, cut);
    let mut segments = Segments {
        cut_by_view: view.map_or_else(BTreeSet::new, |view| view.cuts(&labels)),
        labels,
        grey: None,
        threshold: Some(cut),
    };
    // A binary image has no intermediate grey values.
    let two = values
        .iter()
        .all(|v| *v == values[0] || *v == 0.0 || *v == 1.0 || *v == 255.0);
    if options.sub_voxel && !two && segments.labels.iter().all(|l| *l < HALO) {
        let mut owner = segments.labels.clone();
        add_halo(&mut owner, dims, LAYERS);
        segments.grey = Some(Grey::new(dims, values, owner));
    }
    Ok(segments)
}

/// Fills cavities, splits and separates according to the options.
fn divide(
    labels: &[u32],
    dims: [usize; 3],
    options: &ScanOptions,
    progress: Progress,
) -> Result<Vec<u32>> {
    let Some(neck) = options.separate else {
        return Ok(if options.split {
            pieces(dims, |n| labels[n] != 0).0
        } else {
            labels.to_vec()
        });
    };
    progress("separate", 0, 1);
    let mut mask = Mask {
        dims,
        solid: labels.iter().map(|l| *l != 0).collect(),
    };
    if mask.solid.iter().all(|s| *s) {
        return Err(ShapeError::SolidVolume);
    }
    fill_cavities(&mut mask);
    Ok(separate(&transform::to_void(&mask), dims, neck))
}

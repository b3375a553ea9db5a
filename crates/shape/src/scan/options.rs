//! Options for converting a volume to shapes.

use super::Threshold;
use crate::assemble::ShapeOptions;
use crate::error::{Result, ShapeError, check_length, within};

/// Options for converting a volume to shapes.
#[derive(Clone, Debug, PartialEq)]
pub struct ScanOptions {
    /// Edge length of a voxel [m].
    pub voxel: f64,
    /// Label of a single grain; `None` for all labels. If a labelled image is to be split or
    /// separated, the label of the solid phase, and all grains are built.
    pub label: Option<u32>,
    /// Whether integers are labels even if the image looks grey.
    pub labels: bool,
    /// Segmentation of solid and void; required for grey images, `None` for labels.
    pub threshold: Option<Threshold>,
    /// Whether to apply a median of 27 voxels before the threshold. Surfaces are located in the
    /// unfiltered image.
    pub median: bool,
    /// Whether to treat each connected piece of the solid voxels, or of each label, as a grain.
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
    /// Whether to try refused labels again with other options for each, see [`Cure`](super::Cure).
    pub rescue: bool,
    /// Whether to try on the refused labels which options would accept them.
    pub advise: bool,
    /// Resolution, nodes and bounds. With the default number of cells, small grains get fewer: 1.25
    /// times the number of voxels across them, but at least 24. More add no detail.
    pub shape: ShapeOptions,
}

impl ScanOptions {
    /// Returns the default options for this voxel edge length [m].
    pub fn new(voxel: f64) -> ScanOptions {
        ScanOptions {
            voxel,
            label: None,
            labels: false,
            threshold: None,
            median: false,
            split: false,
            separate: None,
            sub_voxel: true,
            pad: false,
            largest_piece: false,
            smoothing: None,
            rescue: false,
            advise: false,
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
    pub(super) fn divides(&self) -> bool {
        self.split || self.separate.is_some()
    }

    /// Checks the options before a volume is read.
    ///
    /// # Errors
    /// [`ShapeError::BadParameter`] for a value out of range,
    /// [`ShapeError::MedianWithoutThreshold`].
    pub fn check(&self) -> Result<()> {
        if self.median && self.threshold.is_none() {
            return Err(ShapeError::MedianWithoutThreshold);
        }
        check_length("voxel size", self.voxel)?;
        self.shape.check()?;
        if let Some(smoothing) = self.smoothing {
            let reason = "must lie between 0.5 and 5 voxels";
            within("smoothing", smoothing, 0.5..=5.0, reason)?;
        }
        if let Some(neck) = self.separate {
            let reason = "must lie between 0.3 and 1: neck over grain";
            within("separate", neck, 0.3..=1.0, reason)?;
        }
        if let Some(Threshold::Value(value)) = self.threshold {
            within("threshold", value, f64::MIN..=f64::MAX, "must be finite")?;
        }
        Ok(())
    }
}

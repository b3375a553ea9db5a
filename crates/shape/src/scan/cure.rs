//! Options that may save a refused label, and their trial on single labels.

use super::ScanOptions;
use crate::error::{Defect, ShapeError};
use std::fmt::{Display, Formatter};

/// Options for one label that differ from those of the image.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cure {
    /// Whether to apply a median of 27 voxels to the mask of the label.
    pub median: bool,
    /// Standard deviation of the smoothing [voxels]; `None` for that of the image.
    pub smoothing: Option<f64>,
    /// Whether to keep the largest of several pieces.
    pub largest_piece: bool,
}

/// Writes the options of the command line.
impl Display for Cure {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        let mut words = Vec::new();
        if self.largest_piece {
            words.push("--largest-piece".to_owned());
        }
        if self.median {
            words.push("--median".to_owned());
        }
        if let Some(smoothing) = self.smoothing {
            words.push(format!("--smoothing {smoothing}"));
        }
        write!(f, "{}", words.join(" "))
    }
}

/// Smoothings that are tried [voxels].
const SMOOTHINGS: [f64; 3] = [1.5, 2.0, 3.0];
/// Smoothing that keeps necks which the default one breaks [voxels].
const GENTLE: f64 = 0.8;
/// Minimum difference of a tried smoothing from the present one [voxels].
const DIFFERENT: f64 = 0.2;

/// Returns the cures for this refusal, the gentlest first; none if options cannot help. The label
/// was smoothed by `smoothing` voxels.
pub(super) fn cures(why: &ShapeError, options: &ScanOptions, smoothing: f64) -> Vec<Cure> {
    if let ShapeError::SeveralPieces { .. } = why {
        return vec![Cure { largest_piece: true, ..Cure::default() }];
    }
    let ShapeError::Quality { defect, .. } = why else {
        return Vec::new();
    };
    let stronger = SMOOTHINGS.into_iter().filter(|s| *s > smoothing + DIFFERENT);
    let stronger: Vec<Option<f64>> = stronger.map(Some).collect();
    let cure = |median| {
        move |smoothing: &Option<f64>| Cure { median, smoothing: *smoothing, ..Cure::default() }
    };
    let mut all: Vec<Cure> = stronger.iter().map(cure(false)).collect();
    if *defect == Defect::Broken && smoothing > GENTLE + DIFFERENT {
        all.push(cure(false)(&Some(GENTLE)));
    }
    // The median filters grey values; it has no effect on labels.
    if options.threshold.is_some() && !options.median {
        all.extend([None].iter().chain(&stronger).map(cure(true)));
    }
    all
}

#[cfg(test)]
mod tests {
    use super::super::Threshold;
    use super::*;

    #[test]
    fn cures_are_named_as_options_and_none_repeats_the_present_ones() {
        let named = |defect, median, smoothing| -> Vec<String> {
            let why = ShapeError::quality(defect, "");
            let threshold = Some(Threshold::Otsu);
            let options = ScanOptions { median, threshold, ..ScanOptions::new(1.0) };
            cures(&why, &options, smoothing).iter().map(Cure::to_string).collect()
        };
        assert_eq!(
            named(Defect::Gradient, false, 1.5),
            [
                "--smoothing 2",
                "--smoothing 3",
                "--median",
                "--median --smoothing 2",
                "--median --smoothing 3"
            ]
        );
        assert_eq!(
            named(Defect::Broken, true, 1.1),
            ["--smoothing 1.5", "--smoothing 2", "--smoothing 3", "--smoothing 0.8"]
        );
        let options = ScanOptions::new(1.0);
        let rough = ShapeError::quality(Defect::Gradient, "");
        let found = cures(&rough, &options, 1.5);
        let found: Vec<String> = found.iter().map(Cure::to_string).collect();
        assert_eq!(found, ["--smoothing 2", "--smoothing 3"], "labels have no median");
        let few = ShapeError::TooFewVoxels { label: 1, voxels: 3, needed: 64 };
        assert!(cures(&few, &options, 1.1).is_empty());
        let two = ShapeError::SeveralPieces { label: 1, count: 2, sizes: String::new() };
        let found = cures(&two, &options, 1.1);
        assert_eq!(found.iter().map(Cure::to_string).collect::<Vec<_>>(), ["--largest-piece"]);
    }
}

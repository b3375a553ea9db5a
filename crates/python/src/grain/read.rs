//! Reading of a 3-D image with the options of Python.

use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};

use grainwake_run::case::quantity::Length;
use grainwake_shape::scan::{
    Scan, ScanOptions, Threshold, Volume, grey_notes, read_volume_and_voxel, scan_volume,
};
use grainwake_shape::{ReadLimits, SourceFile};
use pyo3::prelude::*;
use pyo3::types::PyString;

use super::build::options;
use super::volume;
use crate::arguments::{Whole, quantity, whole};
use crate::error::{Raise, input, warn};
use crate::running::interruptible;
use crate::threads::detached;

/// Options of a scan as Python gives them.
pub(super) struct Given {
    pub label: Option<Whole>,
    pub median: bool,
    pub split: bool,
    pub separate: Option<f64>,
    pub from_mask: bool,
    pub pad: bool,
    pub largest_piece: bool,
    pub smoothing: Option<f64>,
    pub rescue: bool,
    pub labels: bool,
    pub roundness: bool,
    pub cells: Option<Whole>,
    pub nodes: Option<Whole>,
}

impl Given {
    /// Returns the checked options.
    fn options(self, voxel: f64, threshold: Option<Threshold>) -> PyResult<ScanOptions> {
        let mut how = ScanOptions::new(voxel);
        how.label = whole("label", self.label.as_ref(), 0)?;
        how.threshold = threshold;
        how.median = self.median;
        how.split = self.split;
        how.separate = self.separate;
        how.sub_voxel = !self.from_mask;
        how.pad = self.pad;
        how.largest_piece = self.largest_piece;
        how.smoothing = self.smoothing;
        how.rescue = self.rescue;
        how.labels = self.labels;
        how.shape = options(self.cells.as_ref(), self.nodes.as_ref())?;
        how.shape.roundness = self.roundness;
        how.check().raise()?;
        Ok(how)
    }
}

/// Reads an image and builds its grains. Ctrl-C ends it before the next grain.
pub(super) fn read(
    py: Python<'_>,
    image: &Bound<'_, PyAny>,
    voxel: &Bound<'_, PyAny>,
    threshold: Option<&Bound<'_, PyAny>>,
    given: Given,
) -> PyResult<Scan> {
    let voxel = quantity::<Length>("voxel", voxel)?;
    let how = given.options(voxel, threshold.map(segmentation).transpose()?)?;
    let scanned = if let Ok(path) = image.extract::<PathBuf>() {
        let (volume, source, stated) = detached(py, || {
            let limits = ReadLimits::of_this_machine(how.bytes_per_voxel());
            read_volume_and_voxel(&path, &limits)
        })?
        .raise()?;
        let other = stated.filter(|stated| stated.contradicts(voxel)).map(|stated| {
            let file = path.display();
            format!(
                "{file} states voxels of {stated}, unlike voxel = {voxel:e} m; the grains have the \
                 size of voxel"
            )
        });
        warn(py, other)?;
        interruptible(py, |stop| scan_until(&volume, &source, &how, stop))?
    } else {
        let volume = volume::volume(image)?;
        interruptible(py, |stop| {
            let source = volume::source(&volume);
            scan_until(&volume, &source, &how, stop)
        })?
    };
    let scan = scanned.raise()?;
    warn(py, grey_notes(&scan.grains))?;
    Ok(scan)
}

/// Builds the grains of a volume; no further grain is begun once `stop` is set.
fn scan_until(
    volume: &Volume,
    source: &SourceFile,
    how: &ScanOptions,
    stop: &AtomicBool,
) -> grainwake_shape::Result<Scan> {
    scan_volume(volume, source, how, &|_, _, _| match stop.load(Ordering::Relaxed) {
        true => ControlFlow::Break(()),
        false => ControlFlow::Continue(()),
    })
}

fn segmentation(value: &Bound<'_, PyAny>) -> PyResult<Threshold> {
    if let Ok(word) = value.cast::<PyString>() {
        return match &*word.to_cow()? {
            "otsu" => Ok(Threshold::Otsu),
            "otsu3" => Ok(Threshold::Otsu3),
            other => Err(input(format!(
                "threshold: found \"{other}\"; expected a grey value, \"otsu\" or \"otsu3\""
            ))),
        };
    }
    value
        .extract()
        .map(Threshold::Value)
        .map_err(|_| input("threshold: expected a grey value, \"otsu\" or \"otsu3\""))
}

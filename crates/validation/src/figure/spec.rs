//! Validated description of the figures of a suite.

use std::collections::BTreeMap;
use std::path::PathBuf;

use grainwake_report::figure::field::Style;

use super::raw::{AxisSpec, SliceSpec};
use crate::check::Check;
use crate::measurement::Sampling;

/// Figure as described in `validation.toml`.
#[derive(Clone, Debug)]
pub struct FigureSpec {
    /// File name without extension, unique within the suite.
    pub name: String,
    /// Title, in label markup.
    pub title: String,
    /// Caption, in label markup.
    pub caption: String,
    /// Publications of the reference data.
    pub sources: Vec<String>,
    pub(super) content: Content,
}

#[derive(Clone, Debug)]
pub enum Content {
    Plot { across: AxisSpec, up: AxisSpec, series: Vec<SeriesSpec> },
    Pictures { style: Style, pictures: Vec<SliceSpec> },
}

/// Data set and its style.
#[derive(Clone, Debug)]
pub struct SeriesSpec {
    pub label: String,
    pub colour: &'static str,
    /// Number of its symbol.
    pub sign: usize,
    /// SVG dash pattern of its line ("" for a solid line); none for points only.
    pub line: Option<&'static str>,
    pub data: Data,
}

#[derive(Clone, Debug)]
pub enum Data {
    /// Columns of a file.
    Reference { file: PathBuf, x: String, y: String, constants: BTreeMap<String, f64> },
    /// Table of a run.
    History {
        run: String,
        sampling: Sampling,
        constants: BTreeMap<String, f64>,
        /// Whether the derivative is drawn.
        derivative: bool,
    },
    /// One value of each of several runs.
    Results {
        points: Vec<ResultPoint>,
        /// Whether the relative error is drawn.
        error: bool,
        /// Exponent of the guide line.
        slope: Option<f64>,
    },
}

/// Value of a run.
#[derive(Clone, Debug)]
pub struct ResultPoint {
    pub run: String,
    pub x: f64,
    pub check: Check,
    /// Expected value.
    pub reference: Option<f64>,
}

//! Figures of a suite: curves, points and fields from run folders beside reference data.

mod build;
mod draw;
mod plot;
mod raw;

use std::collections::BTreeMap;
use std::path::PathBuf;

use grainwake_report::figure::field::Style;

pub(crate) use build::build;
pub use draw::DrawnFigure;
pub(crate) use raw::RawFigure;
use raw::{AxisSpec, SliceSpec};

use crate::check::Check;
use crate::measurement::Sampling;

/// FigureSpec as described in `validation.toml`.
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
    content: Content,
}

#[derive(Clone, Debug)]
enum Content {
    Plot {
        across: AxisSpec,
        up: AxisSpec,
        series: Vec<SeriesSpec>,
    },
    Pictures {
        style: Style,
        pictures: Vec<SliceSpec>,
    },
}

/// Data set and its style.
#[derive(Clone, Debug)]
struct SeriesSpec {
    label: String,
    colour: &'static str,
    /// Number of its symbol.
    sign: usize,
    /// SVG dash pattern of its line ("" for a solid line); none for points only.
    line: Option<&'static str>,
    data: Data,
}

#[derive(Clone, Debug)]
enum Data {
    /// Columns of a file.
    Reference {
        file: PathBuf,
        x: String,
        y: String,
        constants: BTreeMap<String, f64>,
    },
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
struct ResultPoint {
    run: String,
    x: f64,
    check: Check,
    /// Expected value.
    reference: Option<f64>,
}

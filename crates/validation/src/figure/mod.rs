//! Figures of a suite: curves, points and pictures from run folders beside reference data.

mod draw;
mod file;
mod plot;
mod raw;

use std::collections::BTreeMap;
use std::path::PathBuf;

use grainwake_report::figure::field::{Quantity, Style};
use grainwake_report::figure::plan;

pub use draw::Drawn;
pub(crate) use file::build;
pub(crate) use raw::RawFigure;

use crate::measure::Window;
use crate::suite::Check;

/// A figure as `validation.toml` describes it.
#[derive(Clone, Debug)]
pub struct Figure {
    /// File name without its extension; one of its kind within the suite.
    pub name: String,
    /// Title, in label markup.
    pub title: String,
    /// What is to be seen, in label markup.
    pub caption: String,
    /// Where the reference data are from.
    pub sources: Vec<String>,
    content: Content,
}

#[derive(Clone, Debug)]
enum Content {
    Plot {
        across: AxisPlan,
        up: AxisPlan,
        series: Vec<Series>,
    },
    Pictures {
        quantity: Quantity,
        style: Style,
        pictures: Vec<Picture>,
    },
}

/// An axis before the data are known.
#[derive(Clone, Debug)]
struct AxisPlan {
    label: String,
    log: bool,
    /// Ends; none to take them from the data.
    ends: [Option<f64>; 2],
    /// Places of the ticks; none for round values.
    ticks: Option<Vec<f64>>,
}

/// One set of data and how it is drawn.
#[derive(Clone, Debug)]
struct Series {
    label: String,
    colour: &'static str,
    /// Number of its sign.
    sign: usize,
    /// SVG dash pattern of its line ("" for a full line); none for points alone.
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
    /// A table of a run.
    History {
        run: String,
        window: Window,
        constants: BTreeMap<String, f64>,
        /// Whether the derivative is drawn.
        derivative: bool,
    },
    /// One number of each of several runs.
    Results {
        points: Vec<Point>,
        /// Whether the distance from the reference is drawn.
        error: bool,
        /// Power of x that the guide line follows.
        slope: Option<f64>,
    },
}

/// The number of a run.
#[derive(Clone, Debug)]
struct Point {
    run: String,
    x: f64,
    check: Check,
    /// What the number should be.
    reference: Option<f64>,
}

/// A slice of a run.
#[derive(Clone, Debug)]
struct Picture {
    run: String,
    plane: String,
    title: String,
    window: Option<plan::Window>,
}

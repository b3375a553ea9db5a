//! The table `[[figure]]` of `validation.toml`, before validation.

use std::path::PathBuf;

use grainwake_plot::equal_aspect::Window;
use grainwake_plot::style;
use grainwake_report::figure::field::Style;
use grainwake_run::case::Located;
use serde::Deserialize;

use crate::columns::TableSource;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawFigure {
    pub name: Located<String>,
    pub title: String,
    #[serde(default)]
    pub caption: String,
    pub x: Option<AxisSpec>,
    pub y: Option<AxisSpec>,
    #[serde(default)]
    pub reference: Vec<RawReferenceCurve>,
    #[serde(default)]
    pub history: Vec<RawHistory>,
    #[serde(default)]
    pub results: Vec<RawResults>,
    pub field: Option<Style>,
    #[serde(default)]
    pub picture: Vec<SliceSpec>,
}

/// Axis of a plot.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AxisSpec {
    /// Label, in label markup.
    pub label: String,
    /// Linear or logarithmic.
    #[serde(default)]
    pub scale: Scale,
    /// Lower end; `None` for that of the data.
    pub from: Option<Located<f64>>,
    /// Upper end; `None` for that of the data.
    pub to: Option<Located<f64>>,
    /// Positions of the ticks; `None` for round values.
    pub ticks: Option<Vec<f64>>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Scale {
    #[default]
    Linear,
    Log,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Colour {
    Blue,
    Vermilion,
    Green,
    Purple,
    Orange,
    Sky,
    Black,
    Grey,
}

/// Symbol of the points, in the order of `frame::Marker::nth`.
#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Symbol {
    Circle,
    Square,
    Triangle,
    Diamond,
    Down,
    Pentagon,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LineKind {
    Full,
    Dashed,
    Dotted,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawReferenceCurve {
    pub label: String,
    pub data: PathBuf,
    pub x: Located<String>,
    pub y: Located<String>,
    pub source: Option<String>,
    pub colour: Option<Colour>,
    pub sign: Option<Symbol>,
    pub line: Option<LineKind>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawHistory {
    pub label: String,
    pub run: Located<String>,
    pub of: Located<String>,
    #[serde(default)]
    pub grain: usize,
    #[serde(default)]
    pub table: TableSource,
    pub against: Option<Located<String>>,
    pub from: Option<f64>,
    pub to: Option<f64>,
    #[serde(default)]
    pub derivative: bool,
    pub colour: Option<Colour>,
    pub line: Option<LineKind>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawResults {
    pub label: String,
    pub runs: Vec<Located<String>>,
    pub quantity: Located<String>,
    pub x: Located<Coordinates>,
    #[serde(default)]
    pub error: Located<bool>,
    pub reference: Option<f64>,
    pub slope: Option<f64>,
    pub colour: Option<Colour>,
    pub sign: Option<Symbol>,
    pub line: Option<LineKind>,
}

#[derive(Clone, Deserialize)]
#[serde(untagged)]
pub enum Coordinates {
    List(Vec<f64>),
    Expression(String),
}

/// Slice of a run.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SliceSpec {
    /// Name of the run.
    pub run: Located<String>,
    /// Name of the plane.
    pub plane: String,
    /// Title, in label markup.
    #[serde(default)]
    pub title: String,
    /// Lower left corner [m]; `None` for that of the slice.
    pub from: Option<[f64; 2]>,
    /// Upper right corner [m]; `None` for that of the slice.
    pub to: Option<Located<[f64; 2]>>,
}

impl SliceSpec {
    /// Returns the displayed range.
    pub fn window(&self) -> Window {
        let to = self.to.as_ref().map(|to| to.value);
        Window {
            low: self.from.unwrap_or([f64::NEG_INFINITY; 2]).into(),
            high: to.unwrap_or([f64::INFINITY; 2]).into(),
        }
    }
}

impl Colour {
    /// Returns the colour in SVG notation.
    pub fn hex(self) -> &'static str {
        match self {
            Colour::Blue => style::BLUE,
            Colour::Vermilion => style::VERMILION,
            Colour::Green => style::GREEN,
            Colour::Purple => style::PURPLE,
            Colour::Orange => style::ORANGE,
            Colour::Sky => style::SKY,
            Colour::Black => style::INK,
            Colour::Grey => style::FAINT,
        }
    }
}

impl LineKind {
    /// Returns the SVG dash pattern, empty for a solid line.
    pub fn dash(self) -> &'static str {
        match self {
            LineKind::Full => "",
            LineKind::Dashed => "4.5 2",
            LineKind::Dotted => "1.2 1.6",
        }
    }
}

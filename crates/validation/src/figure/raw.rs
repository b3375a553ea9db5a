//! The table `[[figure]]` of `validation.toml`, before validation.

use std::path::PathBuf;

use grainwake_plot::style;
use grainwake_run::case::Loc;
use serde::Deserialize;

use crate::columns::TableSource;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawFigure {
    pub name: Loc<String>,
    pub title: String,
    #[serde(default)]
    pub caption: String,
    pub x: Option<RawAxis>,
    pub y: Option<RawAxis>,
    #[serde(default)]
    pub reference: Vec<RawReference>,
    #[serde(default)]
    pub history: Vec<RawHistory>,
    #[serde(default)]
    pub results: Vec<RawResults>,
    pub field: Option<RawField>,
    #[serde(default)]
    pub picture: Vec<RawPicture>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawAxis {
    pub label: String,
    #[serde(default)]
    pub scale: Scale,
    pub from: Option<Loc<f64>>,
    pub to: Option<Loc<f64>>,
    pub ticks: Option<Vec<f64>>,
}

#[derive(Clone, Copy, Default, PartialEq, Deserialize)]
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
pub enum Mark {
    Circle,
    Square,
    Triangle,
    Diamond,
    Down,
    Pentagon,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Line {
    Full,
    Dashed,
    Dotted,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawReference {
    pub label: String,
    pub data: PathBuf,
    pub x: Loc<String>,
    pub y: Loc<String>,
    pub source: Option<String>,
    pub colour: Option<Colour>,
    pub sign: Option<Mark>,
    pub line: Option<Line>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawHistory {
    pub label: String,
    pub run: Loc<String>,
    pub of: Loc<String>,
    #[serde(default)]
    pub grain: usize,
    #[serde(default)]
    pub table: TableSource,
    pub against: Option<Loc<String>>,
    pub from: Option<f64>,
    pub to: Option<f64>,
    #[serde(default)]
    pub derivative: bool,
    pub colour: Option<Colour>,
    pub line: Option<Line>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawResults {
    pub label: String,
    pub runs: Vec<Loc<String>>,
    pub quantity: Loc<String>,
    pub x: Loc<Coordinates>,
    #[serde(default)]
    pub error: Loc<bool>,
    pub reference: Option<f64>,
    pub slope: Option<f64>,
    pub colour: Option<Colour>,
    pub sign: Option<Mark>,
    pub line: Option<Line>,
}

#[derive(Clone, Deserialize)]
#[serde(untagged)]
pub enum Coordinates {
    List(Vec<f64>),
    Expression(String),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawField {
    pub quantity: FieldQuantity,
    pub label: Option<String>,
    pub limit: Option<f64>,
    pub length: Option<String>,
    #[serde(default)]
    pub arrows: bool,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FieldQuantity {
    Speed,
    Vorticity,
    SolidFraction,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawPicture {
    pub run: Loc<String>,
    pub plane: String,
    #[serde(default)]
    pub title: String,
    pub from: Option<Loc<[f64; 2]>>,
    pub to: Option<Loc<[f64; 2]>>,
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

impl Line {
    /// Returns the SVG dash pattern, empty for a solid line.
    pub fn dash(self) -> &'static str {
        match self {
            Line::Full => "",
            Line::Dashed => "4.5 2",
            Line::Dotted => "1.2 1.6",
        }
    }
}

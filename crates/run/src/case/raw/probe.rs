//! `[[probe]]`: points, a line or a plane sampled over time.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::case::located::Located;
use crate::case::quantity::{Length, Quantity, Time, Triple};

/// Points, a line or a plane whose state is written to `probes/NAME.csv`. Give one of `point`,
/// `points`, `line` and `plane`.
#[derive(Clone, Debug, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawProbe {
    /// Name of the table: letters, digits, `-` and `_`; "probe0" for the first probe if not given.
    pub name: Option<Located<String>>,
    /// Interval of the rows [s]; that of `output.tables` if not given. 0 turns the probe off.
    pub every: Option<Located<Quantity<Time>>>,
    /// One point [m].
    pub point: Option<Located<Triple<Length>>>,
    /// Several points [m].
    pub points: Option<Located<Vec<Located<Triple<Length>>>>>,
    /// Points at equal distances on a line.
    pub line: Option<Located<RawLine>>,
    /// Plane across the box, for the flux through it.
    pub plane: Option<Located<RawProbePlane>>,
}

/// Points at equal distances on a line, both ends included.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawLine {
    /// First point [m].
    pub from: Located<Triple<Length>>,
    /// Last point [m].
    pub to: Located<Triple<Length>>,
    /// Number of points, at least 2.
    pub points: Located<usize>,
}

/// Plane across the box.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawProbePlane {
    /// Normal of the plane: "x", "y" or "z".
    pub normal: Located<String>,
    /// Position along that axis [m].
    pub at: Located<Quantity<Length>>,
}

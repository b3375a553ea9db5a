//! `[[poses]]`: grains placed by a table, such as the settled heap of another run.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::grain::RawShape;
use super::motion::RawMotion;
use crate::case::located::Located;
use crate::case::quantity::{Density, Length, Quantity, Time, Triple};

/// Grains at the poses of a table.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawPoses {
    /// A run folder, relative to the case file: its `grains.csv` gives the poses, and its
    /// `case.resolved.toml` shape, density, material and motion of each grain. Give either `run` or
    /// `file`.
    pub run: Option<Located<String>>,
    /// A CSV table, relative to the case file, with the columns of `grains.csv` or some of them.
    pub file: Option<Located<String>>,
    /// Takes the rows at this time [s] or at the last one before; the last rows if not given.
    pub time: Option<Located<Quantity<Time>>>,
    /// Takes velocities and angular velocities from the table; otherwise the grains start at rest.
    #[serde(default)]
    pub velocities: Located<bool>,
    /// Moves all grains [m].
    #[serde(default)]
    pub offset: Located<Triple<Length>>,
    /// With `file`: `.grain` files, relative to the case file. Grain n of the table takes the n-th,
    /// in turn.
    #[serde(default)]
    pub files: Vec<Located<String>>,
    /// With `file`: closed forms, taken in turn after the files.
    #[serde(default)]
    pub shapes: Vec<Located<RawShape>>,
    /// With `file`: number of surface nodes of closed forms.
    pub nodes: Option<Located<usize>>,
    /// With `file`: rescales each grain to this equivalent diameter [m], unless the table gives
    /// it.
    pub equivalent_diameter: Option<Located<Quantity<Length>>>,
    /// Density [kg/m3]: with `file`, unless the table gives it; with `run`, instead of that of the
    /// run.
    pub density: Option<Located<Quantity<Density>>>,
    /// Motion of all grains, as for `[[grain]]`; with `run`, instead of that of the run. "fixed"
    /// makes a fixed bed of a settled heap.
    pub motion: Option<Located<RawMotion>>,
}

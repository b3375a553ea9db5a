//! The case file as written: every key, its forms, its default. No key is checked against
//! another here; `validate` does that. Resolved values are written back through the same types.

mod domain;
mod expect;
pub(crate) mod forms;
mod given;
mod grain;
mod motion;
mod orientation;
mod packing;
mod physics;
mod plan;

pub use domain::{AxisFaces, CellSize, Face, FaceKind, RawDomain};
pub use expect::{OneOrMany, RawExpect, RawExpected, Tolerance};
pub use grain::{Position, RawGrain, RawShape, ShapeKind};
pub use motion::Law;
pub use orientation::{Orientation, Turns};
pub use packing::{Arrangement, PackingOrientation, RawPacking};
pub use physics::{RawContact, RawCoupling, RawFluid};
pub use plan::{RawOutput, RawRun, RawStop, RawTime};

use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::loc::Loc;
use super::quantity::{Acceleration, Triple};

/// A case: grains, fluid, box and what to write. Bare numbers are SI; strings carry units.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "Grainwake case file")]
pub struct RawCase {
    /// One line that says what the case is.
    #[serde(default)]
    pub title: String,
    /// Gravity [m/s2].
    #[serde(default = "earth")]
    pub gravity: Loc<Triple<Acceleration>>,
    /// The fluid; without it the run is dry (contact only).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fluid: Option<Loc<RawFluid>>,
    /// The box.
    pub domain: Loc<RawDomain>,
    /// How the grains act on the grid.
    #[serde(default)]
    pub coupling: RawCoupling,
    /// Contact law.
    #[serde(default)]
    pub contact: RawContact,
    /// Clock.
    pub time: RawTime,
    /// What is written and when.
    #[serde(default)]
    pub output: RawOutput,
    /// How the run is executed; threads have no effect on the results, precision rounds them.
    #[serde(default)]
    pub run: RawRun,
    /// Expected results, which make the case a test.
    #[serde(default, skip_serializing_if = "RawExpect::is_empty")]
    pub expect: RawExpect,
    /// The grains.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub grain: Vec<Loc<RawGrain>>,
    /// Groups of grains placed by a rule; written out as `[[grain]]` in the resolved case.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub packing: Vec<Loc<RawPacking>>,
}

fn earth() -> Loc<Triple<Acceleration>> {
    Loc::none(Triple::new(DVec3::new(0.0, 0.0, -9.81)))
}

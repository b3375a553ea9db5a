//! Case file as written: every key with its notations and its default. `validate` checks the keys
//! against each other. Resolved values are written through the same types.

mod domain;
mod expect;
mod formula;
mod grain;
mod motion;
mod orientation;
mod packing;
mod physics;
mod plan;
mod poses;
mod probe;
mod scales;

pub use domain::{AxisFaces, CellSize, Face, FaceKind, RawBoundaries, RawDomain};
pub use expect::{OneOrMany, RawExpect, RawExpected, Tolerance};
pub use grain::{Position, RawGrain, RawShape, ShapeKind};
pub use motion::MotionLaw;
pub use orientation::{Orientation, Turns};
pub use packing::{Arrangement, Bounds, PackingOrientation, RawPacking};
pub use physics::{RawContact, RawCoupling, RawFluid};
pub use plan::{RawOutput, RawPlane, RawRun, RawStop, RawTime};
pub use poses::RawPoses;
pub use probe::{RawLine, RawProbe};
pub use scales::{RawScales, ScalePreset, ScaleTable};

use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::located::{Located, is_default};
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
    pub gravity: Located<Triple<Acceleration>>,
    /// The fluid; without it the run is dry (contact only).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fluid: Option<Located<RawFluid>>,
    /// The box.
    pub domain: Located<RawDomain>,
    /// Coupling of grains and fluid.
    #[serde(default)]
    pub coupling: RawCoupling,
    /// Contact law.
    #[serde(default)]
    pub contact: RawContact,
    /// Clock.
    pub time: RawTime,
    /// Outputs and their intervals.
    #[serde(default)]
    pub output: RawOutput,
    /// Threads, which have no effect on the results, and precision, which decides the rounding.
    #[serde(default)]
    pub run: RawRun,
    /// Expected results, which make the case a test.
    #[serde(default, skip_serializing_if = "is_default")]
    pub expect: RawExpect,
    /// Points, lines and planes sampled over time.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub probe: Vec<Located<RawProbe>>,
    /// The grains.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub grain: Vec<Located<RawGrain>>,
    /// Groups of grains placed by a table; written out as `[[grain]]` in the resolved case.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub poses: Vec<Located<RawPoses>>,
    /// Groups of grains placed by a rule; written out as `[[grain]]` in the resolved case.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub packing: Vec<Located<RawPacking>>,
}

fn earth() -> Located<Triple<Acceleration>> {
    Triple::new(DVec3::new(0.0, 0.0, -9.81)).into()
}

//! `[time]`, `[output]` and `[run]`.

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};

use super::scales::RawScales;
use crate::case::located::Located;
use crate::case::notation::{Notation, Unsupported, notations, variant};
use crate::case::quantity::{Length, Number, Quantity, Time};
use crate::number_format::AXES;
use grainwake_solver::math::Precision;
use grainwake_solver::sim::events::StopWhen;

/// Clock.
#[derive(Clone, Debug, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawTime {
    /// End of the run [s].
    pub end: Located<Quantity<Time>>,
    /// Fixed step [s]. Without it the step follows `cfl`, `viscous` and `max_step`.
    pub step: Option<Located<Quantity<Time>>>,
    /// Limit of dt max(sum |u_a| / h_a); 0.4 where no limit or step is given.
    pub cfl: Option<Located<Quantity<Number>>>,
    /// Limit of nu dt sum 1 / h_a^2; 0.2 where it is not given.
    pub viscous: Option<Located<Quantity<Number>>>,
    /// Longest step [s]; from gravity, cell size (dry: diameter) and formulas if not given.
    pub max_step: Option<Located<Quantity<Time>>>,
    /// Ends the run before `end`: "landing" (every grain has touched the floor), "rest" (every
    /// grain has landed and lies still) or "separation" (a pair has parted after kissing).
    pub stop: Option<Located<RawStop>>,
}

/// Condition of an early end.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RawStop {
    /// Event that must have happened.
    pub when: StopWhen,
    /// Time to continue after the event [s].
    pub hold: Located<Quantity<Time>>,
}

/// Table of [`RawStop`].
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StopTable {
    /// Event that must have happened.
    #[schemars(schema_with = "stop_schema")]
    when: StopWhen,
    /// Time to continue after the event [s].
    #[serde(default)]
    hold: Located<Quantity<Time>>,
}

fn stop_schema(_: &mut SchemaGenerator) -> Schema {
    json_schema!({ "enum": [StopWhen::Landing, StopWhen::Rest, StopWhen::Separation] })
}

impl Notation for RawStop {
    const EXPECTED: &'static str =
        "\"landing\", \"rest\", \"separation\", or { when = \"landing\", hold = \"50 ms\" }";
    type List = Unsupported;
    type Table = StopTable;
    fn from_word(word: &str) -> Result<Self, String> {
        Ok(RawStop { when: variant(word)?, hold: Located::default() })
    }
    fn from_table(StopTable { when, hold }: StopTable) -> Result<Self, String> {
        Ok(RawStop { when, hold })
    }
    fn scalar_schemas(generator: &mut SchemaGenerator) -> Vec<Schema> {
        vec![stop_schema(generator)]
    }
}

notations!(RawStop);

/// Outputs and their intervals. An interval of 0 turns that output off.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RawOutput {
    /// Interval of the rows of `grains.csv` and `diagnostics.csv` [s]; end / 400 if not given, but
    /// not shorter than the step expected at the settling speed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tables: Option<Located<Quantity<Time>>>,
    /// Interval of the slices [s]; end / 40 if not given (dry: none).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slices: Option<Located<Quantity<Time>>>,
    /// Interval of the full fields [s]; 0 writes none.
    pub fields: Located<Quantity<Time>>,
    /// Interval of the posed grain surfaces [s]; that of the slices if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub surfaces: Option<Located<Quantity<Time>>>,
    /// Interval of the rows of `contacts.csv` [s]: force, overlap and point of every contact; none
    /// if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub contacts: Option<Located<Quantity<Time>>>,
    /// Interval of the VTK files of contact points and contact network [s]; none if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub contact_network: Option<Located<Quantity<Time>>>,
    /// Whether the beginning and the end of contacts with walls are events.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub wall_events: bool,
    /// Slices and surfaces also at a kiss, role change, separation or landing.
    pub at_events: bool,
    /// Slice planes. If not given: normal to y (normal to x if gravity acts along y) through the
    /// centre of each of at most two grains, else through the middle of the box.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub planes: Option<Vec<Located<RawPlane>>>,
    /// Scales of dimensionless columns in the tables: "gravity", "buoyancy", "viscous", or numbers;
    /// no such columns if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scales: Option<Located<RawScales>>,
    /// Wall-clock time between checkpoints [s]; 0 writes none by the clock.
    pub checkpoint_interval: Located<Quantity<Time>>,
    /// Steps between checkpoints; 0 writes none by steps.
    pub checkpoint_steps: Located<u64>,
    /// Checkpoints to keep, at least 1; 2 during the run and 1 after its end if not given. Another
    /// run can start from each of them (`run --from`).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub checkpoint_keep: Option<Located<usize>>,
}

impl Default for RawOutput {
    fn default() -> Self {
        RawOutput {
            tables: None,
            slices: None,
            fields: Located::default(),
            surfaces: None,
            contacts: None,
            contact_network: None,
            wall_events: false,
            at_events: true,
            planes: None,
            scales: None,
            checkpoint_interval: Quantity::new(300.0).into(),
            checkpoint_steps: 0.into(),
            checkpoint_keep: None,
        }
    }
}

/// One slice plane; give either `at` or `grain`.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawPlane {
    /// Normal of the plane: "x", "y" or "z".
    pub normal: Located<String>,
    /// Position along that axis [m].
    pub at: Option<Located<Quantity<Length>>>,
    /// Follows the centre of this grain.
    pub grain: Option<Located<usize>>,
}

/// Threads and precision. Results are bitwise identical for any number of threads; single precision
/// has larger rounding errors.
#[derive(Clone, Debug, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RawRun {
    /// Threads; 0 takes all cores. `--threads` overrides it.
    pub threads: Located<usize>,
    /// Floating-point type of the fields: "f64", or "f32" for half the memory and up to twice the
    /// speed. Grains, contact and sums over the grid are in double precision always.
    #[schemars(schema_with = "precision_schema")]
    pub precision: Located<Precision>,
}

fn precision_schema(_: &mut SchemaGenerator) -> Schema {
    json_schema!({ "enum": [Precision::Double, Precision::Single] })
}

impl From<&crate::Plane> for RawPlane {
    fn from(plane: &crate::Plane) -> RawPlane {
        let (at, grain) = match plane.position {
            crate::PlanePosition::At(at) => (Some(Quantity::new(at).into()), None),
            crate::PlanePosition::Grain(grain) => (None, Some(grain.into())),
        };
        RawPlane { normal: AXES[plane.axis].to_string().into(), at, grain }
    }
}

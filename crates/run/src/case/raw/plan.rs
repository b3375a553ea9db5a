//! `[time]`, `[output]` and `[run]`.

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};

use super::forms::{Forms, Never, deserialize_forms};
use crate::case::loc::Loc;
use crate::case::quantity::{Length, Number, Quantity, Time};
use crate::case::suggest::nearest;
use grainwake_solver::math::Precision;
use grainwake_solver::sim::events::StopWhen;

/// Clock.
#[derive(Clone, Debug, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawTime {
    /// End of the run [s].
    pub end: Loc<Quantity<Time>>,
    /// The same step always [s]. Without it the step follows `cfl`, `viscous` and `max_step`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step: Option<Loc<Quantity<Time>>>,
    /// Limit of dt max(sum |u_a| / h_a); 0.4 where no limit or step is given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cfl: Option<Loc<Quantity<Number>>>,
    /// Limit of nu dt sum 1 / h_a^2; 0.2 where it is not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub viscous: Option<Loc<Quantity<Number>>>,
    /// Never a longer step than this [s]; from gravity and cell size (dry: diameter) if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_step: Option<Loc<Quantity<Time>>>,
    /// Ends the run before `end`: "landing" (every grain has touched the floor), "rest" (every
    /// grain has landed and lies still) or "separation" (a pair has parted after kissing).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stop: Option<Loc<RawStop>>,
}

/// When to stop early.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RawStop {
    /// What must have happened.
    pub when: StopWhen,
    /// How long to go on after it [s].
    pub hold: Loc<Quantity<Time>>,
}

fn stop_word(word: &str) -> Result<StopWhen, String> {
    match word {
        "landing" => Ok(StopWhen::Landing),
        "rest" => Ok(StopWhen::Rest),
        "separation" => Ok(StopWhen::Separation),
        _ => {
            let hint = nearest(word, ["landing", "rest", "separation"])
                .map_or(String::new(), |w| format!(" (did you mean \"{w}\"?)"));
            Err(format!(
                "found \"{word}\"{hint}; expected {}",
                RawStop::EXPECTED
            ))
        }
    }
}

/// Table form of `RawStop`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StopTable {
    when: StopWhen,
    #[serde(default)]
    hold: Loc<Quantity<Time>>,
}

fn no_time() -> Quantity<Time> {
    Quantity::new(0.0)
}

impl Forms for RawStop {
    const EXPECTED: &'static str =
        "\"landing\", \"rest\", \"separation\", or { when = \"landing\", hold = \"50 ms\" }";
    type List = Never;
    type Table = StopTable;
    fn from_word(word: &str) -> Result<Self, String> {
        Ok(RawStop {
            when: stop_word(word)?,
            hold: no_time().into(),
        })
    }
    fn from_table(table: StopTable) -> Result<Self, String> {
        Ok(RawStop {
            when: table.when,
            hold: table.hold,
        })
    }
}

deserialize_forms!(RawStop);

impl JsonSchema for RawStop {
    fn schema_name() -> Cow<'static, str> {
        "Stop".into()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let words =
            json_schema!({ "enum": [StopWhen::Landing, StopWhen::Rest, StopWhen::Separation] });
        let hold = generator.subschema_for::<Quantity<Time>>();
        json_schema!({
            "description": RawStop::EXPECTED,
            "anyOf": [
                words,
                {
                    "type": "object",
                    "properties": { "when": words, "hold": hold },
                    "required": ["when"],
                    "additionalProperties": false,
                },
            ],
        })
    }
}

/// What is written and when. An interval of 0 turns that output off.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RawOutput {
    /// Interval of the rows of `grains.csv` and `diagnostics.csv` [s]; end / 400 if not given, but
    /// not shorter than the step expected at the settling speed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tables: Option<Loc<Quantity<Time>>>,
    /// Interval of the slices [s]; end / 40 if not given (dry: none).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slices: Option<Loc<Quantity<Time>>>,
    /// Interval of the full fields [s]; 0 writes none.
    pub fields: Loc<Quantity<Time>>,
    /// Interval of the posed grain surfaces [s]; that of the slices if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub surfaces: Option<Loc<Quantity<Time>>>,
    /// Slices and surfaces also at a kiss, role change, separation or landing.
    pub at_events: bool,
    /// Slice planes. If not given: normal to y (normal to x if gravity acts along y) through the
    /// centre of each of at most two grains, else through the middle of the box.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub planes: Option<Vec<Loc<RawPlane>>>,
    /// Wall-clock time between checkpoints [s]; 0 writes none by the clock.
    pub checkpoint_interval: Loc<Quantity<Time>>,
    /// Steps between checkpoints; 0 writes none by steps.
    pub checkpoint_steps: Loc<u64>,
}

impl Default for RawOutput {
    fn default() -> Self {
        RawOutput {
            tables: None,
            slices: None,
            fields: no_time().into(),
            surfaces: None,
            at_events: true,
            planes: None,
            checkpoint_interval: Quantity::new(300.0).into(),
            checkpoint_steps: 0.into(),
        }
    }
}

/// One slice plane; give either `at` or `grain`.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RawPlane {
    /// Normal of the plane: "x", "y" or "z".
    pub normal: Loc<String>,
    /// Where it lies along that axis [m].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at: Option<Loc<Quantity<Length>>>,
    /// Follows the centre of this grain.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub grain: Option<Loc<usize>>,
}

/// How the run is executed. Threads change no bit of a result; single precision rounds more coarsely.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RawRun {
    /// Threads; 0 takes all cores. `--threads` goes before it.
    pub threads: Loc<usize>,
    /// Floating-point type of the fields: "f64", or "f32" for half the memory and up to twice the
    /// speed. Grains, contact and sums over the grid are in double precision always.
    #[schemars(schema_with = "precision_schema")]
    pub precision: Loc<Precision>,
}

impl Default for RawRun {
    fn default() -> Self {
        RawRun {
            threads: 0.into(),
            precision: Precision::Double.into(),
        }
    }
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
        RawPlane {
            normal: ["x", "y", "z"][plane.axis].to_string().into(),
            at,
            grain,
        }
    }
}

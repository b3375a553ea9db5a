//! The requested analysis of a study: claims to be tested, correlations and figures.

use std::collections::BTreeMap;

use grainwake_run::case::exactly;
use serde::{Deserialize, Serialize};

/// Requested analysis of the results: claims, correlations, figures.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Analysis {
    /// Conditions that a run must meet to be in claims, correlations and figures; the results on
    /// the first contact are of all runs.
    #[serde(default)]
    pub when: BTreeMap<String, Condition>,
    /// Claims to be tested.
    #[serde(default)]
    pub claims: Vec<Claim>,
    /// Rule of the verdicts on claims.
    #[serde(default)]
    pub verdicts: Option<VerdictRule>,
    /// Rank correlations to be computed.
    #[serde(default)]
    pub correlations: Option<Correlations>,
    /// Requested results on the first contact of pairs.
    #[serde(default)]
    pub kissing: Option<Kissing>,
    /// Contents of the figures.
    #[serde(default)]
    pub figures: FigureRequest,
    /// Quantities that are not converged on the study's grid.
    #[serde(default)]
    pub resolution: Option<Resolution>,
}

/// Quantities that are not converged on the study's grid.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Resolution {
    /// Quantities that still change with the grid: no claim about them is called contradicted.
    pub unconverged: Vec<String>,
    /// Evidence, printed at the head of the report: what a finer grid gives.
    pub note: String,
}

/// Name of the effect of trends, in [`VerdictRule::negligible`].
pub const RANK_CORRELATION: &str = "rank_correlation";

/// Rule of the verdicts on claims.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VerdictRule {
    /// Largest share of wrong verdicts on directions that is accepted, as the p values are adjusted
    /// for the number of claims; none: no adjustment.
    #[serde(default)]
    pub false_discovery_rate: Option<f64>,
    /// Sizes of effects that do not matter: of a `rank_correlation`, or of the difference of a
    /// quantity, in its unit.
    #[serde(default)]
    pub negligible: BTreeMap<String, f64>,
}

/// Claim about a quantity, with its statistical test.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Claim {
    /// Statement in words.
    pub says: String,
    /// Section of the publication that makes the claim.
    pub part: String,
    /// Quantity that the claim is about.
    pub quantity: String,
    /// Statistical test.
    pub test: Test,
    /// Conditions that a model must meet to be included.
    #[serde(default)]
    pub when: BTreeMap<String, Condition>,
    /// Whether right-censored observations are excluded; otherwise they count as lower bounds.
    #[serde(default)]
    pub observed: bool,
}

/// Statistical test of a quantity.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Test {
    /// Monotonic trend with a factor.
    Trend {
        /// Factor.
        with: String,
        /// Direction.
        sign: Sign,
    },
    /// Larger at one level of an axis than at another, all else equal.
    Order {
        /// Axis.
        axis: String,
        /// Level with the larger values.
        more: String,
        /// Level with the smaller values.
        less: String,
    },
    /// Equal at two levels of an axis, all else equal.
    Equal {
        /// Axis.
        axis: String,
        /// The two levels.
        #[serde(deserialize_with = "exactly")]
        values: [String; 2],
        /// Relative difference that counts as equal.
        within: f64,
    },
    /// Larger coefficient of variation at one level of an axis than at another.
    Spread {
        /// Axis.
        axis: String,
        /// Level with the larger variation.
        more: String,
        /// Level with the smaller variation.
        less: String,
    },
    /// Trend of the range over the levels of an axis with a factor.
    Range {
        /// Axis.
        over: String,
        /// Factor.
        with: String,
        /// Direction.
        sign: Sign,
    },
    /// Equal to the value of a reference model.
    Near {
        /// Name of the reference model, or a pattern: the first model in the records is taken.
        model: String,
        /// Relative difference that counts as equal.
        within: f64,
    },
}

/// Direction of a trend.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sign {
    /// Increasing.
    Rises,
    /// Decreasing.
    Falls,
    /// Neither.
    None,
}

/// Condition that a model must meet to be included.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(
    untagged,
    expecting = "expected a level, a list of levels, or { at_least = ..., at_most = ... }"
)]
pub enum Condition {
    /// Level of the axis.
    Is(String),
    /// One of several levels of the axis.
    In(Vec<String>),
    /// Range of a factor.
    Range(Range),
}

/// Range of a factor; both ends are included.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Range {
    /// Lower end.
    pub at_least: Option<f64>,
    /// Upper end.
    pub at_most: Option<f64>,
}

/// Rank correlations of quantities with factors, separately for each level of an axis.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Correlations {
    /// Quantities.
    pub quantities: Vec<String>,
    /// Factors.
    pub factors: Vec<String>,
    /// Axis.
    pub by: String,
}

/// Requested results on the first contact of pairs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Kissing {
    /// Axis whose levels are compared.
    pub by: String,
    /// Axis of the grids, from coarse to fine.
    #[serde(default)]
    pub grid: Option<String>,
}

/// Requested figures; a figure whose keys are missing is not drawn.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FigureRequest {
    /// Axis whose levels are the grains.
    pub grains: Option<String>,
    /// Factor that is constant along a row of grains.
    pub rows: Option<String>,
    /// Factor that is constant along a column of grains.
    pub columns: Option<String>,
    /// Axis whose levels are the initial orientations.
    pub orientations: Option<String>,
    /// Grain whose orientations are shown.
    pub oriented: Option<String>,
    /// Model whose initial state is shown.
    pub setup: Option<String>,
    /// Models shown at several instants, in slices.
    pub stories: Vec<String>,
    /// Orientation in which the histories of all grains are compared.
    pub compare: Option<String>,
    /// Model that all others are compared with.
    pub reference: Option<String>,
}

impl Analysis {
    /// Adds another analysis: its claims and conditions come on top, its tables replace those here.
    pub(super) fn extend(&mut self, other: Analysis) {
        self.when.extend(other.when);
        self.claims.extend(other.claims);
        self.verdicts = other.verdicts.or(self.verdicts.take());
        self.correlations = other.correlations.or(self.correlations.take());
        self.kissing = other.kissing.or(self.kissing.take());
        self.resolution = other.resolution.or(self.resolution.take());
        if other.figures != FigureRequest::default() {
            self.figures = other.figures;
        }
    }
}

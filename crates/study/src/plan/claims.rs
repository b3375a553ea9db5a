//! The analysis file: claims to be tested, correlations and figures.

use std::collections::BTreeMap;
use std::ops::Range;

use grainwake_run::case::{Located, Problem, Source};
use serde::{Deserialize, Serialize};

use super::expand::Model;
use super::quantities::{PAIR_QUANTITIES, SETTLING_QUANTITIES, SHAPE_FACTORS};
use crate::error::{did_you_mean, refer_to_study_keys};

/// Requested analysis of the results: claims, correlations, figures.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Analysis {
    /// Claims to be tested.
    #[serde(default)]
    pub claims: Vec<Claim>,
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
        /// Reference model.
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
#[serde(untagged)]
pub enum Condition {
    /// Level of the axis.
    Is(String),
    /// One of several levels of the axis.
    In(Vec<String>),
    /// Range of a factor; both ends are included.
    Range {
        /// Lower end.
        at_least: Option<f64>,
        /// Upper end.
        at_most: Option<f64>,
    },
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

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawAnalysis {
    #[serde(default)]
    claim: Vec<RawClaim>,
    correlations: Option<Located<Correlations>>,
    kissing: Option<Located<Kissing>>,
    figures: Option<Located<FigureRequest>>,
    resolution: Option<Located<Resolution>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawClaim {
    says: String,
    #[serde(default)]
    part: String,
    quantity: Located<String>,
    test: Located<Test>,
    #[serde(rename = "where", default)]
    when: BTreeMap<String, Located<Condition>>,
    #[serde(default)]
    observed: bool,
}

type Span<'a> = Option<&'a Range<usize>>;

/// Check of the names in an analysis file against the models of the study.
struct NameCheck<'a> {
    source: &'a Source,
    models: &'a [Model],
    problems: Vec<Problem>,
}

impl NameCheck<'_> {
    /// Reports a name that is not among the known ones; returns whether it is known.
    fn require<'b>(
        &mut self,
        kind: &str,
        name: &str,
        known: impl Iterator<Item = &'b str>,
        span: Span,
    ) -> bool {
        let mut known: Vec<&str> = known.collect();
        known.sort_unstable();
        known.dedup();
        if known.contains(&name) {
            return true;
        }
        let hint = did_you_mean(name, known.iter().copied());
        let problem = Problem::new(format!("there is no {kind} \"{name}\""))
            .help(format!("{hint}known names: {}", known.join(", ")));
        self.problems.push(self.source.locate(problem, span, "here"));
        false
    }

    fn quantity(&mut self, name: &str, span: Span) {
        let known = PAIR_QUANTITIES.into_iter().chain(SETTLING_QUANTITIES);
        self.require("quantity", name, known, span);
    }

    fn axis(&mut self, name: &str, span: Span) -> bool {
        let known = self.models.iter().flat_map(|m| m.levels.keys());
        self.require("axis", name, known.map(String::as_str), span)
    }

    fn levels<'b>(&mut self, axis: &str, names: impl IntoIterator<Item = &'b String>, span: Span) {
        if self.axis(axis, span) {
            let kind = format!("value of \"{axis}\" called");
            for name in names {
                let known = self.models.iter().filter_map(|m| m.levels.get(axis));
                self.require(&kind, name, known.map(String::as_str), span);
            }
        }
    }

    fn factor(&mut self, name: &str, span: Span) {
        let own = self.models.iter().flat_map(|m| m.factors.keys());
        self.require("factor", name, own.map(String::as_str).chain(SHAPE_FACTORS), span);
    }

    fn model(&mut self, name: &str, span: Span) {
        let known = self.models.iter().map(|m| m.name.as_str());
        self.require("model", name, known, span);
    }

    fn test(&mut self, test: &Located<Test>) {
        let span = test.span.as_ref();
        match &test.value {
            Test::Trend { with, .. } => self.factor(with, span),
            Test::Order { axis, more, less } | Test::Spread { axis, more, less } => {
                self.levels(axis, [more, less], span);
            }
            Test::Equal { axis, values, .. } => self.levels(axis, values, span),
            Test::Range { over, with, .. } => {
                self.axis(over, span);
                self.factor(with, span);
            }
            Test::Near { model, .. } => self.model(model, span),
        }
    }

    fn condition(&mut self, name: &str, condition: &Located<Condition>) {
        let span = condition.span.as_ref();
        match &condition.value {
            Condition::Is(level) => self.levels(name, [level], span),
            Condition::In(levels) => self.levels(name, levels, span),
            Condition::Range { .. } => self.factor(name, span),
        }
    }

    fn figures(&mut self, figures: &FigureRequest, span: Span) {
        for axis in [&figures.grains, &figures.orientations].into_iter().flatten() {
            self.axis(axis, span);
        }
        for factor in [&figures.rows, &figures.columns].into_iter().flatten() {
            self.factor(factor, span);
        }
        let models = [&figures.setup, &figures.reference].into_iter().flatten();
        for model in models.chain(&figures.stories) {
            self.model(model, span);
        }
        for (axis, level) in
            [(&figures.grains, &figures.oriented), (&figures.orientations, &figures.compare)]
        {
            if let Some(axis) = axis {
                self.levels(axis, level, span);
            }
        }
    }
}

impl Analysis {
    /// Reads an analysis file and checks its names against the models.
    ///
    /// # Errors
    /// All problems found, with their location in the file.
    pub fn parse(name: &str, text: &str, models: &[Model]) -> Result<Analysis, Vec<Problem>> {
        let (source, raw): (Source, RawAnalysis) =
            Source::parse(name, text, &[]).map_err(|p| vec![refer_to_study_keys(p)])?;
        let mut check = NameCheck { source: &source, models, problems: Vec::new() };
        for claim in &raw.claim {
            check.quantity(&claim.quantity, claim.quantity.span.as_ref());
            check.test(&claim.test);
            for (name, condition) in &claim.when {
                check.condition(name, condition);
            }
        }
        if let Some(Located { value, span }) = &raw.correlations {
            let span = span.as_ref();
            value.quantities.iter().for_each(|q| check.quantity(q, span));
            value.factors.iter().for_each(|f| check.factor(f, span));
            check.axis(&value.by, span);
        }
        if let Some(Located { value, span }) = &raw.kissing {
            for axis in [&value.by].into_iter().chain(&value.grid) {
                check.axis(axis, span.as_ref());
            }
        }
        if let Some(Located { value, span }) = &raw.resolution {
            let quantities = &value.unconverged;
            quantities.iter().for_each(|q| check.quantity(q, span.as_ref()));
        }
        if let Some(figures) = &raw.figures {
            check.figures(&figures.value, figures.span.as_ref());
        }
        if !check.problems.is_empty() {
            return Err(check.problems);
        }
        let claim = |raw: RawClaim| Claim {
            says: raw.says,
            part: raw.part,
            quantity: raw.quantity.value,
            test: raw.test.value,
            observed: raw.observed,
            when: raw.when.into_iter().map(|(name, c)| (name, c.value)).collect(),
        };
        Ok(Analysis {
            claims: raw.claim.into_iter().map(claim).collect(),
            correlations: raw.correlations.map(|c| c.value),
            kissing: raw.kissing.map(|k| k.value),
            figures: raw.figures.map(|f| f.value).unwrap_or_default(),
            resolution: raw.resolution.map(|r| r.value),
        })
    }
}

//! Claims about the results, and what the runs say about them.

use std::collections::BTreeMap;

use grainwake_solver::case::{Loc, Problem, Source, nearest};
use serde::{Deserialize, Serialize};

use crate::error::of_a_study;
use crate::plan::expand::Model;
use crate::plan::quantities::{PAIR_QUANTITIES, SETTLING_QUANTITIES, SHAPE_FACTORS};

/// What is asked of the results: claims, correlations, figures.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Analysis {
    /// Claims to be tested.
    #[serde(default)]
    pub claims: Vec<Claim>,
    /// Rank correlations to be listed.
    #[serde(default)]
    pub correlations: Option<Correlations>,
    /// What the figures show.
    #[serde(default)]
    pub figures: FigureRequest,
}

/// A claim and how it is tested.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Claim {
    /// In words.
    pub says: String,
    /// Where it is made.
    pub part: String,
    /// The quantity that it is about.
    pub quantity: String,
    /// How it is tested.
    pub test: Test,
    /// Which models count.
    #[serde(default)]
    pub when: BTreeMap<String, Condition>,
    /// Whether pairs that landed before it happened are left out, not lower bounds.
    #[serde(default)]
    pub observed: bool,
}

/// A test of a quantity.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Test {
    /// It rises or falls with a factor.
    Trend {
        /// Which factor.
        with: String,
        /// How.
        sign: Sign,
    },
    /// It is larger at one value of an axis than at another, all else equal.
    Order {
        /// Which axis.
        axis: String,
        /// Where it is larger.
        more: String,
        /// Where it is smaller.
        less: String,
    },
    /// It is the same at two values of an axis, all else equal.
    Equal {
        /// Which axis.
        axis: String,
        /// The two values.
        values: [String; 2],
        /// Relative difference that counts as none.
        within: f64,
    },
    /// It is spread more widely, relative to its size, at one value of an axis than at another.
    Spread {
        /// Which axis.
        axis: String,
        /// Where it is spread more.
        more: String,
        /// Where it is spread less.
        less: String,
    },
    /// Its range over the values of an axis rises or falls with a factor.
    Range {
        /// Which axis.
        over: String,
        /// Which factor.
        with: String,
        /// How.
        sign: Sign,
    },
    /// It is that of a certain model.
    Near {
        /// Which model.
        model: String,
        /// Relative difference that counts as none.
        within: f64,
    },
}

/// Which way a trend goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sign {
    /// It rises.
    Rises,
    /// It falls.
    Falls,
    /// It does neither.
    None,
}

/// What a model must be to count.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Condition {
    /// This value of the axis.
    Is(String),
    /// One of these values of the axis.
    In(Vec<String>),
    /// A factor in this range.
    Range {
        /// Not smaller.
        at_least: Option<f64>,
        /// Not larger.
        at_most: Option<f64>,
    },
}

/// Rank correlations of quantities with factors, apart for each value of an axis.
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

/// What the figures show. What is not given is not drawn.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FigureRequest {
    /// Axis whose values are the grains.
    pub grains: Option<String>,
    /// Factors that place a grain in its row and its column.
    pub rows: Option<String>,
    /// Its column.
    pub columns: Option<String>,
    /// Axis whose values are the orientations.
    pub orientations: Option<String>,
    /// Grain whose orientations are shown.
    pub oriented: Option<String>,
    /// Model whose set-up is shown.
    pub setup: Option<String>,
    /// Models that are shown at instants, in slices.
    pub stories: Vec<String>,
    /// Orientation in which curves are compared.
    pub compare: Option<String>,
    /// Model that stands beside all others.
    pub reference: Option<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RawAnalysis {
    #[serde(default)]
    claim: Vec<RawClaim>,
    correlations: Option<Loc<Correlations>>,
    figures: Option<Loc<FigureRequest>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawClaim {
    says: String,
    #[serde(default)]
    part: String,
    quantity: Loc<String>,
    test: Loc<Test>,
    #[serde(rename = "where", default)]
    when: BTreeMap<String, Loc<Condition>>,
    #[serde(default)]
    observed: bool,
}

/// What can be asked for: of a pair, of other grains.
fn quantities() -> impl Iterator<Item = &'static str> + Clone {
    PAIR_QUANTITIES.into_iter().chain(SETTLING_QUANTITIES)
}

/// Checks names against the models of the study.
struct Names<'a> {
    source: &'a Source,
    models: &'a [Model],
}

impl Names<'_> {
    fn check<'b>(
        &self,
        kind: &str,
        name: &str,
        known: impl Iterator<Item = &'b str> + Clone,
        span: Option<&std::ops::Range<usize>>,
    ) -> Result<(), Problem> {
        if known.clone().any(|k| k == name) {
            return Ok(());
        }
        let mut all: Vec<&str> = known.collect();
        all.sort_unstable();
        all.dedup();
        let hint = nearest(name, all.iter().copied())
            .map_or(String::new(), |n| format!("did you mean \"{n}\"? "));
        let problem = Problem::new(format!("there is no {kind} \"{name}\""))
            .help(format!("{hint}There are: {}", all.join(", ")));
        Err(self.source.locate(problem, span, "here"))
    }
    fn quantity(&self, name: &Loc<String>) -> Result<(), Problem> {
        self.check("quantity", &name.value, quantities(), name.span.as_ref())
    }
    fn axis(&self, name: &str, span: Option<&std::ops::Range<usize>>) -> Result<(), Problem> {
        self.check(
            "axis",
            name,
            self.models
                .iter()
                .flat_map(|m| m.levels.keys().map(String::as_str)),
            span,
        )
    }
    fn level(
        &self,
        axis: &str,
        name: &str,
        span: Option<&std::ops::Range<usize>>,
    ) -> Result<(), Problem> {
        self.axis(axis, span)?;
        let known = self
            .models
            .iter()
            .filter_map(|m| m.levels.get(axis).map(String::as_str));
        self.check(&format!("value of \"{axis}\" called"), name, known, span)
    }
    fn factor(&self, name: &str, span: Option<&std::ops::Range<usize>>) -> Result<(), Problem> {
        let own = self
            .models
            .iter()
            .flat_map(|m| m.factors.keys().map(String::as_str));
        self.check("factor", name, own.chain(SHAPE_FACTORS), span)
    }
    fn model(&self, name: &str, span: Option<&std::ops::Range<usize>>) -> Result<(), Problem> {
        self.check(
            "model",
            name,
            self.models.iter().map(|m| m.name.as_str()),
            span,
        )
    }

    fn test(&self, test: &Loc<Test>) -> Result<(), Problem> {
        let span = test.span.as_ref();
        match &test.value {
            Test::Trend { with, .. } => self.factor(with, span),
            Test::Order { axis, more, less } | Test::Spread { axis, more, less } => self
                .level(axis, more, span)
                .and_then(|()| self.level(axis, less, span)),
            Test::Equal {
                axis,
                values: [a, b],
                ..
            } => self
                .level(axis, a, span)
                .and_then(|()| self.level(axis, b, span)),
            Test::Range { over, with, .. } => {
                self.axis(over, span).and_then(|()| self.factor(with, span))
            }
            Test::Near { model, .. } => self.model(model, span),
        }
    }

    fn condition(&self, name: &str, condition: &Loc<Condition>) -> Result<(), Problem> {
        let span = condition.span.as_ref();
        match &condition.value {
            Condition::Is(level) => self.level(name, level, span),
            Condition::In(levels) => levels
                .iter()
                .try_for_each(|level| self.level(name, level, span)),
            Condition::Range { .. } => self.factor(name, span),
        }
    }

    fn figures(
        &self,
        plan: &FigureRequest,
        span: Option<&std::ops::Range<usize>>,
    ) -> Result<(), Problem> {
        let each = |name: &Option<String>, check: &dyn Fn(&str) -> Result<(), Problem>| {
            name.as_deref().map_or(Ok(()), check)
        };
        each(&plan.grains, &|n| self.axis(n, span))?;
        each(&plan.orientations, &|n| self.axis(n, span))?;
        each(&plan.rows, &|n| self.factor(n, span))?;
        each(&plan.columns, &|n| self.factor(n, span))?;
        each(&plan.setup, &|n| self.model(n, span))?;
        each(&plan.reference, &|n| self.model(n, span))?;
        plan.stories.iter().try_for_each(|n| self.model(n, span))?;
        if let Some(axis) = &plan.grains {
            each(&plan.oriented, &|n| self.level(axis, n, span))?;
        }
        if let Some(axis) = &plan.orientations {
            each(&plan.compare, &|n| self.level(axis, n, span))?;
        }
        Ok(())
    }
}

impl Analysis {
    /// Reads an analysis file for these models.
    ///
    /// # Errors
    /// What is wrong, with its place.
    pub fn parse(name: &str, text: &str, models: &[Model]) -> Result<Analysis, Vec<Problem>> {
        let (source, raw): (Source, RawAnalysis) =
            Source::parse(name, text, &[]).map_err(|p| vec![of_a_study(p)])?;
        let names = Names {
            source: &source,
            models,
        };
        let mut problems = Vec::new();
        let mut note = |found: Result<(), Problem>| problems.extend(found.err());
        for claim in &raw.claim {
            note(names.quantity(&claim.quantity));
            note(names.test(&claim.test));
            claim
                .when
                .iter()
                .for_each(|(name, c)| note(names.condition(name, c)));
        }
        if let Some(Loc { value, span }) = &raw.correlations {
            let span = span.as_ref();
            value.quantities.iter().for_each(|q| {
                note(names.check("quantity", q, quantities(), span));
            });
            value
                .factors
                .iter()
                .for_each(|f| note(names.factor(f, span)));
            note(names.axis(&value.by, span));
        }
        if let Some(Loc { value, span }) = &raw.figures {
            note(names.figures(value, span.as_ref()));
        }
        if !problems.is_empty() {
            return Err(problems);
        }
        let claim = |raw: RawClaim| Claim {
            says: raw.says,
            part: raw.part,
            quantity: raw.quantity.value,
            test: raw.test.value,
            observed: raw.observed,
            when: raw
                .when
                .into_iter()
                .map(|(name, c)| (name, c.value))
                .collect(),
        };
        Ok(Analysis {
            claims: raw.claim.into_iter().map(claim).collect(),
            correlations: raw.correlations.map(|c| c.value),
            figures: raw.figures.map(|f| f.value).unwrap_or_default(),
        })
    }
}

//! The analysis file: its keys, and the check of its names against the models of the study.

use std::collections::BTreeMap;

use grainwake_run::case::{Located, Problem, Source, did_you_mean};
use serde::Deserialize;

use super::claims::{
    Analysis, Claim, Condition, Correlations, FigureRequest, Kissing, RANK_CORRELATION, Range,
    Resolution, Test, VerdictRule,
};
use super::expand::Model;
use super::quantities::{PAIR_QUANTITIES, SETTLING_QUANTITIES, SHAPE_FACTORS};
use crate::error::refer_to_study_keys;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawAnalysis {
    #[serde(rename = "where", default)]
    when: BTreeMap<String, Located<Condition>>,
    #[serde(default)]
    claim: Vec<RawClaim>,
    verdicts: Option<Located<VerdictRule>>,
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

type Span<'a> = Option<&'a std::ops::Range<usize>>;

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
        let help = format!("{hint}known names: {}", known.join(", "));
        self.report(&format!("there is no {kind} \"{name}\""), &help, span);
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

    fn report(&mut self, message: &str, help: &str, span: Span) {
        self.problems.push(self.source.problem(message, help, span, "here"));
    }

    /// Checks two levels of an axis that are to be compared.
    fn two_levels(&mut self, axis: &str, levels: [&String; 2], span: Span) {
        self.levels(axis, levels, span);
        if levels[0] == levels[1] {
            self.report("a value is compared with itself", "name two values of the axis", span);
        }
    }

    fn test(&mut self, test: &Located<Test>) {
        let span = test.span.as_ref();
        if let Test::Equal { within, .. } | Test::Near { within, .. } = &test.value
            && !(within.is_finite() && *within > 0.0)
        {
            let help = "within is the largest relative difference that counts as equal, like 0.05";
            self.report("within must be a positive number", help, span);
        }
        match &test.value {
            Test::Trend { with, .. } => self.factor(with, span),
            Test::Order { axis, more, less } | Test::Spread { axis, more, less } => {
                self.two_levels(axis, [more, less], span);
            }
            Test::Equal { axis, values: [a, b], .. } => self.two_levels(axis, [a, b], span),
            Test::Range { over, with, .. } => {
                self.axis(over, span);
                self.factor(with, span);
            }
            Test::Near { model, .. } => {
                let known = glob::Pattern::new(model)
                    .is_ok_and(|pattern| self.models.iter().any(|m| pattern.matches(&m.name)));
                if !known {
                    self.model(model, span);
                }
            }
        }
    }

    fn condition(&mut self, name: &str, condition: &Located<Condition>) {
        let span = condition.span.as_ref();
        match &condition.value {
            Condition::Is(level) => self.levels(name, [level], span),
            Condition::In(levels) => {
                if levels.is_empty() {
                    let help = "list values of the axis, or leave out the condition";
                    self.report("no model meets a condition without values", help, span);
                }
                self.levels(name, levels, span);
            }
            Condition::Range(Range { at_least, at_most }) => {
                let help = "give at_least, at_most, or both with at_least below at_most";
                if at_least.is_none() && at_most.is_none() {
                    self.report("the range has no end", help, span);
                }
                if at_least.zip(*at_most).is_some_and(|(low, high)| low > high) {
                    self.report("no value lies in the range", help, span);
                }
                self.factor(name, span);
            }
        }
    }

    fn verdicts(&mut self, rule: &VerdictRule, span: Span) {
        if rule.false_discovery_rate.is_some_and(|rate| !(rate > 0.0 && rate < 1.0)) {
            self.report("false_discovery_rate must lie between 0 and 1", "0.05 is common", span);
        }
        if rule.negligible.values().any(|size| !(size.is_finite() && *size > 0.0)) {
            self.report("a negligible effect must be a positive number", "leave out the key", span);
        }
        let known = PAIR_QUANTITIES.into_iter().chain(SETTLING_QUANTITIES);
        let known: Vec<&str> = known.chain([RANK_CORRELATION]).collect();
        for name in rule.negligible.keys() {
            self.require("effect", name, known.iter().copied(), span);
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
        for (name, condition) in &raw.when {
            check.condition(name, condition);
        }
        if let Some(Located { value, span }) = &raw.verdicts {
            check.verdicts(value, span.as_ref());
        }
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
            if value.grid.as_ref() == Some(&value.by) {
                let help = "by is the axis that is compared, grid that of the grids";
                check.report("by and grid are the same axis", help, span.as_ref());
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
            when: conditions(raw.when),
        };
        Ok(Analysis {
            when: conditions(raw.when),
            verdicts: raw.verdicts.map(|v| v.value),
            claims: raw.claim.into_iter().map(claim).collect(),
            correlations: raw.correlations.map(|c| c.value),
            kissing: raw.kissing.map(|k| k.value),
            figures: raw.figures.map(|f| f.value).unwrap_or_default(),
            resolution: raw.resolution.map(|r| r.value),
        })
    }
}

fn conditions(raw: BTreeMap<String, Located<Condition>>) -> BTreeMap<String, Condition> {
    raw.into_iter().map(|(name, condition)| (name, condition.value)).collect()
}

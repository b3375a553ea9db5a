//! Verdicts on claims, from the effects that their tests give.

use std::collections::BTreeMap;

use serde::Serialize;

use super::claim_test::{Claimed, Effect, Outcome, test};
use super::statistics::{Estimate, FEWEST, false_discovery_adjusted};
use crate::format::p_value;
use crate::measure::record::RunRecord;
use crate::plan::claims::{Analysis, Claim, Condition, RANK_CORRELATION, Test, VerdictRule};

/// Verdict on a claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// The results show the claim.
    Holds,
    /// The results show the opposite.
    Contradicted,
    /// The results show neither.
    Open,
}

grainwake_formats::display_as_serialized!(Verdict);

/// Claim and the result of its test. The JSON names are stable.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// Statement of the claim.
    pub claim: String,
    /// Section of the publication that makes the claim.
    pub part: String,
    /// Quantity.
    pub quantity: String,
    /// Statistical test.
    pub test: Test,
    /// Conditions that a run must meet to be included.
    #[serde(rename = "where")]
    pub when: BTreeMap<String, Condition>,
    /// Whether pairs without the event are left out; otherwise they count as right-censored.
    pub observed: bool,
    /// Verdict.
    pub verdict: Verdict,
    /// Result of the test in words.
    pub says: String,
    /// Number of models or pairs of models.
    pub n: usize,
    /// Number of right-censored observations.
    #[serde(rename = "bounds")]
    pub censored: usize,
    /// Kind of the effect.
    pub effect: Effect,
    /// Estimated effect.
    pub value: Option<f64>,
    /// 95 % confidence interval.
    pub interval: Option<[f64; 2]>,
    /// Two-sided p value.
    pub p: Option<f64>,
    /// p value adjusted for the number of claims that name a direction, if the analysis states a
    /// false-discovery rate.
    pub adjusted_p: Option<f64>,
    /// Size of an effect that does not matter, if known.
    pub negligible: Option<f64>,
}

/// Tests the claims of an analysis. A claim about a quantity that is not converged with the grid is
/// never called contradicted.
pub fn evaluate(analysis: &Analysis, records: &[RunRecord]) -> Vec<Finding> {
    let rule = analysis.verdicts.clone().unwrap_or_default();
    let outcomes: Vec<Outcome> = analysis.claims.iter().map(|claim| test(claim, records)).collect();
    let negligible = |claim: &Claim, outcome: &Outcome| rule.negligible_effect(claim, outcome);
    // Claims of equality are judged by their intervals, and are not in the family.
    let directed = |claim: &Claim, outcome: &Outcome| match outcome.claimed {
        Claimed::Positive | Claimed::Negative => true,
        Claimed::Nothing => negligible(claim, outcome).is_none(),
        Claimed::AtMost(_) => false,
    };
    let family = analysis.claims.iter().zip(&outcomes).filter(|(c, o)| directed(c, o));
    let known: Vec<f64> = family.filter_map(|(_, o)| Some(o.estimate?.p)).collect();
    let mut adjusted = false_discovery_adjusted(&known).into_iter();
    let unconverged = |claim: &Claim| {
        let resolution = analysis.resolution.as_ref();
        resolution.is_some_and(|r| r.unconverged.contains(&claim.quantity))
    };
    let finding = |(claim, mut outcome): (&Claim, Outcome)| {
        let in_family = directed(claim, &outcome);
        let adjusted_p = outcome.estimate.filter(|_| in_family).and_then(|_| adjusted.next());
        let adjusted_p = adjusted_p.filter(|_| rule.false_discovery_rate.is_some());
        if let Some(p) = adjusted_p {
            outcome.says += &format!("; adjusted p {}", p_value(p));
        }
        let negligible = negligible(claim, &outcome);
        let judge = |estimate| judge(&rule, &outcome, estimate, adjusted_p, negligible);
        let mut verdict = outcome.estimate.map_or(Verdict::Open, judge);
        if unconverged(claim) {
            outcome.says += "; not converged with the grid";
            if verdict == Verdict::Contradicted {
                verdict = Verdict::Open;
            }
        }
        Finding {
            claim: claim.says.clone(),
            part: claim.part.clone(),
            quantity: claim.quantity.clone(),
            test: claim.test.clone(),
            when: claim.when.clone(),
            observed: claim.observed,
            verdict,
            says: outcome.says,
            n: outcome.n,
            censored: outcome.censored,
            effect: outcome.effect,
            value: outcome.estimate.map(|e| e.value),
            interval: outcome.estimate.map(|e| [e.low, e.high]),
            p: outcome.estimate.map(|e| e.p),
            adjusted_p,
            negligible,
        }
    };
    analysis.claims.iter().zip(outcomes).map(finding).collect()
}

impl VerdictRule {
    /// Returns the size of an effect that does not matter.
    fn negligible_effect(&self, claim: &Claim, outcome: &Outcome) -> Option<f64> {
        match (outcome.claimed, outcome.effect) {
            (Claimed::AtMost(within), _) => Some(within),
            (_, Effect::RankCorrelation) => self.negligible.get(RANK_CORRELATION).copied(),
            _ => self.negligible.get(&claim.quantity).copied(),
        }
    }
}

/// Returns the verdict on an effect.
///
/// - A direction is shown by an interval that excludes zero, and by an adjusted p value below the
///   false-discovery rate where one is given. It is contradicted by the opposite direction, and by
///   an interval of negligible effects.
/// - Equality is shown by an interval of negligible effects, and contradicted by an interval
///   outside of them. Without a negligible size "no effect" is only contradicted: by a direction.
/// - No effect is called negligible by fewer than [`FEWEST`] pairs with the event on either side.
fn judge(
    rule: &VerdictRule,
    outcome: &Outcome,
    e: Estimate,
    adjusted_p: Option<f64>,
    negligible: Option<f64>,
) -> Verdict {
    let significant =
        rule.false_discovery_rate.is_none_or(|rate| adjusted_p.is_some_and(|p| p < rate));
    let (rises, falls) = (significant && e.low > 0.0, significant && e.high < 0.0);
    let inside = negligible.is_some_and(|size| e.low >= -size && e.high <= size)
        && outcome.informative() >= FEWEST;
    let outside = negligible.is_some_and(|size| e.low > size || e.high < -size);
    let (holds, contradicted) = match outcome.claimed {
        Claimed::Positive => (rises, falls || inside),
        Claimed::Negative => (falls, rises || inside),
        Claimed::Nothing if negligible.is_none() => (false, rises || falls),
        Claimed::Nothing | Claimed::AtMost(_) => (inside, outside),
    };
    match (holds, contradicted) {
        (true, _) => Verdict::Holds,
        (_, true) => Verdict::Contradicted,
        _ => Verdict::Open,
    }
}

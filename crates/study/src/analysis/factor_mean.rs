//! Means of quantities at the values of a factor.

use std::collections::BTreeMap;

use serde::Serialize;

use super::observation::{Member, members};
use super::statistics::{bootstrap_interval, share_interval};
use crate::measure::mean;
use crate::measure::record::RunRecord;
use crate::plan::Factors;
use crate::plan::claims::{Analysis, Condition};

/// Name of the share of runs in which the pair comes into contact before it lands.
pub const KISSING_SHARE: &str = "kissing_share";
/// Largest number of values of a factor that are groups of their own.
const VALUES: usize = 6;
/// Number of groups of a factor with more values.
const GROUPS: usize = 4;

/// Mean of a quantity over the models of a group with similar values of a factor. The JSON names
/// are stable.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FactorMean {
    /// Quantity; [`KISSING_SHARE`] or one of the correlations.
    pub quantity: String,
    /// Factor.
    pub factor: String,
    /// Level of the axis.
    pub level: String,
    /// Mean of the factor over the group.
    pub at: f64,
    /// Number of models.
    pub models: usize,
    /// Mean over the models of the mean over their members, without right-censored values.
    pub mean: f64,
    /// 95 % interval, of a share that of Clopper and Pearson, else of a bootstrap over models and
    /// members; none for a single run.
    pub interval: Option<[f64; 2]>,
}

/// A model: its factors and the values of its members.
struct Model<'a> {
    factors: &'a Factors,
    values: Vec<f64>,
}

/// Computes the means of the quantities of the requested correlations, and of the share of pairs
/// that kiss if results on the first contact are requested.
pub fn factor_means(analysis: &Analysis, records: &[RunRecord]) -> Vec<FactorMean> {
    let Some(request) = &analysis.correlations else {
        return Vec::new();
    };
    let share = analysis.kissing.as_ref().map(|_| KISSING_SHARE.to_owned());
    let mut out = Vec::new();
    for quantity in share.iter().chain(&request.quantities) {
        let interval = |values: &[Vec<f64>]| match quantity == KISSING_SHARE {
            true => share_interval(values),
            false => bootstrap_interval(values),
        };
        for level in request.levels(records) {
            let when = BTreeMap::from([(request.by.clone(), Condition::Is(level.clone()))]);
            let models = models(records, quantity, &when);
            for factor in &request.factors {
                out.extend(groups(&models, factor).into_iter().filter_map(|group| {
                    let (at, values): (Vec<f64>, Vec<Vec<f64>>) = group.into_iter().unzip();
                    let means: Vec<f64> =
                        values.iter().filter_map(|v| mean(v.iter().copied())).collect();
                    let several = values.iter().map(Vec::len).sum::<usize>() > 1;
                    Some(FactorMean {
                        quantity: quantity.clone(),
                        factor: factor.clone(),
                        level: level.clone(),
                        at: mean(at)?,
                        models: means.len(),
                        mean: mean(means)?,
                        interval: several.then(|| interval(&values)).flatten(),
                    })
                }));
            }
        }
    }
    out
}

/// Returns the models that have a value of the quantity.
fn models<'a>(
    records: &'a [RunRecord],
    quantity: &str,
    when: &BTreeMap<String, Condition>,
) -> Vec<Model<'a>> {
    let share = quantity == KISSING_SHARE;
    let value = |(_, value, censored): &Member| match (share, *censored) {
        (true, censored) => Some(if censored { 0.0 } else { 1.0 }),
        (false, true) => None,
        (false, false) => Some(*value),
    };
    let model = |members: Vec<Member<'a>>| Model {
        factors: &members[0].0.factors,
        values: members.iter().filter_map(value).collect(),
    };
    let all = members(records, if share { "kiss_time" } else { quantity }, when);
    all.into_iter().map(model).filter(|model| !model.values.is_empty()).collect()
}

/// Returns the factor and the values of the models, in groups of ascending factor: one for each
/// value of the factor if it has few, else four of about equal size.
fn groups(models: &[Model], factor: &str) -> Vec<Vec<(f64, Vec<f64>)>> {
    let known = models.iter().filter_map(|m| Some((*m.factors.get(factor)?, m.values.clone())));
    let mut known: Vec<(f64, Vec<f64>)> = known.collect();
    known.sort_by(|a, b| a.0.total_cmp(&b.0));
    let by_value: Vec<Vec<(f64, Vec<f64>)>> =
        known.chunk_by(|a, b| a.0 == b.0).map(<[_]>::to_vec).collect();
    if by_value.len() <= VALUES {
        return by_value;
    }
    let ends = (0..=GROUPS).map(|i| i * known.len() / GROUPS).collect::<Vec<usize>>();
    ends.windows(2).map(|ends| known[ends[0]..ends[1]].to_vec()).collect()
}

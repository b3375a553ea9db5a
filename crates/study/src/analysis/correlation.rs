//! Rank correlations of quantities with factors.

use std::collections::BTreeMap;

use serde::Serialize;

use super::observation::{observations, with_factor};
use super::statistics::spearman;
use crate::measure::record::RunRecord;
use crate::measure::unique;
use crate::plan::claims::{Analysis, Condition, Correlations};

/// Rank correlation of a quantity with a factor. The JSON names are stable.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Correlation {
    /// Quantity.
    pub quantity: String,
    /// Factor.
    pub factor: String,
    /// Level of the axis.
    pub level: String,
    /// Number of models.
    pub n: usize,
    /// Number of right-censored observations.
    #[serde(rename = "bounds")]
    pub censored: usize,
    /// Spearman's rank correlation.
    pub rho: Option<f64>,
    /// 95 % confidence interval.
    pub interval: Option<[f64; 2]>,
    /// Two-sided p value.
    pub p: Option<f64>,
}

impl Correlations {
    /// Returns the levels of the axis, in the order of the study file.
    pub fn levels(&self, records: &[RunRecord]) -> Vec<String> {
        let levels = records.iter().filter_map(|r| r.levels.get(&self.by));
        unique(levels)
    }
}

/// Computes the rank correlations that an analysis requests.
pub fn correlations(analysis: &Analysis, records: &[RunRecord]) -> Vec<Correlation> {
    let Some(request) = &analysis.correlations else {
        return Vec::new();
    };
    let levels = request.levels(records);
    let mut out = Vec::new();
    for quantity in &request.quantities {
        for factor in &request.factors {
            for level in &levels {
                let condition = Condition::Is(level.clone());
                let when = BTreeMap::from([(request.by.clone(), condition)]);
                let all = observations(records, quantity, &when);
                let (x, y, censored) = with_factor(&all, factor);
                let found = spearman(&x, &y);
                out.push(Correlation {
                    quantity: quantity.clone(),
                    factor: factor.clone(),
                    level: level.clone(),
                    n: x.len(),
                    censored,
                    rho: found.map(|e| e.value),
                    interval: found.map(|e| [e.low, e.high]),
                    p: found.map(|e| e.p),
                });
            }
        }
    }
    out
}

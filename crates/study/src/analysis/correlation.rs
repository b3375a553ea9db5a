//! Rank correlations of quantities with factors.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::analysis::statistics;
use crate::analysis::verdict::{Observation, observations};
use crate::measure::record::RunRecord;
use crate::plan::claims::{Analysis, Condition};

/// A rank correlation. The JSON names are stable.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Correlation {
    /// Quantity.
    pub quantity: String,
    /// Factor.
    pub factor: String,
    /// Value of the axis.
    pub level: String,
    /// Models.
    pub n: usize,
    /// Those that are lower bounds.
    pub bounds: usize,
    /// Spearman's rank correlation.
    pub rho: Option<f64>,
    /// 95 % interval.
    pub interval: Option<[f64; 2]>,
    /// Two-sided p value.
    pub p: Option<f64>,
}

/// The rank correlations of an analysis.
pub fn correlations(analysis: &Analysis, rows: &[RunRecord]) -> Vec<Correlation> {
    let Some(wanted) = &analysis.correlations else {
        return Vec::new();
    };
    let mut levels: Vec<&String> = rows
        .iter()
        .filter_map(|r| r.levels.get(&wanted.by))
        .collect();
    levels.sort();
    levels.dedup();
    let mut out = Vec::new();
    for quantity in &wanted.quantities {
        for factor in &wanted.factors {
            for level in &levels {
                let when = BTreeMap::from([(wanted.by.clone(), Condition::Is((*level).clone()))]);
                let all = observations(rows, quantity, &when);
                let known: Vec<(&Observation, f64)> = all
                    .iter()
                    .filter_map(|s| Some((s, *s.factors.get(factor)?)))
                    .collect();
                let (x, y): (Vec<f64>, Vec<f64>) =
                    known.iter().map(|(s, f)| (*f, s.latest())).unzip();
                let found = statistics::spearman(&x, &y);
                out.push(Correlation {
                    quantity: quantity.clone(),
                    factor: factor.clone(),
                    level: (*level).clone(),
                    n: known.len(),
                    bounds: known.iter().filter(|(s, _)| s.bound).count(),
                    rho: found.map(|e| e.value),
                    interval: found.map(|e| [e.low, e.high]),
                    p: found.map(|e| e.p),
                });
            }
        }
    }
    out
}

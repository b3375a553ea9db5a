//! Tables of the report page.

use grainwake_report::html::{name_column, number_column, properties, table, text_column};
use maud::{Markup, html};

use super::Content;
use super::settling;
use crate::analysis::correlation::Correlation;
use crate::analysis::verdict::Finding;
use crate::format::{p_value, quantity_value, significant, title};
use crate::measure::record::RunRecord;
use crate::run::state::StateKind;

/// Columns of the table of pairs: heading and quantity.
const PAIR_COLUMNS: [(&str, &str); 9] = [
    ("kiss time", "kiss_time"),
    ("kissing stage", "kissing_stage"),
    ("contact stage", "contact_stage"),
    ("tumble time", "tumble_time"),
    ("pass time", "pass_time"),
    ("kisses", "kisses"),
    ("role changes", "role_changes"),
    ("mean speed leading", "mean_speed_leading"),
    ("mean speed trailing", "mean_speed_trailing"),
];

/// Returns a text, or a dash for a missing one.
fn cell(text: Option<String>) -> Markup {
    html! { (text.as_deref().unwrap_or("–")) }
}

/// Returns the claims with their verdicts.
pub(super) fn claims(content: &Content) -> Markup {
    let findings = content.findings;
    let rule = content.plan.analysis.verdicts.as_ref();
    let row = |f: &Finding| {
        let verdict = html! { span class={ "verdict " (f.verdict) } { (f.verdict) } };
        vec![html! { (f.part) }, html! { (f.claim) }, verdict, html! { (f.says) }]
    };
    let columns = ["part", "claim", "verdict", "measured"].map(text_column);
    html! {
        p {
            "A claim holds, or is contradicted, if the 95 % confidence interval shows it; \
             otherwise it is open. "
            @match rule.and_then(|rule| rule.false_discovery_rate) {
                Some(rate) => {
                    "A direction must also have an adjusted p value (Benjamini and Hochberg) below "
                    (rate) ": of the directions found, about this share is due to chance."
                }
                None => {
                    "Claims are tested independently: of twenty false claims, one appears to hold \
                     by chance."
                }
            }
        }
        (table(&columns, findings.iter().map(row)))
    }
}

/// Returns the state and the measured values of all runs.
pub(super) fn runs(content: &Content) -> Markup {
    let known =
        |(_, name): &(&str, &str)| content.records.iter().any(|r| r.measured(name).is_some());
    let pairs = PAIR_COLUMNS.into_iter().filter(|_| content.has_pairs());
    let quantities = pairs.chain(settling::COLUMNS.into_iter().filter(known));
    let (headings, quantities): (Vec<&str>, Vec<&str>) = quantities.unzip();
    let mut columns = vec![name_column("run"), text_column("state")];
    // Seconds where minutes have no digit.
    let longest = content.records.iter().filter_map(|r| r.wall_s).fold(0.0, f64::max);
    let (wall, unit) =
        if longest < 60.0 { ("wall time [s]", 1.0) } else { ("wall time [min]", 60.0) };
    columns.extend(headings.into_iter().chain([wall]).map(number_column));
    let row = |record: &RunRecord| {
        let quantity = |name: &&str| {
            let value = record.measured(name).map(|v| quantity_value(name, v));
            html! { @if record.is_lower_bound(name) { "≥ " } (cell(value)) }
        };
        let mut row = vec![html! { (record.name) }, html! { (record.state) }];
        row.extend(quantities.iter().map(quantity));
        row.push(cell(record.wall_s.map(|s| significant(s / unit))));
        row
    };
    // The page names missing runs at its head.
    let shown = content.records.iter().filter(|record| record.state != StateKind::Missing);
    let shown: Vec<&RunRecord> = shown.collect();
    html! {
        @if content.has_pairs() {
            p {
                "Dimensionless values, until a grain first lands or leaves the box, or the run \
                 ends. ≥: lower bound, the pair was still in contact then. All quantities are in "
                code { "table.csv" } "."
            }
        }
        @if content.has_settling() { (settling::table_note()) }
        (table(&columns, shown.into_iter().map(row)))
    }
}

/// Returns the rank correlations.
pub(super) fn correlations(correlations: &[Correlation]) -> Markup {
    let mut columns = ["quantity", "factor", "level"].map(text_column).to_vec();
    columns.extend(["n", "rank correlation", "95 % interval", "p"].map(number_column));
    let row = |c: &Correlation| {
        let ends = |[a, b]: [f64; 2]| format!("{} to {}", significant(a), significant(b));
        vec![
            html! { (title(&c.quantity)) },
            html! { (c.factor) },
            html! { (c.level) },
            html! { (c.n) },
            cell(c.rho.map(significant)),
            cell(c.interval.map(ends)),
            cell(c.p.map(p_value)),
        ]
    };
    table(&columns, correlations.iter().map(row))
}

/// Returns a wall-clock time in hours, or in seconds below a minute.
fn duration(seconds: f64) -> String {
    match seconds < 60.0 {
        true => format!("{} s", significant(seconds)),
        false => format!("{:.2} h", seconds / 3600.0),
    }
}

/// Returns the study file, the program and the totals of all runs.
pub(super) fn provenance(content: &Content) -> Markup {
    let plan = content.plan;
    let sum = |pick: fn(&RunRecord) -> Option<f64>| -> Option<f64> {
        content.records.iter().filter_map(pick).reduce(|a, b| a + b)
    };
    // Finished runs of the n-th accepted program.
    let accepted = |n: usize| {
        let both = plan.runs.iter().zip(content.records).filter(|(_, record)| record.finished());
        both.filter(|(run, record)| run.accepted_ids.get(n) == Some(&record.id)).count()
    };
    let divergences = content.records.iter().filter_map(|r| r.max_divergence);
    let divergence = divergences.reduce(f64::max);
    let rows = [
        ("study file", html! { code { (plan.study.display()) } }),
        (
            "program",
            html! {
                "Grainwake " (plan.version)
                @if let Some(commit) = &plan.commit { ", commit " (commit) }
                @for (n, commit) in plan.accepted.iter().enumerate() {
                    "; " (accepted(n)) " finished runs by commit " (commit)
                }
            },
        ),
        ("time steps, all runs", cell(sum(|r| r.steps.map(|n| n as f64)).map(|n| n.to_string()))),
        ("wall-clock time, all runs", cell(sum(|r| r.wall_s).map(duration))),
        ("largest |div u|, all runs", cell(divergence.map(|d| format!("{d:.1e} 1/s")))),
    ];
    html! {
        (properties(&rows.map(|(name, value)| (html! { (name) }, value))))
        p {
            "Each run folder in " code { "runs/" } " contains its case with all defaults ("
            code { "case.resolved.toml" } "), which can be run as it is, and its "
            code { "provenance.json" } "."
        }
    }
}

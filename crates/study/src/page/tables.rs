//! Tables of the report page.

use std::fmt::Write;

use grainwake_plot::text::escape;

use super::html::Content;
use super::settling;
use crate::analysis::correlation::Correlation;
use crate::analysis::verdict::Finding;
use crate::format::{p_value, quantity_value, significant, title};
use crate::measure::record::RunRecord;

/// Columns of the table of pairs: heading and quantity.
const PAIR_COLUMNS: [(&str, &str); 9] = [
    ("kiss", "kiss_time"),
    ("kissing", "kissing_stage"),
    ("contact", "contact_stage"),
    ("45°", "tumble_time"),
    ("passed", "pass_time"),
    ("kisses", "kisses"),
    ("role changes", "role_changes"),
    ("v leading", "mean_speed_leading"),
    ("v trailing", "mean_speed_trailing"),
];

/// Opens a table: headings of text columns, then of numeric columns.
fn open(text: &[&str], numeric: &[&str]) -> String {
    let text = text.iter().map(|name| format!("<th>{name}</th>"));
    let numeric = numeric
        .iter()
        .map(|name| format!("<th class=\"number\">{name}</th>"));
    let head: String = text.chain(numeric).collect();
    format!("<div class=\"scroll\"><table><thead><tr>{head}</tr></thead><tbody>\n")
}

const CLOSE: &str = "</tbody></table></div>\n";

fn number(value: &str) -> String {
    format!("<td class=\"number\">{value}</td>")
}

/// Claims with their verdicts.
pub(super) fn claims(findings: &[Finding]) -> String {
    let mut out = String::from(
        "<p>A claim holds, or is contradicted, if the 95 % confidence interval shows it; otherwise \
         it is open. Claims are tested independently: of twenty false claims, one appears to hold \
         by chance.</p>\n",
    );
    out += &open(&["part", "claim", "verdict", "measured"], &[]);
    for f in findings {
        let (part, claim, says) = (escape(&f.part), escape(&f.claim), escape(&f.says));
        let v = f.verdict;
        let _ = writeln!(
            out,
            "<tr><td>{part}</td><td>{claim}</td><td class=\"verdict {v}\">{v}</td>\
             <td>{says}</td></tr>"
        );
    }
    out + CLOSE
}

/// State and measured values of all runs.
pub(super) fn runs(content: &Content) -> String {
    let known =
        |(_, name): &(&str, &str)| content.records.iter().any(|r| r.measured(name).is_some());
    let pairs = PAIR_COLUMNS.into_iter().filter(|_| content.has_pairs());
    let columns: Vec<(&str, &str)> = pairs
        .chain(settling::COLUMNS.into_iter().filter(known))
        .collect();
    let mut out = String::new();
    if content.has_pairs() {
        out += "<p>Dimensionless values. v: mean speed until the first landing. ≥: lower bound, \
                the pair landed in contact. All quantities are in <code>table.csv</code>.</p>\n";
    }
    if content.has_settling() {
        out += &settling::table_note();
    }
    let mut numeric: Vec<&str> = columns.iter().map(|(heading, _)| *heading).collect();
    numeric.push("wall [min]");
    out += &open(&["run", "state"], &numeric);
    for record in content.records {
        let cell = |name: &str| {
            let value = record
                .measured(name)
                .map_or("–".into(), |v| quantity_value(name, v));
            let bound = if record.is_lower_bound(name) {
                "≥ "
            } else {
                ""
            };
            number(&format!("{bound}{value}"))
        };
        let cells: String = columns.iter().map(|(_, name)| cell(name)).collect();
        let wall = record
            .wall_s
            .map_or("–".into(), |s| format!("{:.1}", s / 60.0));
        let (name, state, wall) = (escape(&record.name), &record.state, number(&wall));
        let _ = writeln!(
            out,
            "<tr><td class=\"name\">{name}</td><td>{state}</td>{cells}{wall}</tr>"
        );
    }
    out + CLOSE
}

/// Rank correlations.
pub(super) fn correlations(correlations: &[Correlation]) -> String {
    let numeric = ["n", "rank correlation", "95 % interval", "p"];
    let mut out = open(&["quantity", "factor", "level"], &numeric);
    for c in correlations {
        let rho = c.rho.map_or("–".into(), significant);
        let ends = |[a, b]: [f64; 2]| format!("{} to {}", significant(a), significant(b));
        let interval = c.interval.map_or("–".into(), ends);
        let cells = [
            c.n.to_string(),
            rho,
            interval,
            c.p.map_or("–".into(), p_value),
        ];
        let cells: String = cells.iter().map(|cell| number(&escape(cell))).collect();
        let (factor, level) = (escape(&c.factor), escape(&c.level));
        let quantity = escape(&title(&c.quantity));
        let _ = writeln!(
            out,
            "<tr><td>{quantity}</td><td>{factor}</td><td>{level}</td>{cells}</tr>"
        );
    }
    out + CLOSE
}

/// Study file, program and totals of all runs.
pub(super) fn provenance(content: &Content) -> String {
    let plan = content.plan;
    let sum = |pick: fn(&RunRecord) -> Option<f64>| -> f64 {
        content.records.iter().filter_map(pick).sum()
    };
    let divergences = content.records.iter().filter_map(|r| r.max_divergence);
    let commit = plan
        .commit
        .as_deref()
        .map_or(String::new(), |c| format!(", commit {c}"));
    let steps: u64 = content.records.iter().filter_map(|r| r.steps).sum();
    let rows = [
        (
            "study file",
            format!("<code>{}</code>", escape(&plan.study.display().to_string())),
        ),
        (
            "program",
            format!("Grainwake {}{}", escape(&plan.version), escape(&commit)),
        ),
        ("time steps, all runs", steps.to_string()),
        (
            "wall-clock time, all runs",
            format!("{:.2} h", sum(|r| r.wall_s) / 3600.0),
        ),
        (
            "largest |div u|, all runs",
            format!("{:.1e} 1/s", divergences.fold(0.0, f64::max)),
        ),
    ];
    let rows = rows.map(|(name, value)| format!("<tr><th>{name}</th><td>{value}</td></tr>\n"));
    format!(
        "<table><tbody>\n{}</tbody></table>\n<p>Each run folder in <code>runs/</code> contains its \
         case with all defaults (<code>case.resolved.toml</code>), which can be run as it is, and \
         its <code>provenance.json</code>.</p>\n",
        rows.concat()
    )
}

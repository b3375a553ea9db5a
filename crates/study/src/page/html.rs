//! The page of a study: one HTML file without scripts or outside resources.

use std::collections::BTreeMap;
use std::fmt::Write;

use grainwake_report::STYLE;
use grainwake_report::figure::text::{escape, html};

use crate::analysis::correlation::Correlation;
use crate::analysis::statistics::median;
use crate::analysis::verdict::{Finding, Observation, observations};
use crate::format::{number, p_value, plain, significant};
use crate::measure::pair::PairMeasures;
use crate::measure::record::RunRecord;
use crate::page::figure::StudyFigure;
use crate::plan::Manifest;

/// What is on the page.
pub(crate) struct Content<'a> {
    pub manifest: &'a Manifest,
    pub rows: &'a [RunRecord],
    pub findings: &'a [Finding],
    pub correlations: &'a [Correlation],
    /// Figures with their SVG documents.
    pub figures: &'a [(StudyFigure, String)],
    pub notes: &'a [String],
}

/// A pair that comes this near without touching has missed narrowly [d]: a cell of the paper's mesh.
const NARROWLY: f64 = 0.125;

/// Columns of the table: heading and quantity.
const COLUMNS: [(&str, &str); 9] = [
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

impl Content<'_> {
    /// The whole page.
    pub fn html(&self) -> String {
        let title = escape(&self.manifest.title);
        let mut out = format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>{title}</title>\n<style>\n{STYLE}.holds {{ color: #00785a; }} .contradicted {{ color: #b34700; }} .open {{ color: var(--soft); }} td.verdict {{ font-weight: 600; white-space: nowrap; }}\n</style>\n</head>\n<body>\n<main>\n<header>\n<h1>{title}</h1>\n<p class=\"lead\">{}</p>\n</header>\n",
            self.lead()
        );
        out += &self.notices();
        let settle = self.rows.iter().any(|r| r.settling.is_some());
        if settle {
            let answers = super::settling::answers(self);
            section(
                &mut out,
                "Which create_folder fastest, and how sure",
                &answers,
            );
        }
        if self.has_pairs() {
            section(
                &mut out,
                "Which kiss first, which part first, and how sure",
                &self.answers(),
            );
        }
        if !self.findings.is_empty() {
            section(&mut out, "The claims and what the runs say", &self.claims());
        }
        if !self.figures.is_empty() {
            let blocks: String = self
                .figures
                .iter()
                .map(|(figure, svg)| block(figure, svg))
                .collect();
            section(
                &mut out,
                "Figures",
                &format!("<div class=\"figures\">\n{blocks}</div>\n"),
            );
        }
        section(&mut out, "All runs", &self.table());
        if !self.correlations.is_empty() {
            section(&mut out, "Rank correlations", &self.correlation_table());
        }
        section(&mut out, "Where it comes from", &self.provenance());
        out += "<footer>Made by Grainwake from the run folders of this study; the figures are in <code>figures/</code>, the numbers in <code>table.csv</code>, <code>table.json</code> and <code>analysis.json</code>.</footer>\n</main>\n</body>\n</html>\n";
        out
    }

    /// Whether any finished run is a pair; taken to be so while none is finished.
    fn has_pairs(&self) -> bool {
        let settle = self.rows.iter().any(|r| r.settling.is_some());
        !settle || self.rows.iter().any(|r| r.pair.is_some())
    }

    fn lead(&self) -> String {
        let (done, all) = (self.done(), self.rows.len());
        let mut text = format!("{done} of {all} runs are finished");
        let of = |what: fn(&PairMeasures) -> bool| {
            let pairs = self.rows.iter().filter_map(|r| r.pair.as_ref());
            pairs.filter(|p| what(p)).count()
        };
        let kissed = of(|p| p.kiss_time.is_some());
        let parted = of(|p| p.parted == Some(true));
        let again = of(|p| p.repeated == Some(true));
        let missed =
            of(|p| p.kiss_time.is_none() && p.closest_gap.is_some_and(|gap| gap < NARROWLY));
        text += &super::settling::lead(self.rows).unwrap_or_default();
        if done > 0 && self.has_pairs() {
            let _ = write!(
                text,
                "; {kissed} pairs kissed before they landed, {parted} of them parted, {again} kissed more than once; \
                 {missed} passed within {NARROWLY} d of each other without touching"
            );
        }
        let count = |verdict: &str| {
            self.findings
                .iter()
                .filter(|f| f.verdict == verdict)
                .count()
        };
        if !self.findings.is_empty() {
            let _ = write!(
                text,
                ". Of {} claims {} hold, {} are contradicted and {} stay open",
                self.findings.len(),
                count("holds"),
                count("contradicted"),
                count("open")
            );
        }
        text + ". Times are in √(d/g), lengths in the equal-volume diameter d, speeds in √(d g)."
    }

    fn notices(&self) -> String {
        let mut items: Vec<String> = Vec::new();
        for word in ["missing", "unfinished", "failed", "stale"] {
            let names: Vec<String> = self
                .rows
                .iter()
                .filter(|r| r.state == word)
                .map(|r| escape(&r.name))
                .collect();
            if !names.is_empty() {
                items.push(format!("{word}: {}", names.join(", ")));
            }
        }
        items.extend(
            self.rows
                .iter()
                .filter(|r| r.state == "failed")
                .filter_map(|r| {
                    Some(format!(
                        "{}: {}",
                        escape(&r.name),
                        escape(r.remark.as_ref()?)
                    ))
                }),
        );
        items.extend(self.notes.iter().map(|note| escape(note)));
        if items.is_empty() {
            return String::new();
        }
        let items: String = items
            .iter()
            .map(|item| format!("<li>{item}</li>"))
            .collect();
        format!(
            "<div class=\"notice\" role=\"note\"><b>Missing or left out</b><ul>{items}</ul></div>\n"
        )
    }

    /// First and last kisses and partings, and what is known about their certainty.
    fn answers(&self) -> String {
        let all = BTreeMap::new();
        let kiss = observations(self.rows, "kiss_time", &all);
        let part = observations(self.rows, "contact_stage", &all);
        let mut out = String::new();
        for (what, list) in [
            ("first contact", &kiss),
            ("time in contact until the pair parts", &part),
        ] {
            let mut sorted: Vec<&Observation> = list.iter().filter(|s| !s.bound).collect();
            sorted.sort_by(|a, b| a.value.total_cmp(&b.value));
            if sorted.is_empty() {
                let _ = writeln!(out, "<p>No finished run gives a {what}.</p>");
                continue;
            }
            let name =
                |s: &&Observation| format!("{} ({})", escape(&s.model), significant(s.value));
            let few: Vec<String> = sorted.iter().take(5).map(name).collect();
            let last: Vec<String> = sorted.iter().rev().take(3).map(name).collect();
            let bounds = list.len() - sorted.len();
            let more = if bounds > 0 {
                format!(" {bounds} landed before.")
            } else {
                String::new()
            };
            let _ = writeln!(
                out,
                "<p><b>Shortest {what}</b>: {}. <b>Longest</b>: {}.{more}</p>",
                few.join(", "),
                last.join(", ")
            );
        }
        out + &self.certainty(&kiss, &part)
    }

    fn certainty(&self, kiss: &[Observation], part: &[Observation]) -> String {
        if self.rows.iter().all(|r| r.member == 0) {
            return "<p><b>How sure</b>: every model was run once. Up to the first contact the motion follows from the start; after it the motion is sensitive to the smallest disturbance, and an <code>[ensemble]</code> of repetitions tells how much. Claims and correlations go by ranks over all models, so that no single run decides.</p>\n".into();
        }
        let spread = |list: &[Observation]| {
            let several: Vec<f64> = list
                .iter()
                .filter(|s| s.range.1 > s.range.0)
                .map(|s| (s.range.1 - s.range.0) / s.value)
                .collect();
            median(&several).map_or("not known".into(), |m| format!("{:.1} %", 100.0 * m))
        };
        format!(
            "<p><b>How sure</b>: models were repeated with small random offsets of the start. The range of the repetitions, relative to their median, is {} for the first contact and {} for the time in contact (medians over the models). Differences of single models below that say nothing.</p>\n",
            spread(kiss),
            spread(part)
        )
    }

    fn claims(&self) -> String {
        let mut out = String::from(
            "<p>A claim holds, or is contradicted, if the 95 % interval says so; else it stays open. Each claim is tested by itself: of twenty claims that are not true, one would seem to hold by chance.</p>\n<div class=\"scroll\"><table><thead><tr><th>part</th><th>claim</th><th>verdict</th><th>measured</th></tr></thead><tbody>\n",
        );
        for f in self.findings {
            let _ = writeln!(
                out,
                "<tr><td>{}</td><td>{}</td><td class=\"verdict {v}\">{v}</td><td>{}</td></tr>",
                escape(&f.part),
                escape(&f.claim),
                escape(&f.says),
                v = f.verdict
            );
        }
        out + "</tbody></table></div>\n"
    }

    /// Columns of the table that any run has.
    fn columns(&self) -> Vec<(&'static str, &'static str)> {
        let known = |(_, name): &(&str, &str)| self.rows.iter().any(|r| r.measured(name).is_some());
        let mut out = Vec::new();
        if self.has_pairs() {
            out.extend(COLUMNS);
        }
        out.extend(super::settling::COLUMNS.into_iter().filter(known));
        out
    }

    fn table(&self) -> String {
        let columns = self.columns();
        let head: String = columns
            .iter()
            .map(|(name, _)| format!("<th class=\"number\">{name}</th>"))
            .collect();
        let mut out = String::new();
        if self.has_pairs() {
            out += "<p>Dimensionless; v is the mean speed until the first landing, ≥ a lower bound. All quantities are in <code>table.csv</code>.</p>\n";
        }
        if self.rows.iter().any(|r| r.settling.is_some()) {
            out += &super::settling::note();
        }
        let _ = writeln!(
            out,
            "<div class=\"scroll\"><table><thead><tr><th>run</th><th>state</th>{head}<th class=\"number\">wall [min]</th></tr></thead><tbody>"
        );
        for row in self.rows {
            let cell = |name: &str| {
                let value = row.measured(name).map_or("–".into(), |v| number(name, v));
                let bound = name == "contact_stage"
                    && row.pair.as_ref().is_some_and(|p| p.parted == Some(false));
                format!(
                    "<td class=\"number\">{}{value}</td>",
                    if bound { "≥ " } else { "" }
                )
            };
            let cells: String = columns.iter().map(|(_, name)| cell(name)).collect();
            let wall = row
                .wall_s
                .map_or("–".into(), |s| format!("{:.1}", s / 60.0));
            let _ = writeln!(
                out,
                "<tr><td class=\"name\">{}</td><td>{}</td>{cells}<td class=\"number\">{wall}</td></tr>",
                escape(&row.name),
                row.state
            );
        }
        out + "</tbody></table></div>\n"
    }

    fn correlation_table(&self) -> String {
        let mut out = String::from(
            "<div class=\"scroll\"><table><thead><tr><th>quantity</th><th>factor</th><th></th><th class=\"number\">n</th><th class=\"number\">rank correlation</th><th class=\"number\">95 % interval</th><th class=\"number\">p</th></tr></thead><tbody>\n",
        );
        for c in self.correlations {
            let value = |v: Option<f64>| v.map_or("–".into(), significant);
            let interval = c.interval.map_or("–".into(), |[a, b]| {
                format!("{} to {}", significant(a), significant(b))
            });
            let _ = writeln!(
                out,
                "<tr><td>{}</td><td>{}</td><td>{}</td><td class=\"number\">{}</td><td class=\"number\">{}</td><td class=\"number\">{interval}</td><td class=\"number\">{}</td></tr>",
                escape(&plain(&c.quantity)),
                escape(&c.factor),
                escape(&c.level),
                c.n,
                value(c.rho),
                c.p.map_or("–".into(), p_value)
            );
        }
        out + "</tbody></table></div>\n"
    }

    fn provenance(&self) -> String {
        let m = self.manifest;
        let wall: f64 = self.rows.iter().filter_map(|r| r.wall_s).sum();
        let steps: u64 = self.rows.iter().filter_map(|r| r.steps).sum();
        let divergence = self
            .rows
            .iter()
            .filter_map(|r| r.max_divergence)
            .fold(0.0, f64::max);
        let commit = m
            .commit
            .as_deref()
            .map_or(String::new(), |c| format!(", commit {}", escape(c)));
        format!(
            "<table><tbody>\n<tr><th>study file</th><td><code>{}</code></td></tr>\n<tr><th>program</th><td>Grainwake {}{commit}</td></tr>\n<tr><th>steps of all runs</th><td>{steps}</td></tr>\n<tr><th>wall-clock time of all runs</th><td>{:.2} h</td></tr>\n<tr><th>largest |div u| of all runs</th><td>{divergence:.1e} 1/s</td></tr>\n</tbody></table>\n<p>Each run folder in <code>runs/</code> has its case with all defaults (<code>case.resolved.toml</code>), which runs as it is, and its own <code>provenance.json</code>.</p>\n",
            escape(&m.study.display().to_string()),
            escape(&m.version),
            wall / 3600.0
        )
    }
}

fn section(out: &mut String, title: &str, body: &str) {
    let _ = writeln!(out, "<section>\n<h2>{title}</h2>\n{body}</section>");
}

fn block(figure: &StudyFigure, svg: &str) -> String {
    let class = if figure.drawing.width() <= 280.0 {
        " class=\"column\""
    } else {
        ""
    };
    let number = if figure.number.is_empty() {
        String::new()
    } else {
        format!("Figure {}. ", figure.number)
    };
    format!(
        "<figure{class} id=\"{name}\">\n<div class=\"paper\">{svg}</div>\n<figcaption><b>{number}{}.</b> {} <span>(<a href=\"figures/{name}.png\">PNG</a>, <a href=\"figures/{name}.svg\">SVG</a>)</span></figcaption>\n</figure>\n",
        html(&figure.title),
        html(&figure.caption),
        name = figure.name,
    )
}

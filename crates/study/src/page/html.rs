//! The report page: one HTML file without scripts and external resources.

use std::collections::BTreeMap;
use std::fmt::Write;

use grainwake_plot::text::{escape, html};
use grainwake_report::STYLE;

use super::figure::StudyFigure;
use super::{settling, tables};
use crate::analysis::correlation::Correlation;
use crate::analysis::observation::{Observation, observations};
use crate::analysis::statistics::median;
use crate::analysis::verdict::Finding;
use crate::format::{percent, significant};
use crate::measure::pair::PairMeasures;
use crate::measure::record::RunRecord;
use crate::plan::Plan;

/// Contents of the page.
pub(crate) struct Content<'a> {
    pub plan: &'a Plan,
    pub records: &'a [RunRecord],
    pub findings: &'a [Finding],
    pub correlations: &'a [Correlation],
    /// Figures with their SVG text.
    pub figures: &'a [(StudyFigure, String)],
    pub notes: &'a [String],
}

/// Gap that counts as a near miss of a pair without contact [d]: one cell of the paper's mesh.
const NEAR_MISS: f64 = 0.125;

const VERDICT_STYLE: &str = ".holds { color: #00785a; } .contradicted { color: #b34700; } \
     .open { color: var(--soft); } td.verdict { font-weight: 600; white-space: nowrap; }";

impl Content<'_> {
    /// Returns the page.
    pub fn html(&self) -> String {
        let title = escape(&self.plan.title);
        let mut out = format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <title>{title}</title>\n<style>\n{STYLE}{VERDICT_STYLE}\n</style>\n</head>\n<body>\n\
             <main>\n<header>\n<h1>{title}</h1>\n<p class=\"lead\">{}</p>\n</header>\n",
            self.lead()
        );
        out += &self.resolution();
        out += &self.notices();
        let mut section = |title: &str, shown: bool, body: &dyn Fn() -> String| {
            if shown {
                let _ = writeln!(out, "<section>\n<h2>{title}</h2>\n{}</section>", body());
            }
        };
        section(
            "Settling speeds and their uncertainty",
            self.has_settling(),
            &|| settling::summary(self),
        );
        section(
            "Contact and separation times and their uncertainty",
            self.has_pairs(),
            &|| self.contact_times(),
        );
        section("Claims and verdicts", !self.findings.is_empty(), &|| {
            tables::claims(self.findings)
        });
        section("Figures", !self.figures.is_empty(), &|| {
            let blocks = self.figures.iter().map(|(figure, svg)| block(figure, svg));
            format!(
                "<div class=\"figures\">\n{}</div>\n",
                blocks.collect::<String>()
            )
        });
        section("All runs", true, &|| tables::runs(self));
        section("Rank correlations", !self.correlations.is_empty(), &|| {
            tables::correlations(self.correlations)
        });
        section("Provenance", true, &|| tables::provenance(self));
        out += "<footer>Produced by Grainwake from the run folders of this study. Figures: \
                <code>figures/</code>; values: <code>table.csv</code>, <code>table.json</code> and \
                <code>analysis.json</code>.</footer>\n</main>\n</body>\n</html>\n";
        out
    }

    /// Returns the warning that quantities are not converged with the grid, with the evidence.
    fn resolution(&self) -> String {
        let resolution = self.plan.analysis.resolution.as_ref();
        resolution.map_or(String::new(), |resolution| {
            format!(
                "<div class=\"notice\" role=\"note\"><b>Not converged with the grid</b>\
                 <p>{}</p></div>\n",
                escape(&resolution.note)
            )
        })
    }

    /// Returns whether any run has measured values of settling grains.
    pub fn has_settling(&self) -> bool {
        self.records.iter().any(|r| r.settling.is_some())
    }

    /// Returns whether any finished run is a pair, or no run has finished.
    pub fn has_pairs(&self) -> bool {
        !self.has_settling() || self.records.iter().any(|r| r.pair.is_some())
    }

    /// Returns whether every model was run only once.
    pub fn without_ensemble(&self) -> bool {
        self.records.iter().all(|r| r.member == 0)
    }

    fn lead(&self) -> String {
        let finished = self
            .records
            .iter()
            .filter(|record| record.finished())
            .count();
        let mut text = format!("{finished} of {} runs are finished", self.records.len());
        text += &settling::lead(self.records).unwrap_or_default();
        if finished > 0 && self.has_pairs() {
            let count = |property: fn(&PairMeasures) -> bool| {
                let pairs = self.records.iter().filter_map(|r| r.pair.as_ref());
                pairs.filter(|p| property(p)).count()
            };
            let near_miss = count(|p| {
                p.kiss_time.is_none() && p.closest_gap.is_some_and(|gap| gap < NEAR_MISS)
            });
            let _ = write!(
                text,
                "; {} pairs kissed before landing, {} of them separated, {} kissed more than \
                 once; {near_miss} passed within {NEAR_MISS} d of each other without contact",
                count(|p| p.kiss_time.is_some()),
                count(|p| p.parted == Some(true)),
                count(|p| p.repeated == Some(true)),
            );
        }
        if !self.findings.is_empty() {
            let count = |v: &str| self.findings.iter().filter(|f| f.verdict == v).count();
            let _ = write!(
                text,
                ". Of {} claims, {} hold, {} are contradicted and {} are open",
                self.findings.len(),
                count("holds"),
                count("contradicted"),
                count("open")
            );
        }
        text + ". Times are in √(d/g), lengths in the equal-volume diameter d, speeds in √(d g)."
    }

    /// Lists runs without results and omitted parts.
    fn notices(&self) -> String {
        let mut items: Vec<String> = Vec::new();
        for state in ["missing", "unfinished", "failed", "stale"] {
            let runs = self.records.iter().filter(|r| r.state == state);
            let names: Vec<String> = runs.map(|r| escape(&r.name)).collect();
            if !names.is_empty() {
                items.push(format!("{state}: {}", names.join(", ")));
            }
        }
        let failed = self.records.iter().filter(|r| r.state == "failed");
        let reason = |r: &RunRecord| {
            Some(format!(
                "{}: {}",
                escape(&r.name),
                escape(r.remark.as_ref()?)
            ))
        };
        items.extend(failed.filter_map(reason));
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

    /// Shortest and longest contact times, and their uncertainty.
    fn contact_times(&self) -> String {
        let all = BTreeMap::new();
        let kiss = observations(self.records, "kiss_time", &all);
        let contact = observations(self.records, "contact_stage", &all);
        let mut out = String::new();
        for (what, list) in [
            ("first contact", &kiss),
            ("time in contact until separation", &contact),
        ] {
            let mut sorted: Vec<&Observation> = list.iter().filter(|o| !o.censored).collect();
            sorted.sort_by(|a, b| a.value.total_cmp(&b.value));
            let name =
                |o: &&Observation| format!("{} ({})", escape(&o.model), significant(o.value));
            let first: Vec<String> = sorted.iter().take(5).map(name).collect();
            let last: Vec<String> = sorted.iter().rev().take(3).map(name).collect();
            let (first, last) = (first.join(", "), last.join(", "));
            let _ = match (sorted.len(), list.len() - sorted.len()) {
                (0, _) => writeln!(out, "<p>No finished run has a {what}.</p>"),
                (_, censored) => writeln!(
                    out,
                    "<p><b>Shortest {what}</b>: {first}. <b>Longest</b>: {last}.{}</p>",
                    match censored {
                        0 => String::new(),
                        n => format!(" {n} pairs landed before (right-censored)."),
                    }
                ),
            };
        }
        out + &self.uncertainty(&kiss, &contact)
    }

    fn uncertainty(&self, kiss: &[Observation], contact: &[Observation]) -> String {
        if self.without_ensemble() {
            return "<p><b>Uncertainty</b>: every model was run once. The motion before the first \
                    contact is reproducible; after it, small disturbances grow. An \
                    <code>[ensemble]</code> of repetitions measures their effect. Claims and \
                    correlations are tested by ranks over all models, so no single run decides \
                    them.</p>\n"
                .into();
        }
        let spread = |list: &[Observation]| {
            let varied = list.iter().filter(|o| o.range.1 > o.range.0);
            let relative: Vec<f64> = varied.map(|o| (o.range.1 - o.range.0) / o.value).collect();
            median(&relative).map_or("unknown".into(), percent)
        };
        format!(
            "<p><b>Uncertainty</b>: models were repeated with small random offsets of the initial \
             position. The range of the repetitions relative to their median is {} for the first \
             contact and {} for the time in contact (medians over the models). Smaller differences \
             between single models are not significant.</p>\n",
            spread(kiss),
            spread(contact)
        )
    }
}

/// Figure with its number, title, caption and links.
fn block(figure: &StudyFigure, svg: &str) -> String {
    let class = match figure.drawing.width() <= 280.0 {
        true => " class=\"column\"",
        false => "",
    };
    let number = match figure.number.as_str() {
        "" => String::new(),
        number => format!("Figure {number}. "),
    };
    format!(
        "<figure{class} id=\"{name}\">\n<div class=\"paper\">{svg}</div>\n\
         <figcaption><b>{number}{}.</b> {} <span>(<a href=\"figures/{name}.png\">PNG</a>, \
         <a href=\"figures/{name}.svg\">SVG</a>)</span></figcaption>\n</figure>\n",
        html(&figure.title),
        html(&figure.caption),
        name = figure.name,
    )
}

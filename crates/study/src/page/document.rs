//! The report page: one HTML file without scripts and external resources.

use grainwake_report::html::{self, section};
use maud::{Markup, html};

use super::Content;
use super::{kissing, pairs, settling, tables};
use crate::analysis::verdict::Verdict;
use crate::measure::record::{RunRecord, note_on_unmeasured};
use crate::run::state::StateKind;

/// Number of runs that are named where very many are in the same state.
const LISTED: usize = 10;

impl Content<'_> {
    /// Returns the page.
    pub fn html(&self) -> String {
        let content = html! {
            (self.resolution())
            (html::omissions(&self.omissions()))
            @if self.has_settling() {
                (section("Settling speeds and their uncertainty", &settling::summary(self)))
            }
            @if self.has_pairs() {
                @let title = "Contact and separation times and their uncertainty";
                (section(title, &pairs::summary(self)))
            }
            @if let Some(results) = self.kissing {
                (section("Who kisses", &kissing::tables(results)))
            }
            @if !self.findings.is_empty() {
                (section("Claims and verdicts", &tables::claims(self)))
            }
            @if !self.figures.is_empty() { (section("Figures", &html::figures(self.figures))) }
            (section("All runs", &tables::runs(self)))
            @if !self.correlations.is_empty() {
                (section("Rank correlations", &tables::correlations(self.correlations)))
            }
            (section("Provenance", &tables::provenance(self)))
        };
        let footer = html! {
            "Produced by Grainwake from the run folders of this study. Figures: "
            code { "figures/" } "; values: " code { "table.csv" } ", " code { "table.json" } " and "
            code { "analysis.json" } "."
        };
        html::page(&self.plan.title, &self.lead(), &content, &footer)
    }

    /// Returns the warning that quantities are not converged with the grid, with the evidence.
    fn resolution(&self) -> Markup {
        html! {
            @if let Some(resolution) = &self.plan.analysis.resolution {
                (html::notice(&html! {
                    b { "Not converged with the grid" }
                    p { (resolution.note) }
                }))
            }
        }
    }

    fn lead(&self) -> Markup {
        let finished = self.records.iter().filter(|record| record.finished());
        let finished = finished.count();
        let verdicts = |v: Verdict| self.findings.iter().filter(|f| f.verdict == v).count();
        html! {
            (finished) " of " (self.records.len())
            (if self.records.len() == 1 { " run is finished" } else { " runs are finished" })
            (settling::lead(self.records))
            @if finished > 0 && self.has_pairs() { (pairs::lead(self.records)) }
            @if !self.findings.is_empty() {
                ". Claims that hold: " (verdicts(Verdict::Holds))
                ", contradicted: " (verdicts(Verdict::Contradicted))
                ", open: " (verdicts(Verdict::Open))
            }
            "."
            @if self.has_settling() || self.has_pairs() {
                " Times are in √(d/g), lengths in the equivalent diameter d, speeds in √(d g)."
            }
        }
    }

    /// Lists runs without results and omitted parts.
    fn omissions(&self) -> Vec<String> {
        let mut out = Vec::new();
        use StateKind::{Damaged, Failed, Missing, Stale, Unfinished};
        for state in [Missing, Unfinished, Failed, Stale, Damaged] {
            let runs = self.records.iter().filter(|r| r.state == state);
            let names: Vec<&str> = runs.map(|r| r.name.as_str()).collect();
            if let Some(first) = names.get(..LISTED).filter(|_| names.len() > 2 * LISTED) {
                let all = names.len();
                out.push(format!("{state}: {all} runs, the first are {}", first.join(", ")));
            } else if !names.is_empty() {
                out.push(format!("{state}: {}", names.join(", ")));
            }
        }
        // Files of a finished run may be damaged.
        let ended = |r: &&RunRecord| matches!(r.state, Failed | Damaged) || r.finished();
        let ended = self.records.iter().filter(ended);
        let reason = |r: &RunRecord| Some(format!("{}: {}", r.name, r.remark.as_ref()?));
        out.extend(ended.filter_map(reason));
        out.extend(note_on_unmeasured(self.records));
        out.extend(self.notes.iter().cloned());
        out
    }
}

//! Parts of the report page about pairs.

use std::collections::BTreeMap;

use maud::{Markup, html};

use super::{Content, paragraph};
use crate::analysis::observation::{Observation, observations};
use crate::analysis::statistics::median;
use crate::format::{missed, percent, significant};
use crate::measure::pair::PairMeasures;
use crate::measure::record::RunRecord;

/// Gap that counts as a near miss of a pair without contact [d]: one cell of the paper's mesh.
const NEAR_MISS: f64 = 0.125;
/// Growth of the distance of the centres above which grains have moved apart [d].
const PARTED: f64 = 0.01;

/// Returns the numbers of contacts and separations as half a sentence.
pub(super) fn lead(records: &[RunRecord]) -> Markup {
    let count = |property: fn(&PairMeasures) -> bool| {
        let pairs = records.iter().filter_map(|r| r.pair.as_ref());
        pairs.filter(|p| property(p)).count()
    };
    let near_miss = count(|p| {
        let close = p.closest_gap.is_some_and(|gap| gap < NEAR_MISS);
        p.kiss_time.is_none() && close && moved_apart(p)
    });
    html! {
        "; runs in which the pair kissed before the first landing or the end: "
        (count(|p| p.kiss_time.is_some()))
        ", and separated: " (count(|p| p.parted == Some(true)))
        ", and kissed more than once: " (count(|p| p.repeated == Some(true)))
        "; runs in which the grains came within " (NEAR_MISS)
        " d of each other without contact, and moved apart again: " (near_miss)
    }
}

/// Returns whether the centres were closer than at the end of the observation: the grains do not
/// approach any more.
fn moved_apart(pair: &PairMeasures) -> bool {
    let ends = pair.closest.zip(pair.final_distance);
    ends.is_some_and(|(closest, last)| last > closest + PARTED)
}

/// Returns the shortest and longest contact times, and their uncertainty.
pub(super) fn summary(content: &Content) -> Markup {
    let all = BTreeMap::new();
    let kiss = observations(content.records, "kiss_time", &all);
    let contact = observations(content.records, "contact_stage", &all);
    html! {
        (extremes("first contact", &kiss, content.plan.has_members()))
        (extremes("time in contact until separation", &contact, content.plan.has_members()))
        (paragraph("Uncertainty", &uncertainty(content, &kiss, &contact)))
    }
}

/// Returns the five shortest and the three longest times, censored ones left out; `several` if
/// models have several runs.
fn extremes(what: &str, all: &[Observation], several: bool) -> Markup {
    let mut sorted: Vec<&Observation> = all.iter().filter(|o| !o.censored).collect();
    sorted.sort_by(|a, b| a.value.total_cmp(&b.value));
    let censored = all.len() - sorted.len();
    let name = |o: &&Observation| format!("{} ({})", o.model, significant(o.value));
    let first: Vec<String> = sorted.iter().take(5).map(name).collect();
    let last: Vec<String> = sorted.iter().rev().take(3).map(name).collect();
    html! {
        p {
            @if sorted.is_empty() {
                "No model has a " (what) ", in more than half of its runs, before a grain lands or \
                 leaves the box, or the run ends."
            } @else {
                b { "Shortest " (what) ", by model" } ": " (first.join(", ")) ". "
                b { "Longest" } ": " (last.join(", ")) "."
                @if censored > 0 { " " (missed(censored, several)) " no such time." }
            }
        }
    }
}

fn uncertainty(content: &Content, kiss: &[Observation], contact: &[Observation]) -> Markup {
    let spread = |list: &[Observation]| {
        let has_all = |o: &&Observation| {
            o.durations.len() > 1 && o.durations.iter().all(|duration| !duration.censored)
        };
        let of_all = list.iter().filter(has_all);
        let relative: Vec<f64> = of_all.map(|o| (o.range.1 - o.range.0) / o.value).collect();
        let Some(range) = median(&relative).map(percent) else {
            return "unknown".to_owned();
        };
        let models = if relative.len() == 1 { "model" } else { "models" };
        format!("{range} of the time (median of {} {models})", relative.len())
    };
    html! {
        @if content.without_ensemble() {
            "every model was run once. The motion before the first contact is reproducible; after \
             it, small disturbances grow. An " code { "[ensemble]" } " of repetitions measures \
             their effect. Claims and correlations are tested by ranks over all models, so no \
             single run decides them."
        } @else {
            "models were repeated with small changes of their start. The range over the \
             repetitions is " (spread(kiss)) " for the first contact and " (spread(contact)) " for \
             the time in contact. It counts models in which the event occurs in every repetition. \
             Smaller differences between single models are not significant."
        }
    }
}

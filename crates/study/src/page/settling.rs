//! Parts of the report page about runs other than pairs.

use grainwake_run::number_format::number_of_grains;
use maud::{Markup, html};

use super::{Content, paragraph};
use crate::format::significant;
use crate::measure::record::RunRecord;
use crate::measure::settling::SettlingMeasures;
use crate::measure::table::SETTLING_TABLE;

/// Columns of the table: heading and quantity.
pub(super) const COLUMNS: [(&str, &str); 12] = [
    ("grains", "grains"),
    ("landed", "landed"),
    ("peak speed [m/s]", "peak_speed_m_per_s"),
    ("final speed [m/s]", "final_speed_m_per_s"),
    ("final speed / √(d g)", "final_speed"),
    ("speed change", "speed_change"),
    ("peak Reynolds", "peak_reynolds"),
    ("final Reynolds", "final_reynolds"),
    ("landing time [s]", "landing_time_s"),
    ("drift / d", "drift"),
    ("long axis [°]", "long_axis"),
    ("turned [°]", "turned"),
];

/// Largest relative change of the speed in the final window of a terminal speed.
const STEADY: f64 = 0.02;

fn settling_runs(records: &[RunRecord]) -> Vec<(&RunRecord, &SettlingMeasures)> {
    let known = records.iter().filter_map(|r| Some((r, r.settling.as_ref()?)));
    known.collect()
}

/// Returns the landings, speeds and Reynolds numbers as half a sentence; empty without such runs.
pub(super) fn lead(records: &[RunRecord]) -> String {
    let all = settling_runs(records);
    if all.is_empty() {
        return String::new();
    }
    let sum =
        |pick: fn(&SettlingMeasures) -> usize| all.iter().map(|(_, s)| pick(s)).sum::<usize>();
    let (landed, grains) = (sum(|s| s.landed), sum(|s| s.grains));
    let range = |pick: fn(&SettlingMeasures) -> Option<f64>| {
        let values = || all.iter().filter_map(|(_, s)| pick(s));
        let (low, high) = (values().reduce(f64::min)?, values().reduce(f64::max)?);
        Some(match low == high {
            true => significant(low),
            false => format!("{} to {}", significant(low), significant(high)),
        })
    };
    let speeds = range(|s| s.final_speed_m_per_s);
    let speeds = speeds.map(|range| format!("; final settling speeds {range} m/s"));
    let reynolds = range(|s| s.final_reynolds).map(|range| format!(", Reynolds numbers {range}"));
    let parts = [speeds, reynolds].map(Option::unwrap_or_default).concat();
    format!("; {landed} of {} landed{parts}", number_of_grains(grains))
}

/// Returns the runs in order of a value: the first five and the last three.
fn extremes(title: &str, what: &str, unit: &str, runs: &[(&RunRecord, f64)]) -> Markup {
    let name =
        |(record, v): &(&RunRecord, f64)| format!("{} ({} {unit})", record.name, significant(*v));
    let first: Vec<String> = runs.iter().take(5).map(name).collect();
    let last: Vec<String> = runs.iter().skip(5).rev().take(3).map(name).collect();
    html! {
        @if runs.is_empty() {
            p { "No finished run has a " (what) "." }
        } @else {
            (paragraph(title, &html! {
                (first.join(", ")) "."
                @if !last.is_empty() { " Last: " (last.join(", ")) "." }
            }))
        }
    }
}

/// Returns the fastest grains, the first landings, and the uncertainty of both.
pub(super) fn summary(content: &Content) -> Markup {
    let all = settling_runs(content.records);
    let sorted = |pick: fn(&SettlingMeasures) -> Option<f64>| {
        let known = all.iter().filter_map(|(record, s)| Some((*record, pick(s)?)));
        let mut values: Vec<(&RunRecord, f64)> = known.collect();
        values.sort_by(|a, b| a.1.total_cmp(&b.1));
        values
    };
    let mut speeds = sorted(|s| s.final_speed_m_per_s);
    speeds.reverse();
    let landings = sorted(|s| s.landing_time_s);
    let unsteady = |s: &SettlingMeasures| s.speed_change.is_some_and(|c| c.abs() > STEADY);
    let unsteady = all.iter().filter(|(_, s)| unsteady(s));
    let unsteady: Vec<&str> = unsteady.map(|(r, _)| r.name.as_str()).collect();
    let without = all.iter().filter(|(_, s)| s.final_speed_m_per_s.is_none());
    let without = without.count();
    html! {
        (extremes("Largest final speed", "final settling speed", "m/s", &speeds))
        (extremes("First landing", "landing", "s", &landings))
        @if !unsteady.is_empty() {
            (paragraph("Not steady", &html! {
                "the speed changes by more than " (100.0 * STEADY) " % over the diameter in which \
                 it is measured: " (unsteady.join(", ")) ". Use a taller box to reach the terminal \
                 speed."
            }))
        }
        @if without > 0 {
            p {
                (without) " runs have no final settling speed: their grains fell less than two \
                diameters before the floor slowed them or the run ended."
            }
        }
        (paragraph("Uncertainty", &uncertainty(content)))
    }
}

fn uncertainty(content: &Content) -> Markup {
    html! {
        @if content.without_ensemble() {
            "every model was run once. An " code { "[ensemble]" } " of repetitions with small \
             offsets shows the sensitivity to the initial position, a finer mesh the \
             discretisation error."
        } @else {
            "models were repeated with small changes of their start; bars in the \
             figures are the ranges of the repetitions."
        }
    }
}

/// Returns the definition of the final speed, and the file with the values of each grain.
pub(super) fn table_note() -> Markup {
    html! {
        p {
            "Final speeds are means over the last diameter fallen; for a grain that landed, over \
             the last but one. With several grains they are averaged, and " i { "landing time" }
            " is the first landing. Values of each grain: " code { (SETTLING_TABLE) } "."
        }
    }
}

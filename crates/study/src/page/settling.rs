//! Parts of the report page about runs other than pairs.

use std::fmt::Write;

use grainwake_plot::text::escape;

use super::html::Content;
use crate::format::significant;
use crate::measure::record::RunRecord;
use crate::measure::settling::SettlingMeasures;
use crate::measure::table::SETTLING_TABLE;

/// Columns of the table: heading and quantity.
pub(super) const COLUMNS: [(&str, &str); 12] = [
    ("grains", "grains"),
    ("landed", "landed"),
    ("peak v [m/s]", "peak_speed_m_per_s"),
    ("final v [m/s]", "final_speed_m_per_s"),
    ("final v / √(d g)", "final_speed"),
    ("change of v", "speed_change"),
    ("peak Re", "peak_reynolds"),
    ("final Re", "final_reynolds"),
    ("lands at [s]", "landing_time_s"),
    ("drift / d", "drift"),
    ("long axis [°]", "long_axis"),
    ("rotation [°]", "turned"),
];

/// Largest relative change of the speed in the final window of a terminal speed.
const STEADY: f64 = 0.02;

fn settling_runs(records: &[RunRecord]) -> Vec<(&RunRecord, &SettlingMeasures)> {
    let known = records
        .iter()
        .filter_map(|r| Some((r, r.settling.as_ref()?)));
    known.collect()
}

/// Returns the landings, speeds and Reynolds numbers as half a sentence; none without such runs.
pub(super) fn lead(records: &[RunRecord]) -> Option<String> {
    let all = settling_runs(records);
    if all.is_empty() {
        return None;
    }
    let grains: usize = all.iter().map(|(_, s)| s.grains).sum();
    let landed: usize = all.iter().map(|(_, s)| s.landed).sum();
    let mut text = format!("; {landed} of {grains} grains landed");
    let span = |pick: fn(&SettlingMeasures) -> Option<f64>| {
        let values = || all.iter().filter_map(|(_, s)| pick(s));
        let (low, high) = (values().reduce(f64::min)?, values().reduce(f64::max)?);
        let (low_text, high_text) = (significant(low), significant(high));
        Some(if low == high {
            low_text
        } else {
            format!("{low_text} to {high_text}")
        })
    };
    if let Some(speeds) = span(|s| s.final_speed_m_per_s) {
        let _ = write!(text, "; final settling speeds {speeds} m/s");
    }
    if let Some(reynolds) = span(|s| s.final_reynolds) {
        let _ = write!(text, ", Reynolds numbers {reynolds}");
    }
    Some(text)
}

/// Fastest grains, first landings, and the uncertainty of both.
pub(super) fn summary(content: &Content) -> String {
    let all = settling_runs(content.records);
    let list = |title: &str, what: &str, unit: &str, values: Vec<(&RunRecord, f64)>| {
        let name = |(record, v): &(&RunRecord, f64)| {
            format!("{} ({} {unit})", escape(&record.name), significant(*v))
        };
        let first: Vec<String> = values.iter().take(5).map(name).collect();
        let last: Vec<String> = values.iter().skip(5).rev().take(3).map(name).collect();
        let last = match last.is_empty() {
            true => String::new(),
            false => format!(" Last: {}.", last.join(", ")),
        };
        match values.is_empty() {
            true => format!("<p>No finished run has a {what}.</p>\n"),
            false => format!("<p><b>{title}</b>: {}.{last}</p>\n", first.join(", ")),
        }
    };
    let sorted = |pick: fn(&SettlingMeasures) -> Option<f64>| {
        let known = all
            .iter()
            .filter_map(|(record, s)| Some((*record, pick(s)?)));
        let mut values: Vec<(&RunRecord, f64)> = known.collect();
        values.sort_by(|a, b| a.1.total_cmp(&b.1));
        values
    };
    let mut speeds = sorted(|s| s.final_speed_m_per_s);
    speeds.reverse();
    let mut out = list("Largest final speed", "final settling speed", "m/s", speeds);
    out += &list(
        "First landing",
        "landing",
        "s",
        sorted(|s| s.landing_time_s),
    );
    let unsteady = |s: &SettlingMeasures| s.speed_change.is_some_and(|c| c.abs() > STEADY);
    let unsteady: Vec<String> = all
        .iter()
        .filter(|(_, s)| unsteady(s))
        .map(|(r, _)| escape(&r.name))
        .collect();
    if !unsteady.is_empty() {
        let _ = writeln!(
            out,
            "<p><b>Not steady</b>: the speed changes by more than {:.0} % over the diameter in \
             which it is measured: {}. Use a taller box to reach the terminal speed.</p>",
            100.0 * STEADY,
            unsteady.join(", ")
        );
    }
    let without = all
        .iter()
        .filter(|(_, s)| s.final_speed_m_per_s.is_none())
        .count();
    if without > 0 {
        let _ = writeln!(
            out,
            "<p>{without} runs have no final settling speed: their grains fell less than two \
             diameters before the floor slowed them or the run ended.</p>"
        );
    }
    out += if content.without_ensemble() {
        "<p><b>Uncertainty</b>: every model was run once. An <code>[ensemble]</code> of \
         repetitions with small offsets shows the sensitivity to the initial position, a finer \
         mesh the discretisation error.</p>\n"
    } else {
        "<p><b>Uncertainty</b>: models were repeated with small random offsets of the initial \
         position; bars in the figures are the ranges of the repetitions.</p>\n"
    };
    out
}

/// Definition of the final speed, and the file with the values of each grain.
pub(super) fn table_note() -> String {
    format!(
        "<p>Final speeds are means over the last diameter fallen; for a grain that landed, over \
         the last but one. With several grains they are averaged, and <i>lands at</i> is the first \
         landing. Values of each grain: <code>{SETTLING_TABLE}</code>.</p>\n"
    )
}

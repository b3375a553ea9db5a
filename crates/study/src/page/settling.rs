//! The parts of the page that speak of grains that are no pairs.

use std::fmt::Write;

use grainwake_report::figure::text::escape;

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
    ("turned [°]", "turned"),
];

/// Speeds that still change by more than this are no terminal speeds.
const STEADY: f64 = 0.02;

/// Runs that are no pairs.
fn settled(rows: &[RunRecord]) -> Vec<(&RunRecord, &SettlingMeasures)> {
    rows.iter()
        .filter_map(|row| Some((row, row.settling.as_ref()?)))
        .collect()
}

/// What came out, in half a sentence; none without such runs.
pub(super) fn lead(rows: &[RunRecord]) -> Option<String> {
    let all = settled(rows);
    if all.is_empty() {
        return None;
    }
    let grains: usize = all.iter().map(|(_, s)| s.grains).sum();
    let landed: usize = all.iter().map(|(_, s)| s.landed).sum();
    let mut text = if grains == all.len() {
        format!("; {landed} of {grains} grains landed")
    } else {
        format!("; {landed} of their {grains} grains landed")
    };
    let span = |pick: fn(&SettlingMeasures) -> Option<f64>| {
        let values = || all.iter().filter_map(|(_, s)| pick(s));
        let ends = (values().reduce(f64::min)?, values().reduce(f64::max)?);
        Some(if ends.0 == ends.1 {
            significant(ends.0)
        } else {
            format!("{} to {}", significant(ends.0), significant(ends.1))
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

/// Which create_folder fastest and land first, and how sure that is.
pub(super) fn answers(content: &Content) -> String {
    let all = settled(content.rows);
    let mut out = String::new();
    let mut list =
        |what: [&str; 2], unit: &str, pick: fn(&SettlingMeasures) -> Option<f64>, up: bool| {
            let mut sorted: Vec<(&RunRecord, f64)> = all
                .iter()
                .filter_map(|(row, s)| Some((*row, pick(s)?)))
                .collect();
            sorted.sort_by(|a, b| a.1.total_cmp(&b.1));
            if up {
                sorted.reverse();
            }
            let name = |(row, v): &(&RunRecord, f64)| {
                format!("{} ({} {unit})", escape(&row.name), significant(*v))
            };
            let first: Vec<String> = sorted.iter().take(5).map(name).collect();
            let last: Vec<String> = sorted.iter().skip(5).rev().take(3).map(name).collect();
            if sorted.is_empty() {
                let _ = writeln!(out, "<p>No finished run gives a {}.</p>", what[1]);
            } else {
                let last = if last.is_empty() {
                    String::new()
                } else {
                    format!(" Last: {}.", last.join(", "))
                };
                let first = first.join(", ");
                let _ = writeln!(out, "<p><b>{}</b>: {first}.{last}</p>", what[0]);
            }
        };
    list(
        ["Fastest at the end", "final settling speed"],
        "m/s",
        |s| s.final_speed_m_per_s,
        true,
    );
    list(
        ["First to land", "landing"],
        "s",
        |s| s.landing_time_s,
        false,
    );
    let changing: Vec<String> = all
        .iter()
        .filter(|(_, s)| s.speed_change.is_some_and(|c| c.abs() > STEADY))
        .map(|(row, _)| escape(&row.name))
        .collect();
    let without = all
        .iter()
        .filter(|(_, s)| s.final_speed_m_per_s.is_none())
        .count();
    if !changing.is_empty() {
        let _ = writeln!(
            out,
            "<p><b>Not yet steady</b>: the speed still changes by more than {:.0} % over the diameter where it is measured: {}. A taller box shows whether it settles.</p>",
            100.0 * STEADY,
            changing.join(", ")
        );
    }
    if without > 0 {
        let _ = writeln!(
            out,
            "<p>{without} runs have no final settling speed: their grains fell less than two diameters before the floor slowed them or the run ended.</p>"
        );
    }
    if content.rows.iter().all(|r| r.member == 0) {
        out += "<p><b>How sure</b>: every model was run once. An <code>[ensemble]</code> of repetitions with small offsets tells how far the results hang on the start, and a finer grid how far on the cells.</p>\n";
    } else {
        out += "<p><b>How sure</b>: models were repeated with small random offsets of the start; the ranges of the repetitions are bars in the figures.</p>\n";
    }
    out
}

/// Where the numbers of each grain are.
pub(super) fn note() -> String {
    format!(
        "<p>Final speeds are means over the last diameter fallen (of a grain that landed, the last but one); with several grains, means over them, and <i>lands</i> is the first of them. Each grain has its row in <code>{SETTLING_TABLE}</code>.</p>\n"
    )
}

//! The report page of a run.

mod tables;

use grainwake_formats::events::EventKind;
use grainwake_plot::{literal, plain};
use maud::{Markup, html};
use serde_json::Value;

use crate::features::{RunFeatures, RunKind, short};
use crate::files::WrittenFigure;
use crate::html::{self, label, name_column, notice, number_column, section};
use crate::phases::{self, Phase, PhaseKind};
use crate::run_folder::RunFolder;

/// Saved 3-D page in a run folder, to which the report links.
const VIEW: &str = "view.html";

/// Returns the page.
pub fn page(
    run: &RunFolder,
    features: &RunFeatures,
    figures: &[WrittenFigure],
    notes: &[String],
) -> String {
    let content = html! {
        (state(run, features))
        (html::omissions(notes))
        @if !features.phases.is_empty() { (section("Phases", &phases(features))) }
        @if !figures.is_empty() { (section("Figures", &html::figures(figures))) }
        (section("Set-up", &tables::parameters(run, features)))
        @if !run.events.is_empty() { (section("Events", &tables::events(run, features))) }
        (section("Provenance", &tables::provenance(run)))
    };
    let footer = html! {
        "Produced by Grainwake from the tables of this run folder. Figures as PNG and SVG: "
        code { "figures/" } ". Interactive 3-D page: "
        @if run.path.join(VIEW).is_file() { a href=(VIEW) { (VIEW) } } @else { code { "grainwake view" } }
        "."
    };
    html::page(title(run, features), &lead(run, features), &content, &footer)
}

fn title<'a>(run: &'a RunFolder, features: &RunFeatures) -> &'a str {
    let general = match features.kind {
        RunKind::Flow => "Flow without grains",
        RunKind::Single => "One grain",
        RunKind::Pair => "Two grains",
        RunKind::Many => "Many grains",
    };
    run.facts.title.as_deref().unwrap_or(general)
}

/// Returns one or two sentences with the main result and the extent of the run.
fn lead(run: &RunFolder, features: &RunFeatures) -> Markup {
    let result = match features.kind {
        RunKind::Pair => pair_sentence(run, features),
        RunKind::Single => single_sentence(run, features),
        RunKind::Many => format!("{} grains. ", run.moving().len()),
        RunKind::Flow => String::new(),
    };
    let wall = run.summary_number("wall_s");
    let wall = wall.map_or(String::new(), |s| format!(" and took {}", tables::duration(s)));
    let summary = run.summary.as_ref();
    let reason = summary.and_then(|s| s.get("ended_by")?.as_str());
    let reason = reason.filter(|reason| *reason != "end");
    let reason = reason.map_or(String::new(), |r| format!("; it ended by {}", literal(r)));
    let end = short(features.end);
    label(&format!("{result}The run covers {end} s of simulated time{wall}{reason}."))
}

fn pair_sentence(run: &RunFolder, features: &RunFeatures) -> String {
    let Some(kiss) = features.kiss else {
        return match run.finished() {
            true => "The two grains did not touch. ".to_owned(),
            false => "The two grains have not touched so far. ".to_owned(),
        };
    };
    let mut events = vec![(kiss.time, format!("kissed at {}", features.pair_event_text(kiss)))];
    let tumbling = |phase: &&Phase| phase.kind == PhaseKind::Tumbling;
    if let Some(phase) = features.phases.iter().find(tumbling) {
        let text = format!("tumbled from {}", features.time_text(phase.start));
        events.push((phase.start, text));
    } else if let Some(time) = late_tumble(run, features) {
        events.push((time, format!("tumbled at {}", features.time_text(time))));
    }
    if let Some(separation) = features.separation {
        let text = format!("separated at {}", features.pair_event_text(separation));
        events.push((separation.time, text));
    }
    events.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut texts: Vec<String> = events.into_iter().map(|(_, text)| text).collect();
    if let [_, .., last] = &mut texts[..] {
        last.insert_str(0, "and ");
    }
    format!("The two grains {}. ", texts.join(", "))
}

/// Returns the time of a tumble after the separation and before the landing [s].
fn late_tumble(run: &RunFolder, features: &RunFeatures) -> Option<f64> {
    let time = phases::first(&run.events, EventKind::Tumble)?;
    let separated = |phase: &&Phase| phase.kind == PhaseKind::Separated;
    let last = features.phases.iter().rfind(separated)?;
    (last.start <= time && time <= last.end).then_some(time)
}

fn single_sentence(run: &RunFolder, features: &RunFeatures) -> String {
    if !run.has_curves() {
        // A single row, that of the end, does not show the fastest motion.
        let peak = run.peak_settling_speed().filter(|v| features.is_motion(run, *v));
        let text = |v| format!("The largest settling speed was {} m/s. ", short(v));
        return peak.map_or(String::new(), text);
    }
    let velocities = run.grains.iter().flat_map(|h| &h.velocity).filter(|v| v.is_finite());
    let fastest = velocities.max_by(|a, b| a.length().total_cmp(&b.length()));
    match fastest.filter(|v| features.is_motion(run, v.length())) {
        Some(v) => {
            let direction = features.direction_text(*v);
            format!("The grain reached {} m/s {direction}. ", short(v.length()))
        }
        None => String::new(),
    }
}

/// Returns the notice of a failed or unfinished run; empty for a finished one.
fn state(run: &RunFolder, features: &RunFeatures) -> Markup {
    let extent = html! { "Results up to " i { "t" } " = " (label(&short(features.end))) " s." };
    let failure = run.failure.as_ref();
    let text = |name| failure.and_then(|f| f.get(name)).and_then(Value::as_str);
    let text = |name| text(name).unwrap_or("not known");
    html! {
        @if failure.is_some() {
            div.notice role="alert" {
                b { "This run failed" } ": " (text("what")) ". To try: " (text("remedy")) ". "
                (extent)
            }
        } @else if !run.finished() {
            (notice(&html! {
                b { "This run has not finished" } ": there is no " code { "summary.json" } ". "
                (extent)
            }))
        }
    }
}

fn phase_colour(kind: PhaseKind) -> &'static str {
    match kind {
        PhaseKind::Drafting => "#8fcbee",
        PhaseKind::Kissing => "#f0b840",
        PhaseKind::Tumbling => "#dfa0c4",
        PhaseKind::Separated => "#5cc4a2",
        PhaseKind::Landed => "#c4c4c8",
    }
}

/// Returns a bar with the share of each phase, and a table of their times.
fn phases(features: &RunFeatures) -> Markup {
    let duration = |phase: &Phase| phase.end - phase.start;
    let total: f64 = features.phases.iter().map(duration).sum();
    let ends = |phase: &Phase| [phase.start, phase.end].map(short);
    let spoken = |phase: &Phase| {
        let [start, end] = ends(phase).map(|text| plain(&text));
        format!("{} from {start} s to {end} s", phase.kind.name())
    };
    let spoken: Vec<String> = features.phases.iter().map(spoken).collect();
    let scaled = tables::scaled_time(features);
    let mut columns =
        vec![name_column("phase"), number_column("from [s]"), number_column("to [s]")];
    if let Some((label, _)) = scaled {
        columns.extend(["from", "to"].map(|end| number_column(&format!("{end}, {label}"))));
    }
    let row = |phase: &Phase| {
        let colour = format!("background:{}", phase_colour(phase.kind));
        let mut row = vec![html! { span.swatch style=(colour) {} (phase.kind.name()) }];
        row.extend(ends(phase).map(|text| label(&text)));
        if let Some((_, factor)) = scaled {
            row.extend([phase.start, phase.end].map(|time| label(&short(time * factor))));
        }
        row
    };
    html! {
        div.bar role="img" aria-label={ "Phases: " (spoken.join("; ")) } {
            @for phase in &features.phases {
                @let (name, share) = (phase.kind.name(), 100.0 * duration(phase) / total);
                @let colour = phase_colour(phase.kind);
                div style=(format!("width:{share:.3}%;background:{colour}")) {
                    // A name that does not fit is left to the table.
                    @if share >= 1.1 * name.len() as f64 { (name) }
                }
            }
        }
        (html::table(&columns, features.phases.iter().map(row)))
    }
}

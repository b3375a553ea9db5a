//! The page: one self-contained HTML file without scripts or outside resources.

mod tables;

use grainwake_plot::{COLUMN, escape, html, literal, plain};

use crate::figure::Figure;
use crate::phases::{Phase, PhaseKind};
use crate::run_folder::RunFolder;
use crate::story::{Story, Subject, short};

/// Style sheet of all pages.
pub const STYLE: &str = include_str!("style.css");

/// The whole page; `figures` come with their SVG documents.
pub fn page(
    run: &RunFolder,
    story: &Story,
    figures: &[(Figure, String)],
    notes: &[String],
) -> String {
    let title = title(run, story);
    let mut out = String::with_capacity(1 << 20);
    out.push_str("<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n");
    out.push_str("<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n");
    out.push_str(&format!(
        "<title>{}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n<main>\n",
        escape(&title)
    ));
    out.push_str(&format!(
        "<header>\n<h1>{}</h1>\n<p class=\"lead\">{}</p>\n</header>\n",
        escape(&title),
        lead(run, story)
    ));
    out.push_str(&notices(run, story, notes));
    if !story.phases.is_empty() {
        out.push_str(&format!(
            "<section>\n<h2>Phases</h2>\n{}</section>\n",
            phase_bar(story)
        ));
    }
    if !figures.is_empty() {
        out.push_str("<section>\n<h2>Figures</h2>\n<div class=\"figures\">\n");
        for (i, (figure, svg)) in figures.iter().enumerate() {
            out.push_str(&figure_block(i + 1, figure, svg));
        }
        out.push_str("</div>\n</section>\n");
    }
    out.push_str(&format!(
        "<section>\n<h2>What was run</h2>\n{}</section>\n",
        tables::parameters(run, story)
    ));
    if !run.events.is_empty() {
        out.push_str(&format!(
            "<section>\n<h2>Events</h2>\n{}</section>\n",
            tables::events(run, story)
        ));
    }
    out.push_str(&format!(
        "<section>\n<h2>Where it comes from</h2>\n{}</section>\n",
        tables::provenance(run)
    ));
    out.push_str("<footer>Made by Grainwake from the tables of this run folder; the same figures are in <code>figures/</code> as PNG and SVG.</footer>\n");
    out.push_str("</main>\n</body>\n</html>\n");
    out
}

fn title(run: &RunFolder, story: &Story) -> String {
    let what = match story.subject {
        Subject::Flow => "Flow without grains",
        Subject::Single => "One grain",
        Subject::Pair => "Settling pair",
        Subject::Many => "Many grains",
    };
    run.facts.title.clone().unwrap_or_else(|| what.to_owned())
}

/// One or two sentences with the result.
fn lead(run: &RunFolder, story: &Story) -> String {
    let end = format!("The run covers {} s of simulated time", short(story.end));
    let first = match story.subject {
        Subject::Pair => pair_sentence(story),
        Subject::Single => single_sentence(run, story),
        Subject::Many => format!(
            "{} grains. ",
            run.grains.iter().filter(|h| !h.is_empty()).count()
        ),
        Subject::Flow => String::new(),
    };
    let wall = run
        .summary
        .as_ref()
        .and_then(|s| s.get("wall_s"))
        .and_then(serde_json::Value::as_f64);
    let wall = wall.map_or(String::new(), |wall| {
        format!(" and took {}", tables::duration(wall))
    });
    let ended = run
        .summary
        .as_ref()
        .and_then(|s| s.get("ended_by"))
        .and_then(serde_json::Value::as_str);
    let ended = ended.filter(|reason| *reason != "end");
    let ended = ended.map_or(String::new(), |reason| {
        format!("; it ended by {}", literal(reason))
    });
    html(&format!("{first}{end}{wall}{ended}."))
}

fn pair_sentence(story: &Story) -> String {
    let Some(kiss) = story.kiss else {
        return "The two grains did not touch. ".to_owned();
    };
    let mut happened = vec![(kiss.time, format!("kissed at {}", story.moment_text(kiss)))];
    let tumbling = |phase: &&Phase| phase.kind == PhaseKind::Tumbling;
    if let Some(phase) = story.phases.iter().find(tumbling) {
        let text = format!("tumbled from {}", story.time_text(phase.start));
        happened.push((phase.start, text));
    }
    if let Some(parting) = story.parting {
        let text = format!("parted at {}", story.moment_text(parting));
        happened.push((parting.time, text));
    }
    happened.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut texts: Vec<String> = happened.into_iter().map(|(_, text)| text).collect();
    if let [_, .., last] = &mut texts[..] {
        last.insert_str(0, "and ");
    }
    format!("The two grains {}. ", texts.join(", "))
}

fn single_sentence(run: &RunFolder, story: &Story) -> String {
    let peak = run
        .grains
        .iter()
        .flat_map(|h| h.velocity.iter().map(|v| -v.dot(story.up)))
        .fold(f64::NEG_INFINITY, f64::max);
    if peak > 0.0 {
        format!("The grain reached {} m/s downwards. ", short(peak))
    } else {
        String::new()
    }
}

fn notices(run: &RunFolder, story: &Story, notes: &[String]) -> String {
    let mut out = String::new();
    let up_to = html(&short(story.end));
    if let Some(failure) = &run.failure {
        let say = |name: &str| {
            failure
                .get(name)
                .and_then(serde_json::Value::as_str)
                .unwrap_or("not known")
        };
        out.push_str(&format!(
            "<div class=\"notice\" role=\"alert\"><b>This run failed</b>: {}. To try: {}. What follows goes up to <i>t</i> = {up_to} s.</div>\n",
            escape(say("what")),
            escape(say("remedy"))
        ));
    } else if !run.finished() {
        out.push_str(&format!(
            "<div class=\"notice\" role=\"note\"><b>This run has not finished</b>: there is no <code>summary.json</code>. What follows goes up to <i>t</i> = {up_to} s.</div>\n",
        ));
    }
    if !notes.is_empty() {
        let items: Vec<String> = notes
            .iter()
            .map(|note| format!("<li>{}</li>", escape(note)))
            .collect();
        out.push_str(&format!(
            "<div class=\"notice\" role=\"note\"><b>Missing or left out</b><ul>{}</ul></div>\n",
            items.join("")
        ));
    }
    out
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

fn phase_bar(story: &Story) -> String {
    let total: f64 = story
        .phases
        .iter()
        .map(|phase| phase.end - phase.start)
        .sum();
    let (label, factor) = story.time_axis();
    let dimensionless = factor != 1.0;
    let mut bar = String::new();
    let mut rows = String::new();
    let mut spoken = Vec::new();
    for phase in &story.phases {
        let share = 100.0 * (phase.end - phase.start) / total;
        let name = phase.kind.name();
        let colour = phase_colour(phase.kind);
        // A name that would be cut is left to the table below.
        let shown = if share >= 1.1 * name.len() as f64 {
            name
        } else {
            ""
        };
        bar.push_str(&format!(
            "<div style=\"width:{share:.3}%;background:{colour}\">{shown}</div>"
        ));
        let scaled = |time: f64| html(&short(time * factor));
        let scaled = if dimensionless {
            format!(
                "<td class=\"number\">{}</td><td class=\"number\">{}</td>",
                scaled(phase.start),
                scaled(phase.end)
            )
        } else {
            String::new()
        };
        rows.push_str(&format!(
            "<tr><td class=\"name\"><span class=\"swatch\" style=\"background:{colour}\"></span>{name}</td><td class=\"number\">{}</td><td class=\"number\">{}</td>{scaled}</tr>\n",
            html(&short(phase.start)),
            html(&short(phase.end))
        ));
        spoken.push(format!(
            "{name} from {} s to {} s",
            plain(&short(phase.start)),
            plain(&short(phase.end))
        ));
    }
    let scaled = if dimensionless {
        let label = html(label.split("  ").next().unwrap_or(label));
        format!("<th class=\"number\">from, {label}</th><th class=\"number\">to, {label}</th>")
    } else {
        String::new()
    };
    format!(
        "<div class=\"bar\" role=\"img\" aria-label=\"Phases: {}\">{bar}</div>\n<div class=\"scroll\"><table><thead><tr><th>phase</th><th class=\"number\">from [s]</th><th class=\"number\">to [s]</th>{scaled}</tr></thead><tbody>\n{rows}</tbody></table></div>\n",
        escape(&spoken.join("; "))
    )
}

fn figure_block(number: usize, figure: &Figure, svg: &str) -> String {
    let class = if figure.drawing.width() <= COLUMN + 30.0 {
        " class=\"column\""
    } else {
        ""
    };
    format!(
        "<figure{class} id=\"{name}\">\n<div class=\"paper\">{svg}</div>\n<figcaption><b>Figure {number}. {}.</b> {} <span>(<a href=\"figures/{name}.png\">PNG</a>, <a href=\"figures/{name}.svg\">SVG</a>)</span></figcaption>\n</figure>\n",
        html(&figure.title),
        html(&figure.caption),
        name = figure.name,
    )
}

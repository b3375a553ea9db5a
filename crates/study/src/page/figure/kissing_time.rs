//! Fig. 14: kissing times of all models, and their spread by grain.

use std::collections::BTreeMap;

use grainwake_report::figure::axis::{Axis, extent};
use grainwake_report::figure::frame::{Frame, Sign};
use grainwake_report::figure::style::{
    BLUE, GREEN, HAIR, INK, ORANGE, PAGE, SMALL, TEXT, VERMILION,
};
use grainwake_report::figure::svg::{Anchor, Drawing};
use grainwake_report::figure::text;

use super::{FigureData, StudyFigure, symbol, value_text};
use crate::analysis::observation::{Observation, observations};
use crate::analysis::statistics::quantile;
use crate::format::significant;

const COLOURS: [&str; 4] = [VERMILION, ORANGE, BLUE, GREEN];
const SHADES: [&str; 2] = ["#e9e9ec", "#f6f6f8"];
const LABEL: &str = "kissing time  *t* √(*g*/*d*)  [–]";

/// Kissing times by grain: where each grain stands, and its block.
struct Layout {
    grains: Vec<String>,
    reference: Option<Observation>,
    all: Vec<Observation>,
    frame: Frame,
    /// First and last place, value of the row factor.
    blocks: Vec<(usize, usize, f64)>,
}

fn layout(data: &FigureData, height: f64, top: f64) -> Option<Layout> {
    let plan = &data.plan.analysis.figures;
    let axis = plan.grains.as_ref()?;
    let grains = data.levels(axis);
    let all = observations(data.records, "kiss_time", &BTreeMap::new());
    let reference = plan
        .reference
        .as_ref()
        .and_then(|name| all.iter().find(|s| s.model == *name))
        .cloned();
    let values = all.iter().flat_map(|s| [s.range.0, s.range.1, s.value]);
    let (_, high) = extent(values)?;
    let places = grains.len() + usize::from(plan.reference.is_some());
    let mut across = Axis::linear("grain", 0.0, places as f64, 4, true);
    let number = |name: &String| {
        name.trim_start_matches(|c: char| !c.is_ascii_digit())
            .trim_start_matches('0')
            .to_owned()
    };
    across.ticks = grains
        .iter()
        .enumerate()
        .map(|(i, g)| (i as f64 + 0.5, number(g)))
        .collect();
    if let Some(name) = &plan.reference {
        across
            .ticks
            .push((places as f64 - 0.5, text::literal(name)));
    }
    let frame = Frame {
        x: 38.0,
        y: top,
        width: PAGE - 38.0 - 8.0,
        height,
        across,
        // Room for the labels of the blocks.
        up: Axis::linear(LABEL, 0.0, 1.12 * high, 5, false),
    };
    let mut blocks: Vec<(usize, usize, f64)> = Vec::new();
    for (i, grain) in grains.iter().enumerate() {
        let run = data
            .plan
            .runs
            .iter()
            .find(|r| r.levels.get(axis) == Some(grain))?;
        let value = plan
            .rows
            .as_ref()
            .and_then(|f| run.factors.get(f))
            .copied()
            .unwrap_or(f64::NAN);
        match blocks.last_mut() {
            Some((_, last, v)) if *v == value => *last = i,
            _ => blocks.push((i, i, value)),
        }
    }
    Some(Layout {
        grains,
        reference,
        all,
        frame,
        blocks,
    })
}

impl Layout {
    fn ground(&self, drawing: &mut Drawing, rows: Option<&str>) {
        let f = &self.frame;
        let blocks = || {
            let each = self.blocks.iter().enumerate();
            each.map(|(n, (first, last, value))| {
                let (left, right) = (f.px(*first as f64), f.px(*last as f64 + 1.0));
                (left, right, format!("fill=\"{}\"", SHADES[n % 2]), *value)
            })
        };
        for (left, right, shade, _) in blocks() {
            drawing.rectangle(left, f.y, right - left, f.height, &shade);
        }
        f.grid(drawing);
        for (left, right, shade, value) in blocks() {
            if let Some(factor) = rows.filter(|_| value.is_finite()) {
                let label = format!("{} = {}", symbol(factor), value_text(value));
                let (middle, width) = (0.5 * (left + right), text::width(&label, TEXT) + 4.0);
                // No line of the grid runs through the letters.
                drawing.rectangle(middle - 0.5 * width, f.y + 1.0, width, 11.0, &shade);
                drawing.label(middle, f.y + 9.0, Anchor::Middle, TEXT, INK, &label, false);
            }
        }
        if let Some(reference) = &self.reference {
            f.level(drawing, reference.value);
        }
    }
}

/// Kissing time of every model, with the spread of its members.
pub fn by_model(data: &FigureData) -> Option<StudyFigure> {
    let plan = &data.plan.analysis.figures;
    let layout = layout(data, 190.0, 20.0)?;
    let f = &layout.frame;
    let mut drawing = Drawing::new(PAGE, f.y + f.height + 26.0);
    layout.ground(&mut drawing, plan.rows.as_deref());
    let orientations = plan
        .orientations
        .as_ref()
        .map(|axis| data.levels(axis))
        .unwrap_or_default();
    let mut x = f.x;
    for (n, name) in orientations.iter().enumerate() {
        Sign::number(n).draw(&mut drawing, (x + 4.0, 9.0), 3.0, COLOURS[n % 4], false);
        let label = text::literal(name);
        drawing.label(
            x + 10.0,
            9.0 + 0.36 * SMALL,
            Anchor::Start,
            SMALL,
            INK,
            &label,
            false,
        );
        x += 24.0 + text::width(&label, SMALL);
    }
    let bounds = layout.all.iter().filter(|s| s.censored).count();
    if bounds > 0 {
        Sign::Circle.draw(&mut drawing, (x + 4.0, 9.0), 3.0, INK, true);
        drawing.label(
            x + 10.0,
            9.0 + 0.36 * SMALL,
            Anchor::Start,
            SMALL,
            INK,
            "hollow: no kiss before landing, which is shown",
            false,
        );
    }
    let mut draw = |sample: &Observation, at: f64, n: usize, colour: &str| {
        let x = f.px(at);
        if sample.range.1 > sample.range.0 {
            drawing.line(
                &[(x, f.py(sample.range.0)), (x, f.py(sample.range.1))],
                colour,
                0.9,
                None,
            );
        }
        Sign::number(n).draw(
            &mut drawing,
            (x, f.py(sample.value)),
            2.9,
            colour,
            sample.censored,
        );
    };
    let grain_axis = plan.grains.as_deref().unwrap_or_default();
    for sample in &layout.all {
        let grain = sample.levels.get(grain_axis);
        let Some(place) = grain.and_then(|g| layout.grains.iter().position(|o| o == g)) else {
            continue;
        };
        let level = plan
            .orientations
            .as_ref()
            .and_then(|axis| sample.levels.get(axis));
        let n = level
            .and_then(|l| orientations.iter().position(|o| o == l))
            .unwrap_or(0);
        let shift = if orientations.len() > 1 {
            0.6 * n as f64 / (orientations.len() - 1) as f64 - 0.3
        } else {
            0.0
        };
        draw(sample, place as f64 + 0.5 + shift, n, COLOURS[n % 4]);
    }
    if let Some(reference) = &layout.reference {
        draw(reference, layout.grains.len() as f64 + 0.5, 0, INK);
    }
    f.outline(&mut drawing, (true, true));
    let members = data.records.iter().map(|r| r.member).max().unwrap_or(0);
    let mut caption = format!(
        "First contact of {} models, by grain and initial orientation.",
        layout.all.len()
    );
    if let Some(rows) = &plan.rows {
        caption += &format!(" A block holds the grains of one {rows}.");
    }
    if let Some(name) = plan
        .reference
        .as_ref()
        .filter(|_| layout.reference.is_some())
    {
        caption += &format!(" The dashed line is {}.", text::literal(name));
    }
    caption += &if members > 0 {
        format!(
            " Signs are medians and bars the range of up to {} runs with small random offsets of the start.",
            members + 1
        )
    } else {
        " Each sign is one run.".to_owned()
    };
    if bounds > 0 {
        caption += &format!(" {bounds} pairs landed before they kissed.");
    }
    Some(StudyFigure {
        name: "fig14a-kissing-time".into(),
        number: "14a".into(),
        title: "Kissing time of all models".into(),
        caption,
        drawing,
    })
}

/// Spread of the kissing time over the orientations of each grain.
pub fn boxes(data: &FigureData) -> Option<StudyFigure> {
    let plan = &data.plan.analysis.figures;
    let layout = layout(data, 160.0, 8.0)?;
    let f = &layout.frame;
    let axis = plan.grains.as_ref()?;
    let mut drawing = Drawing::new(PAGE, f.y + f.height + 26.0);
    layout.ground(&mut drawing, plan.rows.as_deref());
    let mut widest: Option<(f64, &String)> = None;
    let mut drawn = 0;
    for (i, grain) in layout.grains.iter().enumerate() {
        let values: Vec<f64> = layout
            .all
            .iter()
            .filter(|s| s.levels.get(axis) == Some(grain))
            .map(|s| s.value)
            .collect();
        let of = |part: f64| quantile(&values, part);
        let (Some(low), Some(q1), Some(middle), Some(q3), Some(high)) =
            (of(0.0), of(0.25), of(0.5), of(0.75), of(1.0))
        else {
            continue;
        };
        drawn += 1;
        if widest.is_none_or(|(w, _)| high - low > w) {
            widest = Some((high - low, grain));
        }
        let (x, half) = (f.px(i as f64 + 0.5), 7.0);
        for (from, end) in [(q1, low), (q3, high)] {
            drawing.line(&[(x, f.py(from)), (x, f.py(end))], INK, HAIR, None);
            drawing.line(
                &[(x - 3.5, f.py(end)), (x + 3.5, f.py(end))],
                INK,
                HAIR,
                None,
            );
        }
        let style = format!(
            "fill=\"{BLUE}\" fill-opacity=\"0.35\" stroke=\"{INK}\" stroke-width=\"{HAIR}\""
        );
        drawing.rectangle(x - half, f.py(q3), 2.0 * half, f.py(q1) - f.py(q3), &style);
        drawing.line(
            &[(x - half, f.py(middle)), (x + half, f.py(middle))],
            INK,
            1.4,
            None,
        );
    }
    if let Some(reference) = &layout.reference {
        Sign::Circle.draw(
            &mut drawing,
            (
                f.px(layout.grains.len() as f64 + 0.5),
                f.py(reference.value),
            ),
            2.9,
            INK,
            reference.censored,
        );
    }
    f.outline(&mut drawing, (true, true));
    let bounds = layout.all.iter().filter(|s| s.censored).count();
    let mut caption = match widest {
        Some((width, grain)) if drawn > 0 => format!(
            "Kissing times of the orientations of each grain: smallest, lower quantile, median, upper quantile and largest. The orientation matters most for {}, whose kissing times span {}.",
            text::literal(grain),
            significant(width)
        ),
        _ => return None,
    };
    if bounds > 0 {
        caption += &format!(
            " The {bounds} pairs that landed before they kissed count with the time of the landing."
        );
    }
    Some(StudyFigure {
        name: "fig14b-kissing-time-spread".into(),
        number: "14b".into(),
        title: "Spread of the kissing time by grain".into(),
        caption,
        drawing,
    })
}

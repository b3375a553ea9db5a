//! Fig. 14: kissing times of all models, and their spread over the orientations of each grain.

use std::collections::BTreeMap;

use grainwake_plot::axis::{Axis, AxisRange, extent};
use grainwake_plot::drawing::{Anchor, Drawing};
use grainwake_plot::frame::{Fill, Frame, Labelled, Marker};
use grainwake_plot::legend::{Entry, Legend};
use grainwake_plot::style::{BLUE, GREEN, HAIR, INK, ORANGE, PAGE, TEXT, VERMILION};
use grainwake_plot::{Figure, text};

use super::data::{FigureData, factor_label, symbol_entry};
use crate::analysis::observation::{Observation, observations};
use crate::analysis::statistics::quantile;
use crate::format::significant;

const COLOURS: [&str; 4] = [VERMILION, ORANGE, BLUE, GREEN];
const SHADES: [&str; 2] = ["#e9e9ec", "#f6f6f8"];
const LABEL: &str = "kissing time  *t* √(*g*/*d*)  [–]";
const LEFT: f64 = 38.0;
/// Height of the legend of the first figure [pt].
const LEGEND: f64 = 9.0;

/// Frame with one position per grain, grouped into blocks of equal row factor.
struct Layout<'a> {
    axis: &'a str,
    grains: Vec<String>,
    reference: Option<Observation>,
    all: Vec<Observation>,
    frame: Frame,
    /// First and last position of a block, and the value of its row factor.
    blocks: Vec<(usize, usize, f64)>,
}

fn layout<'a>(data: &'a FigureData, height: f64, top: f64) -> Option<Layout<'a>> {
    let request = &data.plan.analysis.figures;
    let axis = request.grains.as_ref()?;
    let grains = data.levels(axis);
    let all = observations(data.records, "kiss_time", &BTreeMap::new());
    let reference = request.reference.as_ref();
    let found = reference.and_then(|name| all.iter().find(|o| o.model == *name)).cloned();
    let (_, high) = extent(all.iter().flat_map(|o| [o.range.0, o.range.1, o.value]))?;
    let count = grains.len() + usize::from(reference.is_some());
    let mut across = Axis::linear("grain", 0.0, count as f64, 4, AxisRange::Tight);
    let number = |name: &str| {
        let digits = name.trim_start_matches(|c: char| !c.is_ascii_digit());
        digits.trim_start_matches('0').to_owned()
    };
    let ticks = grains.iter().map(|grain| number(grain));
    let ticks = ticks.chain(reference.map(|name| text::literal(name)));
    across.ticks = ticks.enumerate().map(|(i, label)| (i as f64 + 0.5, label)).collect();
    let mut blocks: Vec<(usize, usize, f64)> = Vec::new();
    for (i, grain) in grains.iter().enumerate() {
        let run = data.run_at(axis, grain)?;
        let value = request.rows.as_ref().and_then(|f| run.factors.get(f));
        let value = value.copied().unwrap_or(f64::NAN);
        match blocks.last_mut() {
            Some((_, last, v)) if *v == value => *last = i,
            _ => blocks.push((i, i, value)),
        }
    }
    Some(Layout {
        axis,
        grains,
        reference: found,
        all,
        frame: Frame {
            x: LEFT,
            y: top,
            width: PAGE - LEFT - 8.0,
            height,
            across,
            // Room for the labels of the blocks.
            up: Axis::linear(LABEL, 0.0, 1.12 * high, 5, AxisRange::Rounded),
        },
        blocks,
    })
}

impl Layout<'_> {
    /// Starts a drawing with blocks, grid and the level of the reference.
    fn drawing(&self, rows: Option<&str>) -> Drawing {
        let f = &self.frame;
        let mut drawing = Drawing::new(PAGE, f.y + f.height + 26.0);
        let blocks = || {
            self.blocks.iter().enumerate().map(|(n, (first, last, value))| {
                let (left, right) = (f.px(*first as f64), f.px(*last as f64 + 1.0));
                (left, right, format!("fill=\"{}\"", SHADES[n % 2]), *value)
            })
        };
        for (left, right, shade, _) in blocks() {
            drawing.rectangle(left, f.y, right - left, f.height, &shade);
        }
        f.grid(&mut drawing);
        for (left, right, shade, value) in blocks() {
            if let Some(factor) = rows.filter(|_| value.is_finite()) {
                let label = factor_label(factor, value);
                let (middle, width) = (0.5 * (left + right), text::width(&label, TEXT) + 4.0);
                // Hides the grid behind the letters.
                drawing.rectangle(middle - 0.5 * width, f.y + 1.0, width, 11.0, &shade);
                drawing.text((middle, f.y + 9.0), Anchor::Middle, &label);
            }
        }
        if let Some(reference) = &self.reference {
            f.level(&mut drawing, reference.value);
        }
        drawing
    }

    /// Horizontal coordinate of the reference, to the right of all grains.
    fn reference_position(&self) -> f64 {
        self.grains.len() as f64 + 0.5
    }

    /// Draws the symbol of an observation and the bar of its range.
    fn mark(&self, drawing: &mut Drawing, at: f64, o: &Observation, sign: Marker, colour: &str) {
        let f = &self.frame;
        let x = f.px(at);
        if o.range.1 > o.range.0 {
            let bar = [(x, f.py(o.range.0)), (x, f.py(o.range.1))];
            drawing.line(&bar, colour, 0.9, None);
        }
        sign.draw(drawing, (x, f.py(o.value)), 2.9, colour, Fill::of_bound(o.censored));
    }

    fn censored(&self) -> usize {
        self.all.iter().filter(|o| o.censored).count()
    }
}

/// Draws the kissing time of every model, with its range over the ensemble.
pub fn by_model(data: &FigureData) -> Option<Figure> {
    let request = &data.plan.analysis.figures;
    let layout = layout(data, 190.0, 20.0)?;
    let mut drawing = layout.drawing(request.rows.as_deref());
    let orientations = request.orientations.as_ref();
    let levels = orientations.map(|axis| data.levels(axis)).unwrap_or_default();
    let entry = |(n, name): (usize, &String)| symbol_entry(name, n, COLOURS[n % 4]);
    let mut entries: Vec<Entry> = levels.iter().enumerate().map(entry).collect();
    let censored = layout.censored();
    if censored > 0 {
        entries.push(Entry {
            name: "hollow: landed before kissing; the landing is shown".into(),
            colour: INK,
            line: None,
            symbol: Some((Marker::Circle, Fill::Hollow)),
        });
    }
    Legend::new(entries, PAGE - LEFT).draw(&mut drawing, (LEFT, LEGEND));
    for observation in &layout.all {
        let grain = observation.levels.get(layout.axis);
        let Some(i) = grain.and_then(|g| layout.grains.iter().position(|o| o == g)) else {
            continue;
        };
        let level = orientations.and_then(|axis| observation.levels.get(axis));
        let n = level.and_then(|l| levels.iter().position(|o| o == l)).unwrap_or(0);
        let shift = match levels.len() {
            0 | 1 => 0.0,
            count => 0.6 * n as f64 / (count - 1) as f64 - 0.3,
        };
        let at = i as f64 + 0.5 + shift;
        let sign = Marker::nth(n);
        layout.mark(&mut drawing, at, observation, sign, COLOURS[n % 4]);
    }
    if let Some(reference) = &layout.reference {
        let at = layout.reference_position();
        layout.mark(&mut drawing, at, reference, Marker::nth(0), INK);
    }
    layout.frame.outline(&mut drawing, Labelled::BOTH);
    let count = layout.all.len();
    let mut caption = format!("First contact of {count} models, by grain and initial orientation.");
    if let Some(rows) = &request.rows {
        caption += &format!(" Blocks: grains of equal {rows}.");
    }
    if let Some(reference) = &layout.reference {
        caption += &format!(" Dashed line: {}.", text::literal(&reference.model));
    }
    caption += &match data.records.iter().map(|r| r.member).max() {
        None | Some(0) => " Each symbol is one run.".to_owned(),
        Some(members) => format!(
            " Symbols are medians and bars the range of up to {} runs with small random offsets \
             of the initial position.",
            members + 1
        ),
    };
    if censored > 0 {
        caption += &format!(" {censored} pairs landed before they kissed.");
    }
    let title = "Kissing time of all models";
    Some(Figure::new("fig14a-kissing-time", title, caption, drawing).numbered("14a"))
}

/// Draws a box plot of the kissing times over the orientations of each grain.
pub fn box_plot(data: &FigureData) -> Option<Figure> {
    let layout = layout(data, 160.0, 8.0)?;
    let f = &layout.frame;
    let mut drawing = layout.drawing(data.plan.analysis.figures.rows.as_deref());
    let box_style =
        format!("fill=\"{BLUE}\" fill-opacity=\"0.35\" stroke=\"{INK}\" stroke-width=\"{HAIR}\"");
    let mut widest: Option<(f64, &String)> = None;
    for (i, grain) in layout.grains.iter().enumerate() {
        let own = layout.all.iter().filter(|o| o.levels.get(layout.axis) == Some(grain));
        let values: Vec<f64> = own.map(|o| o.value).collect();
        if values.is_empty() {
            continue;
        }
        let [low, q1, middle, q3, high] =
            [0.0, 0.25, 0.5, 0.75, 1.0].map(|part| quantile(&values, part).unwrap_or(f64::NAN));
        if widest.is_none_or(|(width, _)| high - low > width) {
            widest = Some((high - low, grain));
        }
        let (x, half) = (f.px(i as f64 + 0.5), 7.0);
        let mut bar = |from: (f64, f64), to: (f64, f64), width: f64| {
            let ends = [(from.0, f.py(from.1)), (to.0, f.py(to.1))];
            drawing.line(&ends, INK, width, None);
        };
        for (from, end) in [(q1, low), (q3, high)] {
            bar((x, from), (x, end), HAIR);
            bar((x - 3.5, end), (x + 3.5, end), HAIR);
        }
        let height = f.py(q1) - f.py(q3);
        drawing.rectangle(x - half, f.py(q3), 2.0 * half, height, &box_style);
        let median = [(x - half, f.py(middle)), (x + half, f.py(middle))];
        drawing.line(&median, INK, 1.4, None);
    }
    if let Some(reference) = &layout.reference {
        let place = (f.px(layout.reference_position()), f.py(reference.value));
        Marker::Circle.draw(&mut drawing, place, 2.9, INK, Fill::of_bound(reference.censored));
    }
    f.outline(&mut drawing, Labelled::BOTH);
    let (width, grain) = widest?;
    let mut caption = format!(
        "Kissing times over the orientations of each grain: minimum, lower quartile, median, upper \
         quartile and maximum. The range is largest for {}: {}.",
        text::literal(grain),
        significant(width)
    );
    let censored = layout.censored();
    if censored > 0 {
        caption += &format!(
            " The {censored} pairs that landed before they kissed are included with the time of \
             landing."
        );
    }
    let title = "Spread of the kissing time by grain";
    Some(Figure::new("fig14b-kissing-time-spread", title, caption, drawing).numbered("14b"))
}

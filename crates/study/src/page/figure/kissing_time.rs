//! Fig. 14: kissing times of all models, and their spread over the orientations of each grain.

use std::collections::{BTreeMap, BTreeSet};

use grainwake_plot::axis::{Axis, AxisRange, extent};
use grainwake_plot::drawing::{Anchor, Drawing};
use grainwake_plot::frame::{Frame, Labelled};
use grainwake_plot::legend::{Entry, Legend};
use grainwake_plot::style::{BLUE, HAIR, INK, PAGE, TEXT};
use grainwake_plot::{Figure, text};

use super::data::FigureData;
use super::legend::symbol_entry;
use super::line_style::OUTSIDE;
use super::misses::{self, STRIP};
use crate::analysis::observation::{Observation, observations};
use crate::analysis::statistics::quantile;
use crate::format::{missed, significant};
use crate::page::label::{label, name_of};

const SHADES: [&str; 2] = ["#e9e9ec", "#f6f6f8"];
const LEFT: f64 = 38.0;
/// Top edge of the frame without a legend, and vertical position of a legend [pt].
const TOP: f64 = 8.0;
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

fn layout<'a>(data: &'a FigureData, height: f64) -> Option<Layout<'a>> {
    let request = &data.plan.analysis.figures;
    let axis = request.grains.as_ref()?;
    let grains = data.levels(axis);
    let all = observations(data.records, "kiss_time", &BTreeMap::new());
    let reference = request.reference.as_ref();
    let found = reference.and_then(|name| all.iter().find(|o| o.model == *name)).cloned();
    let kissed = all.iter().filter(|o| o.occurred());
    let (_, high) = extent(kissed.map(|o| o.range.1))?;
    let strip = if all.iter().any(|o| o.censored) { STRIP } else { 0.0 };
    let ticks = short_names(&grains).into_iter().chain(reference.cloned());
    let ticks = ticks.map(|name| text::literal(&name)).collect();
    let across = Axis::categories(&name_of(axis), ticks);
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
            y: TOP + strip,
            width: PAGE - LEFT - 8.0,
            height,
            across,
            // Room for the labels of the blocks.
            up: Axis::linear(&label("kiss_time"), 0.0, 1.12 * high, 5, AxisRange::Rounded),
        },
        blocks,
    })
}

/// Returns the numbers of names that differ in a final number only; else the names.
fn short_names(names: &[String]) -> Vec<String> {
    let beginning = names.first().map(|name| name.trim_end_matches(|c: char| c.is_ascii_digit()));
    let number = |name: &String| -> Option<u64> {
        let digits = name.strip_prefix(beginning?)?;
        digits.parse().ok().filter(|_| digits.bytes().all(|c| c.is_ascii_digit()))
    };
    let numbers: Option<Vec<u64>> = names.iter().map(number).collect();
    let distinct =
        |numbers: &Vec<u64>| numbers.iter().collect::<BTreeSet<_>>().len() == names.len();
    match numbers.filter(distinct) {
        Some(numbers) => numbers.iter().map(u64::to_string).collect(),
        None => names.to_vec(),
    }
}

impl Layout<'_> {
    /// Starts a drawing with blocks, grid and the level of the reference.
    fn drawing(&self, data: &FigureData) -> Drawing {
        let f = &self.frame;
        let rows = data.plan.analysis.figures.rows.as_ref();
        let mut drawing = Drawing::new(PAGE, f.y + f.height + f.foot());
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
                let label = data.fitting_label(factor, value, right - left - 4.0);
                let (middle, width) = (0.5 * (left + right), text::width(&label, TEXT) + 4.0);
                // Hides the grid behind the letters.
                drawing.rectangle(middle - 0.5 * width, f.y + 1.0, width, 11.0, &shade);
                drawing.text((middle, f.y + 9.0), Anchor::Middle, &label);
            }
        }
        if let Some(reference) = self.reference.as_ref().filter(|o| !o.censored) {
            f.level(&mut drawing, reference.value);
        }
        if self.censored() > 0 {
            misses::strip(&mut drawing, f, true);
        }
        drawing
    }

    /// Horizontal coordinate of the reference, to the right of all grains.
    fn reference_position(&self) -> f64 {
        self.grains.len() as f64 + 0.5
    }

    fn censored(&self) -> usize {
        self.all.iter().filter(|o| o.censored).count()
    }
}

/// Draws the kissing time of every model, with its range over the ensemble.
pub fn by_model(data: &FigureData) -> Option<Figure> {
    let request = &data.plan.analysis.figures;
    let mut layout = layout(data, 190.0)?;
    let orientations = request.orientations.as_ref();
    let levels = orientations.map(|axis| data.levels(axis)).unwrap_or_default();
    let style = |level: Option<&String>| match (orientations, level) {
        (Some(axis), Some(level)) => data.level_style(axis, level),
        _ => OUTSIDE,
    };
    let entry = |name: &String| symbol_entry(name, style(Some(name)));
    let mut entries: Vec<Entry> = levels.iter().map(entry).collect();
    let (censored, several) = (layout.censored(), data.plan.has_members());
    if censored > 0 {
        entries.push(misses::entry(several));
    }
    let legend = Legend::new(entries, PAGE - LEFT);
    layout.frame.y += legend.height() + 10.5 - TOP;
    let mut drawing = layout.drawing(data);
    legend.draw(&mut drawing, (LEFT, LEGEND));
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
        let x = layout.frame.px(i as f64 + 0.5 + shift);
        misses::mark(&mut drawing, &layout.frame, x, observation, style(level));
    }
    if let Some(reference) = &layout.reference {
        let x = layout.frame.px(layout.reference_position());
        misses::mark(&mut drawing, &layout.frame, x, reference, OUTSIDE);
    }
    layout.frame.outline(&mut drawing, Labelled::BOTH);
    let count = layout.all.len();
    let mut caption = format!("First contact of {count} models, by grain and initial orientation.");
    if let Some(rows) = &request.rows {
        caption += &format!(" Blocks: grains of equal {rows}.");
    }
    if let Some(reference) = layout.reference.as_ref().filter(|o| !o.censored) {
        caption += &format!(" Dashed line: {}.", text::literal(&reference.model));
    }
    caption += &match data.records.iter().map(|r| r.member).max() {
        None | Some(0) => " Each symbol is one run.".to_owned(),
        Some(members) => format!(
            " Symbols are medians over up to {} runs with small changes of their start, runs \
             without a kiss last; bars are the range of the kisses.",
            members + 1
        ),
    };
    if censored > 0 {
        caption +=
            &format!(" Hollow, above the axis: {} no kissing time.", missed(censored, several));
    }
    let title = "Kissing time of all models";
    Some(Figure::new("fig14a-kissing-time", title, caption, drawing).numbered("14a"))
}

/// Draws a box plot of the kissing times over the orientations of each grain.
pub fn box_plot(data: &FigureData) -> Option<Figure> {
    let layout = layout(data, 160.0)?;
    let f = &layout.frame;
    let mut drawing = layout.drawing(data);
    let box_style =
        format!("fill=\"{BLUE}\" fill-opacity=\"0.35\" stroke=\"{INK}\" stroke-width=\"{HAIR}\"");
    let mut widest: Option<(f64, &String)> = None;
    for (i, grain) in layout.grains.iter().enumerate() {
        let own = layout.all.iter().filter(|o| o.levels.get(layout.axis) == Some(grain));
        let (missing, kissed): (Vec<_>, Vec<_>) = own.partition(|o| o.censored);
        misses::number(&mut drawing, f, f.px(i as f64 + 0.5), missing.len());
        let values: Vec<f64> = kissed.iter().map(|o| o.value).collect();
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
        misses::mark(&mut drawing, f, f.px(layout.reference_position()), reference, OUTSIDE);
    }
    f.outline(&mut drawing, Labelled::BOTH);
    let (width, grain) = widest?;
    let mut caption = format!(
        "Kissing times over the orientations in which each grain kisses: minimum, lower quartile, \
         median, upper quartile and maximum. The range is largest for {}: {}.",
        text::literal(grain),
        significant(width)
    );
    let censored = layout.censored();
    if censored > 0 {
        let what = match data.plan.has_members() {
            true => "in which half or more of the runs have no kiss",
            false => "without a kiss",
        };
        caption += &format!(
            " Numbers above the axis: orientations of the grain {what}, {censored} in all; \
             their pairs landed, or their runs ended, before."
        );
    }
    let title = "Spread of the kissing time by grain";
    Some(Figure::new("fig14b-kissing-time-spread", title, caption, drawing).numbered("14b"))
}

#[cfg(test)]
mod tests {
    use super::short_names;

    #[test]
    fn only_numbered_names_are_shortened() {
        let short = |names: &[&str]| {
            short_names(&names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>())
        };
        assert_eq!(short(&["g01", "g02", "g10"]), ["1", "2", "10"]);
        assert_eq!(short(&["7", "08"]), ["7", "8"]);
        for names in [
            ["quartz", "sand2mm", "loess2mm"],
            ["g1", "h2", "g3"],
            ["g1", "g01", "g2"],
            ["s1.5", "s2.5", "s3.5"],
            ["coal", "coal1", "coal2"],
        ] {
            assert_eq!(short(&names), names);
        }
        assert!(short(&[]).is_empty());
    }
}

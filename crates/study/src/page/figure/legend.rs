//! Line styles of runs in the overview figures, and their legend.

use grainwake_plot::frame::{Fill, Marker};
use grainwake_plot::legend::{Entry, Legend};
use grainwake_plot::style::{
    BLUE, GREEN, INK, ORANGE, PAGE, SERIES_COLOURS, VERMILION, series_colour,
};
use grainwake_plot::text;

use super::data::FigureData;
use crate::analysis::observation::unique;
use crate::plan::Run;

const DASHES: [Option<&str>; 4] = [None, Some("4 1.8"), Some("1.2 1.5"), Some("6 1.6 1.2 1.6")];
/// Colours of up to four levels.
const FOUR: [&str; 4] = [VERMILION, ORANGE, BLUE, GREEN];
/// Number of lines that differ in colour or dash pattern.
const MOST: usize = SERIES_COLOURS * DASHES.len();

/// Line style of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineStyle {
    /// Colour of the line and the symbols.
    pub colour: &'static str,
    /// Dash pattern of the line.
    pub dash: Option<&'static str>,
    /// Symbol of the points.
    pub sign: Marker,
}

impl LineStyle {
    fn numbered(colour: usize, dash: usize, sign: usize) -> LineStyle {
        LineStyle {
            colour: series_colour(colour),
            dash: DASHES[dash % DASHES.len()],
            sign: Marker::nth(sign),
        }
    }

    /// Returns the n-th style; [`MOST`] lines and 36 symbols differ.
    pub fn nth(n: usize) -> LineStyle {
        let cycle = n / SERIES_COLOURS;
        LineStyle::numbered(n, cycle, n + cycle)
    }

    /// Returns the style of the n-th of `count` levels of an axis.
    pub fn of_level(n: usize, count: usize) -> LineStyle {
        match FOUR.get(n).filter(|_| count <= FOUR.len()) {
            Some(colour) => LineStyle { colour, dash: None, sign: Marker::nth(n) },
            None => LineStyle::nth(n),
        }
    }
}

/// Returns the entry of a legend with a symbol.
pub fn symbol_entry(name: &str, style: LineStyle) -> Entry {
    Entry::symbol(text::literal(name), style.colour, style.sign, Fill::Solid)
}

/// Assignment of line styles to runs.
pub enum LineStyles {
    /// One style per model; none for many models.
    Models(Vec<String>),
    /// One style per level of an axis.
    Axis(String, Vec<String>),
    /// One colour per level of the first axis, one dash pattern and symbol per level of the second.
    Axes([(String, Vec<String>); 2]),
}

impl LineStyles {
    /// Assigns by model if there are few models or no axes, else by two axes or one axis with few
    /// levels.
    pub fn of(data: &FigureData) -> LineStyles {
        let models = unique(data.plan.runs.iter().map(|run| &run.model));
        LineStyles::choose(models, &axes(data))
    }

    fn choose(mut models: Vec<String>, axes: &[(String, Vec<String>)]) -> LineStyles {
        let few = |levels: &[String], most: usize| levels.len() <= most;
        if !few(&models, SERIES_COLOURS) {
            let pairs = axes.iter().flat_map(|a| axes.iter().map(move |b| [a, b]));
            let fits = |[a, b]: &[&(String, Vec<String>); 2]| {
                a.0 != b.0 && few(&a.1, SERIES_COLOURS) && few(&b.1, DASHES.len())
            };
            if let Some(pair) = pairs.into_iter().find(fits) {
                return LineStyles::Axes(pair.map(Clone::clone));
            }
            if let Some((axis, levels)) = axes.iter().find(|(_, levels)| few(levels, MOST)) {
                return LineStyles::Axis(axis.clone(), levels.clone());
            }
        }
        if !few(&models, MOST) {
            models.clear();
        }
        LineStyles::Models(models)
    }

    /// Returns the style of a run; black for a model outside the axes and for one of many models.
    pub fn style(&self, run: &Run) -> LineStyle {
        let level = |axis: &String, levels: &[String]| {
            let level = run.levels.get(axis)?;
            levels.iter().position(|l| l == level)
        };
        let style = match self {
            LineStyles::Models(models) => {
                models.iter().position(|m| *m == run.model).map(LineStyle::nth)
            }
            LineStyles::Axis(axis, levels) => level(axis, levels).map(LineStyle::nth),
            LineStyles::Axes([first, second]) => level(&first.0, &first.1).map(|colour| {
                let n = level(&second.0, &second.1);
                LineStyle::numbered(colour, n.unwrap_or(0), n.unwrap_or(colour))
            }),
        };
        style.unwrap_or(LineStyle { colour: INK, dash: None, sign: Marker::Circle })
    }

    fn entries(&self) -> Vec<(String, LineStyle)> {
        let nth = |names: &[String]| -> Vec<(String, LineStyle)> {
            names.iter().enumerate().map(|(n, name)| (name.clone(), LineStyle::nth(n))).collect()
        };
        match self {
            LineStyles::Models(models) => nth(models),
            LineStyles::Axis(axis, levels) => {
                nth(&levels.iter().map(|level| format!("{axis} {level}")).collect::<Vec<_>>())
            }
            LineStyles::Axes([(first, colours), (second, dashes)]) => {
                let colours = colours.iter().enumerate();
                let colours =
                    colours.map(|(i, l)| (format!("{first} {l}"), LineStyle::numbered(i, 0, 0)));
                let dashes = dashes.iter().enumerate().map(|(i, level)| {
                    let style = LineStyle { colour: INK, ..LineStyle::numbered(0, i, i) };
                    (format!("{second} {level}"), style)
                });
                colours.chain(dashes).collect()
            }
        }
    }

    /// Returns the legend, with symbols or else lines, for a frame with the given left edge [pt].
    pub fn legend(&self, left: f64, symbols: bool) -> Legend {
        let entry = |(name, style): (String, LineStyle)| match symbols {
            true => symbol_entry(&name, style),
            false => Entry::line(text::literal(&name), style.colour, style.dash),
        };
        Legend::new(self.entries().into_iter().map(entry), PAGE - left)
    }
}

/// Returns the axes with more than one level, and their levels in the order of the runs.
pub fn axes(data: &FigureData) -> Vec<(String, Vec<String>)> {
    let names = unique(data.plan.runs.iter().flat_map(|run| run.levels.keys()));
    let axes = names.into_iter().map(|axis| {
        let levels = data.levels(&axis);
        (axis, levels)
    });
    axes.filter(|(_, levels)| levels.len() > 1).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(count: usize) -> Vec<String> {
        (1..=count).map(|i| format!("n{i}")).collect()
    }

    fn distinct<T: PartialEq>(values: &[T]) -> bool {
        (0..values.len()).all(|i| !values[..i].contains(&values[i]))
    }

    #[test]
    fn no_two_entries_of_a_legend_look_alike() {
        let of = |levels: usize| (format!("a{levels}"), names(levels));
        let one = |levels| vec![of(levels)];
        let axes = [one(12), vec![of(7), of(2)], vec![of(4), of(6)], vec![of(9), of(8)]];
        for axes in [vec![]].into_iter().chain(axes) {
            let styles = LineStyles::choose(names(24), &axes);
            let entries = styles.entries();
            assert!(!entries.is_empty());
            let lines: Vec<_> = entries.iter().map(|(_, s)| (s.colour, s.dash)).collect();
            let symbols: Vec<_> = entries.iter().map(|(_, s)| (s.colour, s.sign)).collect();
            assert!(distinct(&lines) && distinct(&symbols), "{axes:?}");
        }
        let many = LineStyles::choose(names(25), &[]);
        assert!(many.entries().is_empty(), "a repeated style would be ambiguous");
        let swapped = LineStyles::choose(names(24), &[of(4), of(6)]);
        assert!(matches!(swapped, LineStyles::Axes([(first, _), _]) if first == "a6"));
    }

    #[test]
    fn levels_differ() {
        for count in [4, 5, 24] {
            let of_level = |n| LineStyle::of_level(n, count);
            let styles: Vec<_> = (0..count).map(of_level).map(|s| (s.colour, s.dash)).collect();
            assert!(distinct(&styles), "{count}");
        }
    }
}

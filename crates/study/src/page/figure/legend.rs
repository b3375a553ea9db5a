//! Line styles of runs in the overview figures, and their legend.

use grainwake_plot::frame::Fill;
use grainwake_plot::legend::Entry;
use grainwake_plot::style::SERIES_COLOURS;
use grainwake_plot::text;

use super::data::FigureData;
use super::line_style::{DASHES, LineStyle, MOST, OUTSIDE};
use crate::measure::unique;
use crate::plan::Run;

/// Returns the entry of a legend with a symbol.
pub fn symbol_entry(name: &str, style: LineStyle) -> Entry {
    Entry::symbol(text::literal(name), style.colour, style.sign, Fill::Solid)
}

/// Assignment of line styles to runs. Levels have their style of [`LineStyle::of_level`] in all
/// figures of a report.
pub enum LineStyles {
    /// One style per model; none for many models.
    Models(Vec<(String, LineStyle)>),
    /// One style per level of an axis.
    Axis(String, Vec<String>),
    /// One colour per level of the first axis, one dash pattern and symbol per level of the second.
    Axes([(String, Vec<String>); 2]),
}

impl LineStyles {
    /// Assigns by model if there are few models or no axes, else by two axes or one axis with few
    /// levels.
    pub fn of(data: &FigureData) -> LineStyles {
        let axes: Vec<(String, Vec<String>)> =
            axes(data).into_iter().map(|(axis, _)| (axis.clone(), data.declared(&axis))).collect();
        let names = unique(data.plan.runs.iter().map(|run| &run.model));
        let level = |name: &String| match axes.as_slice() {
            [(axis, levels)] => {
                let level = data.run(name)?.levels.get(axis)?;
                levels.iter().position(|l| l == level)
            }
            _ => None,
        };
        let models = names.iter().map(|name| (name.clone(), level(name))).collect();
        LineStyles::choose(models, &axes)
    }

    /// Chooses the styles of models, each with the index of its level on the only axis.
    fn choose(models: Vec<(String, Option<usize>)>, axes: &[(String, Vec<String>)]) -> LineStyles {
        let few = |count: usize, most: usize| count <= most;
        if !few(models.len(), SERIES_COLOURS) {
            let pairs = axes.iter().flat_map(|a| axes.iter().map(move |b| [a, b]));
            let fits = |[a, b]: &[&(String, Vec<String>); 2]| {
                a.0 != b.0 && few(a.1.len(), SERIES_COLOURS) && few(b.1.len(), DASHES.len())
            };
            if let Some(pair) = pairs.into_iter().find(fits) {
                return LineStyles::Axes(pair.map(Clone::clone));
            }
            if let Some((axis, levels)) = axes.iter().find(|(_, levels)| few(levels.len(), MOST)) {
                return LineStyles::Axis(axis.clone(), levels.clone());
            }
        }
        if !few(models.len(), MOST) {
            return LineStyles::Models(Vec::new());
        }
        let count = axes.first().map_or(0, |(_, levels)| levels.len());
        let of_level = |n: usize| LineStyle::of_level(n, count);
        let used: Vec<&str> =
            models.iter().filter_map(|(_, level)| Some(of_level((*level)?).colour)).collect();
        let unused = |style: &LineStyle| style.dash.is_some() || !used.contains(&style.colour);
        let mut free = (0..).map(LineStyle::nth).filter(unused);
        let style = |(name, level): (String, Option<usize>)| {
            let style = level.map(of_level).or_else(|| free.next());
            (name, style.unwrap_or(OUTSIDE))
        };
        LineStyles::Models(models.into_iter().map(style).collect())
    }

    /// Returns the style of a run; black for a model outside the axes and for one of many models.
    pub fn style(&self, run: &Run) -> LineStyle {
        let level = |(axis, levels): (&String, &Vec<String>)| {
            let level = run.levels.get(axis)?;
            Some(LineStyle::of_level(levels.iter().position(|l| l == level)?, levels.len()))
        };
        let index = |(axis, levels): &(String, Vec<String>)| {
            let level = run.levels.get(axis)?;
            levels.iter().position(|l| l == level)
        };
        let style = match self {
            LineStyles::Models(models) => {
                models.iter().find(|(name, _)| *name == run.model).map(|(_, style)| *style)
            }
            LineStyles::Axis(axis, levels) => level((axis, levels)),
            LineStyles::Axes([first, second]) => {
                level((&first.0, &first.1)).map(|style| match index(second) {
                    Some(n) => LineStyle { colour: style.colour, ..LineStyle::of_second(n) },
                    None => style,
                })
            }
        };
        style.unwrap_or(OUTSIDE)
    }

    /// Returns the names and styles of the legend that at least one of the `drawn` runs has.
    fn entries(&self, drawn: &[&Run]) -> Vec<(String, LineStyle)> {
        let of_axis = |axis: &str, levels: &[String], style: &dyn Fn(usize) -> LineStyle| {
            let has = |(_, level): &(usize, &String)| {
                drawn.iter().any(|run| run.levels.get(axis) == Some(*level))
            };
            let shown = levels.iter().enumerate().filter(has);
            shown.map(|(n, level)| (format!("{axis} {level}"), style(n))).collect::<Vec<_>>()
        };
        match self {
            LineStyles::Models(models) => {
                let has =
                    |(name, _): &&(String, LineStyle)| drawn.iter().any(|run| run.model == *name);
                models.iter().filter(has).cloned().collect()
            }
            LineStyles::Axis(axis, levels) => {
                of_axis(axis, levels, &|n| LineStyle::of_level(n, levels.len()))
            }
            LineStyles::Axes([(first, colours), (second, signs)]) => {
                let colour = |n| LineStyle {
                    colour: LineStyle::of_level(n, colours.len()).colour,
                    ..LineStyle::of_second(0)
                };
                let mut out = of_axis(first, colours, &colour);
                out.extend(of_axis(second, signs, &LineStyle::of_second));
                out
            }
        }
    }

    /// Returns the entries of a legend of the `drawn` runs, with symbols or else lines.
    pub fn legend_entries(&self, drawn: &[&Run], symbols: bool) -> Vec<Entry> {
        let entry = |(name, style): (String, LineStyle)| match symbols {
            true => symbol_entry(&name, style),
            false => Entry::line(text::literal(&name), style.colour, style.dash),
        };
        self.entries(drawn).into_iter().map(entry).collect()
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

    fn models(count: usize) -> Vec<(String, Option<usize>)> {
        names(count).into_iter().map(|name| (name, None)).collect()
    }

    /// Runs of 24 models that have every level of every axis.
    fn runs(axes: &[(String, Vec<String>)]) -> Vec<Run> {
        let run = |(i, name): (usize, String)| {
            let levels = axes.iter().map(|(axis, all)| (axis.clone(), all[i % all.len()].clone()));
            let levels: std::collections::BTreeMap<String, String> = levels.collect();
            serde_json::from_value(serde_json::json!({
                "name": name, "model": name, "member": 0, "levels": levels, "factors": {},
                "base": "case.toml", "set": [], "id": "0", "case_sha256": "0", "ending": "",
                "end_s": 1.0, "memory_bytes": 0, "wall_s": 0.0,
            }))
            .unwrap()
        };
        names(24).into_iter().enumerate().map(run).collect()
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
            let styles = LineStyles::choose(models(24), &axes);
            let runs = runs(&axes);
            let drawn: Vec<&Run> = runs.iter().collect();
            let entries = styles.entries(&drawn);
            assert!(!entries.is_empty());
            let lines: Vec<_> = entries.iter().map(|(_, s)| (s.colour, s.dash)).collect();
            let symbols: Vec<_> = entries.iter().map(|(_, s)| (s.colour, s.sign)).collect();
            assert!(distinct(&lines) && distinct(&symbols), "{axes:?}");
        }
        let many = LineStyles::choose(models(25), &[]);
        assert!(matches!(many, LineStyles::Models(m) if m.is_empty()), "would be ambiguous");
        let swapped = LineStyles::choose(models(24), &[of(4), of(6)]);
        assert!(matches!(swapped, LineStyles::Axes([(first, _), _]) if first == "a6"));
    }

    #[test]
    fn a_level_has_one_colour_and_symbol_in_all_figures() {
        let axes = [("weight".to_owned(), names(3)), ("gap".to_owned(), names(2))];
        let runs = runs(&axes);
        let styles = LineStyles::choose(models(24), &axes);
        for run in &runs {
            let [weight, gap] = [0, 1].map(|i| {
                let (axis, levels) = &axes[i];
                let n = levels.iter().position(|l| *l == run.levels[axis]).unwrap();
                LineStyle::of_level(n, levels.len())
            });
            let style = styles.style(run);
            assert_eq!((style.colour, style.sign), (weight.colour, gap.sign));
        }
        // One axis with few levels: its models have the style of their level, another one not.
        let three = vec![("a".into(), Some(1)), ("b".into(), Some(0)), ("single".into(), None)];
        let LineStyles::Models(found) = LineStyles::choose(three, &axes[1..]) else {
            panic!("few models have styles of their own");
        };
        let expected = [1, 0].map(|n| LineStyle::of_level(n, 2));
        assert_eq!([found[0].1, found[1].1], expected);
        assert!(expected.iter().all(|style| style.colour != found[2].1.colour));
        // Runs that are not drawn have no entry.
        let light: Vec<&Run> = runs.iter().filter(|r| r.levels["weight"] == "n1").collect();
        let entries: Vec<String> = styles.entries(&light).into_iter().map(|e| e.0).collect();
        assert_eq!(entries, ["weight n1", "gap n1", "gap n2"]);
    }

    #[test]
    fn levels_differ() {
        for count in 1..4 {
            // Vermilion and orange look alike.
            let colours: Vec<_> =
                (0..count).map(|n| LineStyle::of_level(n, count).colour).collect();
            assert!(distinct(&colours) && !colours.contains(&grainwake_plot::style::ORANGE));
        }
        for count in [4, 5, 24] {
            let of_level = |n| LineStyle::of_level(n, count);
            let styles: Vec<_> = (0..count).map(of_level).map(|s| (s.colour, s.dash)).collect();
            assert!(distinct(&styles), "{count}");
        }
    }
}

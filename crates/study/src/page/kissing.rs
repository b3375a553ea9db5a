//! Tables of the report page about the first contact of pairs.

use grainwake_report::html::{number_column, table, text_column};
use maud::{Markup, html};

use crate::analysis::kissing::{GridDifference, KissingResults, Level, LevelDifference};
use crate::format::{p_value, percent, significant};

/// Returns the shares of pairs that kiss, their differences, and their change with the grid.
pub(super) fn tables(results: &KissingResults) -> Markup {
    let gridded = results.levels.iter().any(|level| level.grid.is_some());
    html! {
        p {
            "Share of runs in which the pair comes into contact before it lands or the run \
             ends: mean over the models of the share of their members, with Clopper and \
             Pearson's 95 % interval for the number of models. The median time is that by which \
             half of the runs have kissed."
        }
        (levels(&results.levels, gridded))
        @if !results.differences.is_empty() { (differences(&results.differences, gridded)) }
        @if !results.grids.is_empty() { (grids(&results.grids)) }
    }
}

fn levels(levels: &[Level], gridded: bool) -> Markup {
    let mut columns = vec![text_column("level")];
    columns.extend(gridded.then(|| text_column("grid")));
    columns.extend(["models", "runs", "models: all, some, none kiss"].map(number_column));
    columns.extend(["share", "95 % interval", "median time"].map(number_column));
    let row = |l: &Level| {
        let [all, some, none] = l.all_some_none;
        let mut row = vec![html! { (l.level) }];
        row.extend(gridded.then(|| grid_cell(l.grid.as_ref())));
        row.extend([
            html! { (l.models) },
            html! { (l.runs) },
            html! { (all) ", " (some) ", " (none) },
            html! { (percent(l.share)) },
            interval(l.interval.map(percent)),
            optional(l.median_time),
        ]);
        row
    };
    table(&columns, levels.iter().map(row))
}

fn differences(differences: &[LevelDifference], gridded: bool) -> Markup {
    let mut columns = vec![text_column("first level less second")];
    columns.extend(gridded.then(|| text_column("grid")));
    columns.extend(["pairs", "share", "95 % interval", "p", "log-rank p"].map(number_column));
    columns.extend(["time", "95 % interval"].map(number_column));
    let row = |d: &LevelDifference| {
        let mut row = vec![html! { (d.first) " − " (d.second) }];
        row.extend(gridded.then(|| grid_cell(d.grid.as_ref())));
        row.extend([
            html! { (d.pairs) },
            html! { (percent(d.share)) },
            interval(d.interval.map(percent)),
            html! { (d.share_p.map_or("–".into(), p_value)) },
            html! { (d.log_rank_p.map_or("–".into(), p_value)) },
            optional(d.time_shift),
            d.time_shift_interval.map_or(html! { "–" }, |ends| interval(ends.map(significant))),
        ]);
        row
    };
    html! {
        p {
            "Differences over the models that are equal on all other axes. The p value of the \
             share is that of exchanging the levels within the models. The log-rank test of \
             the times is stratified by these axes and includes pairs without contact; its p value \
             counts the members of a model as one. The difference of the times is the \
             Hodges-Lehmann shift of the median times of models that kiss at both levels."
        }
        (table(&columns, differences.iter().map(row)))
    }
}

fn grids(grids: &[GridDifference]) -> Markup {
    let mut columns = vec![text_column("coarse grid less fine"), text_column("level")];
    columns.extend(["models", "share", "95 % interval"].map(number_column));
    columns.extend(["same outcome", "time, relative"].map(number_column));
    let row = |g: &GridDifference| {
        vec![
            html! { (g.coarse) " − " (g.fine) },
            html! { (g.level.as_deref().unwrap_or("all")) },
            html! { (g.models) },
            html! { (percent(g.share)) },
            interval(g.interval.map(percent)),
            html! { (percent(g.agreement)) },
            html! { (g.time.map_or("–".into(), percent)) },
        ]
    };
    html! {
        p {
            "Change with the grid, over the models and members that both grids have. Same outcome: \
             share of models whose members mostly kiss on both grids, or mostly do not. Time: \
             median of the absolute differences of the median times."
        }
        (table(&columns, grids.iter().map(row)))
    }
}

fn grid_cell(grid: Option<&String>) -> Markup {
    html! { (grid.map_or("–", String::as_str)) }
}

fn interval([low, high]: [String; 2]) -> Markup {
    html! { (low) " to " (high) }
}

fn optional(value: Option<f64>) -> Markup {
    html! { (value.map_or("–".into(), significant)) }
}

//! Who kisses: shares, differences between levels and change with the grid, and their report.

use std::collections::BTreeMap;

use grainwake_study::kissing::{KissingResults, kissing};
use grainwake_study::{Analysis, Kissing, PairMeasures, RunRecord, StateKind};

/// Member of a model that kisses at a time, or lands at 40 without a kiss.
fn record(levels: [(&str, &str); 3], member: usize, kiss: Option<f64>) -> RunRecord {
    let levels: BTreeMap<String, String> =
        levels.map(|(axis, level)| (axis.to_owned(), level.to_owned())).into();
    let model = levels.values().cloned().collect::<Vec<_>>().join("-");
    RunRecord {
        name: format!("{model}-m{member}"),
        model,
        member,
        levels: levels.into_iter().collect(),
        state: StateKind::Finished,
        pair: Some(PairMeasures {
            kiss_time: kiss,
            landing_time: Some(40.0),
            ..PairMeasures::default()
        }),
        ..RunRecord::default()
    }
}

/// Eight grains in two orientations on two grids, four members each: "down" always kisses, at
/// 30 + n on the fine grid and a tenth later on the coarse one; of "broad" members 0 to 2 kiss at
/// 15 + n on the fine grid, and no member on the coarse one.
fn records() -> Vec<RunRecord> {
    let mut out = Vec::new();
    for n in 0..8 {
        let grain = format!("g{n}");
        for (grid, stretch) in [("c08", 1.1), ("c16", 1.0)] {
            for member in 0..4 {
                let time = f64::from(n);
                let at = |orientation| [("grain", &*grain), ("o", orientation), ("cells", grid)];
                let broad = (member < 3 && grid == "c16").then_some(15.0 + time);
                let down = Some(stretch * (30.0 + 0.1 * time));
                out.push(record(at("down"), member, down));
                out.push(record(at("broad"), member, broad));
            }
        }
    }
    out
}

fn evaluate(records: &[RunRecord], grid: Option<&str>) -> KissingResults {
    let request = Kissing { by: "o".into(), grid: grid.map(str::to_owned) };
    let analysis = Analysis { kissing: Some(request), ..Analysis::default() };
    kissing(&analysis, records).unwrap()
}

#[test]
fn shares_count_models_alike_and_their_interval_holds_the_members() {
    let found = evaluate(&records(), Some("cells"));
    let level = |name: &str, grid: &str| {
        let here = |l: &&grainwake_study::kissing::Level| {
            l.level == name && l.grid.as_deref() == Some(grid)
        };
        found.levels.iter().find(here).unwrap()
    };
    let down = level("down", "c16");
    assert_eq!((down.models, down.runs, down.all_some_none), (8, 32, [8, 0, 0]));
    // Eight models that all kiss: the exact binomial interval, 0.025^(1/8) to 1.
    assert_eq!((down.share, down.interval[1]), (1.0, 1.0));
    assert!((down.interval[0] - 0.6306).abs() < 1e-4, "{:?}", down.interval);
    let broad = level("broad", "c16");
    assert_eq!((broad.share, broad.all_some_none), (0.75, [0, 8, 0]));
    // Eight models with a share of three quarters: Clopper and Pearson for 6 of 8.
    let [low, high] = broad.interval;
    assert!((low - 0.3491).abs() < 1e-4 && (high - 0.9681).abs() < 1e-4, "{low} {high}");
    assert_eq!(level("broad", "c08").all_some_none, [0, 0, 8]);
    assert_eq!(level("broad", "c08").median_time, None);
    // A model with more members weighs no more than others.
    let mut uneven = records();
    uneven.extend((4..40).map(|member| {
        record([("grain", "g0"), ("o", "broad"), ("cells", "c16")], member, Some(15.0))
    }));
    let found = evaluate(&uneven, Some("cells"));
    let broad = found.levels.iter().find(|l| l.level == "broad" && l.share > 0.0).unwrap();
    assert!((broad.share - (7.0 * 0.75 + 39.0 / 40.0) / 8.0).abs() < 1e-12, "{}", broad.share);
}

#[test]
fn levels_are_compared_within_grains() {
    let found = evaluate(&records(), Some("cells"));
    let on = |grid: &str| {
        let d = found.differences.iter().find(|d| d.grid.as_deref() == Some(grid)).unwrap();
        assert_eq!((&*d.first, &*d.second, d.pairs), ("down", "broad", 8));
        d
    };
    let fine = on("c16");
    assert_eq!(fine.share, 0.25);
    // Member 3 misses in all models: its number is drawn once for all, up to three times in four.
    assert_eq!(fine.interval, [0.0, 0.75]);
    assert_eq!(fine.share_p, Some(2.0 / 256.0));
    // Of the eight differences 30 + 0.1 n - (15 + n) the median of the Walsh averages is 11.85.
    assert!((fine.time_shift.unwrap() - 11.85).abs() < 1e-9, "{:?}", fine.time_shift);
    let [low, high] = fine.time_shift_interval.unwrap();
    assert!(low >= 8.7 && high <= 15.0, "{low} {high}");
    let coarse = on("c08");
    assert_eq!((coarse.share, coarse.time_shift), (1.0, None));
    // The first level is earlier in all eight pairs, with any number of members: 2 of 2^8.
    assert_eq!(coarse.log_rank_p, Some(2.0 / 256.0));
}

#[test]
fn grids_are_compared_model_by_model() {
    let found = evaluate(&records(), Some("cells"));
    let of = |level: Option<&str>| {
        let here = |g: &&grainwake_study::kissing::GridDifference| g.level.as_deref() == level;
        found.grids.iter().find(here).unwrap()
    };
    let all = of(None);
    assert_eq!((&*all.coarse, &*all.fine, all.models), ("c08", "c16", 16));
    assert_eq!((all.share, all.agreement), (-0.375, 0.5));
    let down = of(Some("down"));
    assert_eq!((down.share, down.agreement), (0.0, 1.0));
    assert!((down.time.unwrap() - 0.1).abs() < 1e-9);
    assert_eq!((of(Some("broad")).share, of(Some("broad")).agreement), (-0.75, 0.0));
    assert_eq!(of(Some("broad")).time, None);
    assert!(evaluate(&records(), None).grids.is_empty());
    // Two of four members kiss: the model does not.
    let mut half = records();
    half.retain(|r| r.member != 2 || r.levels["o"] == "down" || r.levels["cells"] == "c08");
    half.extend(half.clone().into_iter().filter(|r| r.member == 3).map(|mut r| {
        r.member = 2;
        r
    }));
    let found = evaluate(&half, Some("cells"));
    let broad = found.grids.iter().find(|g| g.level.as_deref() == Some("broad")).unwrap();
    assert_eq!((broad.share, broad.agreement), (-0.5, 1.0));
}

#[test]
fn equal_records_give_equal_intervals() {
    assert_eq!(evaluate(&records(), Some("cells")), evaluate(&records(), Some("cells")));
}

#[test]
fn grids_are_in_the_order_of_the_study_even_if_runs_are_missing() {
    let mut some = records();
    // The first model of the coarse grid has not finished.
    let first = some.iter().position(|r| r.levels["cells"] == "c08").unwrap();
    for record in &mut some {
        if record.model == records()[first].model {
            record.state = StateKind::Missing;
        }
    }
    let found = evaluate(&some, Some("cells"));
    assert!(!found.grids.is_empty());
    assert!(found.grids.iter().all(|g| g.coarse == "c08" && g.fine == "c16"), "{:?}", found.grids);
}

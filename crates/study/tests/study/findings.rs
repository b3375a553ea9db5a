//! Claims tested on synthetic tables with known results.

use std::collections::BTreeMap;

use grainwake_study::correlation::correlations;
use grainwake_study::factor_mean::{KISSING_SHARE, factor_means};
use grainwake_study::observation::observations;
use grainwake_study::verdict::evaluate;
use grainwake_study::{Analysis, Model, PairMeasures, RunRecord, StateKind};

/// 16 grains in four orientations and a sphere; `fill` returns the measured values.
fn rows(fill: impl Fn(f64, f64, usize) -> PairMeasures) -> Vec<RunRecord> {
    let mut out = Vec::new();
    for grain in 0..16 {
        let (s, r) = (0.45 + 0.15 * (grain / 4) as f64, 0.2 + 0.2 * (grain % 4) as f64);
        for o in 1..=4 {
            let levels = BTreeMap::from([
                ("grain".into(), format!("g{grain:02}")),
                ("orientation".into(), format!("o{o}")),
            ]);
            let factors = BTreeMap::from([("sphericity".into(), s), ("roundness".into(), r)]);
            out.push(row(&format!("g{grain:02}-o{o}"), levels, factors, fill(s, r, o)));
        }
    }
    out.push(row("sphere", BTreeMap::new(), BTreeMap::new(), fill(1.0, 1.0, 3)));
    out
}

fn row(
    name: &str,
    levels: BTreeMap<String, String>,
    factors: BTreeMap<String, f64>,
    pair: PairMeasures,
) -> RunRecord {
    RunRecord {
        name: name.into(),
        model: name.into(),
        levels: levels.into_iter().collect(),
        factors: factors.into_iter().collect(),
        state: StateKind::Finished,
        diameter_m: Some(2e-3),
        gravity_m_per_s2: Some([0.0, 0.0, -9.81]),
        pair: Some(pair),
        ..RunRecord::default()
    }
}

/// Reproducible noise.
fn noise(s: f64, r: f64, o: usize) -> f64 {
    (1e3 * s + 3.7e3 * r + 17.0 * o as f64).sin()
}

fn kiss(time: f64) -> PairMeasures {
    PairMeasures { kiss_time: Some(time), landing_time: Some(60.0), ..PairMeasures::default() }
}

/// Kissing times as in the paper: order 1 > 2 = 4 > 3, with an effect of shape in 1 only.
fn as_in_the_paper(s: f64, r: f64, o: usize) -> PairMeasures {
    let base = [0.0, 20.0 - 6.0 * s - 2.0 * r, 14.0, 10.0, 14.0][o];
    kiss(base + 0.05 * noise(s, r, o))
}

fn models(rows: &[RunRecord]) -> Vec<Model> {
    let model = |row: &RunRecord| Model {
        name: row.model.clone(),
        base: "case.toml".into(),
        settings: Vec::new(),
        levels: row.levels.clone(),
        factors: row.factors.clone(),
    };
    rows.iter().map(model).collect()
}

fn verdict(rows: &[RunRecord], claim: &str) -> (String, String) {
    let text = format!("[[claim]]\nsays = \"a claim\"\n{claim}\n");
    let analysis = Analysis::parse("analysis.toml", &text, &models(rows)).unwrap();
    let found = evaluate(&analysis, rows).remove(0);
    (found.verdict.to_string(), found.says)
}

const ORDER: &str = "quantity = \"kiss_time\"\ntest.order = { axis = \"orientation\", more = \"o1\", less = \"o3\" }";

/// Claim of a trend of the kissing time with a factor in an orientation.
fn trend(factor: &str, sign: &str, o: &str) -> String {
    format!(
        "quantity = \"kiss_time\"\ntest.trend = {{ with = \"{factor}\", sign = \"{sign}\" }}\nwhere = {{ orientation = \"{o}\" }}"
    )
}

#[test]
fn orders_hold_are_contradicted_or_stay_open() {
    let paper = rows(as_in_the_paper);
    let (found, says) = verdict(&paper, ORDER);
    assert_eq!(found, "holds");
    assert!(says.contains("for 16 of 16 pairs of models") && says.contains("p < 0.0001"), "{says}");
    let reversed =
        ORDER.replace("\"o1\"", "\"x\"").replace("\"o3\"", "\"o1\"").replace("\"x\"", "\"o3\"");
    assert_eq!(verdict(&paper, &reversed).0, "contradicted");
    let chance = rows(|s, r, o| kiss(10.0 + noise(s, r, o)));
    assert_eq!(verdict(&chance, ORDER).0, "open");
    let equal = "quantity = \"kiss_time\"\ntest.equal = { axis = \"orientation\", values = [\"o2\", \"o4\"], within = 0.05 }";
    assert_eq!(verdict(&paper, equal).0, "holds");
    assert_eq!(verdict(&paper, &equal.replace("\"o4\"", "\"o3\"")).0, "contradicted");
    let few: Vec<RunRecord> = paper
        .iter()
        .filter(|r| r.levels.get("grain").is_none_or(|g| g == "g03"))
        .cloned()
        .collect();
    let (found, says) = verdict(&few, ORDER);
    assert!(found == "open" && says.contains("too few for a test"), "{says}");
}

#[test]
fn trends_and_ranges_follow_the_factors() {
    let paper = rows(as_in_the_paper);
    assert_eq!(verdict(&paper, &trend("sphericity", "falls", "o1")).0, "holds");
    assert_eq!(verdict(&paper, &trend("sphericity", "rises", "o1")).0, "contradicted");
    assert_eq!(verdict(&paper, &trend("sphericity", "none", "o1")).0, "contradicted");
    assert_eq!(verdict(&paper, &trend("sphericity", "falls", "o3")).0, "open");
    assert_eq!(
        verdict(&paper, &trend("sphericity", "none", "o3")).0,
        "open",
        "no trend seen is no proof of none"
    );
    let low = trend("sphericity", "falls", "o1")
        .replace("orientation = \"o1\"", "orientation = \"o1\", sphericity = { at_most = 0.7 }");
    let (found, says) = verdict(&paper, &low);
    assert!(found == "holds" && says.contains("n = 8"), "{found} {says}");
    let range = "quantity = \"kiss_time\"\ntest.range = { over = \"orientation\", with = \"sphericity\", sign = \"falls\" }";
    assert_eq!(verdict(&paper, range).0, "holds");
    let spread = "quantity = \"kiss_time\"\ntest.spread = { axis = \"orientation\", more = \"o1\", less = \"o3\" }";
    assert_eq!(verdict(&paper, spread).0, "holds");
    let near = "quantity = \"kiss_time\"\ntest.near = { model = \"sphere\", within = 0.05 }\nwhere = { orientation = \"o3\" }";
    assert_eq!(verdict(&paper, near).0, "holds");
    // A pattern finds the same reference.
    assert_eq!(verdict(&paper, &near.replace("\"sphere\"", "\"sph*\"")), verdict(&paper, near));
    assert_eq!(verdict(&paper, &near.replace("\"o3\"", "\"o1\"")).0, "contradicted");
}

#[test]
fn events_after_the_landing_are_right_censored() {
    let late = rows(|s, r, o| {
        let mut m = as_in_the_paper(s, r, o);
        if o == 1 && s < 0.5 {
            m.kiss_time = None;
            m.landing_time = Some(40.0);
        }
        m
    });
    let (found, says) = verdict(&late, ORDER);
    assert!(
        found == "holds"
            && says.contains("for 16 of 16")
            && says
                .contains("4 without the event before the landing or the end, which count as last"),
        "{says}"
    );
    let (found, says) = verdict(&late, &format!("observed = true\n{ORDER}"));
    assert!(
        found == "holds" && says.contains("for 12 of 12") && says.contains("are left out"),
        "{says}"
    );
    // An early landing without a kiss must not rank as an early kiss.
    let early = rows(|s, r, o| {
        let mut m = as_in_the_paper(s, r, o);
        if o == 1 && s < 0.5 {
            m.kiss_time = None;
            m.landing_time = Some(0.1);
        }
        m
    });
    let falls = trend("sphericity", "falls", "o1");
    let (found, says) = verdict(&early, &falls);
    assert!(found == "holds" && says.contains("4 without the event, ranked last"), "{says}");
    let (_, says) = verdict(&early, &format!("observed = true\n{falls}"));
    assert!(says.contains("n = 12"), "{says}");
    let range = "observed = true\nquantity = \"kiss_time\"\ntest.range = { over = \"orientation\", with = \"sphericity\", sign = \"falls\" }";
    let (_, says) = verdict(&early, range);
    assert!(says.contains("n = 12"), "ranges with a gap do not count: {says}");
    let parts = rows(|s, r, o| PairMeasures {
        contact_stage: Some(5.0 * r),
        parted: Some(r < 0.7),
        ..as_in_the_paper(s, r, o)
    });
    let bounds = observations(&parts, "contact_stage", &BTreeMap::new())
        .iter()
        .filter(|s| s.censored)
        .count();
    assert_eq!(bounds, 16 + 1, "the roundest column and the sphere have not parted");
    let mut unfinished = parts.clone();
    unfinished[0].state = StateKind::Unfinished;
    assert_eq!(observations(&unfinished, "kiss_time", &BTreeMap::new()).len(), 64);
}

#[test]
fn members_count_as_one_model() {
    let mut all = rows(as_in_the_paper);
    let first = all[0].clone();
    let time = first.pair.as_ref().unwrap().kiss_time.unwrap();
    for (member, shift) in [(1, 0.4), (2, -0.2)] {
        let mut row = first.clone();
        (row.member, row.name) = (member, format!("{}-m{member}", row.name));
        row.pair = Some(kiss(time + shift));
        all.push(row);
    }
    let found = observations(&all, "kiss_time", &BTreeMap::new());
    assert_eq!(found.len(), 65);
    assert_eq!((found[0].value, found[0].range), (time, (time - 0.2, time + 0.4)));
    // A fourth member that lands early counts last: the median is between the later two.
    let mut missed = all[66].clone();
    missed.member = 3;
    missed.pair = Some(PairMeasures { landing_time: Some(1.0), ..PairMeasures::default() });
    all.push(missed.clone());
    let found = observations(&all, "kiss_time", &BTreeMap::new());
    assert!((found[0].value - (time + 0.2)).abs() < 1e-12 && !found[0].censored);
    // With two of four members without contact the model misses, and has no time in contact.
    all[65].pair = missed.pair;
    assert!(observations(&all, "kiss_time", &BTreeMap::new())[0].censored);
    for row in &mut all {
        if let Some(pair) = row.pair.as_mut().filter(|pair| pair.kiss_time.is_some()) {
            (pair.contact_stage, pair.parted) = (Some(1.0), Some(true));
        }
    }
    assert_eq!(observations(&all, "contact_stage", &BTreeMap::new()).len(), 64);
}

#[test]
fn orders_of_times_are_tested_by_rates_and_misses_are_last() {
    // Orientation 1 misses for half of the grains, and kisses sooner for the others.
    let split = |landing: f64| {
        rows(|_, r, o| match o {
            1 if r < 0.5 => PairMeasures { landing_time: Some(landing), ..PairMeasures::default() },
            1 => kiss(9.0 + 0.1 * r),
            _ => kiss(10.0 + 0.1 * r),
        })
    };
    // The excess of contacts is a half in either direction for 8 of 16 grains each.
    let (found, says) = verdict(&split(50.0), ORDER);
    assert!(found == "open" && says.contains("p = 1.0000"), "{says}");
    assert!(says.contains("−1.00 to ∞"), "{says}");
    // A pair that lands before the other one kisses is compared with nothing: 2 of 2^8. It is no
    // early contact either.
    let (found, says) = verdict(&split(5.0), ORDER);
    assert!(found == "open" && says.contains("p = 0.0078"), "{says}");
    assert!(says.contains("−1.00 to ∞"), "{says}");
    let split = split(5.0);
    let (found, says) = verdict(&split, &format!("observed = true\n{ORDER}"));
    assert!(found == "contradicted" && says.contains("for 0 of 8"), "{says}");
}

#[test]
fn pairs_that_miss_at_both_levels_show_no_equality() {
    let equal = "quantity = \"kiss_time\"\ntest.equal = { axis = \"orientation\", values = [\"o2\", \"o4\"], within = 0.05 }";
    let kissing = |number: usize| {
        let mut all = rows(as_in_the_paper);
        let missing = all.iter_mut().filter(|row| row.levels.contains_key("grain"));
        for row in missing.skip(4 * number) {
            row.pair = Some(PairMeasures { landing_time: Some(60.0), ..PairMeasures::default() });
        }
        all
    };
    let found = |number: usize, claim: &str| {
        let text = format!(
            "[[claim]]\nsays = \"a\"\n{claim}\n[verdicts]\nnegligible = {{ kiss_time = 1 }}\n"
        );
        let all = kissing(number);
        let analysis = Analysis::parse("analysis.toml", &text, &models(&all)).unwrap();
        evaluate(&analysis, &all).remove(0)
    };
    for (number, verdict) in [(0, "open"), (5, "open"), (6, "holds"), (16, "holds")] {
        let f = found(number, equal);
        assert_eq!((f.n, f.verdict.to_string().as_str()), (number, verdict), "{}", f.says);
        assert_eq!(f.says.contains("without the event on both sides"), number < 16, "{}", f.says);
    }
    // An order between levels of which none kisses is not contradicted by differences of zero.
    assert_eq!(found(0, ORDER).verdict.to_string(), "open");
    let near = "quantity = \"kiss_time\"\ntest.near = { model = \"g15-o3\", within = 0.05 }\nwhere = { orientation = \"o3\" }";
    let f = found(0, near);
    assert_eq!((f.n, f.verdict.to_string().as_str()), (0, "open"), "{}", f.says);
}

#[test]
fn claims_of_equality_are_not_in_the_family() {
    let chance = rows(|s, r, o| kiss(10.0 + noise(s, r, o)));
    let equal = "quantity = \"kiss_time\"\ntest.equal = { axis = \"orientation\", values = [\"o2\", \"o4\"], within = 0.05 }";
    let one = format!("[[claim]]\nsays = \"a\"\n{ORDER}\n");
    let adjusted = |text: &str| {
        let text = format!("{text}[verdicts]\nfalse_discovery_rate = 0.05\n");
        let analysis = Analysis::parse("analysis.toml", &text, &models(&chance)).unwrap();
        evaluate(&analysis, &chance).iter().map(|f| f.adjusted_p).collect::<Vec<_>>()
    };
    let alone = adjusted(&one);
    let both = adjusted(&format!("{one}[[claim]]\nsays = \"b\"\n{equal}\n"));
    assert!(alone[0].is_some() && both == [alone[0], None], "{both:?}");
}

#[test]
fn a_claim_of_equality_has_two_levels() {
    let paper = rows(as_in_the_paper);
    let parsed = |levels: &str| {
        let text = format!(
            "[[claim]]\nsays = \"a\"\nquantity = \"kiss_time\"\n\
             test.equal = {{ axis = \"orientation\", values = [{levels}], within = 0.05 }}\n"
        );
        Analysis::parse("analysis.toml", &text, &models(&paper))
    };
    assert!(parsed("\"o2\", \"o4\"").is_ok());
    let refused = format!("{:?}", parsed("\"o2\", \"o4\", \"o2\"").unwrap_err());
    assert!(refused.contains("found 3 values, expected a list of 2 values"), "{refused}");
}

#[test]
fn correlations_are_listed_by_level() {
    let paper = rows(as_in_the_paper);
    let text = "[correlations]\nquantities = [\"kiss_time\"]\nfactors = [\"sphericity\", \"roundness\"]\nby = \"orientation\"\n";
    let analysis = Analysis::parse("analysis.toml", text, &models(&paper)).unwrap();
    let found = correlations(&analysis, &paper);
    assert_eq!(found.len(), 8);
    assert!(found.iter().all(|c| c.n == 16));
    let first = &found[0];
    assert_eq!((first.factor.as_str(), first.level.as_str()), ("sphericity", "o1"));
    assert!(
        first.rho.unwrap() < -0.8 && first.interval.unwrap()[1] < -0.5 && first.p.unwrap() < 1e-3
    );
}

#[test]
fn means_are_of_the_models_with_a_value_of_the_factor() {
    let paper = rows(as_in_the_paper);
    let text = "[correlations]\nquantities = [\"kiss_time\"]\nfactors = [\"sphericity\"]\n\
                by = \"orientation\"\n[kissing]\nby = \"orientation\"\n";
    let analysis = Analysis::parse("analysis.toml", text, &models(&paper)).unwrap();
    let found = factor_means(&analysis, &paper);
    // Two quantities, four orientations and four sphericities.
    assert_eq!(found.len(), 32);
    let of = |quantity: &str| {
        found.iter().find(|m| m.quantity == quantity && m.level == "o1").unwrap().clone()
    };
    let (share, time) = (of(KISSING_SHARE), of("kiss_time"));
    assert_eq!((share.at, share.models, share.mean), (0.45, 4, 1.0));
    let [low, high] = share.interval.unwrap();
    assert!((low - 0.3976).abs() < 1e-4 && high == 1.0, "{low}, {high}");
    let here = |row: &&RunRecord| {
        row.levels.get("orientation").is_some_and(|l| l == "o1")
            && row.factors["sphericity"] == 0.45
    };
    let times: Vec<f64> =
        paper.iter().filter(here).map(|row| row.get("kiss_time").unwrap()).collect();
    assert_eq!(time.mean, times.iter().sum::<f64>() / 4.0);
    let [low, high] = time.interval.unwrap();
    assert!(low < time.mean && time.mean < high, "{low} {high}");
}

#[test]
fn a_factor_with_many_values_has_four_groups_and_censored_times_count_in_the_share_only() {
    let mut paper = rows(as_in_the_paper);
    for (i, row) in paper.iter_mut().enumerate() {
        row.factors.insert("sphericity".into(), i as f64);
    }
    // One of the 16 grains in orientation 1 lands before it kisses.
    let missed = paper.iter_mut().find(|row| row.levels["orientation"] == "o1").unwrap();
    let pair = missed.pair.as_mut().unwrap();
    (pair.kiss_time, pair.landing_time) = (None, Some(90.0));
    let text = "[correlations]\nquantities = [\"kiss_time\"]\nfactors = [\"sphericity\"]\n\
                by = \"orientation\"\n[kissing]\nby = \"orientation\"\n";
    let analysis = Analysis::parse("analysis.toml", text, &models(&paper)).unwrap();
    let found = factor_means(&analysis, &paper);
    let of = |quantity: &str| -> Vec<(usize, f64)> {
        let here = found.iter().filter(|m| m.quantity == quantity && m.level == "o1");
        here.map(|m| (m.models, m.mean)).collect()
    };
    let share: Vec<(usize, f64)> = of(KISSING_SHARE);
    assert_eq!(share, [(4, 0.75), (4, 1.0), (4, 1.0), (4, 1.0)]);
    let models: Vec<usize> = of("kiss_time").iter().map(|m| m.0).collect();
    assert_eq!(models, [3, 4, 4, 4]);
}

#[test]
fn wrong_names_are_located() {
    let paper = rows(as_in_the_paper);
    let problem =
        |text: &str| Analysis::parse("analysis.toml", text, &models(&paper)).unwrap_err().remove(0);
    let p =
        problem(&format!("[[claim]]\nsays = \"a\"\n{}", ORDER.replace("kiss_time", "kis_time")));
    assert!(
        p.to_string().contains("no quantity \"kis_time\"")
            && p.help.as_deref().unwrap().contains("\"kiss_time\""),
        "{p}"
    );
    assert_eq!(p.place().unwrap().1, 3);
    let p = problem(&format!("[[claim]]\nsays = \"a\"\n{}", ORDER.replace("\"o3\"", "\"o5\"")));
    assert!(p.to_string().contains("value of \"orientation\" called \"o5\""), "{p}");
    let p = problem(&format!(
        "[[claim]]\nsays = \"a\"\n{ORDER}\nwhere = {{ sphericty = {{ at_most = 1 }} }}"
    ));
    assert!(p.help.as_deref().unwrap().contains("\"sphericity\""), "{p}");
    let p = problem("[figures]\nstories = [\"g99-o1\"]\n");
    assert!(p.to_string().contains("no model \"g99-o1\""), "{p}");
    let p = problem("[figures]\nstory = 1\n");
    assert!(p.to_string().contains("unknown key `story`"), "{p}");
}

#[test]
fn conditions_and_tests_that_cannot_hold_are_refused() {
    let paper = rows(as_in_the_paper);
    let first = |text: String| {
        let problem =
            Analysis::parse("analysis.toml", &text, &models(&paper)).unwrap_err().remove(0);
        assert!(problem.place().is_some(), "{problem:?}");
        problem.to_string()
    };
    let when = |condition: &str| {
        first(format!("[[claim]]\nsays = \"a\"\n{ORDER}\nwhere = {{ {condition} }}"))
    };
    assert!(when("sphericity = { atleast = 0.7 }").contains("at_least = ..."));
    assert!(when("sphericity = { at_least = 0.9, at_most = 0.5 }").contains("no value"));
    assert!(when("sphericity = {}").contains("no end"));
    assert!(when("orientation = []").contains("without values"));
    let claim = |test: &str| {
        first(format!("[[claim]]\nsays = \"a\"\nquantity = \"kiss_time\"\ntest.{test}"))
    };
    let order = "order = { axis = \"orientation\", more = \"o1\", less = \"o1\" }";
    assert!(claim(order).contains("compared with itself"));
    assert!(claim("near = { model = \"sphere\", within = -1 }").contains("positive number"));
    let same = "[kissing]\nby = \"orientation\"\ngrid = \"orientation\"";
    assert!(first(same.into()).contains("the same axis"));
}

#[test]
fn equal_values_of_zero_are_equal() {
    let none = rows(|_, _, _| PairMeasures { role_changes: Some(0.0), ..kiss(10.0) });
    let equal = "quantity = \"role_changes\"\ntest.equal = { axis = \"orientation\", values = [\"o2\", \"o4\"], within = 0.05 }";
    let (found, says) = verdict(&none, equal);
    assert!(found == "holds" && says.contains("difference 0.0 %"), "{found}: {says}");
    let near = "quantity = \"role_changes\"\ntest.near = { model = \"sphere\", within = 0.1 }";
    assert_eq!(verdict(&none, near).0, "holds");
    // No relative difference to zero.
    let some = rows(|_, r, o| PairMeasures {
        role_changes: Some(if o == 3 && r > 0.9 { 0.0 } else { 1.0 }),
        ..kiss(10.0)
    });
    let (found, says) = verdict(&some, near);
    assert!(found == "open" && !says.contains("NaN") && !says.contains("inf"), "{found}: {says}");
}

#[test]
fn a_reference_without_the_event_is_last() {
    let missed = || PairMeasures { landing_time: Some(60.0), ..PairMeasures::default() };
    let near = "quantity = \"kiss_time\"\ntest.near = { model = \"sphere\", within = 0.05 }";
    // Nothing kisses: no pair shows a difference or equality.
    let (found, says) = verdict(&rows(|_, _, _| missed()), near);
    assert!(found == "open" && says.contains("too few for a test"), "{found}: {says}");
    // All kiss but the reference.
    let mut all = rows(|_, _, _| kiss(60.0));
    let sphere = all.iter_mut().find(|row| row.model == "sphere").unwrap();
    sphere.pair = Some(missed());
    let (found, says) = verdict(&all, near);
    assert!(found == "contradicted" && says.contains("−∞"), "{found}: {says}");
}

#[test]
fn a_pair_that_leaves_the_box_is_no_longer_observed() {
    let mut all = rows(|_, _, _| PairMeasures { left_time: Some(7.0), ..PairMeasures::default() });
    all.iter_mut().for_each(|row| row.end_time_s = Some(0.5));
    let found = observations(&all, "kiss_time", &BTreeMap::new());
    assert!(found.iter().all(|o| o.censored && o.value == 7.0));
}

#[test]
fn runs_that_end_in_the_water_are_censored_at_their_end() {
    let mut rows = rows(|_, _, _| PairMeasures::default());
    for row in &mut rows {
        row.end_time_s = Some(0.5);
    }
    let found = observations(&rows, "kiss_time", &BTreeMap::new());
    let end = 0.5 / (2e-3_f64 / 9.81).sqrt();
    assert_eq!(found.len(), 65);
    assert!(found.iter().all(|o| o.censored && (o.value / end - 1.0).abs() < 1e-12));
}

#[test]
fn stages_that_last_until_the_landing_are_lower_bounds() {
    let stay = |tumble: Option<f64>| PairMeasures {
        parted: Some(false),
        tumble_time: tumble,
        kissing_stage: Some(4.0),
        contact_stage: Some(9.0),
        ..kiss(10.0)
    };
    let rows = rows(|_, _, o| stay((o == 1).then_some(14.0)));
    let censored = |quantity: &str| {
        let found = observations(&rows, quantity, &BTreeMap::new());
        found.iter().filter(|o| o.censored).count()
    };
    assert_eq!(censored("contact_stage"), 65);
    assert_eq!(censored("kissing_stage"), 49, "the 16 that tumble are complete");
}

#[test]
fn claims_about_unconverged_quantities_are_never_contradicted() {
    let paper = rows(as_in_the_paper);
    let claim = trend("sphericity", "rises", "o1");
    assert_eq!(verdict(&paper, &claim).0, "contradicted");
    let resolution = |quantity: &str| {
        format!("\n[resolution]\nunconverged = [\"{quantity}\"]\nnote = \"why\"\n")
    };
    let (found, says) = verdict(&paper, &(claim.clone() + &resolution("kiss_time")));
    assert_eq!(found, "open");
    assert!(says.ends_with("not converged with the grid"), "{says}");
    let other = verdict(&paper, &(claim + &resolution("contact_stage")));
    assert_eq!(other.0, "contradicted");
}

/// Verdicts on the claims of an analysis file.
fn verdicts(rows: &[RunRecord], text: &str) -> Vec<(String, String)> {
    let analysis = Analysis::parse("analysis.toml", text, &models(rows)).unwrap();
    let found = evaluate(&analysis, rows).into_iter();
    found.map(|finding| (finding.verdict.to_string(), finding.says)).collect()
}

#[test]
fn a_false_discovery_rate_adjusts_for_the_number_of_claims() {
    // One weak trend among claims about noise.
    let effect = |s: f64, o: usize| if o == 1 { 3.2 * s } else { 0.0 };
    let weak = rows(|s, r, o| kiss(20.0 + effect(s, o) + noise(s, r, o)));
    let claim = |with: &str, o: usize| {
        format!("[[claim]]\nsays = \"a\"\n{}\n", trend(with, "rises", &format!("o{o}")))
    };
    let many: String = (1..=4).map(|o| claim("sphericity", o) + &claim("roundness", o)).collect();
    let alone = verdicts(&weak, &many);
    let adjusted = verdicts(&weak, &(many.clone() + "[verdicts]\nfalse_discovery_rate = 0.05\n"));
    let held = |all: &[(String, String)]| all.iter().filter(|(v, _)| v == "holds").count();
    assert!(held(&alone) > held(&adjusted), "{alone:#?} {adjusted:#?}");
    assert!(adjusted.iter().all(|(_, says)| says.contains("; adjusted p ")));
    assert!(alone.iter().all(|(_, says)| !says.contains("adjusted")));
}

#[test]
fn an_effect_that_does_not_matter_contradicts_a_direction() {
    // 0.1 longer in orientation 1, where 1.6 matters.
    let small = rows(|s, r, o| kiss(if o == 1 { 16.1 } else { 16.0 } + 0.01 * noise(s, r, o)));
    let claim = format!("[[claim]]\nsays = \"a\"\n{ORDER}\n");
    assert_eq!(verdicts(&small, &claim)[0].0, "holds");
    let opposite = claim.replace("more = \"o1\", less = \"o3\"", "more = \"o2\", less = \"o4\"");
    assert_eq!(verdicts(&small, &opposite)[0].0, "open");
    let rule = "[verdicts]\nnegligible = { kiss_time = 1.6, rank_correlation = 0.9 }\n";
    assert_eq!(verdicts(&small, &(opposite + rule))[0].0, "contradicted");
    // No trend is shown only by an interval of negligible correlations.
    let none = format!("[[claim]]\nsays = \"a\"\n{}\n", trend("roundness", "none", "o2"));
    assert_eq!(verdicts(&small, &none)[0].0, "open");
    assert_eq!(verdicts(&small, &(none + rule))[0].0, "holds");
}

#[test]
fn wrong_rules_of_verdicts_are_refused() {
    let paper = rows(as_in_the_paper);
    let problem =
        |text: &str| Analysis::parse("analysis.toml", text, &models(&paper)).unwrap_err().remove(0);
    let p = problem("[verdicts]\nfalse_discovery_rate = 5\n");
    assert!(p.to_string().contains("between 0 and 1"), "{p}");
    let p = problem("[verdicts]\nnegligible = { kiss_time = -1 }\n");
    assert!(p.to_string().contains("positive number"), "{p}");
    let p = problem("[verdicts]\nnegligible = { kis_time = 1 }\n");
    assert!(p.to_string().contains("no effect \"kis_time\""), "{p}");
    let p = problem("where = { orientation = \"o9\" }\n");
    assert!(p.to_string().contains("\"o9\""), "{p}");
}

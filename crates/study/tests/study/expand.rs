//! Expansion of study files, and messages about invalid ones.

use std::path::Path;

use crate::common::{folder, plan, problems};
use crate::files::{DRY, STUDY};
use grainwake_study::{Selection, Study};

fn names(study: &str) -> Vec<String> {
    let (_folder, path) = folder(study);
    plan(&path).unwrap().runs.into_iter().map(|r| r.name).collect()
}

#[test]
fn axes_multiply_and_models_follow() {
    let expected = ["light-smooth", "light-rough", "heavy-smooth", "heavy-rough", "alone"];
    assert_eq!(names(STUDY), expected);
    let (_folder, path) = folder(STUDY);
    let runs = plan(&path).unwrap().runs;
    let case = |i: usize| runs[i].case().unwrap();
    let heavy = case(3);
    assert_eq!(heavy.setup.grains.iter().map(|g| g.density).collect::<Vec<_>>(), [4000.0, 4000.0]);
    assert_eq!(heavy.plan.end, 0.05, "adjusted");
    assert_eq!(case(1).plan.end, 0.06, "not adjusted");
    assert_eq!(case(0).setup.grains[0].density, 2000.0);
    assert!(
        case(3).resolved.contains("friction = 0.6")
            && case(3).resolved.contains("wall_friction = 0.1")
    );
    assert_eq!(case(4).setup.grains[1].velocity.z, 0.0);
    assert_eq!(runs[3].factors["density"], 4000.0);
    assert_eq!(
        (runs[3].levels["weight"].as_str(), runs[3].levels["grip"].as_str()),
        ("heavy", "rough")
    );
    assert!(runs[4].levels.is_empty());
}

#[test]
fn overrides_apply_after_all_settings_of_the_study() {
    let unset = ["-time.end".to_owned(), "time.end=40 ms".to_owned()];
    let (_folder, path) = folder(STUDY);
    let runs = grainwake_study::Plan::resolve(&Study::read(&path).unwrap(), &unset).unwrap().runs;
    assert!(runs.iter().all(|run| run.end_s == 0.04));
    let unset = ["-time.step".to_owned(), "time.max_step=0.3 ms".to_owned()];
    let set = STUDY.replace("\"time.end\" = \"50 ms\"", "\"time.step\" = \"0.05 ms\"");
    let (_folder, path) = folder(&set);
    let runs = grainwake_study::Plan::resolve(&Study::read(&path).unwrap(), &unset).unwrap().runs;
    let heavy = runs[3].case().unwrap().resolved;
    assert!(heavy.contains("max_step = 0.0003") && !heavy.contains("\nstep = "), "{heavy}");
}

#[test]
fn runs_that_are_the_same_case_are_noted() {
    let (_folder, path) = folder(STUDY);
    let study = Study::read(&path).unwrap();
    let note = |sets: &[&str]| {
        let sets: Vec<String> = sets.iter().map(|s| (*s).to_string()).collect();
        grainwake_study::Plan::resolve(&study, &sets).unwrap().note_on_equal_runs()
    };
    assert_eq!(note(&[]), None);
    let equal = note(&["contact.friction=0.3", "contact.wall_friction=0.3"]).unwrap();
    assert!(equal.starts_with("light-rough is the same case as light-smooth, and so are 1 more"));
}

#[test]
fn a_model_may_replace_all_grains() {
    let text = STUDY.replace(
        "set = { \"grain.1.velocity\" = [0, 0, 0] }",
        "set.grain = [\n { shape = { kind = \"ellipsoid\", size = [\"3 mm\", \"2 mm\", \"1 mm\"] }, nodes = 300, density = 2500, position = [\"5 mm\", \"5 mm\", \"9 mm\"] },\n]",
    );
    let (_folder, path) = folder(&text);
    let runs = plan(&path).unwrap().runs;
    let case = runs[4].case().unwrap();
    assert_eq!(case.setup.grains.len(), 1);
    assert!((case.setup.grains[0].shape.equivalent_diameter() - 6e-9_f64.cbrt()).abs() < 1e-5);
}

#[test]
fn hashes_depend_on_everything_that_affects_the_results() {
    let ids = |study: &str, sets: &[&str]| {
        let (_folder, path) = folder(study);
        let sets: Vec<String> = sets.iter().map(|s| (*s).to_string()).collect();
        let runs =
            grainwake_study::Plan::resolve(&Study::read(&path).unwrap(), &sets).unwrap().runs;
        runs.into_iter().map(|r| r.id).collect::<Vec<_>>()
    };
    let first = ids(STUDY, &[]);
    let mut distinct = first.clone();
    distinct.sort();
    distinct.dedup();
    assert_eq!(distinct.len(), 5);
    assert_eq!(first, ids(STUDY, &["title=other", "run.threads=3", "output.checkpoint_steps=11"]));
    let later = ids(STUDY, &["time.end=0.07"]);
    let softer = ids(STUDY, &["contact.stiffness=100"]);
    assert!(first.iter().zip(&later).zip(&softer).all(|((a, b), c)| a != b && a != c));
}

#[test]
fn an_ensemble_offsets_all_but_the_first_member() {
    let text = format!(
        "{STUDY}\n[ensemble]\nmembers = 4\noffset = \"0.05 mm\"\nmodels = [\"light-*\"]\nseed = 7\n"
    );
    let (_folder, path) = folder(&text);
    let runs = plan(&path).unwrap().runs;
    let named: Vec<&str> = runs.iter().map(|r| r.name.as_str()).collect();
    assert_eq!(
        named[..5],
        ["light-smooth", "light-smooth-m1", "light-smooth-m2", "light-smooth-m3", "light-rough"]
    );
    assert_eq!(runs.len(), 2 * 4 + 3);
    let place = |i: usize| runs[i].case().unwrap().setup.grains[1].pose.position;
    let start = place(0);
    let offsets: Vec<_> = (1..4).map(|i| place(i) - start).collect();
    for offset in &offsets {
        assert!(
            offset.z.abs() < 1e-9
                && offset.length() > 1e-9
                && offset.length() <= 0.05e-3 * (1.0 + 1e-9),
            "{offset}"
        );
    }
    assert!(offsets[0].distance(offsets[1]) > 1e-7);
    assert_eq!(plan(&path).unwrap().runs, runs, "the same every time");
    // A grain with a given height keeps it.
    let first = text.replace("[ensemble]", "[ensemble]\ngrain = 0");
    let (_folder, path) = folder(&first);
    let runs = plan(&path).unwrap().runs;
    let moved = runs[1].case().unwrap().setup.grains[0].pose.position;
    assert!(moved.z == 5e-3 && moved.x != 5e-3);
}

#[test]
fn an_ensemble_turns_a_grain_and_pairs_the_members_of_all_models() {
    let ensemble = "[ensemble]\nmembers = 3\noffset = \"0.05 mm\"\n";
    let (_folder, path) = folder(&format!("{STUDY}\n{ensemble}turn = \"2 deg\"\n"));
    let runs = plan(&path).unwrap().runs;
    let pose = |name: &str| {
        let run = runs.iter().find(|run| run.name == name).unwrap();
        run.case().unwrap().setup.grains[1].pose
    };
    let largest = 3.0_f64.sqrt() * 2.0_f64.to_radians();
    for member in ["m1", "m2"] {
        let [light, heavy] = ["light", "heavy"].map(|weight| {
            let (start, moved) =
                (pose(&format!("{weight}-rough")), pose(&format!("{weight}-rough-{member}")));
            let turn = moved.orientation * start.orientation.inverse();
            (moved.position - start.position, turn)
        });
        let angle = light.1.to_axis_angle().1;
        assert!(angle > 1e-3 && angle <= largest * (1.0 + 1e-9), "{angle}");
        assert!(light.0.distance(heavy.0) < 1e-12 && light.1.angle_between(heavy.1) < 1e-6);
    }
    let turn = |a: &str, b: &str| pose(a).orientation.angle_between(pose(b).orientation);
    assert!(turn("light-rough-m1", "light-rough-m2") > 1e-3);
    let (message, help) = {
        let found = problems(&format!("{STUDY}\n{ensemble}turn = \"2 mm\"\n"));
        (found[0].to_string(), found[0].help.clone().unwrap_or_default())
    };
    assert!(message.contains("angle") && help.contains("2 deg"), "{message} {help}");
}

#[test]
fn an_ensemble_shifts_all_grains_by_a_part_of_a_cell() {
    let wet = DRY.replace(
        "[contact]",
        "cell_size = \"0.5 mm\"\n[fluid]\ndensity = 1000\n\
        viscosity = \"1 mPa s\"\n[contact]",
    );
    let wet = wet.replace("step = \"0.1 ms\"\n", "");
    let ensemble = "[ensemble]\nmembers = 6\noffset = \"0.05 mm\"\ncell_shift = true\n";
    let root = tempfile::tempdir().unwrap();
    let path = root.path().join("study.toml");
    std::fs::write(root.path().join("case.toml"), wet).unwrap();
    std::fs::write(
        &path,
        format!(
            "title = \"shift\"\nbase = \"case.toml\"\n\
        [[axis]]\nname = \"weight\"\nkey = \"grain.0.density\"\n\
        values = [{{ name = \"a\", value = 2500 }}]\n{ensemble}"
        ),
    )
    .unwrap();
    let runs = plan(&path).unwrap().runs;
    let positions = |i: usize| {
        let grains = runs[i].case().unwrap().setup.grains;
        [grains[0].pose.position, grains[1].pose.position]
    };
    let start = positions(0);
    let mut largest: f64 = 0.0;
    for member in 1..6 {
        let [first, second] = positions(member);
        let shift = first - start[0];
        assert!(shift.min_element() >= 0.0 && shift.max_element() <= 0.5e-3, "{shift}");
        largest = largest.max(shift.max_element());
        // The second grain has an offset of its own; the gap stays.
        let own = second - start[1] - shift;
        assert!(own.length() <= 0.05e-3 * (1.0 + 1e-6) && own.z.abs() < 1e-5, "{own}");
    }
    assert!(largest > 0.3e-3, "{largest}");
    // The shift alone, without an offset of one grain.
    let text = std::fs::read_to_string(&path).unwrap();
    std::fs::write(&path, text.replace("offset = \"0.05 mm\"\n", "")).unwrap();
    let runs = plan(&path).unwrap().runs;
    let [first, second] = [0, 1].map(|i| runs[1].case().unwrap().setup.grains[i].pose.position);
    assert!((second - first - (start[1] - start[0])).length() < 1e-12 && first != start[0]);
}

#[test]
fn problems_are_located() {
    let one = |study: &str| {
        let found = problems(study);
        let p = found.first().unwrap().clone();
        let place = p.place().map(|(name, line, _)| (name.ends_with("study.toml"), line));
        (p.to_string(), p.help.clone().unwrap_or_default(), place)
    };
    let (message, help, place) =
        one(&STUDY.replace("key = [\"grain.0.density\"", "keys = [\"grain.0.density\""));
    assert!(message.contains("unknown key `keys`") && help.contains("`key`"), "{message} {help}");
    assert_eq!(place, Some((true, 6)));
    let beyond = STUDY.replace("key = [\"grain.0.density\"", "key = [\"grain.4.density\"");
    let (message, _, place) = one(&beyond);
    assert!(message.starts_with("grain.4.density: model \""), "{message}");
    assert!(message.contains("`grain` has no element 4: accepted are 0 to 1"), "{message}");
    assert!(place.is_some_and(|(in_study, _)| in_study), "{place:?}");
    let (message, _, place) = one(&STUDY.replace("case.toml", "cases.toml"));
    assert!(message.contains("no case file"), "{message}");
    assert_eq!(place, Some((true, 3)));
    // The second of two equal names is the one to change, on any axis and among the models.
    let (message, _, place) =
        one(&STUDY.replace("\"heavy\"", "\"light\"").replace("heavy-*", "light-*"));
    assert_eq!(message, "axis.0.values.1.name: there are two values called \"light\"");
    assert_eq!(place, Some((true, 9)));
    let (message, _, place) = one(&STUDY.replace("\"alone\"", "\"light-rough\""));
    assert_eq!(message, "model.0.name: there are two models called \"light-rough\"");
    assert_eq!(place, Some((true, 18)));
    let joined = STUDY.replace("\"heavy\"", "\"light-rough\"").replace("heavy-*", "light-*");
    let joined = joined.replace("\"smooth\"", "\"rough-rough\"");
    let (message, _, place) = one(&joined);
    assert!(message.contains("two models called \"light-rough-rough\""), "{message}");
    assert_eq!(place, Some((true, 15)));
    let (message, help, _) = one(&STUDY.replace("\"alone\"", "\"Light-Rough\""));
    assert!(message.contains("two models called \"Light-Rough\""), "{message}");
    assert!(help.contains("whatever the case"), "{help}");
    let (message, ..) = one(&STUDY.replace("\"alone\"", &format!("\"{}\"", "a".repeat(201))));
    assert!(message.contains("has 201 characters"), "{message}");
    let (message, help, _) = one(&STUDY.replace("heavy-*", "haevy-rough"));
    assert!(
        message.contains("no model is called") && help.contains("heavy-rough"),
        "{message} {help}"
    );
    let (message, ..) = one(&STUDY.replace("\"heavy\"", "\"../heavy\""));
    assert!(message.contains("cannot be a name"), "{message}");
    let (message, ..) = one(&STUDY.replace("name = \"grip\"", "name = \"weight\""));
    assert!(message.contains("two axes"), "{message}");
    let (message, help, place) = one(&STUDY.replace("factors = { density", "factors = { weight"));
    assert!(message.contains("name of a factor") && help.contains("another name"), "{message}");
    assert_eq!(place, Some((true, 5)));
    let (message, ..) = one(&format!("{STUDY}[ensemble]\nmembers = 0\noffset = 1\n"));
    assert!(message.contains("1 to 1000"), "{message}");
    let (message, help, _) = one(&format!("{STUDY}[ensemble]\nmembers = 2\n"));
    assert!(message.contains("start alike") && help.contains("cell_shift"), "{message}");
    let (message, ..) = one(&format!("{STUDY}[ensemble]\nmembers = 2\noffset = \"1 s\"\n"));
    assert!(message.contains("length") || message.contains("time"), "{message}");
    let (message, ..) = one("title = \"empty\"\n");
    assert!(message.contains("no models"), "{message}");
}

#[test]
fn members_are_located_in_the_ensemble_and_share_no_folder_with_a_model() {
    let ensemble = "[ensemble]\nmembers = 3\noffset = \"0.05 mm\"\n";
    let line = |text: &str| 1 + text.lines().position(|line| line.starts_with("members")).unwrap();
    let one = |text: &str| {
        let problem = problems(text).remove(0);
        assert!(problem.help.is_some(), "{problem}");
        assert_eq!(problem.place().map(|(_, line, _)| line), Some(line(text)), "{problem}");
        problem.to_string()
    };
    let twice = STUDY.replace("\"alone\"", "\"light-rough-m1\"");
    let found = problems(&format!("{twice}{ensemble}")).remove(0).to_string();
    assert!(found.contains("member 1 of \"light-rough\"") && found.contains("both"), "{found}");
    let far = ensemble.replace("0.05 mm", "20 mm");
    assert!(one(&format!("{STUDY}{far}")).contains("of \"light-smooth\""));
    let none = ensemble.replace("[ensemble]", "[ensemble]\ngrain = 5");
    assert!(one(&format!("{STUDY}{none}")).contains("moves grain 5"));
    let single = "[[model]]\nname = \"single\"\nset.grain = [{ shape = { kind = \"sphere\", \
                  diameter = \"2 mm\" }, density = 2500, position = [\"5 mm\", \"5 mm\", \
                  \"9 mm\"] }]\n";
    let second = ensemble.replace("[ensemble]", "[ensemble]\ngrain = 1");
    let message = one(&format!("{STUDY}{single}{second}"));
    assert!(message.contains("moves grain 1, but \"single\" has 1 grain"), "{message}");
    let packed = STUDY.replace(
        "set = { \"grain.1.velocity\" = [0, 0, 0] }",
        "set = { packing = [{ shapes = [{ kind = \"sphere\", diameter = \"1 mm\" }], density = 2500, count = 1, region = { lower = [0, 0, \"20 mm\"], upper = [\"4 mm\", \"4 mm\", \"24 mm\"] } }] }",
    );
    assert!(one(&format!("{packed}{ensemble}")).contains("a position of their own"));
    // A whole table sets the height by the gap.
    let table = STUDY.replace(
        "set = { \"grain.1.velocity\" = [0, 0, 0] }",
        "set = { \"grain.1\" = { shape = { kind = \"sphere\", diameter = \"2 mm\" }, nodes = 200, density = 2500, position = [\"5 mm\", \"5 mm\"], gap_above = { grain = 0, gap = \"2 mm\" } } }",
    );
    assert!(names(&format!("{table}{ensemble}")).contains(&"alone-m2".into()));
}

#[test]
fn columns_of_the_table_are_no_names_of_axes_and_factors() {
    for (from, to) in [
        ("name = \"grip\"", "name = \"state\""),
        ("name = \"grip\"", "name = \"\""),
        ("factors = { density", "factors = { kiss_time"),
    ] {
        let problem = problems(&STUDY.replace(from, to)).remove(0);
        let text = problem.to_string();
        assert!(text.contains("column of the table") || text.contains("no name"), "{text}");
        assert!(problem.place().is_some() && problem.help.is_some());
    }
}

#[test]
fn two_axes_have_no_factor_in_common() {
    let twice =
        STUDY.replace("name = \"rough\", set", "name = \"rough\", factors = { density = 5 }, set");
    let problem = problems(&twice).remove(0);
    assert!(problem.to_string().contains("\"weight\" has the factor \"density\" too"), "{problem}");
    assert_eq!(problem.place().unwrap().1, 15);
}

#[test]
fn case_problems_are_located_in_the_study_file() {
    let found = problems(&STUDY.replace("\"contact.friction\" = 0 ", "\"contact.fricton\" = 0 "));
    let p = &found[0];
    assert!(
        p.to_string().contains("light-smooth") && p.help.as_deref().unwrap().contains("friction"),
        "{p}"
    );
    let (name, line, _) = p.place().unwrap();
    assert!(name.ends_with("study.toml") && line == 14, "{name} {line}");
    let found = problems(&STUDY.replace("\"4 g/cm3\"", "\"4 mm\""));
    assert_eq!(found[0].place().unwrap().1, 9);
    assert!(found[0].to_string().contains("heavy-smooth"));
}

#[test]
fn selection_accepts_patterns_and_shares() {
    let (_folder, path) = folder(STUDY);
    let runs = plan(&path).unwrap().runs;
    let chosen = |text: &str| Selection::parse(text).unwrap().choose(&runs);
    assert_eq!(chosen("light-*,alone").unwrap(), [0, 1, 4]);
    assert_eq!(chosen("*-rough").unwrap(), [1, 3]);
    assert_eq!(chosen("1/2").unwrap(), [0, 2, 4]);
    let mut all: Vec<usize> = (1..=3).flat_map(|i| chosen(&format!("{i}/3")).unwrap()).collect();
    all.sort_unstable();
    assert_eq!(all, [0, 1, 2, 3, 4]);
    assert!(chosen("7/9").unwrap().is_empty());
    let help = chosen("alnoe").unwrap_err().help.unwrap();
    assert!(help.contains("\"alone\""), "{help}");
    for bad in ["0/3", "4/3", "a/3", "", "[", ","] {
        assert!(Selection::parse(bad).is_err(), "{bad}");
    }
}

#[test]
fn factors_that_are_no_numbers_are_refused_where_they_stand() {
    for bad in ["nan", "inf", "-inf"] {
        let found = problems(&STUDY.replace("density = 2000 }", &format!("density = {bad} }}")));
        let place = found[0].place().map(|(_, line, _)| line);
        assert!(found[0].message.starts_with("the factor \"density\" is"), "{}", found[0]);
        assert_eq!((found.len(), place), (1, Some(8)));
        let model = "name = \"alone\"\nfactors = { size = nan }";
        let found = problems(&STUDY.replace("name = \"alone\"", model));
        assert_eq!(found[0].place().map(|(_, line, _)| line), Some(19), "{}", found[0]);
    }
}

#[test]
fn a_billion_models_are_refused_at_once() {
    let values: Vec<String> = (0..1000).map(|n| format!("{{ name = \"v{n}\" }}")).collect();
    let axis =
        |name: &str| format!("[[axis]]\nname = \"{name}\"\nvalues = [{}]\n", values.join(", "));
    let text =
        format!("title = \"large\"\nbase = \"case.toml\"\n{}{}{}", axis("a"), axis("b"), axis("c"));
    let start = std::time::Instant::now();
    let found = problems(&text);
    assert!(start.elapsed().as_secs() < 10);
    assert_eq!(found.len(), 1);
    assert!(found[0].message.contains("the axes up to \"b\" give 1000000 models"), "{}", found[0]);
    assert_eq!(found[0].place().map(|(_, line, _)| line), Some(8));
    let ensemble = "[ensemble]\nmembers = 1000\noffset = \"0.01 mm\"\n";
    let text = format!("title = \"large\"\nbase = \"case.toml\"\n{}{ensemble}", axis("a"));
    let found = problems(&text);
    assert!(found[0].message.contains("1000000 runs"), "{}", found[0]);
}

#[test]
fn the_studies_of_the_morphology_expand() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../studies/dkt-morphology");
    // The ensemble has 65 models on three grids with 8 members each, `members.toml` on one. The
    // trailing grain has a gap instead of a position.
    let expected = [
        ("study.toml", 65),
        ("quick.toml", 65),
        ("finest.toml", 4),
        ("members.toml", 520),
        ("ensemble.toml", 1560),
    ];
    for (name, count) in expected {
        let runs = plan(&folder.join(name)).map(|plan| plan.runs.len());
        assert_eq!(runs.ok(), Some(count), "{name}");
    }
}

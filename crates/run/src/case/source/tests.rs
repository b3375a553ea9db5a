//! Problems of case files: their keys, positions and words.

use super::super::raw::RawCase;
use super::*;

const CASE: &str = "[fluid]\ndensity = 1000\nviscosity = \"1 mPa s\"\n\n[domain]\nsize = [1, 1, 1]\ncells = [4, 4, 4]\n\n[time]\nend = 1\n\n[[grain]]\ndensity = 2000\nshape = { kind = \"sphere\", diameter = 0.1 }\n";

fn problem(text: &str, sets: &[&str]) -> Problem {
    let sets: Vec<String> = sets.iter().map(|s| (*s).to_string()).collect();
    match Source::parse::<RawCase>("case.toml", text, &sets) {
        Ok(_) => panic!("accepted"),
        Err(problem) => problem,
    }
}

#[test]
fn a_good_case_is_read() {
    let (_, case): (_, RawCase) = Source::parse("case.toml", CASE, &[]).unwrap();
    assert_eq!(case.fluid.unwrap().viscosity.as_ref().unwrap().si, 1e-3);
    assert_eq!(case.time.end.si, 1.0);
    assert_eq!(case.grain.len(), 1);
}

#[test]
fn a_mistyped_key_is_located_and_corrected() {
    let p = problem(&CASE.replace("viscosity", "visocsity"), &[]);
    assert_eq!(p.place(), Some(("case.toml", 3, 1)));
    assert_eq!(p.key.as_deref(), Some("fluid.visocsity"));
    assert!(p.help.unwrap().contains("`viscosity`"));
}

#[test]
fn a_table_with_the_brackets_of_a_list_is_named() {
    let case = format!("{CASE}[contact]\nfriction = 0.3\nrestitution = 0.5\n");
    for name in ["fluid", "domain", "time", "contact"] {
        let p = problem(&case.replace(&format!("[{name}]"), &format!("[[{name}]]")), &[]);
        assert_eq!(p.message, "found a list of tables, expected one table");
        assert_eq!(p.key.as_deref(), Some(name));
        assert!(p.help.unwrap().ends_with(&format!(": [{name}]")));
    }
    // A list keeps its own messages.
    let p = problem(&case.replace("density = 2000", "density = {}"), &[]);
    assert_eq!(p.key.as_deref(), Some("grain.0.density"));
}

#[test]
fn a_wrong_unit_is_located() {
    let p = problem(&CASE.replace("1 mPa s", "1 mm"), &[]);
    assert_eq!(p.place(), Some(("case.toml", 3, 13)));
    assert!(p.message.contains("is a length") && p.message.contains("1 mPa s"), "{p}");
    let p = problem(&CASE.replace("diameter = 0.1", "diameter = \"1 s\""), &[]);
    assert_eq!(p.key.as_deref(), Some("grain.0.shape.diameter"));
}

#[test]
fn overrides_reach_tables_and_lists() {
    let sets = [
        "time.end=2".to_string(),
        "fluid.viscosity=2 mPa s".into(),
        "grain.0.density=\"2 g/cm3\"".into(),
        "contact.friction=0.1".into(),
    ];
    let (_, case): (_, RawCase) = Source::parse("case.toml", CASE, &sets).unwrap();
    assert_eq!(case.time.end.si, 2.0);
    assert_eq!(case.fluid.unwrap().viscosity.as_ref().unwrap().si, 2e-3);
    assert_eq!(case.grain[0].density.si, 2000.0);
    assert_eq!(case.contact.friction.si, 0.1);
}

#[test]
fn a_wrong_override_is_located_on_its_own_line() {
    let p = problem(CASE, &["time.end=1", "time.endd=2"]);
    assert_eq!(p.place(), Some(("--set", 1, 6)));
    assert!(p.help.unwrap().contains("`end`"));
    let p = problem(CASE, &["time.end=2 mm"]);
    assert_eq!(p.place().unwrap().0, "--set");
    assert!(problem(CASE, &["nonsense"]).message.contains("no `=`"));
    assert!(problem(CASE, &["grain.3.density=1"]).message.contains("no element 3"));
}

#[test]
fn what_an_override_changed_is_shown_instead_of_the_file() {
    let text = CASE.replace("end = 1", "end = 1\nstop = { when = \"rest\", hold = \"1 s\" }");
    let set = ["time.stop.hold=-1".to_string(), "grain.0.shape.diameter=2".into()];
    let (source, case): (_, RawCase) = Source::parse("case.toml", &text, &set).unwrap();
    let stop = case.time.stop.unwrap();
    let p = source.locate(Problem::new("wrong"), stop.span.as_ref(), "here");
    assert_eq!(p.place(), Some(("--set", 1, 18)));
    assert_eq!(p.key.as_deref(), Some("time.stop"));
    assert!(source.is_overridden(&stop.span.unwrap()));
    // A header does not hold its values: it is right whatever they are.
    let grain = case.grain[0].span.clone().unwrap();
    let p = source.locate(Problem::new("wrong"), Some(&grain), "here");
    assert_eq!(p.place().map(|(name, ..)| name), Some("case.toml"));
    assert!(!source.is_overridden(&grain));
}

#[test]
fn bare_numbers_are_known() {
    let set = ["time.end=2 s".to_string(), "grain.0.shape.diameter=2".into()];
    let (source, _): (_, RawCase) = Source::parse("case.toml", CASE, &set).unwrap();
    assert!(source.is_bare("grain.0.density") && source.is_bare("grain.0.shape"));
    assert!(source.is_bare("domain.size.1") && !source.is_bare("domain.size.3"));
    assert!(!source.is_bare("time.end") && !source.is_bare("fluid.visc"));
}

#[test]
fn an_index_beyond_a_list_is_located() {
    let p = problem(CASE, &["grain.4.density=2"]);
    assert_eq!(p.message, "`grain` has no element 4: accepted is 0, its only element");
    assert_eq!(p.key.as_deref(), Some("grain.4.density"));
    assert_eq!(p.place(), Some(("--set", 1, 1)));
}

#[test]
fn a_missing_table_is_named() {
    let p = problem(&CASE.replace("[time]\nend = 1\n", ""), &[]);
    assert_eq!(p.message, "the table [time] is missing in case.toml");
    assert!(p.help.as_ref().unwrap().contains("add [time] with end ="), "{p:?}");
    assert_eq!((p.key.as_deref(), p.place()), (Some("time"), None));
    // What is missing in a table is told of that table.
    let two = format!("{CASE}\n[[grain]]\nshape = {{ kind = \"sphere\", diameter = 0.1 }}\n");
    let p = problem(&two, &[]);
    assert_eq!(p.key.as_deref(), Some("grain.1"));
    assert_eq!(p.place().map(|(_, line, _)| line), Some(16));
}

#[test]
fn a_table_instead_of_a_row_of_a_list_is_explained() {
    let text = CASE.replacen("[[grain]]", "[grain]", 1);
    let help = problem(&text, &[]).help.unwrap();
    assert!(help.contains("[[grain]]"), "{help}");
}

#[test]
fn kinds_of_values_have_plain_names() {
    for (set, words) in [
        ("run.threads=-1", "found -1, expected a whole number, zero or more"),
        ("domain.cells=[8, -8, 8]", "found -8, expected a whole number, 1 or more"),
        ("run.threads=1.5", "found 1.5, expected a whole number, zero or more"),
        ("fluid=3", "found 3, expected a table of keys and values"),
        ("packing=3", "found 3, expected a list"),
        ("title=3", "found 3, expected text in quotes"),
        ("output.at_events=3", "found 3, expected true or false"),
        ("grain.0.file=true", "found true, expected text in quotes"),
        ("grain.0.orientation=[1, 2, \"a\", 3]", "the text \"a\", expected a number"),
        ("domain.cells=[5, 5]", "found 2 values, expected a list of 3 values"),
        ("domain.cells=[5, 5, 5, 5]", "found 4 values, expected a list of 3 values"),
        ("domain.cell_size=[1, 1, 1, 1]", "found 4 values, expected a list of 3 values"),
        ("domain.boundaries.x=['wall', 'wall', 'slip']", "found 3 values, expected a list of 2"),
        ("grain.0.shape.exponents=[1, 1, 5]", "found 3 values, expected a list of 2 values"),
        ("fluid.advection=3", "expected text in quotes"),
    ] {
        let p = problem(CASE, &[set]);
        assert!(p.message.contains(words), "{set}: {p}");
    }
}

#[test]
fn a_file_as_shape_gets_the_key_of_files() {
    for (set, words) in [
        ("grain.0.shape='x.grain'", "a grain file is `file = \"x.grain\"` instead"),
        ("grain.0.shape={ file = 'x.grain' }", "a grain file is `file = \"x.grain\"` instead"),
        ("packing=[{ shapes = ['x.grain'] }]", "a grain file is `files = [\"x.grain\"]` instead"),
    ] {
        let p = problem(CASE, &[set]);
        assert!(p.help.as_ref().is_some_and(|help| help.contains(words)), "{set}: {p:?}");
    }
}

#[test]
fn broken_toml_is_located() {
    let p = problem("[fluid\ndensity = 1\n", &[]);
    assert_eq!(p.place().unwrap().1, 1);
}

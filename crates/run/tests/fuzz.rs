//! Case files and checkpoint states against damage: a located refusal or a result, never a panic,
//! and bounded memory. `PROPTEST_CASES` sets the number of cases.

#[path = "../../formats/tests/common/peak_memory.rs"]
mod peak_memory;

use std::path::Path;

use grainwake_run::Parent;
use grainwake_run::case::Case;
use grainwake_solver::sim::Simulation;
use proptest::prelude::*;
use proptest::sample::Index;
use sha2::{Digest, Sha256};

/// Most memory that a case of these tests may take [bytes]. Grids are allocated later, by the run.
const MOST_MEMORY: usize = 512 << 20;

/// A pair in water with most keys of the grains, the contact and the outputs.
const PAIR: &str = r#"
title = "pair"
gravity = [0, 0, "-9.81 m/s2"]
[fluid]
density = "1000 kg/m3"
viscosity = "1 mPa s"
initial_velocity = [0, 0, "1 mm/s"]
[domain]
size = ["6 mm", "4 mm", "8 mm"]
cell_size = "0.5 mm"
boundaries = { x = "periodic", y = "slip", z = ["wall", "free-surface"] }
[[grain]]
shape = { kind = "sphere", diameter = "2 mm" }
nodes = 100
density = "1500 kg/m3"
position = ["3 mm", "2 mm", "2 mm"]
velocity = [0, 0, "-1 cm/s"]
[[grain]]
shape = { kind = "ellipsoid", size = ["2 mm", "1.5 mm", "1 mm"] }
nodes = 100
density = 2500
position = ["3.1 mm", "2 mm"]
gap_above = { grain = 0, gap = "1 mm" }
orientation = { long_axis = "z", short_axis = "x" }
rotate = [{ axis = "y", angle = "45 deg" }]
motion = { velocity = { formula = [0, 0, "0.01*sin(20*t)"] }, angular_velocity = "fixed" }
[contact]
stiffness = 200
friction = 0.5
restitution = 0.8
[time]
end = "20 ms"
cfl = 0.3
[output]
tables = "2 ms"
slices = "10 ms"
checkpoint_steps = 40
[run]
threads = 1
precision = "f32"
"#;

/// A packing without fluid.
const HEAP: &str = r#"
title = "heap"
[domain]
size = ["10 mm", "10 mm", "30 mm"]
[contact]
law = "hertz-mindlin"
youngs_modulus = "10 MPa"
poisson_ratio = 0.3
[[packing]]
count = 12
shapes = [{ kind = "sphere", diameter = "2 mm" }]
nodes = 60
density = "2650 kg/m3"
region = { lower = ["1 mm", "1 mm", "1 mm"], upper = ["9 mm", "9 mm", "25 mm"] }
arrangement = "random"
seed = 3
[time]
end = "60 ms"
step = "0.1 ms"
[output]
tables = "1 ms"
"#;

/// Values that a number or a text is replaced by.
const VALUES: [&str; 26] = [
    "0",
    "-1",
    "1",
    "2",
    "1e-300",
    "1e300",
    "-1e300",
    "nan",
    "inf",
    "-inf",
    "9223372036854775807",
    "4294967296",
    "0.1",
    "true",
    "\"\"",
    "\"1e300 mm\"",
    "\"0 mm\"",
    "\"-2 mm\"",
    "\"nan s\"",
    "\"wall\"",
    "\"x\"",
    "[]",
    "[1, 2]",
    "[1, 2, 3]",
    "{}",
    "{ kind = \"cube\" }",
];

/// Change of a text.
#[derive(Clone, Debug)]
enum Change {
    Value(Index, usize),
    DropLine(Index),
    RepeatLine(Index),
    Byte(Index, u8),
}

fn change() -> impl Strategy<Value = Change> {
    prop_oneof![
        6 => (any::<Index>(), 0..VALUES.len()).prop_map(|(at, to)| Change::Value(at, to)),
        2 => any::<Index>().prop_map(Change::DropLine),
        1 => any::<Index>().prop_map(Change::RepeatLine),
        1 => (any::<Index>(), 32..127_u8).prop_map(|(at, to)| Change::Byte(at, to)),
    ]
}

/// Places of the numbers and quoted texts of a TOML text.
fn values(text: &str) -> Vec<std::ops::Range<usize>> {
    let mut out = Vec::new();
    let mut start = None;
    let mut quoted = false;
    for (at, c) in text.char_indices() {
        if c == '"' {
            quoted = !quoted;
        }
        let separates = !quoted && c != '"' && " \n[]{},=".contains(c);
        match (separates, start) {
            (false, None) => start = Some(at),
            (true, Some(from)) => {
                start = None;
                let token = &text[from..at];
                if token.starts_with('"') || token.parse::<f64>().is_ok() {
                    out.push(from..at);
                }
            }
            _ => {}
        }
    }
    out
}

fn changed(text: &str, changes: &[Change]) -> String {
    let mut text = text.to_owned();
    for change in changes {
        match change {
            Change::Value(at, to) => {
                let places = values(&text);
                if !places.is_empty() {
                    text.replace_range(at.get(&places).clone(), VALUES[*to]);
                }
            }
            Change::DropLine(at) | Change::RepeatLine(at) => {
                let mut lines: Vec<&str> = text.lines().collect();
                if !lines.is_empty() {
                    let at = at.index(lines.len());
                    match change {
                        Change::DropLine(_) => drop(lines.remove(at)),
                        _ => lines.insert(at, lines[at]),
                    }
                }
                text = lines.join("\n");
            }
            Change::Byte(at, to) => {
                if text.is_ascii() && !text.is_empty() {
                    let at = at.index(text.len());
                    text.replace_range(at..=at, &char::from(*to).to_string());
                }
            }
        }
    }
    text
}

fn parse(text: &str) -> Result<Case, grainwake_run::case::CaseError> {
    Case::parse(text, "case.toml", Path::new("."), &[])
}

/// `cases` without `PROPTEST_CASES`.
fn config(cases: u32) -> ProptestConfig {
    let default = ProptestConfig::default();
    let asked = std::env::var_os("PROPTEST_CASES").is_some();
    let cases = if asked { default.cases } else { cases };
    ProptestConfig { cases, failure_persistence: None, ..default }
}

#[test]
fn the_seeds_are_sound() {
    for text in [PAIR, HEAP] {
        let case = parse(text).unwrap_or_else(|error| panic!("{error}"));
        assert!(values(text).len() > 20);
        assert!(case.setup.grains.len() > 1);
    }
    assert_eq!(values("a = [1, \"2 mm\"]\nb = true\n"), [5..6, 8..14]);
}

proptest! {
    #![proptest_config(config(200))]

    #[test]
    fn damaged_cases_are_refused_or_read(
        changes in prop::collection::vec(change(), 1..4),
        heap in any::<bool>(),
    ) {
        let text = changed(if heap { HEAP } else { PAIR }, &changes);
        match parse(&text) {
            // The warnings evaluate everything that the case says.
            Ok(case) => drop(case.estimate(2)),
            Err(error) => {
                prop_assert!(!error.problems().is_empty(), "{error}");
                prop_assert!(!error.to_string().is_empty());
            }
        }
        let peak = peak_memory::peak();
        prop_assert!(peak < MOST_MEMORY, "{} MB for\n{text}", peak >> 20);
    }
}

proptest! {
    #![proptest_config(config(30))]

    #[test]
    fn damaged_states_are_refused_or_restored(
        changes in prop::collection::vec((any::<Index>(), any::<u8>()), 0..8),
        numbers in prop::collection::vec((any::<Index>(), any::<f64>()), 0..3),
        cut in prop::option::weighted(0.2, any::<Index>()),
    ) {
        let case = parse(PAIR).unwrap();
        let mut simulation = Simulation::new(case.setup).unwrap();
        simulation.step(f64::INFINITY).unwrap();
        let mut bytes = Vec::new();
        simulation.save(&mut bytes).unwrap();
        for (at, value) in changes {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        // The numbers at the start are the state of the grains.
        for (at, value) in numbers {
            let at = 8 * at.index(100.min(bytes.len() / 8));
            bytes[at..at + 8].copy_from_slice(&value.to_le_bytes());
        }
        if let Some(cut) = cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        if simulation.restore(&mut &bytes[..]).is_ok() {
            // A state that is accepted can be advanced or fails with an error.
            drop(simulation.step(f64::INFINITY));
        }
        let peak = peak_memory::peak();
        prop_assert!(peak < MOST_MEMORY, "{} MB", peak >> 20);
    }
}

/// Finds the checkpoint with this body, and a sound checksum, in a run folder.
fn found(folder: &Path, body: &[u8]) -> bool {
    let mut file = body.to_vec();
    file.extend(Sha256::digest(body));
    std::fs::create_dir_all(folder.join("checkpoint")).unwrap();
    std::fs::write(folder.join("checkpoint/step-0000000001.ckpt"), file).unwrap();
    let provenance = include_bytes!("../../../fuzz/seeds/provenance.json");
    std::fs::write(folder.join("provenance.json"), provenance).unwrap();
    Parent::find(folder, None, &mut |_| {}).is_ok()
}

/// Checkpoint up to its state.
fn record() -> Vec<u8> {
    include_bytes!("../../../fuzz/seeds/checkpoint/record")[1..].to_vec()
}

#[test]
fn a_sound_record_and_a_sound_state_are_read() {
    let folder = tempfile::tempdir().unwrap();
    assert!(found(folder.path(), &record()));
    let state = &include_bytes!("../../../fuzz/seeds/checkpoint/state")[1..];
    let case = parse(include_str!("../../../fuzz/seeds/case/wet.toml")).unwrap();
    Simulation::new(case.setup).unwrap().restore(&mut &state[..]).unwrap();
}

proptest! {
    #![proptest_config(config(200))]

    #[test]
    fn damaged_records_are_refused_or_read(
        changes in prop::collection::vec((any::<Index>(), any::<u8>()), 1..6),
        cut in prop::option::weighted(0.2, any::<Index>()),
    ) {
        let folder = tempfile::tempdir().unwrap();
        let mut body = record();
        for (at, value) in changes {
            let at = at.index(body.len());
            body[at] = value;
        }
        if let Some(cut) = cut {
            body.truncate(cut.index(body.len()));
        }
        found(folder.path(), &body);
        let peak = peak_memory::peak();
        prop_assert!(peak < MOST_MEMORY, "{} MB", peak >> 20);
    }
}

//! The disk space that `check` expects is that of the run folder.

use std::path::Path;

use grainwake_run::case::Case;
use grainwake_run::{Options, Silent, run};

/// Size of the files of a folder and of its checkpoints [bytes].
fn sizes(folder: &Path) -> (f64, f64) {
    let (mut outputs, mut checkpoints) = (0.0, 0.0);
    for entry in std::fs::read_dir(folder).unwrap().flatten() {
        let path = entry.path();
        if path.is_dir() {
            let (below, checkpoints_below) = sizes(&path);
            (outputs, checkpoints) = (outputs + below, checkpoints + checkpoints_below);
        } else if path.extension().is_some_and(|e| e == "ckpt") {
            checkpoints += entry.metadata().unwrap().len() as f64;
        } else {
            outputs += entry.metadata().unwrap().len() as f64;
        }
    }
    (outputs, checkpoints)
}

/// Runs a case and compares its folder with the estimate.
#[track_caller]
fn compare(text: &str, bound: f64) {
    let case = Case::parse(text, "case.toml", Path::new(""), &[]).unwrap();
    let estimate = case.estimate(1);
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("run");
    run(case.job(), &out, &Options::default(), &mut Silent).unwrap();
    let (outputs, checkpoints) = sizes(&out);
    let expected = [estimate.disk_bytes, estimate.checkpoint_bytes].map(|bytes| bytes as f64);
    // One of two checkpoints is kept after the end.
    for (what, expected, found) in
        [("outputs", expected[0], outputs), ("checkpoints", expected[1], 2.0 * checkpoints)]
    {
        println!("{what}: {expected:.0} expected, {found:.0} found");
        assert!((expected / found - 1.0).abs() < bound, "{what}: {expected} for {found}");
    }
}

const WET: &str = r#"
[fluid]
density = 1000
viscosity = "1 mPa s"
[domain]
size = ["8 mm", "8 mm", "12 mm"]
cell_size = "0.25 mm"
boundaries = { x = "wall", y = "wall", z = "wall" }
[time]
step = "0.5 ms"
end = "10 ms"
[[grain]]
shape = { kind = "ellipsoid", size = ["2.4 mm", "2 mm", "1.6 mm"] }
density = 1500
position = ["4 mm", "4 mm", "5 mm"]
"#;

#[test]
fn slices_surfaces_and_fields_count() {
    let output = "[output]\nslices = \"2 ms\"\nsurfaces = \"5 ms\"\nfields = \"5 ms\"\n";
    compare(&format!("{WET}{output}"), 0.1);
    let single = "[run]\nprecision = \"f32\"\n";
    compare(&format!("{WET}{output}{single}"), 0.1);
}

#[test]
fn tables_and_probes_count() {
    let output = "[output]\ntables = \"0.5 ms\"\nslices = 0\nsurfaces = 0\nplanes = []\n\
                  scales = \"gravity\"\n[[probe]]\npoints = [[0.002, 0.002, 0.002]]\n\
                  every = \"0.5 ms\"\n";
    compare(&format!("{WET}{output}"), 0.2);
}

#[test]
fn a_landing_after_the_end_gives_no_files_at_events() {
    let pair = "[[grain]]\nshape = { kind = \"sphere\", diameter = \"2 mm\" }\ndensity = 1500\n\
                position = [\"4 mm\", \"4 mm\", \"9 mm\"]\n";
    let stop = WET.replace("end = \"10 ms\"", "end = \"10 ms\"\nstop = \"landing\"");
    compare(&format!("{stop}{pair}"), 0.1);
}

#[test]
fn surfaces_of_many_grains_are_simplified() {
    let mut text = String::from(
        "gravity = [0, 0, 0]\n[domain]\nsize = [\"16 mm\", \"16 mm\", \"16 mm\"]\n\
         [contact]\nstiffness = 200\n[time]\nstep = \"0.5 ms\"\nend = \"10 ms\"\n\
         [output]\nsurfaces = \"5 ms\"\ntables = \"5 ms\"\n",
    );
    for place in 0..64 {
        let [x, y, z] = [place % 4, place / 4 % 4, place / 16].map(|i| 2 + 4 * i);
        text += &format!(
            "[[grain]]\nshape = {{ kind = \"sphere\", diameter = \"3 mm\" }}\ndensity = 2500\n\
             position = [\"{x} mm\", \"{y} mm\", \"{z} mm\"]\n"
        );
    }
    compare(&text, 0.15);
}

#[test]
fn only_a_run_that_writes_full_fields_has_their_folder() {
    for (output, is_there) in [("fields = 0", false), ("fields = \"5 ms\"", true)] {
        let text = format!("{WET}[output]\n{output}\n");
        let case = Case::parse(&text, "case.toml", Path::new(""), &[]).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("run");
        run(case.job(), &out, &Options::default(), &mut Silent).unwrap();
        assert_eq!(out.join("fields").exists(), is_there, "{output}");
    }
}

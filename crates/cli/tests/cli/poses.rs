//! Grains placed by a table of poses: a settled heap starts the next run.

use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use crate::common::{folder_with, grainwake};
use serde_json::Value;

/// Eight spheres and boxes that fall into a narrow dry box and come to rest.
const SETTLE: &str = r#"
[domain]
size = ["5 mm", "5 mm", "20 mm"]
[contact]
stiffness = 500
restitution = 0.2
global_damping = 20
[time]
end = "160 ms"
[output]
tables = "5 ms"
surfaces = 0
[[packing]]
count = 8
shapes = [
    { kind = "sphere", diameter = "2 mm" },
    { kind = "rounded-box", size = ["2 mm", "1.6 mm", "1.2 mm"], radius = "0.3 mm" },
]
nodes = 400
density = 2500
seed = 3
"#;

/// A dry case without grains in the same box.
const NEXT: &str = r#"
[domain]
size = ["5 mm", "5 mm", "20 mm"]
[contact]
stiffness = 500
restitution = 0.2
accept_overlap = 0.02
[time]
end = "20 ms"
[output]
tables = "1 ms"
surfaces = 0
"#;

/// Folder of the settled run, which all tests share.
fn heap() -> &'static Path {
    static HEAP: LazyLock<(tempfile::TempDir, PathBuf)> = LazyLock::new(|| {
        let (folder, case) = folder_with(SETTLE);
        let out = folder.path().join("heap");
        run(&case, &out, &[]).success();
        (folder, out)
    });
    &HEAP.1
}

/// A folder with the case `next.toml`: the box and `more`, where HEAP is the settled run.
fn next(more: &str) -> (tempfile::TempDir, PathBuf) {
    next_of(NEXT, more)
}

fn next_of(box_only: &str, more: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("next.toml");
    write(&path, box_only, more);
    (folder, path)
}

fn write(path: &Path, box_only: &str, more: &str) {
    let more = more.replace("HEAP", &heap().display().to_string());
    std::fs::write(path, format!("{box_only}[[poses]]\n{more}")).unwrap();
}

fn run(case: &Path, out: &Path, more: &[&str]) -> assert_cmd::assert::Assert {
    let mut command = grainwake();
    command.arg("run").arg(case).arg("-o").arg(out).args(["--quiet", "--no-report"]);
    command.args(more).assert()
}

fn message(done: &assert_cmd::assert::Assert) -> String {
    String::from_utf8_lossy(&done.get_output().stderr).into_owned()
}

/// Rows of `grains.csv` as numbers.
fn rows(run: &Path) -> Vec<Vec<f64>> {
    let text = std::fs::read_to_string(run.join("grains.csv")).unwrap();
    let row = |line: &str| line.split(',').map(|cell| cell.parse().unwrap()).collect();
    text.lines().skip(1).map(row).collect()
}

/// Columns of `grains.csv`.
const POSITION: std::ops::Range<usize> = 2..5;
const VELOCITY: std::ops::Range<usize> = 5..8;
const ORIENTATION: std::ops::Range<usize> = 8..12;

#[test]
fn a_settled_heap_stays_at_rest_in_the_next_run() {
    let (folder, next) = next("run = \"HEAP\"\n");
    let out = folder.path().join("next");
    run(&next, &out, &[]).success();
    let (before, after) = (rows(heap()), rows(&out));
    let before = &before[before.len() - 8..];
    assert!(before.iter().map(|row| row[21]).sum::<f64>() >= 12.0, "the grains are in contact");
    for (old, new) in before.iter().zip(&after[..8]) {
        assert_eq!(old[POSITION], new[POSITION]);
        // The bits of a unit quaternion are kept up to its normalisation.
        let turned = old[ORIENTATION].iter().zip(&new[ORIENTATION]);
        assert!(turned.into_iter().all(|(a, b)| (a - b).abs() < 1e-15));
        assert!(new[VELOCITY].iter().all(|v| *v == 0.0));
    }
    let last = &after[after.len() - 8..];
    for (old, new) in before.iter().zip(last) {
        let moved: f64 = (2..5).map(|k| (old[k] - new[k]).powi(2)).sum::<f64>().sqrt();
        let speed = new[VELOCITY].iter().map(|v| v * v).sum::<f64>().sqrt();
        // A grain without its contacts would fall by 2 mm, to a speed of 0.2 m/s.
        assert!(moved < 2e-5 && speed < 2e-3, "moved by {moved} m, {speed} m/s");
    }
    assert_eq!(
        before.iter().map(|row| row[21]).sum::<f64>(),
        last.iter().map(|row| row[21]).sum::<f64>()
    );
    let summary: Value =
        serde_json::from_slice(&std::fs::read(out.join("summary.json")).unwrap()).unwrap();
    assert!(summary["max_overlap"].as_f64().unwrap() < 0.02, "{summary}");
    // The resolved case lists the grains and gives bitwise identical results.
    let again = folder.path().join("again");
    run(&out.join("case.resolved.toml"), &again, &[]).success();
    assert_eq!(rows(&again), after);
}

#[test]
fn tables_have_times_velocities_offsets_and_own_columns() {
    let early = "run = \"HEAP\"\ntime = \"12 ms\"\nvelocities = true\noffset = [0, 0, \"1 mm\"]\n";
    let (folder, next) = next(early);
    let out = folder.path().join("early");
    run(&next, &out, &["--set", "time.end=2 ms"]).success();
    let of_heap = rows(heap());
    let at_10_ms: Vec<_> = of_heap.iter().filter(|row| (row[0] - 0.01).abs() < 1e-9).collect();
    assert_eq!(at_10_ms.len(), 8);
    for (old, new) in at_10_ms.iter().zip(rows(&out)) {
        assert_eq!(old[VELOCITY], new[VELOCITY]);
        assert!((old[4] + 1e-3 - new[4]).abs() < 1e-15, "{old:?} {new:?}");
    }
    assert!(at_10_ms.iter().any(|row| row[7] < -0.05), "some grains fall");
    let table = "x,y,z,equivalent_diameter,density\n\
                 1.5e-3,2.5e-3,1.5e-3,1e-3,2000\n3.5e-3,2.5e-3,1.5e-3,2e-3,3000\n";
    std::fs::write(folder.path().join("two.csv"), table).unwrap();
    let own = "file = \"two.csv\"\nnodes = 200\n\
               shapes = [{ kind = \"sphere\", diameter = \"2 mm\" }]\n";
    write(&next, NEXT, own);
    let out = folder.path().join("two");
    run(&next, &out, &["--set", "time.end=2 ms"]).success();
    let summary: Value =
        serde_json::from_slice(&std::fs::read(out.join("summary.json")).unwrap()).unwrap();
    for (index, (diameter, density)) in [(1e-3, 2000.0), (2e-3, 3000.0)].into_iter().enumerate() {
        let grain = &summary["grains"][index];
        assert!((grain["equivalent_diameter_m"].as_f64().unwrap() / diameter - 1.0).abs() < 1e-9);
        assert_eq!(grain["density"], density);
    }
}

#[test]
fn overlaps_are_refused_without_consent_and_the_list_is_short() {
    let strict = NEXT.replace("accept_overlap = 0.02\n", "");
    let (folder, next) = next_of(&strict, "run = \"HEAP\"\n");
    let out = folder.path().join("next");
    let refused = message(&run(&next, &out, &[]).code(2));
    assert!(refused.contains("[contact] accept_overlap = 0.0"), "{refused}");
    assert!(!refused.contains("by 0 m") && refused.contains("overlap at the start by"));
    // A lattice of 200 spheres that overlap in 500 pairs gives a short list.
    let rows: Vec<String> = (0..200)
        .map(|n| format!("{},{},{}", 6e-4 * f64::from(n % 10), 6e-4 * f64::from(n / 10), 1e-3))
        .collect();
    std::fs::write(folder.path().join("dense.csv"), format!("x,y,z\n{}\n", rows.join("\n")))
        .unwrap();
    let dense = "file = \"dense.csv\"\nnodes = 100\ndensity = 2500\n\
                 offset = [\"1 mm\", \"1 mm\", 0]\n\
                 shapes = [{ kind = \"sphere\", diameter = \"0.6000001 mm\" }]\n";
    let wide = strict.replace("[\"5 mm\", \"5 mm\", \"20 mm\"]", "[\"8 mm\", \"14 mm\", \"3 mm\"]");
    write(&next, &wide, dense);
    let refused = message(&run(&next, &out, &[]).code(2));
    assert_eq!(refused.matches("overlap at the start by").count(), 10, "{refused}");
    assert!(refused.contains("360 more pairs overlap at the start"), "{refused}");
    assert!(refused.contains("overlap at the start by 0.1 nm"), "{refused}");
    assert!(refused.lines().count() < 100, "{}", refused.lines().count());
    let accepted = ["--set", "contact.accept_overlap=1e-6", "--set", "time.end=1 ms"];
    run(&next, &out, &accepted).success();
    // So does a heap that does not lie in the box.
    let outside = ["--set", "poses.0.offset=[1e-3, 1e-3, 1]"];
    let refused = message(&run(&next, &folder.path().join("outside"), &outside).code(2));
    assert_eq!(refused.matches("lies outside the box").count(), 10, "{refused}");
    assert!(refused.contains("190 more grains cross a side"), "{refused}");
    // More than the run allows is no contact.
    let deep = ["--set", "contact.accept_overlap=0.3"];
    let refused = message(&run(&next, &folder.path().join("deep"), &deep).code(2));
    assert!(
        refused.contains("contact.accept_overlap") && refused.contains("0 and 0.1"),
        "{refused}"
    );
}

#[test]
fn contacts_of_another_stiffness_are_warned_of() {
    let (_folder, next) = next("run = \"HEAP\"\n");
    let check = |more: &[&str]| {
        let done = grainwake().arg("check").arg(&next).args(more).assert().success();
        String::from_utf8_lossy(&done.get_output().stdout).into_owned()
    };
    assert!(!check(&[]).contains("throw them apart"));
    let stiff = check(&["--set", "contact.stiffness=5000"]);
    assert!(stiff.contains("throw them apart: take [contact] stiffness"), "{stiff}");
}

#[test]
fn tables_that_cannot_be_used_are_refused_with_their_place() {
    let (folder, next) = next("");
    std::fs::write(folder.path().join("bad.csv"), "x,y,z\n1e-3,2e-3\n").unwrap();
    std::fs::write(folder.path().join("one.csv"), "x,y,z\n2e-3,2e-3,2e-3\n").unwrap();
    let sphere = "shapes = [{ kind = \"sphere\", diameter = \"1 mm\" }]\n";
    let cases = [
        ("run = \"nowhere\"\n".to_owned(), "there is no run in"),
        (String::new(), "there is no table of poses"),
        (format!("run = \"HEAP\"\n{sphere}"), "leave out `shapes`"),
        ("run = \"HEAP\"\ntime = -1\n".to_owned(), "the first rows are at 0 s"),
        ("run = \"HEAP\"\nfile = \"one.csv\"\n".to_owned(), "keep one of them"),
        (format!("file = \"absent.csv\"\n{sphere}"), "cannot read"),
        (format!("file = \"bad.csv\"\n{sphere}"), "line 2: 2 values under 3 columns"),
        (format!("file = \"one.csv\"\n{sphere}"), "no density"),
        ("file = \"one.csv\"\ndensity = 2500\n".to_owned(), "no shape"),
        (format!("file = \"one.csv\"\ndensity = 2500\ntime = 1\n{sphere}"), "no column 'time'"),
        (format!("file = \"one.csv\"\ndensity = -1\n{sphere}"), "greater than zero"),
        (
            format!("file = \"one.csv\"\ndensity = 2500\nvelocities = true\n{sphere}"),
            "poses.0.velocities: ",
        ),
    ];
    let out = folder.path().join("out");
    for (keys, said) in cases {
        write(&next, NEXT, &keys);
        let refused = message(&run(&next, &out, &[]).code(2));
        assert!(refused.contains(said) && refused.contains("next.toml:"), "{keys}: {refused}");
    }
    assert!(!out.exists());
    // A table of one's own may lack its last line break: the last grain was left out.
    std::fs::write(folder.path().join("two.csv"), "x,y,z\n2e-3,2e-3,2e-3\n2e-3,2e-3,4e-3").unwrap();
    write(&next, NEXT, &format!("file = \"two.csv\"\ndensity = 2500\n{sphere}"));
    let both = grainwake().arg("check").arg(&next).assert().success();
    let both = String::from_utf8_lossy(&both.get_output().stdout).into_owned();
    assert!(both.contains(" 2, equivalent diameter 1 mm"), "{both}");
    // The last rows of a run that was killed may lack grains.
    let killed = folder.path().join("killed");
    std::fs::create_dir(&killed).unwrap();
    std::fs::copy(heap().join("case.resolved.toml"), killed.join("case.resolved.toml")).unwrap();
    let table = std::fs::read_to_string(heap().join("grains.csv")).unwrap();
    let cut: Vec<&str> = table.lines().collect();
    std::fs::write(killed.join("grains.csv"), cut[..cut.len() - 3].join("\n") + "\n").unwrap();
    write(&next, NEXT, "run = \"killed\"\n");
    let refused = message(&run(&next, &out, &[]).code(2));
    assert!(refused.contains("incomplete") && refused.contains("5 of 8 grains"), "{refused}");
}

#[test]
fn the_heap_of_the_example_is_the_end_of_its_first_run() {
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../cases/settled-heap");
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("settle");
    run(&example.join("settle.toml"), &out, &[]).success();
    let settled = rows(&out);
    let table = std::fs::read_to_string(example.join("heap.csv")).unwrap();
    let heap: Vec<&str> = table.lines().skip(1).collect();
    assert_eq!(heap.len(), 20);
    for (line, row) in heap.iter().zip(&settled[settled.len() - 20..]) {
        let kept: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
        let ends = [&row[..2], &row[POSITION], &row[ORIENTATION]].concat();
        let off = kept.iter().zip(&ends).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < 1e-9, "{line}: off by {off}");
    }
}

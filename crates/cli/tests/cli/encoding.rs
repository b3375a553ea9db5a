//! Output folders with names that are not UTF-8. Linux allows them, other systems do not.

use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt;

use crate::common::{DRY, contents, folder_with, grainwake};

const STUDY: &str = r#"
title = "one run"
base = "case.toml"
[[axis]]
name = "weight"
key = "grain.0.density"
values = [{ name = "light", value = 2500 }]
"#;

const SUITE: &str = r#"
title = "Fall on a floor"
[[run]]
name = "fall"
[[run.check]]
quantity = "height"
take = "last"
of = "z"
at_most = 1
"#;

#[test]
fn the_output_may_have_any_name() {
    let (folder, _) = folder_with(DRY);
    let suite = folder.path().join("validation/fall");
    std::fs::create_dir_all(&suite).unwrap();
    std::fs::write(suite.join("validation.toml"), SUITE).unwrap();
    std::fs::write(suite.join("case.toml"), DRY).unwrap();
    std::fs::write(folder.path().join("study.toml"), STUDY).unwrap();
    let cases: [&[&str]; 3] = [
        &["run", "case.toml", "--quiet", "--set", "time.end=2 ms"],
        &["study", "study.toml", "--quiet", "--set", "time.end=2 ms"],
        &["validate", "--quiet", "--set", "time.end=2 ms"],
    ];
    for words in cases {
        let out = folder.path().join(OsStr::from_bytes(&[words[0].as_bytes(), b"\xe9"].concat()));
        let mut program = grainwake();
        program.current_dir(folder.path()).args(words).arg("-o").arg(&out).assert().success();
        let files = contents(&out);
        let (_, text) = files.iter().find(|(name, _)| name.ends_with("provenance.json")).unwrap();
        let text = String::from_utf8_lossy(text);
        assert!(text.contains(&format!("{}\u{fffd}", words[0])), "{text}");
    }
}

#[test]
fn grains_in_a_folder_of_any_name_are_listed_as_json() {
    let folder = tempfile::tempdir().unwrap();
    let ball = |n: usize| {
        let x = [n % 24, n / 24 % 24, n / 576].map(|i| i as f64 - 11.5);
        u8::from(x.iter().map(|x| x * x).sum::<f64>() < 64.0)
    };
    let voxels: Vec<u8> = (0..24 * 24 * 24).map(ball).collect();
    let header = "NRRD0004\ntype: uint8\nsizes: 24 24 24\nencoding: raw\n\n";
    let image = folder.path().join("image.nrrd");
    std::fs::write(&image, [header.as_bytes(), &voxels].concat()).unwrap();
    let mut program = grainwake();
    program.args(["grain", "from-scan", "--no-roundness", "--json", "--voxel", "1 mm"]).arg(&image);
    program.arg("-o").arg(folder.path().join(OsStr::from_bytes(b"out\xe9")));
    let done = program.assert().success();
    let line: serde_json::Value = serde_json::from_slice(&done.get_output().stdout).unwrap();
    let file = line["file"].as_str().unwrap();
    assert!(file.ends_with("out\u{fffd}/label-00001.grain"), "{file}");
}

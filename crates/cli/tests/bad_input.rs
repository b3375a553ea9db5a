//! Bad input: exit code 2, nothing written, and a message with file, line, key and remedy.

mod common;

use common::{WET, folder_with, grainwake};

/// Runs a changed case; standard error must hold these words.
fn refused(from: &str, to: &str, words: &[&str]) {
    assert!(WET.contains(from), "{from}");
    let (folder, case) = folder_with(&WET.replacen(from, to, 1));
    let out = folder.path().join("run");
    for command in ["run", "check"] {
        let mut program = grainwake();
        program.arg(command).arg(&case);
        if command == "run" {
            program.arg("-o").arg(&out);
        }
        let done = program.assert().code(2);
        let said = String::from_utf8_lossy(&done.get_output().stderr).into_owned();
        assert!(done.get_output().stdout.is_empty());
        for word in words {
            assert!(
                said.contains(word),
                "{command}: `{word}` is missing in:\n{said}"
            );
        }
    }
    assert!(!out.exists(), "nothing may be written");
}

#[test]
fn a_wrong_key() {
    refused(
        "viscosity =",
        "viscossity =",
        &[
            "case.toml:5:1",
            "fluid.viscossity",
            "unknown key",
            "did you mean `viscosity`?",
        ],
    );
}

#[test]
fn a_wrong_unit() {
    refused(
        "\"5 mPa s\"",
        "\"5 mPa\"",
        &[
            "case.toml:5:13",
            "fluid.viscosity",
            "is a pressure",
            "\"1 mPa s\"",
        ],
    );
}

#[test]
fn a_missing_grain_file() {
    let from = "shape = { kind = \"sphere\", diameter = \"2 mm\" }\nnodes = 200";
    refused(
        from,
        "file = \"sand.grain\"",
        &[
            "case.toml:18:8",
            "grain.0.file",
            "no grain file",
            "sand.grain",
            "grainwake grain from-scan",
        ],
    );
}

#[test]
fn grains_that_overlap() {
    refused(
        "gap = \"1 mm\"",
        "gap = \"-0.5 mm\"",
        &[
            "case.toml:26:12",
            "grain.1.position",
            "overlap at the start by 0.4",
            "move them apart",
        ],
    );
}

#[test]
fn a_grain_outside() {
    refused(
        "\"3 mm\"]",
        "\"30 mm\"]",
        &[
            "case.toml:21:12",
            "grain.0.position",
            "outside the box",
            "larger",
        ],
    );
    refused(
        "\"3 mm\"]",
        "\"0.5 mm\"]",
        &[
            "case.toml:21:12",
            "crosses a face",
            "lower z",
            "0.5000 mm along z",
        ],
    );
}

#[test]
fn a_periodic_mismatch() {
    refused(
        "x = \"periodic\"",
        "x = [\"periodic\", \"wall\"]",
        &[
            "case.toml:9:20",
            "domain.boundaries.x",
            "one side only",
            "x = \"periodic\"",
        ],
    );
}

#[test]
fn a_mesh_with_a_hole() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("open.obj");
    // A cube of two units without its top.
    let text = "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n\
        f 1 3 2\nf 1 4 3\nf 1 2 6\nf 1 6 5\nf 2 3 7\nf 2 7 6\nf 3 4 8\nf 3 8 7\nf 4 1 5\nf 4 5 8\n";
    std::fs::write(&path, text).unwrap();
    let out = folder.path().join("open.grain");
    let done = grainwake()
        .args(["grain", "from-mesh"])
        .arg(&path)
        .args(["--unit", "1 mm", "-o"])
        .arg(&out)
        .assert()
        .code(2);
    let said = String::from_utf8_lossy(&done.get_output().stderr).into_owned();
    assert!(
        said.contains("the mesh is open")
            && said.contains("near")
            && said.contains("close the hole"),
        "{said}"
    );
    assert!(!out.exists());
}

#[test]
fn an_absurd_image_header() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("absurd.tif");
    // One page of 10^6 x 10^6 samples of 32 bits that are not there.
    let mut bytes: Vec<u8> = b"II*\0\x08\0\0\0".to_vec();
    let entries: [(u16, u16, u32); 9] = [
        (256, 4, 1_000_000),
        (257, 4, 1_000_000),
        (258, 3, 32),
        (259, 3, 1),
        (262, 3, 1),
        (273, 4, 8),
        (277, 3, 1),
        (278, 4, 1_000_000),
        (279, 4, 4_000_000),
    ];
    bytes.extend((entries.len() as u16).to_le_bytes());
    for (tag, kind, value) in entries {
        bytes.extend(tag.to_le_bytes());
        bytes.extend(kind.to_le_bytes());
        bytes.extend(1u32.to_le_bytes());
        bytes.extend(value.to_le_bytes());
    }
    bytes.extend([0; 4]);
    std::fs::write(&path, bytes).unwrap();
    let out = folder.path().join("absurd.grain");
    let start = std::time::Instant::now();
    let done = grainwake()
        .args(["grain", "from-scan"])
        .arg(&path)
        .args(["--voxel", "1 um", "-o"])
        .arg(&out)
        .assert()
        .code(2);
    let said = String::from_utf8_lossy(&done.get_output().stderr).into_owned();
    assert!(
        said.contains("absurd.tif") && said.contains("1000000"),
        "{said}"
    );
    assert!(start.elapsed().as_secs() < 20 && !out.exists());
}

#[test]
fn what_is_not_there_and_what_is_no_case() {
    let folder = tempfile::tempdir().unwrap();
    let done = grainwake()
        .arg("run")
        .arg(folder.path().join("nowhere.toml"))
        .assert()
        .code(2);
    assert!(String::from_utf8_lossy(&done.get_output().stderr).contains("nowhere.toml"));
    let path = folder.path().join("broken.toml");
    std::fs::write(&path, "[fluid\n").unwrap();
    let done = grainwake().arg("check").arg(&path).assert().code(2);
    assert!(String::from_utf8_lossy(&done.get_output().stderr).contains("broken.toml:1:"));
    std::fs::write(&path, b"\xff\xfe\x00").unwrap();
    grainwake().arg("check").arg(&path).assert().code(2);
    grainwake().arg("frobnicate").assert().code(2);
}

#[test]
fn a_damaged_grain_file_is_told_of_with_its_place() {
    let (folder, case) = folder_with(&WET.replacen(
        "shape = { kind = \"sphere\", diameter = \"2 mm\" }\nnodes = 200",
        "file = \"a.grain\"",
        1,
    ));
    let grain = folder.path().join("a.grain");
    grainwake()
        .args(["grain", "make", "sphere", "2 mm", "-o"])
        .arg(&grain)
        .assert()
        .success();
    grainwake().arg("check").arg(&case).assert().success();
    let mut bytes = std::fs::read(&grain).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 4;
    std::fs::write(&grain, bytes).unwrap();
    let done = grainwake().arg("check").arg(&case).assert().code(2);
    let said = String::from_utf8_lossy(&done.get_output().stderr).into_owned();
    assert!(
        said.contains("case.toml:18:8") && said.contains("checksum"),
        "{said}"
    );
}

//! Outputs of `grain`: places that cannot be written are refused before the work, and pictures
//! replace no other file.

use crate::common::grainwake;
use std::path::Path;

/// Runs `grain` in a folder; standard error.
fn grain(folder: &Path, words: &[&str], code: i32) -> String {
    let mut program = grainwake();
    let done = program.current_dir(folder).arg("grain").args(words).assert().code(code);
    String::from_utf8_lossy(&done.get_output().stderr).into_owned()
}

#[test]
fn places_that_cannot_be_written() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("plain.txt"), "text").unwrap();
    let before = crate::common::contents(folder.path());
    // The inputs do not exist: the output is checked first.
    let scan = ["from-scan", "none.tif", "--voxel", "1 um", "-o"];
    let mesh = ["from-mesh", "none.stl", "--unit", "mm", "-o"];
    let make = ["make", "sphere", "2 mm", "-o"];
    let export = ["export", "none.grain", "-o"];
    let family = ["family", "--sphericity", "0.7", "--roundness", "0.5", "-o"];
    for (command, output) in [
        (&scan[..], "plain.txt/x.grain"),
        (&scan, "plain.txt"),
        (&scan, "plain.txt/new/folder"),
        (&mesh, "plain.txt/x.grain"),
        (&make, "plain.txt/x.grain"),
        (&export, "plain.txt/x.stl"),
        (&family, "plain.txt"),
    ] {
        let message = grain(folder.path(), &[command, &[output]].concat(), 2);
        let words = "plain.txt is a file, not a folder";
        assert!(message.contains(words), "{output}: {message}");
    }
    if Path::new("/proc/self").exists() {
        for output in ["/proc/nope", "/proc/nope/x.grain"] {
            let message = grain(folder.path(), &[&scan[..], &[output]].concat(), 4);
            assert!(message.contains("cannot write to /proc: "), "{message}");
        }
    }
    assert_eq!(before, crate::common::contents(folder.path()));
}

#[test]
fn pictures_replace_pictures_only() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["one.grain", "two.grain"] {
        grain(folder.path(), &["make", "sphere", "2 mm", "--cells", "32", "-o", name], 0);
    }
    std::fs::write(folder.path().join("notes.png"), "text").unwrap();
    let before = crate::common::contents(folder.path());
    let commands = [&["info", "one.grain"][..], &["compare", "one.grain", "one.grain"]];
    for command in commands {
        for (picture, words) in [
            ("two.grain", "--picture: two.grain does not end in .png"),
            ("notes.png", "--picture: notes.png exists and is not a picture"),
        ] {
            let message = grain(folder.path(), &[command, &["--picture", picture]].concat(), 2);
            assert!(message.contains(words), "{message}");
        }
        assert_eq!(before, crate::common::contents(folder.path()));
    }
    for command in commands {
        grain(folder.path(), &[command, &["--picture", "picture.png"]].concat(), 0);
    }
}

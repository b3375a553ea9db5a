//! Damaged meshes and images: exit code 2, no grain file, and a message with location and remedy.

use crate::common::grainwake;
use std::path::Path;

/// Runs `grain` with these arguments before `-o` and asserts that standard error contains `words`.
fn refused(command: &[&str], input: &Path, words: &[&str]) {
    let out = input.with_extension("grain");
    let done = grainwake()
        .arg("grain")
        .arg(command[0])
        .arg(input)
        .args(&command[1..])
        .arg("-o")
        .arg(&out)
        .assert()
        .code(2);
    let message = String::from_utf8_lossy(&done.get_output().stderr).into_owned();
    for word in words {
        assert!(message.contains(word), "`{word}` is missing in:\n{message}");
    }
    assert!(!message.contains("panicked") && !out.exists());
}

type Face = [[f64; 3]; 3];

/// A cube of edge 1, two faces a side.
fn cube() -> Vec<Face> {
    let mut faces = Vec::new();
    for axis in 0..3 {
        for upper in [false, true] {
            let corner = |u: f64, v: f64| {
                let mut x = [0.0; 3];
                x[axis] = f64::from(u8::from(upper));
                x[(axis + 1) % 3] = u;
                x[(axis + 2) % 3] = v;
                x
            };
            let side = [corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)];
            let [a, b, c, d] = side;
            faces.extend(match upper {
                true => [[a, b, c], [a, c, d]],
                false => [[a, c, b], [a, d, c]],
            });
        }
    }
    faces
}

/// Writes an STL file.
fn stl(path: &Path, faces: &[Face]) {
    let mut text = "solid body\n".to_string();
    for face in faces {
        text += "facet normal 0 0 0\nouter loop\n";
        for [x, y, z] in face {
            text += &format!("vertex {x} {y} {z}\n");
        }
        text += "endloop\nendfacet\n";
    }
    std::fs::write(path, text + "endsolid body\n").unwrap();
}

fn refused_mesh(faces: &[Face], unit: &str, words: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("body.stl");
    stl(&path, faces);
    refused(&["from-mesh", "--unit", unit], &path, words);
}

#[test]
fn the_cube_itself_is_taken_with_a_bare_unit() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = folder.path().join("cube.stl");
    stl(&mesh, &cube());
    let out = folder.path().join("cube.grain");
    let make = |more: &[&str]| {
        let mut program = grainwake();
        program.args(["grain", "from-mesh"]).arg(&mesh).args(["--unit", "mm"]);
        program.args(more).arg("-o").arg(&out).assert()
    };
    // A length that is no unit of a file needs its number.
    make(&["--equivalent-diameter", "mm"]).code(2);
    let done = make(&[]).success();
    let message = String::from_utf8_lossy(&done.get_output().stdout).into_owned();
    assert!(message.contains("1.000000e-9 m3"), "{message}");
}

/// Sharp corners need more cells than the default; the message names a number that works.
#[test]
fn a_mesh_that_needs_more_cells() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = folder.path().join("corner.stl");
    let [o, x, y, z] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    stl(&mesh, &[[o, y, x], [o, x, z], [x, y, z], [y, o, z]]);
    let out = folder.path().join("corner.grain");
    for unit in ["mm", "1 m"] {
        let run = |more: &[&str]| {
            let mut program = grainwake();
            program.args(["grain", "from-mesh"]).arg(&mesh).args(["--unit", unit]);
            program.args(more).arg("--force").arg("-o").arg(&out).assert()
        };
        let refused = run(&[]).code(2);
        let message = String::from_utf8_lossy(&refused.get_output().stderr).into_owned();
        assert!(message.contains("--cells 70 resolves it"), "{message}");
        run(&["--cells", "70"]).success();
    }
}

#[test]
fn outputs_that_are_inputs_or_have_the_name_of_something_else() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    stl(&path("cube.stl"), &cube());
    std::fs::write(path("ball.nrrd"), nrrd("uint8", [24; 3], &image(BALL))).unwrap();
    std::fs::create_dir(path("slices")).unwrap();
    let before = crate::common::contents(folder.path());
    let run = |words: &[&str], input: &str, out: &str, word: &str| {
        let mut program = grainwake();
        program.arg("grain").args(words);
        if !input.is_empty() {
            program.arg(path(input));
        }
        program.arg("-o").arg(path(out));
        let done = program.assert().code(2);
        let message = String::from_utf8_lossy(&done.get_output().stderr).into_owned();
        assert!(message.contains(word), "`{word}` is missing in:\n{message}");
        assert_eq!(before, crate::common::contents(folder.path()), "{out}");
    };
    let mesh = ["from-mesh", "--unit", "mm", "--force"];
    run(&mesh, "cube.stl", "cube.stl", "is an input of this command");
    run(&mesh, "cube.stl", "slices/../cube.stl", "is an input of this command");
    run(&mesh, "cube.stl", "e2.stl", "e2.grain");
    run(&["make", "sphere", "2 mm"], "", "ball", "does not end in .grain");
    let scan = ["from-scan", "--voxel", "10 um", "--force"];
    run(&scan, "ball.nrrd", "ball.nrrd", "is an input of this command");
    run(&scan, "slices", "slices", "is an input of this command");
    run(&scan, "ball.nrrd", "s.grian", "the extension of a file");
    let family = ["family", "--sphericity", "0.7", "--roundness", "0.5"];
    run(&family, "", "all.grain", "the extension of a file");
}

#[test]
fn a_mesh_with_a_hole() {
    refused_mesh(&cube()[1..], "1 mm", &["the mesh is open: 3 edges", "near (", "Close Holes"]);
}

#[test]
fn a_mesh_with_a_face_without_area() {
    let mut faces = cube();
    faces.push([[0.0; 3], [1.0, 0.0, 0.0], [1.0, 0.0, 0.0]]);
    let defect = "face 12 (counted from 0) near (0, 0, 0) has no area";
    refused_mesh(&faces, "1 mm", &[defect, "Remove Zero Area Faces"]);
}

#[test]
fn a_mesh_inside_out() {
    let mut faces = cube();
    faces.iter_mut().for_each(|f| f.swap(1, 2));
    refused_mesh(&faces, "1 mm", &["/body.stl: the mesh is inside out", "e-9 m3)", "--flip"]);
}

#[test]
fn a_mesh_through_itself() {
    let mut faces = cube();
    // One corner is pulled through the opposite side.
    let moved = faces.iter_mut().flatten().filter(|p| **p == [1.0, 1.0, 1.0]);
    moved.for_each(|p| *p = [0.3, 0.4, -0.5]);
    let words = ["body.stl: ", "cross near (", "pairs cross", "repair the mesh"];
    refused_mesh(&faces, "1 mm", &words);
}

#[test]
fn millimetres_for_metres() {
    let large: Vec<Face> = cube().iter().map(|f| f.map(|p| p.map(|x| 2.0 * x))).collect();
    refused_mesh(
        &large,
        "1 m",
        &["body.stl: the grain has an equivalent diameter of 2.481", "of --unit", "1 um to 1 m"],
    );
    let small: Vec<Face> = cube().iter().map(|f| f.map(|p| p.map(|x| 2e-4 * x))).collect();
    refused_mesh(&small, "1 mm", &["of 0.2481", "check the unit of --unit"]);
    refused_mesh(&small, "-2mm", &["unit = -0.002", "must be finite and positive"]);
}

#[test]
fn a_mesh_that_is_not_a_number() {
    let mut faces = cube();
    faces[0][0][0] = f64::NAN;
    refused_mesh(&faces, "1 mm", &["body.stl", "NaN"]);
}

/// An image of 24^3 bytes from a function of the distance from its middle.
fn image(value: impl Fn(f64) -> u8) -> Vec<u8> {
    let at = |n: usize| n as f64 - 11.5;
    let mut bytes = Vec::new();
    for k in 0..24 {
        for j in 0..24 {
            for i in 0..24 {
                bytes.push(value((at(i).powi(2) + at(j).powi(2) + at(k).powi(2)).sqrt()));
            }
        }
    }
    bytes
}

fn nrrd(kind: &str, sizes: [usize; 3], bytes: &[u8]) -> Vec<u8> {
    let [x, y, z] = sizes;
    let mut file = format!(
        "NRRD0004\ntype: {kind}\ndimension: 3\nsizes: {x} {y} {z}\nendian: little\nencoding: raw\n\n"
    )
    .into_bytes();
    file.extend(bytes);
    file
}

fn refused_image(name: &str, bytes: &[u8], words: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    refused(&["from-scan", "--voxel", "10 um"], &path, words);
}

const BALL: fn(f64) -> u8 = |r| u8::from(r < 8.0);

#[test]
fn an_image_of_the_wrong_size() {
    let file = nrrd("uint8", [24, 24, 99], &image(BALL));
    refused_image(
        "ball.nrrd",
        &file,
        &["ball.nrrd", "57024 bytes", "13824", "export the file again"],
    );
}

#[test]
fn an_image_that_is_all_black_or_all_white() {
    let black = nrrd("uint8", [24; 3], &image(|_| 0));
    refused_image("black.nrrd", &black, &["no solid voxel", "--threshold"]);
    let white = nrrd("uint8", [24; 3], &image(|_| 1));
    refused_image("white.nrrd", &white, &["solid throughout", "--threshold"]);
}

#[test]
fn a_grain_cut_by_every_border() {
    let file = nrrd("uint8", [24; 3], &image(|r| u8::from(r < 15.0)));
    refused_image(
        "cut.nrrd",
        &file,
        &["touches the image border (low x, high x, low y, high y, low z, high z)", "--pad"],
    );
}

#[test]
fn two_pieces_of_one_label() {
    let file = nrrd("uint8", [24; 3], &image(|r| u8::from(r < 3.0 || (6.0..10.0).contains(&r))));
    refused_image("two.nrrd", &file, &["2 separate pieces", "--largest-piece"]);
}

/// Two balls with labels 7 and 9.
fn two_balls() -> Vec<u8> {
    let ball = |n: usize, middle: f64| {
        let at = |n: usize, middle: f64| (n as f64 - middle).powi(2);
        at(n % 24, middle) + at(n / 24 % 24, middle) + at(n / 576, middle) < 16.0
    };
    let value = |n| 7 * u8::from(ball(n, 6.3)) + 9 * u8::from(ball(n, 16.6));
    (0..24 * 24 * 24).map(value).collect()
}

#[test]
fn two_grains_for_one_file() {
    refused_image(
        "two.nrrd",
        &nrrd("uint8", [24; 3], &two_balls()),
        &["two.nrrd holds 2 grains", "two.grain", "labels are 7, 9", "--label N"],
    );
}

#[test]
fn a_float_image_without_a_threshold() {
    let values = image(BALL).into_iter().map(|v| f32::from(v) - 0.25);
    let bytes: Vec<u8> = values.flat_map(f32::to_le_bytes).collect();
    refused_image(
        "grey.nrrd",
        &nrrd("float", [24; 3], &bytes),
        &["grey.nrrd: the image has grey values", "--threshold otsu"],
    );
}

#[test]
fn a_threshold_in_hounsfield_units() {
    let values = image(BALL).into_iter().map(|v| 900 * i16::from(v) - 1000);
    let bytes: Vec<u8> = values.flat_map(i16::to_le_bytes).collect();
    let file = nrrd("int16", [24; 3], &bytes);
    for threshold in ["-500", "-1.5e2"] {
        let message = all_grains(&file, &["--threshold", threshold], 0);
        let number: f64 = threshold.parse().unwrap();
        assert!(message.contains(&format!("threshold {number}")), "{message}");
    }
}

#[test]
fn a_header_that_tells_of_less_than_its_file_holds_or_of_no_file() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("ball.raw"), image(BALL)).unwrap();
    let command = ["from-scan", "--voxel", "10 um"];
    let header = |raw: &str| {
        format!(
            "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 24 24 20\nencoding: raw\n\
             data file: {raw}\n"
        )
    };
    let path = folder.path().join("ball.nhdr");
    std::fs::write(&path, header("ball.raw")).unwrap();
    refused(&command, &path, &["ball.nhdr", "11520 bytes", "ball.raw", "13824", "byte skip"]);
    std::fs::write(&path, header("none.raw")).unwrap();
    refused(&command, &path, &["ball.nhdr", "none.raw", "not there"]);
    let path = folder.path().join("ball.mhd");
    let header = "NDims = 3\nDimSize = 24 24 20\nElementType = MET_UCHAR\nElementDataFile = ";
    std::fs::write(&path, format!("{header}ball.raw\n")).unwrap();
    refused(&command, &path, &["ball.mhd", "11520", "13824", "HeaderSize"]);
}

#[test]
fn a_folder_without_one_of_its_slices() {
    let folder = tempfile::tempdir().unwrap();
    let slices = folder.path().join("slices");
    std::fs::create_dir(&slices).unwrap();
    for (n, slice) in image(BALL).chunks_exact(576).enumerate() {
        std::fs::write(slices.join(format!("s{n}.tif")), tiff(slice)).unwrap();
    }
    let run = |code: i32| {
        let mut program = grainwake();
        program.args(["grain", "from-scan", "--voxel", "10 um", "--no-roundness"]);
        program.arg(&slices).arg("-o");
        let done = program.arg(folder.path().join("ball.grain")).assert();
        String::from_utf8_lossy(&done.code(code).get_output().stderr).into_owned()
    };
    std::fs::rename(slices.join("s17.tif"), folder.path().join("s17.tif")).unwrap();
    let message = run(2);
    assert!(
        message.contains("after s16.tif: numbers 17;") && message.contains("rename"),
        "{message}"
    );
    std::fs::rename(folder.path().join("s17.tif"), slices.join("s17.tif")).unwrap();
    run(0);
}

#[test]
fn grains_of_an_earlier_run_do_not_stay() {
    let folder = tempfile::tempdir().unwrap();
    let (image, out) = (folder.path().join("image.nrrd"), folder.path().join("out"));
    std::fs::write(&image, nrrd("uint8", [24; 3], &two_balls())).unwrap();
    let run = |more: &[&str], code: i32| {
        let mut program = grainwake();
        program.args(["grain", "from-scan", "--voxel", "10 um", "--no-roundness"]);
        program.arg(&image).args(more).arg("-o").arg(&out);
        let done = program.assert().code(code);
        String::from_utf8_lossy(&done.get_output().stderr).into_owned()
    };
    let grains = || -> Vec<String> {
        let files = crate::common::contents(&out).into_iter().map(|(name, _)| name);
        files.filter(|name| name.ends_with(".grain")).collect()
    };
    run(&[], 0);
    assert_eq!(grains(), ["label-00007.grain", "label-00009.grain"]);
    for own in ["label-mine.grain", "label-1.grain", "mine.grain"] {
        std::fs::copy(out.join("label-00007.grain"), out.join(own)).unwrap();
    }
    // Other numbers than before: the old ones belong to no table.
    let message = run(&["--split"], 2);
    assert!(message.contains("label-00007.grain exists already"), "{message}");
    // Commands without a grain, or with a bad option, remove none.
    run(&["--threshold", "200", "--force"], 2);
    for diameter in ["2 parsec", "1e9 m"] {
        run(&["--split", "--force", "--equivalent-diameter", diameter], 2);
    }
    assert_eq!(grains().len(), 5);
    run(&["--split", "--force"], 0);
    assert_eq!(
        grains(),
        [
            "label-00001.grain",
            "label-00002.grain",
            "label-1.grain",
            "label-mine.grain",
            "mine.grain"
        ]
    );
}

#[test]
fn a_flatness_that_the_sphericity_does_not_allow() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let mut program = grainwake();
    program.args(["grain", "family", "--sphericity", "0.9", "--roundness", "0.5"]);
    program.args(["--flatness", "0.5", "-o"]).arg(&out);
    let done = program.assert().code(2);
    let message = String::from_utf8_lossy(&done.get_output().stderr).into_owned();
    for word in ["flatness = 0.5", "--sphericity 0.9", "0.729 to 1"] {
        assert!(message.contains(word), "`{word}` is missing in:\n{message}");
    }
    assert!(!out.exists());
}

/// `from-scan` into a folder; standard error.
fn all_grains(bytes: &[u8], more: &[&str], code: i32) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("image.nrrd");
    std::fs::write(&path, bytes).unwrap();
    let mut program = grainwake();
    program.args(["grain", "from-scan", "--voxel", "10 um", "--no-roundness"]);
    program.arg(&path).args(more).arg("-o");
    let done = program.arg(folder.path().join("out")).assert().code(code);
    String::from_utf8_lossy(&done.get_output().stderr).into_owned()
}

#[test]
fn a_grey_image_taken_for_labels() {
    // Any noise will do; nothing at the border.
    let mut noise = 1_u32;
    let mut grey = image(|r| u8::from(r < 10.0));
    for value in grey.iter_mut().filter(|v| **v > 0) {
        noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        *value = 100 + (noise >> 27) as u8;
    }
    let file = nrrd("uint8", [24; 3], &grey);
    let message = all_grains(&file, &[], 2);
    for word in ["looks grey", "32 values", "--threshold otsu", "--labels"] {
        assert!(message.contains(word), "`{word}` is missing in:\n{message}");
    }
    // Taken for labels on request, they are rejected on one line.
    let message = all_grains(&file, &["--labels"], 2);
    assert!(
        message.contains("32 labels rejected, each of several separate pieces: 100, 101, "),
        "{message}"
    );
    assert!(message.lines().count() < 8, "{message}");
    // With a threshold the grain is there.
    let message = all_grains(&file, &["--threshold", "otsu", "--largest-piece"], 0);
    assert!(!message.contains("looks grey"), "{message}");
}

#[test]
fn a_whole_phase_taken_for_a_grain() {
    let everywhere = nrrd("uint8", [24; 3], &image(|r| u8::from(r < 15.0)));
    let message = all_grains(&everywhere, &[], 2);
    for word in ["label 1 is a whole phase", "--split", "--separate", "--pad"] {
        assert!(message.contains(word), "`{word}` is missing in:\n{message}");
    }
    // Dark grains in bright surroundings.
    let dark = nrrd("uint8", [24; 3], &image(|r| if r < 8.0 { 50 } else { 200 }));
    for more in [&[][..], &["--split"]] {
        let message = all_grains(&dark, &[&["--threshold", "otsu"], more].concat(), 2);
        assert!(message.contains("darker than the void, invert the grey values"), "{message}");
    }
    let two = image(|r| u8::from(r < 3.0 || (6.0..10.0).contains(&r)));
    let message = all_grains(&nrrd("uint8", [24; 3], &two), &[], 2);
    assert!(
        message.contains("label 1 is a whole phase") && message.contains("--largest-piece"),
        "{message}"
    );
}

#[test]
fn an_image_with_a_value_that_is_no_number() {
    let mut values: Vec<f32> = image(BALL).iter().map(|v| f32::from(*v)).collect();
    values[24 * (24 * 3 + 4) + 5] = f32::NAN;
    let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    let file = nrrd("float", [24; 3], &bytes);
    refused_image(
        "nan.nrrd",
        &file,
        &["nan.nrrd", "x 5, y 4, z 3 is NaN, not a finite number", "value of the void"],
    );
}

#[test]
fn a_median_without_a_threshold() {
    let message = all_grains(&nrrd("uint8", [24; 3], &image(BALL)), &["--median"], 2);
    assert!(message.contains("--median") && message.contains("--threshold otsu"), "{message}");
}

#[test]
fn a_closed_form_without_a_unit() {
    let folder = tempfile::tempdir().unwrap();
    let make = |more: &[&str], code: i32| {
        let out = folder.path().join("ball.grain");
        let mut program = grainwake();
        program.args(["grain", "make", "sphere", "2", "--cells", "32"]).args(more);
        let done = program.arg("-o").arg(out).assert().code(code);
        String::from_utf8_lossy(&done.get_output().stderr).into_owned()
    };
    let message = make(&[], 2);
    assert!(message.contains("1 um to 1 m") && message.contains("unit of the sizes"), "{message}");
    make(&["--equivalent-diameter", "2 mm"], 0);
}

#[test]
fn millimetres_for_micrometres() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("ball.nrrd");
    std::fs::write(&path, nrrd("uint8", [24; 3], &image(BALL))).unwrap();
    refused(
        &["from-scan", "--voxel", "100 mm"],
        &path,
        &["equivalent diameter", "check the unit of --voxel"],
    );
    // All grains of an image: nothing is written.
    let all = folder.path().join("all");
    let mut program = grainwake();
    program.args(["grain", "from-scan"]).arg(&path);
    program.args(["--voxel", "100 mm", "-o"]).arg(&all).assert().code(2);
    assert!(!all.exists());
}

/// A directory of a TIFF file: tag, kind and value of each entry, and where the next one lies.
fn directory(file: &mut Vec<u8>, entries: &[(u16, u16, u32)], next: u32) {
    file.extend((entries.len() as u16).to_le_bytes());
    for (tag, kind, value) in entries {
        file.extend(tag.to_le_bytes());
        file.extend(kind.to_le_bytes());
        file.extend(1u32.to_le_bytes());
        file.extend(value.to_le_bytes());
    }
    file.extend(next.to_le_bytes());
}

/// Entries of a page of `edge` x `edge` whole samples of `bits` in one strip of `bytes` at `data`.
fn page(edge: u32, bits: u32, data: u32, bytes: u32) -> [(u16, u16, u32); 9] {
    [
        (256, 4, edge),
        (257, 4, edge),
        (258, 3, bits),
        (259, 3, 1),
        (262, 3, 1),
        (273, 4, data),
        (277, 3, 1),
        (278, 4, edge),
        (279, 4, bytes),
    ]
}

/// A TIFF file with a page for every slice of 24 x 24 bytes.
fn tiff(bytes: &[u8]) -> Vec<u8> {
    let mut file = b"II*\0\x08\0\0\0".to_vec();
    let pages = bytes.len() / 576;
    for (n, slice) in bytes.chunks_exact(576).enumerate() {
        let data = file.len() as u32 + 2 + 9 * 12 + 4;
        let next = if n + 1 < pages { data + 576 } else { 0 };
        directory(&mut file, &page(24, 8, data, 576), next);
        file.extend(slice);
    }
    file
}

#[test]
fn a_truncated_tiff() {
    let whole = tiff(&image(BALL));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("ball.tif");
    std::fs::write(&path, &whole).unwrap();
    let out = folder.path().join("ball.grain");
    let mut taken = grainwake();
    taken.args(["grain", "from-scan", "--voxel", "10 um"]).arg(&path).arg("-o").arg(&out);
    taken.assert().success();
    for part in [whole.len() / 2, 100, 7] {
        refused_image("part.tif", &whole[..part], &["part.tif: damaged", "export the file again"]);
    }
}

#[test]
fn an_absurd_image_header() {
    // One page of 10^6 x 10^6 samples of 32 bits that are not there.
    let mut bytes: Vec<u8> = b"II*\0\x08\0\0\0".to_vec();
    directory(&mut bytes, &page(1_000_000, 32, 8, 4_000_000), 0);
    let start = std::time::Instant::now();
    refused_image("absurd.tif", &bytes, &["absurd.tif", "1000000"]);
    assert!(start.elapsed().as_secs() < 20);
}

#[test]
fn lengths_that_no_grain_has() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("x.grain");
    let bodies: [&[&str]; 5] = [
        &["sphere", "1e300"],
        &["sphere", "1e-300"],
        &["sphere", "1e7 m"],
        &["ellipsoid", "1e100", "1e100", "1e100"],
        &["cylinder", "1e200", "1"],
    ];
    for body in bodies {
        let mut command = grainwake();
        let done = command.args(["grain", "make"]).args(body).arg("-o").arg(&out).assert().code(2);
        let message = String::from_utf8_lossy(&done.get_output().stderr).into_owned();
        assert!(message.contains("between 1e-9 m and 1e6 m"), "{body:?}: {message}");
        assert!(message.lines().all(|line| line.len() < 150), "{message}");
        assert!(!out.exists());
    }
    let mut command = grainwake();
    command.args(["grain", "make", "sphere", "2 mm"]).arg("-o").arg(&out).assert().success();
}

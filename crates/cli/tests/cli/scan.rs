//! `grain from-scan`: preview, notes and advice.

use std::path::Path;

use crate::common::grainwake;
use grainwake_plot::raster::Picture;

const N: usize = 64;

/// An 8-bit image: 0 outside a cylinder, void 60, three balls of 160 with blurred surfaces. The
/// ball with the largest y reaches the edge of the cylinder.
fn masked() -> Vec<u8> {
    let balls = [[22.3, 30.2, 20.4, 8.0], [40.1, 33.4, 40.2, 10.0], [32.2, 53.1, 30.7, 8.0]];
    let value = |n: usize| {
        let x = [n % N, n / N % N, n / N / N].map(|i| i as f64 + 0.5);
        if (x[0] - 32.0).hypot(x[1] - 32.0) >= 28.0 {
            return 0;
        }
        let depth = balls.map(|[a, b, c, radius]| {
            radius - ((x[0] - a).powi(2) + (x[1] - b).powi(2) + (x[2] - c).powi(2)).sqrt()
        });
        let solid = (0.5 + 0.4 * depth.into_iter().fold(-9.0, f64::max)).clamp(0.0, 1.0);
        // Texture, so that void and solid are not of one value.
        (60.0 + 100.0 * solid + (n * 2_654_435_761 % 97) as f64 / 24.0) as u8
    };
    (0..N * N * N).map(value).collect()
}

fn nrrd(path: &Path, values: &[u8]) {
    let header =
        format!("NRRD0004\ntype: uint8\ndimension: 3\nsizes: {N} {N} {N}\nencoding: raw\n\n");
    std::fs::write(path, [header.as_bytes(), values].concat()).unwrap();
}

/// Runs `from-scan` on an image beside the folder `out`; standard error.
fn from_scan(folder: &Path, values: &[u8], more: &[&str], code: i32) -> String {
    let image = folder.join("image.nrrd");
    nrrd(&image, values);
    let mut program = grainwake();
    program.current_dir(folder).args(["grain", "from-scan", "image.nrrd", "--voxel", "20 um"]);
    let done = program.args(["--no-roundness", "-o", "out"]).args(more).assert().code(code);
    String::from_utf8_lossy(&done.get_output().stderr).into_owned()
}

/// Number of pixels of about this hue: the largest and the smallest channel, and their difference.
fn coloured(picture: &Picture, large: usize, small: usize) -> usize {
    let is = |p: &&[u8]| p[large] > p[small].saturating_add(60);
    picture.pixels.chunks_exact(3).filter(is).count()
}

#[test]
fn a_preview_shows_what_will_be_kept_and_writes_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let more = ["--threshold", "otsu", "--split", "--preview", "slices.png"];
    let message = from_scan(folder.path(), &masked(), &more, 0);
    for words in [
        "40 % of the image lie outside the field of view or mask and have the value 0",
        "1 label rejected, cut by the edge of the field of view: 2 (",
        "2 grains kept, 1 rejected; none written",
    ] {
        assert!(message.contains(words), "`{words}` is missing in:\n{message}");
    }
    assert!(!folder.path().join("out").exists());
    let picture = folder.path().join("slices.png");
    let drawn = Picture::from_png(&std::fs::read(&picture).unwrap()).unwrap();
    assert!(drawn.width > 2000 && drawn.height > 1000, "{} x {}", drawn.width, drawn.height);
    // Kept grains are blue to green, the rejected one is orange, and the rest is grey.
    let (cool, warm) = (coloured(&drawn, 2, 0), coloured(&drawn, 0, 2));
    let all = drawn.width * drawn.height;
    assert!(cool > all / 50 && warm > all / 1000, "{cool} and {warm} of {all}");
    assert!(cool + warm < all / 3);
    // The same grains are written without the option.
    let message = from_scan(folder.path(), &masked(), &more[..3], 0);
    assert!(message.contains("2 grains written, 1 rejected"), "{message}");
    let table = std::fs::read_to_string(folder.path().join("out/table.csv")).unwrap();
    assert!(table.lines().next().unwrap().ends_with("shared_surface,specks_removed"));
    // A picture is not replaced, and has its ending.
    let message = from_scan(folder.path(), &masked(), &more, 2);
    assert!(message.contains("slices.png exists already"), "{message}");
    let message = from_scan(folder.path(), &masked(), &["--preview", "slices.jpg"], 2);
    assert!(message.contains("does not end in .png"), "{message}");
}

#[test]
fn specks_are_told_and_a_second_body_is_rejected_with_the_option() {
    let folder = tempfile::tempdir().unwrap();
    let ball = |n: usize, centre: f64, radius: f64| {
        let x = [n % N, n / N % N, n / N / N].map(|i| i as f64 + 0.5 - centre);
        x.iter().map(|x| x * x).sum::<f64>().sqrt() < radius
    };
    let label = |n: usize, second: f64| u8::from(ball(n, 24.3, 12.0) || ball(n, 48.0, second));
    let image = |second: f64| (0..N * N * N).map(|n| label(n, second)).collect::<Vec<u8>>();
    let message = from_scan(folder.path(), &image(2.0), &[], 0);
    assert!(
        message.contains("specks removed from 1 grain, at most 0.44 % of the volume: 1"),
        "{message}"
    );
    let message = from_scan(folder.path(), &image(5.0), &["--force"], 2);
    assert!(
        message.contains("1 label rejected, each of several separate pieces: 1 ("),
        "{message}"
    );
    assert!(message.contains("  --largest-piece would accept 1 of 1"), "{message}");
    let told = from_scan(folder.path(), &image(5.0), &["--force", "--largest-piece"], 0);
    assert!(told.contains("specks removed from 1 grain, at most 7."), "{told}");
}

/// A plate of 4 voxels between blurred surfaces.
#[test]
fn a_grain_without_voxels_free_of_blur_has_a_note() {
    let folder = tempfile::tempdir().unwrap();
    let plate = |n: usize| {
        let x = [n % N, n / N % N, n / N / N].map(|i| (i as f64 - 31.7).abs());
        let depth = [14.0 - x[0], 10.0 - x[1], 2.0 - x[2]].into_iter().fold(9.0, f64::min);
        let texture = (n * 2_654_435_761 % 97) as f64 / 24.0;
        (60.0 + 100.0 * (0.5 + 0.3 * depth).clamp(0.0, 1.0) + texture) as u8
    };
    let image: Vec<u8> = (0..N * N * N).map(plate).collect();
    let message = from_scan(folder.path(), &image, &["--threshold", "otsu"], 0);
    let note = "note: the grey value of the solid is uncertain for 1 grain with";
    assert!(message.contains(note) && message.contains(": label 1"), "{message}");
    let message =
        from_scan(folder.path(), &masked(), &["--threshold", "otsu", "--split", "--force"], 0);
    assert!(!message.contains("uncertain"), "{message}");
}

#[test]
fn the_voxel_size_of_the_file_is_compared() {
    let folder = tempfile::tempdir().unwrap();
    let image = folder.path().join("image.nrrd");
    let ball = |n: usize| {
        let x = [n % 24, n / 24 % 24, n / 576].map(|i| i as f64 - 11.5);
        u8::from(x.iter().map(|x| x * x).sum::<f64>() < 64.0)
    };
    let voxels: Vec<u8> = (0..24 * 24 * 24).map(ball).collect();
    let run = |spacings: &str, voxel: &str, code: i32| {
        let units = "units: \"um\" \"um\" \"um\"";
        let header = format!(
            "NRRD0004\ntype: uint8\nsizes: 24 24 24\nencoding: raw\n{units}\n\
             spacings: {spacings}\n\n"
        );
        std::fs::write(&image, [header.as_bytes(), &voxels].concat()).unwrap();
        let mut program = grainwake();
        program.args(["grain", "from-scan", "--no-roundness", "--force"]).arg(&image);
        program.args(["--voxel", voxel, "-o"]).arg(folder.path().join("ball.grain"));
        let done = program.assert().code(code);
        String::from_utf8_lossy(&done.get_output().stderr).into_owned()
    };
    let message = run("20 20 20", "20 um", 0);
    assert!(!message.contains("note:"), "{message}");
    let message = run("20 20 20", "20 mm", 0);
    assert!(
        message.contains("image.nrrd states voxels of 20 um, unlike --voxel 20 mm"),
        "{message}"
    );
    let message = run("20 20 50", "20 um", 2);
    assert!(message.contains("20 x 20 x 50 um") && message.contains("resample"), "{message}");
}

#[test]
fn filled_cavities_are_told() {
    let folder = tempfile::tempdir().unwrap();
    // A ball of radius 20 voxels with a closed cavity of radius 8.
    let value = |n: usize| {
        let x = [n % N, n / N % N, n / N / N].map(|i| i as f64 + 0.5 - 32.0);
        let radius = x.iter().map(|x| x * x).sum::<f64>().sqrt();
        u8::from((8.0..20.0).contains(&radius))
    };
    let values: Vec<u8> = (0..N * N * N).map(value).collect();
    for more in [&["--force"][..], &["--force", "--separate"], &["--force", "--preview", "x.png"]] {
        let message = from_scan(folder.path(), &values, more, 0);
        let words = "cavities filled in 1 grain, at most 6.4";
        assert!(message.contains(words), "{more:?}: {message}");
    }
}

#[test]
fn a_diameter_out_of_range_is_refused_before_the_image_is_read() {
    let folder = tempfile::tempdir().unwrap();
    for diameter in ["0 mm", "-2 mm", "1e9 m"] {
        let more = ["--threshold", "otsu", "--equivalent-diameter", diameter];
        let message = from_scan(folder.path(), &masked(), &more, 2);
        assert!(message.contains("--equivalent-diameter = "), "{message}");
        assert!(!message.contains("threshold 1"), "the image was read first: {message}");
    }
}

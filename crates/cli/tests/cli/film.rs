//! `grainwake report --film`.

use std::path::Path;

use crate::common::{DRY, WET, folder_with, grainwake};
use grainwake_plot::raster::Picture;
use predicates::prelude::PredicateBooleanExt;
use predicates::str::contains;

fn run(text: &str, more: &[&str]) -> (tempfile::TempDir, std::path::PathBuf) {
    let (folder, case) = folder_with(text);
    let out = folder.path().join("run");
    let mut command = grainwake();
    command.arg("run").arg(&case).arg("-o").arg(&out).args(["--quiet", "--no-report"]).args(more);
    command.assert().success();
    (folder, out)
}

fn film(run: &Path) -> assert_cmd::assert::Assert {
    grainwake().arg("report").arg(run).arg("--film").assert()
}

fn frames(run: &Path) -> Vec<Picture> {
    let file = |n: usize| run.join(format!("film/frame-{n:04}.png"));
    let bytes = (1..).map_while(|n| std::fs::read(file(n)).ok());
    bytes.map(|bytes| Picture::from_png(&bytes).unwrap()).collect()
}

/// Mean row of the pixels that `wanted` accepts, and their number.
fn mean_row(picture: &Picture, wanted: impl Fn(&[u8]) -> bool) -> (f64, usize) {
    let pixels = picture.pixels.chunks_exact(3).enumerate();
    let rows: Vec<usize> =
        pixels.filter(|(_, p)| wanted(p)).map(|(at, _)| at / picture.width).collect();
    (rows.iter().sum::<usize>() as f64 / rows.len().max(1) as f64, rows.len())
}

#[test]
fn a_film_of_slices_shows_fluid_and_grains() {
    let (_folder, run) = run(WET, &["--set", "output.slices=2 ms"]);
    std::fs::create_dir(run.join("film")).unwrap();
    std::fs::write(run.join("film/frame-0032.png"), "of a longer film").unwrap();
    film(&run).success().stdout(contains("film.gif")).stderr(contains("ffmpeg"));
    let frames = frames(&run);
    assert_eq!(frames.len(), 31, "one per slice, none of an older film");
    let size = (frames[0].width, frames[0].height);
    assert!(
        size.0.is_multiple_of(2) && size.1.is_multiple_of(2) && size.0 <= 1280 && size.1 <= 960,
        "{size:?}"
    );
    for pair in frames.windows(2) {
        assert!((pair[1].width, pair[1].height) == size && pair[0] != pair[1]);
    }
    let grain = |p: &[u8]| p == [0xd9; 3];
    let (_, area) = mean_row(&frames[15], grain);
    assert!(area > size.0 * size.1 / 200, "{area} of {size:?} pixels are grains");
    let coloured = |p: &[u8]| i16::from(p[0]) + 8 < i16::from(p[1]);
    // At the start only the colour bar has colours.
    let (still, moving) = (mean_row(&frames[0], coloured).1, mean_row(&frames[15], coloured).1);
    assert!(still > 0 && moving > 2 * still, "{still} {moving}: the fluid starts to move");
    let bytes = std::fs::read(run.join("film.gif")).unwrap();
    assert!(bytes.starts_with(b"GIF89a") && bytes.len() < 20_000_000, "{} bytes", bytes.len());
    film(&run).success();
    assert_eq!(std::fs::read(run.join("film.gif")).unwrap(), bytes, "equal runs, equal bytes");
}

#[test]
fn a_film_of_a_dry_run_shows_the_grains_fall() {
    let (_folder, run) = run(DRY, &[]);
    film(&run).success();
    let frames = frames(&run);
    assert_eq!(frames.len(), 121, "one per row of the table");
    // Grains have colours; frame, text and background have none.
    let coloured = |p: &[u8]| p[0].abs_diff(p[2]) > 30;
    let (first, last) = (mean_row(&frames[0], coloured), mean_row(&frames[120], coloured));
    assert!(last.0 > first.0 + 0.1 * frames[0].height as f64, "{first:?} {last:?}");
}

#[test]
fn a_short_interval_of_a_film_is_not_zero() {
    let (_folder, run) = run(DRY, &["--set", "output.tables=0.2 ms", "--set", "time.end=4 ms"]);
    film(&run).success().stderr(contains("21 pictures").and(contains(", 0.2 ms of the run apart")));
}

#[test]
fn too_few_pictures_are_refused_with_the_remedy() {
    let (folder, run) = run(WET, &[]);
    film(&run).code(2).stderr(contains("at least 8").and(contains("output.slices")));
    assert!(!run.join("film.gif").exists() && !run.join("film").exists());
    film(folder.path()).code(2).stderr(contains("holds no run"));
}

#[test]
fn a_study_has_no_film() {
    let (folder, _) = folder_with(WET);
    let study = folder.path().join("study.toml");
    let text = "title = \"t\"\nbase = \"case.toml\"\n[[axis]]\nname = \"v\"\nkey = \"time.end\"\n\
                values = [{ name = \"a\", value = \"4 ms\" }]\n";
    std::fs::write(&study, text).unwrap();
    let out = folder.path().join("s");
    grainwake().arg("study").arg(&study).arg("-o").arg(&out).arg("--quiet").assert().success();
    film(&out).code(2).stderr(contains("study folder").and(contains("runs/NAME")));
}

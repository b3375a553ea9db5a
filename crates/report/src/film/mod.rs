//! Film of a run: pictures of slices and grains at even times, as an animated GIF and as PNG files.
//!
//! A run with slices shows the speed of the fluid with the grains in the plane; a dry run shows the
//! grains from the side, coloured by their speed. All pictures have one size and one colour scale.

mod moments;
mod side_view;
mod slice_view;

use std::path::{Path, PathBuf};

use grainwake_formats::disk;
use grainwake_plot::Drawing;
use grainwake_plot::animation::encode_gif;
use grainwake_plot::raster::Picture;

use crate::error::{ReportError, Written as _};
use crate::features::RunFeatures;
use crate::figure::Scene;
use crate::files::write_file;
use crate::read_with_surfaces;

/// Smallest number of pictures of a film.
pub const MIN_FRAMES: usize = 8;
/// Largest number of pictures; longer runs are thinned.
pub const MAX_FRAMES: usize = 200;
/// Largest size of the GIF file [bytes]. Larger films are scaled down.
pub const MAX_BYTES: usize = 20_000_000;
/// Largest width and height of the pictures [pixels].
const MAX_SIZE: [f64; 2] = [1280.0, 960.0];
/// Sharpest pictures [pixels/pt].
const MAX_SCALE: f64 = 4.0;
/// Intended duration of a film [s].
const DURATION: f64 = 6.0;
/// Shortest and longest time that a picture is shown [s].
const DELAYS: (f64, f64) = (0.04, 0.12);
/// Folder of the pictures in the run folder.
const FOLDER: &str = "film";
/// Film in the run folder.
const FILE: &str = "film.gif";

/// Files of a film.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    /// Animated GIF.
    pub file: PathBuf,
    /// Size of the GIF file [bytes].
    pub bytes: usize,
    /// Width and height of the GIF [pixels]; the PNG files may be larger.
    pub size: [usize; 2],
    /// Folder with the pictures `frame-0001.png`, ...
    pub folder: PathBuf,
    /// Number of pictures.
    pub frames: usize,
    /// Time that each picture is shown [s].
    pub delay: f64,
    /// Simulated time between two pictures [s].
    pub interval: f64,
    /// Missing or omitted parts.
    pub notes: Vec<String>,
}

/// Pictures of a film, drawn one at a time.
trait View {
    /// Times of the pictures [s].
    fn times(&self) -> &[f64];
    /// Draws one picture.
    fn draw(&self, index: usize) -> Result<Drawing, String>;
}

/// Writes `film.gif` and the PNG files in `film/` into a run folder.
///
/// # Errors
/// If the folder holds no run, a table or log cannot be read, there are too few moments to show, or
/// a file cannot be written.
pub fn write_film(run_dir: &Path) -> Result<Film, ReportError> {
    let (run, surfaces, mut notes) = read_with_surfaces(run_dir)?;
    let features = RunFeatures::of(&run);
    let scene = Scene { run: &run, features: &features, surfaces, instants: Vec::new() };
    let wet = !run.slices.is_empty();
    let view: Box<dyn View + '_> = match wet {
        true => Box::new(slice_view::SliceFilm::new(&scene, &mut notes)),
        false => Box::new(side_view::SideFilm::new(&scene)),
    };
    let found = view.times().len();
    if found < MIN_FRAMES {
        let folder = run_dir.to_owned();
        let output = if wet || run.facts.fluid_density.is_some() { "slices" } else { "tables" };
        return Err(ReportError::TooFewFrames { folder, found, least: MIN_FRAMES, output });
    }
    let folder = run_dir.join(FOLDER);
    let mut film = write_frames(&*view, folder)?;
    film.notes = notes;
    film.file = run_dir.join(FILE);
    let gif = shrunk_gif(&mut film, MAX_BYTES).written(&film.file)?;
    film.bytes = gif.len();
    write_file(&film.file, &gif).written(&film.file)?;
    Ok(film)
}

/// Path of a picture; numbers start at 1.
fn frame_file(folder: &Path, index: usize) -> PathBuf {
    folder.join(format!("frame-{:04}.png", index + 1))
}

/// Draws all pictures into `folder`, in place of those of an earlier film.
fn write_frames(view: &dyn View, folder: PathBuf) -> Result<Film, ReportError> {
    disk::create_folder(&folder).written(&folder)?;
    let times = view.times();
    let mut size = [0, 0];
    let mut scale = 1.0;
    for index in 0..times.len() {
        let file = frame_file(&folder, index);
        let drawing = view.draw(index).written(&file)?;
        if index == 0 {
            let (width, height) = (drawing.width(), drawing.height());
            scale = (MAX_SIZE[0] / width).min(MAX_SIZE[1] / height).min(MAX_SCALE);
            // Video codecs need even sizes.
            size = [width, height].map(|length| 2 * (0.5 * length * scale).floor() as u32);
        }
        let picture = drawing.to_picture(size, scale).written(&file)?;
        write_file(&file, &picture.to_png().written(&file)?).written(&file)?;
    }
    for old in (times.len()..).map(|index| frame_file(&folder, index)).take_while(|f| f.is_file()) {
        disk::remove_file(&old).written(&old)?;
    }
    let count = times.len();
    let span = times[count - 1] - times[0];
    Ok(Film {
        file: PathBuf::new(),
        bytes: 0,
        size: size.map(|length| length as usize),
        folder,
        frames: count,
        // A GIF counts hundredths of a second.
        delay: (100.0 * DURATION / count as f64).round().clamp(100.0 * DELAYS.0, 100.0 * DELAYS.1)
            / 100.0,
        interval: span / (count - 1) as f64,
        notes: Vec::new(),
    })
}

/// Encodes the GIF from the PNG files, scaled down until it has at most `limit` bytes.
fn shrunk_gif(film: &mut Film, limit: usize) -> Result<Vec<u8>, String> {
    let full = film.size;
    loop {
        let size = film.size;
        let picture = |index: usize| -> Result<Picture, String> {
            let file = frame_file(&film.folder, index);
            let bytes = std::fs::read(&file).map_err(|e| format!("{}: {e}", file.display()))?;
            let picture = Picture::from_png(&bytes)?;
            Ok(if size == full { picture } else { picture.resized(size[0], size[1]) })
        };
        let gif = encode_gif(film.frames, film.delay, &picture)?;
        if gif.len() <= limit || size[0].min(size[1]) < 16 {
            return Ok(gif);
        }
        let factor = (0.9 * (limit as f64 / gif.len() as f64).sqrt()).min(0.9);
        film.size = size.map(|length| ((length as f64 * factor) as usize).max(2));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_large_film_is_scaled_down() {
        let folder = crate::testing::folder();
        let mut film = Film {
            file: folder.join(FILE),
            bytes: 0,
            size: [160, 120],
            folder: folder.clone(),
            frames: 8,
            delay: 0.1,
            interval: 1.0,
            notes: Vec::new(),
        };
        // Noise does not compress.
        let mut state = 1u32;
        let mut noise = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 24) as u8
        };
        for index in 0..film.frames {
            let pixels = (0..3 * 160 * 120).map(|_| noise()).collect();
            let png = Picture { width: 160, height: 120, pixels }.to_png().unwrap();
            std::fs::write(frame_file(&folder, index), png).unwrap();
        }
        let whole = shrunk_gif(&mut film, usize::MAX).unwrap();
        assert_eq!(film.size, [160, 120]);
        let limit = whole.len() / 3;
        let small = shrunk_gif(&mut film, limit).unwrap();
        assert!(small.len() <= limit, "{} of {limit}", small.len());
        assert!(film.size[0] < 120 && film.size[0] > 40, "{:?}", film.size);
        std::fs::remove_dir_all(folder).unwrap();
    }
}

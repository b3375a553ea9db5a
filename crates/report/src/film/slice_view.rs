//! Pictures of the speed of the fluid in a plane, with the grains that it cuts.

use grainwake_plot::Drawing;
use grainwake_plot::axis::{Axis, AxisRange};
use grainwake_plot::equal_aspect::Window;

use super::{View, moments};
use crate::features::{RunKind, short};
use crate::figure::Scene;
use crate::figure::section::Section;
use crate::figure::slice_grid::{self, ColourScale, Column, Quantity, Style};
use crate::figure::{slice_outlines, slices};
use crate::run_folder::FrameFile;

/// Share of the pictures for which the name of an event stays.
const NAMED: f64 = 0.1;

/// Film of slices.
pub struct SliceFilm<'a> {
    scene: &'a Scene<'a>,
    times: Vec<f64>,
    /// Slices of each picture, one per plane.
    files: Vec<Vec<&'a FrameFile>>,
    /// Displayed ranges of each picture.
    windows: Vec<Vec<Window>>,
    style: Style,
    /// Largest speed in any slice [m/s].
    largest: f64,
}

impl<'a> SliceFilm<'a> {
    /// Reads all slices once, for the colour scale and the displayed ranges; slices that cannot be
    /// read are added to `notes`.
    pub fn new(scene: &'a Scene<'a>, notes: &mut Vec<String>) -> SliceFilm<'a> {
        let slices = &scene.run.slices;
        let mut times: Vec<f64> = slices.iter().map(|frame| frame.time).collect();
        times.dedup();
        let times: Vec<f64> = moments::even(&times).into_iter().map(|i| times[i]).collect();
        let mut film = SliceFilm {
            scene,
            times: Vec::new(),
            files: Vec::new(),
            windows: Vec::new(),
            style: Style::new(Quantity::Speed),
            largest: 0.0,
        };
        let mut columns = Vec::new();
        let mut apart = false;
        for time in times {
            let files = planes(scene, time);
            let mut read = Vec::new();
            for frame in &files {
                match scene.run.slice(frame).and_then(|image| scene.section(&image)) {
                    Ok(section) if section.velocity.is_some() => read.push(section),
                    Ok(_) => notes.push(scene.run.left_out(frame, "it has no velocity")),
                    Err(what) => notes.push(scene.run.left_out(frame, &what)),
                }
            }
            if read.len() < files.len() || read.is_empty() {
                continue;
            }
            apart |= scene.out_of_plane(time, read[0].view);
            for section in read {
                let column = column(scene, time, &section);
                // Only the range and the largest speed of a slice are kept.
                film.largest = film.largest.max(largest_speed(&section, column.window));
                columns.push(column);
            }
            film.times.push(time);
            film.files.push(files);
        }
        slices::crop(scene, &mut columns);
        let mut windows = columns.into_iter().map(|column| column.window);
        film.windows =
            film.files.iter().map(|files| windows.by_ref().take(files.len()).collect()).collect();
        if !apart {
            film.files.iter_mut().for_each(|files| files.truncate(1));
            film.windows.iter_mut().for_each(|windows| windows.truncate(1));
        }
        let axis = Axis::linear("", 0.0, film.largest.max(1e-30), 5, AxisRange::Rounded);
        film.style.limit = Some(axis.high());
        film
    }

    /// Returns the time and, shortly after an event, its name.
    fn caption(&self, index: usize) -> String {
        let time = self.times[index];
        let interval = (self.times[self.times.len() - 1] - self.times[0]) * NAMED;
        let events = self.scene.run.events.iter().rev();
        let mut past = events.filter(|event| event.time <= time + 1e-12);
        let recent = past.find(|event| time - event.time < interval);
        let name =
            recent.map_or(String::new(), |event| format!(", {}", self.scene.event_name(event)));
        format!("*t* = {} s{name}", short(time))
    }
}

impl View for SliceFilm<'_> {
    fn times(&self) -> &[f64] {
        &self.times
    }

    fn draw(&self, index: usize) -> Result<Drawing, String> {
        let time = self.times[index];
        let several = self.files[index].len() > 1;
        let mut columns = Vec::new();
        for (frame, window) in self.files[index].iter().zip(&self.windows[index]) {
            let image = self.scene.run.slice(frame)?;
            let section = self.scene.section(&image)?;
            let mut column = column(self.scene, time, &section);
            column.window = *window;
            column.time = self.caption(index);
            if let Some(grain) = frame.grain.filter(|_| several) {
                column.title = format!("plane of grain {grain}");
            }
            column.sections = vec![Some(section)];
            column.outlines = slice_outlines::of_column(self.scene, &column);
            columns.push(column);
        }
        let mut scale = ColourScale::new(&self.style, &columns);
        scale.set_largest(self.largest);
        slice_grid::draw(&columns, &[], &scale, None).ok_or_else(|| "there is no slice".to_owned())
    }
}

/// Returns the slices at a time: the planes of both grains of a pair, else the first plane.
fn planes<'a>(scene: &Scene<'a>, time: f64) -> Vec<&'a FrameFile> {
    let frames = || scene.run.slices.iter().filter(|frame| frame.time == time);
    let of_pair = scene.features.pair.filter(|_| scene.features.kind == RunKind::Pair).and_then(
        |[trailing, leading]| {
            let through = |grain| frames().find(|frame| frame.grain == Some(grain));
            Some(vec![through(trailing)?, through(leading)?])
        },
    );
    of_pair.unwrap_or_else(|| frames().take(1).collect())
}

/// Returns a column without its slice, displayed as a whole.
fn column(scene: &Scene, time: f64, section: &Section) -> Column {
    Column {
        title: String::new(),
        time: String::new(),
        at: time,
        window: section.whole(),
        sections: Vec::new(),
        centres: scene.centres(time, section.view),
        outlines: Vec::new(),
    }
}

/// Returns the largest speed in a window, outside the grains [m/s].
fn largest_speed(section: &Section, window: Window) -> f64 {
    let Some(values) = Quantity::Speed.values(section) else {
        return 0.0;
    };
    let cells = section.cells_in(window).filter(|cell| section.solid(*cell) < 0.5);
    cells.map(|cell| values[cell]).filter(|v| v.is_finite()).fold(0.0, f64::max)
}

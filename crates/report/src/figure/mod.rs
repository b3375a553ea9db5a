//! Figures of a run: each a drawing with its caption, written as SVG and PNG.

mod curves;
mod cuts;
pub mod field;
mod heap;
mod history;
mod orientation;
pub mod section;
mod sheet;
pub mod silhouette;
mod slices;
mod trajectory;

use std::collections::BTreeMap;

use grainwake_plot::{Drawing, plain};

use crate::phases::{self, Instant};
use crate::run_folder::RunFolder;
use crate::story::{Story, Subject};

pub use silhouette::{Body, bodies};

/// Names of the coordinate axes.
const AXES: [&str; 3] = ["x", "y", "z"];

/// A figure ready to be written.
#[derive(Clone, Debug)]
pub struct Figure {
    /// File name without its extension.
    pub name: &'static str,
    /// Title.
    pub title: String,
    /// What is to be seen, in plain words with the numbers, in label markup.
    pub caption: String,
    /// The drawing.
    pub drawing: Drawing,
}

impl Figure {
    /// The figure as an SVG document that can also stand inside a page.
    pub fn svg(&self) -> String {
        self.drawing
            .to_svg(self.name, &plain(&self.title), &plain(&self.caption))
    }
}

/// What the figures are drawn from.
pub struct Scene<'a> {
    /// The run folder.
    pub run: &'a RunFolder,
    /// What it tells.
    pub story: &'a Story,
    /// Surfaces of the grains in their own frames, as far as known.
    pub bodies: BTreeMap<usize, Body>,
    /// Instants that the pictures show, at times that the folder has pictures of.
    pub instants: Vec<Instant>,
}

/// Draws all figures that the run has data for; what had to be left out is added to `notes`.
pub fn all(
    run: &RunFolder,
    story: &Story,
    bodies: BTreeMap<usize, Body>,
    notes: &mut Vec<String>,
) -> Vec<Figure> {
    let instants = phases::snap(&story.instants, &picture_times(run));
    let scene = Scene {
        run,
        story,
        bodies,
        instants,
    };
    let mut out = Vec::new();
    match story.subject {
        Subject::Pair => {
            out.extend(trajectory::figure(&scene));
            out.extend(curves::gap(&scene));
            out.extend(curves::pair_velocity(&scene));
            out.extend(orientation::figure(&scene, notes));
        }
        Subject::Single => {
            if story.travels {
                out.extend(trajectory::figure(&scene));
                out.extend(curves::single_velocity(&scene));
            }
            out.extend(history::force(&scene));
            out.extend(orientation::figure(&scene, notes));
        }
        Subject::Many => {
            out.extend(heap::positions(&scene));
            if story.travels && scene.moving().len() <= history::FEW {
                out.extend(trajectory::figure(&scene));
            }
            out.extend(history::each(&scene));
            out.extend(history::many(&scene));
        }
        Subject::Flow => {}
    }
    out.extend(slices::figures(&scene, notes));
    out.extend(history::diagnostics(&scene));
    out
}

/// Times of the slices; without slices, of the table.
fn picture_times(run: &RunFolder) -> Vec<f64> {
    let mut times: Vec<f64> = run.slices.iter().map(|frame| frame.time).collect();
    if times.is_empty() {
        times = run
            .grains
            .iter()
            .find(|history| !history.is_empty())
            .map(|h| h.time.clone())
            .unwrap_or_default();
    }
    times.dedup();
    times
}

/// The letter of the i-th instant: (a), (b), ...
pub fn letter(i: usize) -> String {
    format!("({})", char::from(b'a' + (i % 26) as u8))
}

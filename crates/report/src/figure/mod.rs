//! Figures of a run.

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

use grainwake_plot::Figure;

use crate::phases::{self, Instant};
use crate::run_folder::RunFolder;
use crate::story::{Story, Subject};

pub use silhouette::{Body, bodies};

/// Names of the coordinate axes.
const AXES: [&str; 3] = ["x", "y", "z"];

/// Data of the figures.
pub struct Scene<'a> {
    /// Run folder.
    pub run: &'a RunFolder,
    /// Features derived from the tables.
    pub story: &'a Story,
    /// Known surfaces of the grains, in the body frame.
    pub bodies: BTreeMap<usize, Body>,
    /// Key instants, moved to the nearest times with pictures.
    pub instants: Vec<Instant>,
}

/// Draws all figures that the run has data for; omissions are added to `notes`.
pub fn all(
    run: &RunFolder,
    story: &Story,
    bodies: BTreeMap<usize, Body>,
    notes: &mut Vec<String>,
) -> Vec<Figure> {
    let scene = Scene {
        run,
        story,
        bodies,
        instants: phases::snap(&story.instants, &picture_times(run)),
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

/// Returns the times of the slices or, without slices, of the tables [s].
fn picture_times(run: &RunFolder) -> Vec<f64> {
    let mut times: Vec<f64> = run.slices.iter().map(|frame| frame.time).collect();
    if times.is_empty() {
        let moving = run.grains.iter().find(|history| !history.is_empty());
        times = moving.map(|h| h.time.clone()).unwrap_or_default();
    }
    times.dedup();
    times
}

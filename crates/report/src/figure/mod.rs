//! Figures of a run.

mod arrows;
mod coverage;
mod curves;
pub mod field;
pub mod grain_surface;
mod history;
mod orientation;
pub(crate) mod positions;
pub(crate) mod scene;
pub mod section;
pub(crate) mod slice_grid;
pub(crate) mod slice_outlines;
pub(crate) mod slices;
mod trajectory;

use grainwake_plot::Figure;

use crate::features::{RunFeatures, RunKind};
use crate::phases;
use crate::run_folder::RunFolder;

pub use grain_surface::{GrainSurface, Surfaces, surfaces};
pub(crate) use scene::Scene;

/// Draws all figures that the run has data for; omissions are added to `notes`.
pub fn all(
    run: &RunFolder,
    features: &RunFeatures,
    surfaces: Surfaces,
    notes: &mut Vec<String>,
) -> Vec<Figure> {
    let scene = Scene {
        run,
        features,
        surfaces,
        instants: phases::snap(&features.instants, &picture_times(run)),
    };
    let mut out = Vec::new();
    let has_curves = run.has_curves();
    if !has_curves && features.kind != RunKind::Flow {
        let note = "grains.csv has fewer than two rows for each grain: no curves are drawn. Run \
                    the case with a shorter output.tables.";
        notes.push(note.to_owned());
    }
    match features.kind {
        RunKind::Many if !has_curves => out.extend(positions::figure(&scene)),
        _ if !has_curves => {}
        RunKind::Pair => {
            out.extend(trajectory::figure(&scene));
            out.extend(curves::gap(&scene));
            out.extend(curves::pair_velocity(&scene));
            out.extend(orientation::figure(&scene, notes));
        }
        RunKind::Single => {
            if features.travels {
                out.extend(trajectory::figure(&scene));
                out.extend(curves::single_velocity(&scene));
            }
            out.extend(history::force(&scene));
            out.extend(orientation::figure(&scene, notes));
        }
        RunKind::Many => {
            out.extend(positions::figure(&scene));
            if features.travels && scene.moving().len() <= history::FEW {
                out.extend(trajectory::figure(&scene));
            }
            out.extend(history::each(&scene));
            out.extend(history::many(&scene));
        }
        RunKind::Flow => {}
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

//! JSON documents of the page: the list of runs, and the contents of one run.

use grainwake_formats::events::Event;
use grainwake_formats::table::Table;
use grainwake_plot::colormap::ColorMap;
use grainwake_plot::style::{SERIES_COLOURS, series_colour};
use grainwake_report::features::RunFeatures;
use grainwake_report::run_folder::RunFolder;
use serde::Serialize;

use crate::frame_cache::FrameCache;
use crate::meshes::{Mesh, bodies};
use crate::packed::Packed;
use crate::poses::{Poses, poses};
use crate::slices::{Series, SliceLimits, series};

/// List of runs.
#[derive(Clone, Debug, Serialize)]
pub struct Index {
    /// Program and version.
    pub program: String,
    /// True if a server sends later states of the runs, false in a saved page.
    pub live: bool,
    /// Names of the runs.
    pub runs: Vec<String>,
    /// Table of a study.
    pub study: Option<StudyTable>,
    /// Colours of grains, as `#rrggbb`.
    pub colours: Vec<&'static str>,
    /// 256 colours (R, G, B) of magnitudes.
    pub magnitude: Packed,
    /// 256 colours (R, G, B) of signed values.
    pub signed: Packed,
}

impl Index {
    /// Creates the list with the colours of all figures.
    pub fn new(runs: Vec<String>, study: Option<StudyTable>, live: bool) -> Index {
        let palette = |map: ColorMap| Packed::bytes(map.palette().as_flattened());
        Index {
            program: format!("Grainwake {}", env!("CARGO_PKG_VERSION")),
            live,
            runs,
            study,
            colours: (0..SERIES_COLOURS).map(series_colour).collect(),
            magnitude: palette(ColorMap::Magnitude),
            signed: palette(ColorMap::Signed),
        }
    }
}

/// Table of the runs of a study.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct StudyTable {
    /// Title of the study.
    pub title: String,
    /// Headings of the values.
    pub columns: Vec<String>,
    /// Rows.
    pub rows: Vec<StudyRow>,
}

/// Row of the table of a study.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct StudyRow {
    /// Name of the run.
    pub name: String,
    /// State in words.
    pub state: String,
    /// Index of the run in the list of runs, if it can be opened.
    pub run: Option<usize>,
    /// Values as text; empty if unknown.
    pub values: Vec<String>,
}

/// Largest size of the parts of a run's document.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Poses of grains.
    pub poses: usize,
    /// Slices.
    pub slices: SliceLimits,
}

impl Limits {
    /// Limits of a served page.
    pub const SERVED: Limits =
        Limits { poses: 400_000, slices: SliceLimits { cells: 60_000, total: 4_000_000 } };

    /// Limits of one of `runs` runs in a saved page of about 5 MB.
    pub fn saved(runs: usize) -> Limits {
        let share = |all: usize| (all / runs.max(1)).max(all / 20);
        let slices = SliceLimits { cells: 20_000, total: share(1_000_000) };
        Limits { poses: share(40_000), slices }
    }
}

/// Contents of a run.
#[derive(Clone, Debug, Serialize)]
pub struct RunDocument {
    name: String,
    title: Option<String>,
    /// `finished`, `failed` or `unfinished`.
    state: &'static str,
    failure: Option<String>,
    /// Missing, damaged or omitted parts.
    pub notes: Vec<String>,
    lower: [f64; 3],
    size: Option<[f64; 3]>,
    periodic: [bool; 3],
    gravity: Option<[f64; 3]>,
    fluid_density: Option<f64>,
    viscosity: Option<f64>,
    end: f64,
    grains: Vec<GrainDocument>,
    meshes: Vec<Mesh>,
    poses: Option<Poses>,
    events: Vec<EventDocument>,
    diagnostics: Vec<Column>,
    slices: Vec<Series>,
}

#[derive(Clone, Debug, Serialize)]
struct GrainDocument {
    /// Number in the cycle of colours.
    colour: usize,
    mesh: usize,
    scale: f64,
    diameter: Option<f64>,
    density: Option<f64>,
    shape: Option<String>,
}

#[derive(Clone, Debug, Serialize)]
struct EventDocument {
    label: &'static str,
    #[serde(flatten)]
    event: Event,
}

#[derive(Clone, Debug, Serialize)]
struct Column {
    name: String,
    values: Packed,
}

impl RunDocument {
    /// Collects the contents of a run folder.
    pub fn of(name: &str, run: &RunFolder, limits: Limits, cache: &mut FrameCache) -> RunDocument {
        let mut notes = run.notes.clone();
        let facts = &run.facts;
        let bodies = bodies(run, &mut notes);
        let poses = poses(run, &bodies.diameters, limits.poses);
        let slices = series(run, limits.slices, cache, &mut notes);
        if facts.size.is_none() {
            notes.push("the box is not known: its edges are those of the paths".to_owned());
        }
        if slices.is_empty() && facts.fluid_density.is_some() {
            notes
                .push("no slices: the run has written none yet, or [output] turns them off".into());
        }
        thinning_notes(&mut notes, poses.as_ref(), &slices);
        let features = RunFeatures::of(run);
        let grains = bodies.grains.iter().enumerate().map(|(i, (mesh, scale))| {
            let facts = facts.grains.get(i);
            GrainDocument {
                colour: features.grain_rank(i),
                mesh: *mesh,
                scale: *scale,
                diameter: bodies.diameters[i],
                density: facts.and_then(|f| f.density),
                shape: facts.and_then(|f| f.shape.clone()),
            }
        });
        let failure = run.failure.as_ref();
        let failure =
            failure.map(|f| f.get("what").and_then(|w| w.as_str()).unwrap_or("not known"));
        RunDocument {
            name: name.to_owned(),
            title: facts.title.clone(),
            state: match (&run.failure, run.finished()) {
                (Some(_), _) => "failed",
                (None, true) => "finished",
                (None, false) => "unfinished",
            },
            failure: failure.map(str::to_owned),
            lower: facts.lower.to_array(),
            size: facts.size.map(|size| size.to_array()),
            periodic: [0, 1, 2].map(|axis| run.period(axis).is_some()),
            gravity: facts.gravity.map(|g| g.to_array()),
            fluid_density: facts.fluid_density,
            viscosity: facts.viscosity,
            end: run.end(),
            grains: grains.collect(),
            meshes: bodies.meshes,
            poses,
            events: (run.events.iter().cloned())
                .map(|event| EventDocument { label: event.kind.label(), event })
                .collect(),
            diagnostics: run.diagnostics.as_ref().map(columns).unwrap_or_default(),
            slices,
            notes,
        }
    }
}

/// Adds notes on what the page leaves out for its size.
fn thinning_notes(notes: &mut Vec<String>, poses: Option<&Poses>, slices: &[Series]) {
    if let Some(stride) = poses.map(|p| p.stride).filter(|stride| *stride > 1) {
        notes.push(format!("thinned: one of {stride} output times of the grains is shown"));
    }
    let largest = |value: fn(&Series) -> usize| slices.iter().map(value).max().unwrap_or(1);
    let (stride, coarsening) = (largest(|s| s.stride), largest(|s| s.coarsening));
    if stride > 1 {
        notes.push(format!("thinned: one of {stride} slices is shown"));
    }
    if coarsening > 1 {
        notes.push(format!("slices are averaged over {coarsening} x {coarsening} cells"));
    }
}

/// Returns the columns of the diagnostics as doubles.
fn columns(table: &Table) -> Vec<Column> {
    let column = |name: &String| {
        let values = Packed::doubles(table.column(name)?.iter().copied());
        Some(Column { name: name.clone(), values })
    };
    table.names().iter().filter_map(column).collect()
}

//! Contents of a run folder.

mod facts;
mod frames;
mod history;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use glam::DVec3;
use serde_json::Value;

use grainwake_formats::events;
use grainwake_formats::events::{Event, EventKind};
use grainwake_formats::table::{Damage, Table};
use grainwake_formats::vti::Image;
use grainwake_formats::vtp::{self, Surface};

use crate::error::ReportError;
use frames::read_image;

pub use facts::Facts;
pub use history::{History, histories, histories_with};

/// Part that is left out because of damage, for notes.
const FILE: &str = "the file was";

/// VTK file of a run: a slice of the fields, or surfaces of grains.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameFile {
    /// File.
    pub file: PathBuf,
    /// Time [s].
    pub time: f64,
    /// Grain in the name of the file, if any.
    pub grain: Option<usize>,
}

/// Contents of a run folder.
#[derive(Clone, Debug, Default)]
pub struct RunFolder {
    /// Folder.
    pub path: PathBuf,
    /// Set-up.
    pub facts: Facts,
    /// History of each grain.
    pub grains: Vec<History>,
    /// Table `diagnostics.csv`.
    pub diagnostics: Option<Table>,
    /// Events, in order of time.
    pub events: Vec<Event>,
    /// Contents of `summary.json`, which is written at the end of the run.
    pub summary: Option<Value>,
    /// Contents of `failure.json`, which a failed run writes.
    pub failure: Option<Value>,
    /// Contents of `provenance.json`.
    pub provenance: Option<Value>,
    /// Slices, in order of time.
    pub slices: Vec<FrameFile>,
    /// Full fields, in order of time.
    pub fields: Vec<FrameFile>,
    /// Surfaces, in order of time.
    pub surfaces: Vec<FrameFile>,
    /// Missing or omitted parts.
    pub notes: Vec<String>,
}

/// Returns the shortest image of a distance vector in a box with the given `periods` [m].
pub fn nearest_image(line: DVec3, periods: [Option<f64>; 3]) -> DVec3 {
    let part = |axis: usize| match periods[axis] {
        Some(period) => line[axis] - period * (line[axis] / period).round(),
        None => line[axis],
    };
    DVec3::new(part(0), part(1), part(2))
}

impl RunFolder {
    /// Reads a run folder; missing files are noted.
    ///
    /// # Errors
    /// If the folder holds no run, or a table or log is damaged.
    pub fn open(path: &Path) -> Result<RunFolder, ReportError> {
        RunFolder::open_with(path, Damage::Refuse)
    }

    /// Returns whether the tables have the rows of a curve: two or more.
    pub fn has_curves(&self) -> bool {
        self.grains.iter().any(|history| history.len() > 1)
    }

    /// Returns the largest settling speed of all grains over all steps [m/s], from `summary.json`.
    pub fn peak_settling_speed(&self) -> Option<f64> {
        let grains = self.summary.as_ref()?.get("grains")?.as_array()?.iter();
        let speed = |grain: &Value| grain.get("peak_settling_speed_m_per_s")?.as_f64();
        grains.filter_map(speed).reduce(f64::max)
    }

    /// Returns whether a folder holds a file of a run.
    pub fn exists_in(path: &Path) -> bool {
        let known = ["case.resolved.toml", "grains.csv", "diagnostics.csv", "summary.json"];
        known.iter().any(|name| path.join(name).is_file())
    }

    /// Reads a run folder; missing files are noted, damaged ones treated as given. A damaged table
    /// is kept up to the damage, any other damaged file is left out.
    ///
    /// # Errors
    /// If the folder holds no run, or a file is damaged and damage is refused.
    pub fn open_with(path: &Path, damage: Damage) -> Result<RunFolder, ReportError> {
        let mut run = RunFolder { path: path.to_owned(), ..RunFolder::default() };
        let present = |name: &str| Some(path.join(name)).filter(|file| file.is_file());
        if !RunFolder::exists_in(path) {
            return Err(ReportError::NotARun(path.to_owned()));
        }
        let mut notes = Vec::new();
        match present("case.resolved.toml") {
            Some(file) => {
                let facts = damage.accept(facts::read_case(&file), FILE, &mut notes)?;
                run.facts = facts.unwrap_or_default();
            }
            None => notes.push("case.resolved.toml is missing: the set-up is not known".to_owned()),
        }
        let mut json = |name: &str| match present(name) {
            Some(file) => damage.accept(facts::read_json(&file), FILE, &mut notes),
            None => Ok(None),
        };
        run.summary = json("summary.json")?;
        run.failure = json("failure.json")?;
        run.provenance = json("provenance.json")?;
        if let Some(summary) = &run.summary {
            facts::add_summary(&mut run.facts, summary);
        }
        match present("grains.csv") {
            Some(file) => {
                let read = histories_with(&file, &mut notes, damage);
                run.grains = damage.accept(read, FILE, &mut notes)?.unwrap_or_default();
            }
            None if run.facts.grains.is_empty() => {}
            None => notes
                .push("grains.csv is missing: the motion of the grains is not known".to_owned()),
        }
        match present("diagnostics.csv") {
            Some(file) => {
                let read = Table::read_with(&file, &mut notes, damage);
                run.diagnostics = damage.accept(read, FILE, &mut notes)?;
            }
            None => notes.push("diagnostics.csv is missing".to_owned()),
        }
        if let Some(file) = present("events.jsonl") {
            let read = events::read(&file, &mut notes);
            run.events = damage.accept(read, FILE, &mut notes)?.unwrap_or_default();
        }
        run.notes = notes;
        run.notes.extend(run.short_tables());
        let times = run.collection();
        run.slices = run.frames("slices", "vti", &times);
        run.fields = run.frames("fields", "vti", &times);
        run.surfaces = run.frames("grains", "vtp", &times);
        Ok(run)
    }

    /// Returns a sentence for each table that ends before the finished run: rows are missing.
    pub fn short_tables(&self) -> Vec<String> {
        let Some(end) = self.summary_number("end_time_s") else {
            return Vec::new();
        };
        let diagnostics = self.diagnostics.as_ref().and_then(|table| table.column("time"));
        let of_diagnostics = diagnostics.map(|times| times.last().copied());
        // Grains that have left the box have no more rows.
        let left = self.events.iter().filter(|event| event.kind == EventKind::Left);
        let left: BTreeSet<usize> = left.flat_map(|event| event.grains.iter().copied()).collect();
        let known = self.path.join("grains.csv").is_file() && left.len() < self.facts.grains.len();
        let last = self.grains.iter().filter_map(|history| history.time.last().copied());
        let of_grains = known.then(|| last.reduce(f64::max));
        let tables = [("grains.csv", of_grains), ("diagnostics.csv", of_diagnostics)];
        let listed = self.summary.as_ref().and_then(|summary| summary.get("events")?.as_array());
        let lost = listed.map_or(0, |listed| listed.len().saturating_sub(self.events.len()));
        let events = match lost {
            0 => None,
            1 => Some(format!("{} lacks an event of summary.json", events::FILE)),
            lost => Some(format!("{} lacks {lost} events of summary.json", events::FILE)),
        };
        let short = tables.into_iter().filter_map(|(name, last)| match last? {
            None => Some(format!("{name} has no rows: the file is damaged")),
            Some(last) if last < end * (1.0 - 1e-9) => {
                Some(format!("{name} ends at {last} s and the run at {end} s: rows are missing"))
            }
            Some(_) => None,
        });
        short.chain(events).collect()
    }

    /// Returns whether the run reached its end.
    pub fn finished(&self) -> bool {
        self.summary.is_some()
    }

    /// Returns the last time of any table [s].
    pub fn end(&self) -> f64 {
        let table = self.diagnostics.as_ref();
        let of_diagnostics = table.and_then(|table| table.column("time")?.last()).copied();
        of_diagnostics.filter(|t| t.is_finite()).map_or(0.0, |t| t.max(0.0)).max(self.last_row())
    }

    /// Returns the last time at which a grain is in the box [s].
    pub fn last_row(&self) -> f64 {
        let times = self.grains.iter().filter_map(|h| h.time.last()).copied();
        times.filter(|t| t.is_finite()).fold(0.0, f64::max)
    }

    /// Returns the grains that have a history.
    pub fn moving(&self) -> Vec<usize> {
        let grains = 0..self.grains.len();
        grains.filter(|i| !self.grains[*i].is_empty()).collect()
    }

    /// Returns the grains that change place: not the fixed ones.
    pub fn displaced(&self) -> Vec<usize> {
        let moves = |history: &History| {
            let mut positions = history.position.iter();
            positions.next().is_some_and(|first| positions.any(|p| p != first))
        };
        (0..self.grains.len()).filter(|grain| moves(&self.grains[*grain])).collect()
    }

    /// Returns the grains that have a history and did not leave the box.
    pub fn remaining(&self) -> Vec<usize> {
        let gone = self.events.iter().filter(|event| event.kind == EventKind::Left);
        let gone: Vec<usize> = gone.flat_map(|event| event.grains.iter().copied()).collect();
        self.moving().into_iter().filter(|grain| !gone.contains(grain)).collect()
    }

    /// Returns a number of the summary by its name.
    pub fn summary_number(&self, name: &str) -> Option<f64> {
        self.summary.as_ref()?.get(name)?.as_f64()
    }

    /// Reads a slice.
    ///
    /// # Errors
    /// The file cannot be read as an image; the message names it.
    pub fn slice(&self, frame: &FrameFile) -> Result<Image, String> {
        read_image(&frame.file)
    }

    /// Reads a surface.
    ///
    /// # Errors
    /// The file cannot be read as a surface; the message names it.
    pub fn surface(&self, frame: &FrameFile) -> Result<Surface, String> {
        vtp::read(&frame.file)
    }

    /// Returns the path of a file relative to the folder.
    pub fn short_name(&self, file: &Path) -> String {
        file.strip_prefix(&self.path).unwrap_or(file).display().to_string()
    }

    /// Returns the length of the box along a periodic axis [m]; `None` for other axes.
    pub fn period(&self, axis: usize) -> Option<f64> {
        let faces = self.facts.boundaries.as_ref()?;
        let size = self.facts.size?;
        (faces[axis][0] == "periodic").then_some(size[axis])
    }

    /// Returns the lengths of the box along its periodic axes [m]; `None` for other axes.
    pub fn periods(&self) -> [Option<f64>; 3] {
        [0, 1, 2].map(|axis| self.period(axis))
    }

    /// Returns the shortest periodic image of a distance vector.
    pub fn nearest(&self, line: DVec3) -> DVec3 {
        nearest_image(line, self.periods())
    }

    /// Returns the periodic image of a point inside the box.
    pub fn wrapped(&self, x: DVec3) -> DVec3 {
        let inside = |axis: usize| match self.period(axis) {
            Some(period) => {
                x[axis] - period * ((x[axis] - self.facts.lower[axis]) / period).floor()
            }
            None => x[axis],
        };
        DVec3::new(inside(0), inside(1), inside(2))
    }

    /// Returns the note about a file that is left out.
    pub(crate) fn left_out(&self, frame: &FrameFile, what: &str) -> String {
        format!("{} was left out: {what}", self.short_name(&frame.file))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn periodic_axes_wrap() {
        let mut run = RunFolder::default();
        run.facts.size = Some(DVec3::new(2.0, 3.0, 4.0));
        run.facts.lower = DVec3::new(-1.0, 0.0, 0.0);
        let faces = |word: &str| [word.to_owned(), word.to_owned()];
        run.facts.boundaries = Some([faces("periodic"), faces("wall"), faces("periodic")]);
        assert_eq!(run.wrapped(DVec3::new(1.5, 3.5, -0.5)), DVec3::new(-0.5, 3.5, 3.5));
        assert_eq!(run.nearest(DVec3::new(1.5, 3.5, -0.5)), DVec3::new(-0.5, 3.5, -0.5));
        assert_eq!((run.period(0), run.period(1)), (Some(2.0), None));
    }

    #[test]
    fn a_damaged_run_is_read_up_to_the_damage_if_asked() {
        let folder = crate::testing::folder();
        std::fs::write(folder.join("summary.json"), "{").unwrap();
        std::fs::write(folder.join("diagnostics.csv"), "time,gap\n0,1\n1,x\n2,3\n").unwrap();
        assert!(RunFolder::open(&folder).is_err());
        let run = RunFolder::open_with(&folder, Damage::Truncate).unwrap();
        assert_eq!(run.diagnostics.unwrap().column("time"), Some(&[0.0][..]));
        assert!(run.summary.is_none());
        assert!(run.notes.iter().any(|n| n.contains("diagnostics.csv, line 3")), "{:?}", run.notes);
        assert!(run.notes.iter().any(|n| n.contains("summary.json, line 1")), "{:?}", run.notes);
        std::fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn a_table_that_ends_before_the_run_is_noted() {
        let folder = crate::testing::folder();
        std::fs::write(folder.join("summary.json"), "{\"end_time_s\": 0.2}").unwrap();
        let notes = |rows: &str| {
            std::fs::write(folder.join("diagnostics.csv"), format!("time,gap\n{rows}")).unwrap();
            RunFolder::open(&folder).unwrap().notes.join("; ")
        };
        assert!(!notes("0,1\n0.1,1\n0.2,1\n").contains("diagnostics"));
        assert!(notes("0,1\n0.1,1\n").contains("diagnostics.csv ends at 0.1 s"));
        assert!(notes("").contains("diagnostics.csv has no rows"));
        std::fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn a_folder_without_a_run_is_refused() {
        let folder = crate::testing::folder();
        let error = RunFolder::open(&folder).unwrap_err();
        assert!(matches!(error, ReportError::NotARun(_)), "{error}");
        std::fs::write(folder.join("summary.json"), "{\n\"steps\": }").unwrap();
        let error = RunFolder::open(&folder).unwrap_err().to_string();
        assert!(error.contains("summary.json, line 2"), "{error}");
        std::fs::write(folder.join("summary.json"), b"{}\n\n\xff").unwrap();
        let error = RunFolder::open(&folder).unwrap_err().to_string();
        assert!(error.contains("line 3: not text"), "{error}");
        std::fs::remove_dir_all(folder).unwrap();
    }
}

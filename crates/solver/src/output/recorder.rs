//! Writes what is due after a step. Output times are multiples of their intervals, so that they do
//! not depend on where a run was interrupted.

use std::path::{Path, PathBuf};

use super::checkpoint::{self, Record};
use super::error::{Context, RunError};
use super::meetings::{FEW, Meetings};
use super::pictures::Pictures;
use super::plan::RunPlan;
use super::pvd::{self, Picture};
use super::summary::{GrainSummary, PairSummary, Summary};
use super::tables::Tables;
use crate::dem::{Enclosure, surface_gap};
use crate::sim::Simulation;
use crate::sim::events::{Event, EventKind, EventParams, Tracker};

/// Two outputs less than this part of a step apart are written together.
const SHORTEST_STEP: f64 = 0.1;
/// Two times count as one when they differ by less than this part of the interval.
const SAME_TIME: f64 = 1e-9;

/// Series of outputs, in the order of their indices.
#[derive(Clone, Copy, PartialEq)]
enum Series {
    Tables,
    Slices,
    Fields,
    Surfaces,
}

const SERIES: [Series; 4] = [
    Series::Tables,
    Series::Slices,
    Series::Fields,
    Series::Surfaces,
];

/// The recording side of a run.
pub(super) struct Recorder {
    run: PathBuf,
    digest: String,
    intervals: [f64; 4],
    end: f64,
    at_events: bool,
    enclosure: Enclosure,
    tables: Tables,
    pictures: Pictures,
    tracker: Tracker,
    meetings: Meetings,
    /// Grains that do not touch for so long have parted [s].
    hold: f64,
    next: [u64; 4],
    shown: Vec<Picture>,
    max_divergence: f64,
    max_cfl: f64,
    last_row: Option<f64>,
}

impl Recorder {
    fn build(
        run: &Path,
        digest: &str,
        plan: &RunPlan,
        sim: &Simulation,
        tables: Tables,
    ) -> Recorder {
        let setup = sim.setup();
        let enclosure = setup.enclosure();
        let period =
            [0, 1, 2].map(|axis| enclosure.is_periodic(axis).then(|| enclosure.size()[axis]));
        let fluid_density = setup.fluid.map_or(0.0, |fluid| fluid.density);
        let params = EventParams::for_grains(sim.grains(), setup.gravity, fluid_density, period);
        let gap = pair_gap(sim, &enclosure);
        Recorder {
            run: run.into(),
            digest: digest.into(),
            intervals: [plan.tables, plan.slices, plan.fields, plan.surfaces],
            end: plan.end,
            at_events: plan.at_events && sim.grains().len() <= 2,
            enclosure,
            tables,
            pictures: Pictures::new(&plan.planes, sim),
            tracker: Tracker::new(params, sim.grains(), gap),
            meetings: Meetings::default(),
            hold: params.separation_hold,
            next: [0; 4],
            shown: Vec::new(),
            max_divergence: sim.max_divergence(),
            max_cfl: 0.0,
            last_row: None,
        }
    }

    /// Of a run that starts at t = 0; the first outputs are written.
    pub fn start(
        run: &Path,
        digest: &str,
        plan: &RunPlan,
        sim: &Simulation,
    ) -> Result<Recorder, RunError> {
        let mut recorder = Recorder::build(run, digest, plan, sim, Tables::create(run)?);
        recorder.due(sim)?;
        recorder.checkpoint(sim)?;
        Ok(recorder)
    }

    /// Of a run that goes on from a checkpoint.
    pub fn resume(
        run: &Path,
        record: Record,
        plan: &RunPlan,
        sim: &Simulation,
    ) -> Result<Recorder, RunError> {
        let mut recorder = Recorder::build(
            run,
            &record.digest,
            plan,
            sim,
            Tables::reopen(run, record.lengths)?,
        );
        recorder.tracker.restore(record.tracker);
        recorder.meetings = record.meetings;
        recorder.next = record.next;
        recorder.shown = record.pictures;
        recorder.max_divergence = record.max_divergence;
        recorder.max_cfl = record.max_cfl;
        recorder.last_row = record.last_row;
        recorder.write_collection()?;
        Ok(recorder)
    }

    /// Time from `now` to the next output or the end [s]. Outputs that are nearly due at the same time, the
    /// end among them, wait for the last of them: the steps are about `step` [s] long, and a far
    /// shorter one between them would do the pressure no good.
    pub fn until_next(&self, now: f64, step: f64) -> f64 {
        let times = || {
            let due = self.intervals.iter().zip(&self.next);
            due.filter(|(interval, _)| **interval > 0.0)
                .map(|(interval, k)| *k as f64 * interval)
                .filter(|time| *time < self.end)
                .chain([self.end])
        };
        let first = times().fold(f64::INFINITY, f64::min);
        let together = first + SHORTEST_STEP * step;
        times()
            .filter(|time| *time <= together)
            .fold(first, f64::max)
            - now
    }

    /// Takes in the state after a step and writes what is due; returns what has happened.
    pub fn after_step(&mut self, sim: &Simulation) -> Result<Vec<Event>, RunError> {
        self.max_divergence = self.max_divergence.max(sim.max_divergence());
        self.max_cfl = self.max_cfl.max(sim.cfl());
        let gap = pair_gap(sim, &self.enclosure);
        let before = self.tracker.events().len();
        let mut events = self
            .tracker
            .update(sim.time(), sim.grains(), sim.contacts(), gap);
        if (3..=FEW).contains(&sim.grains().len()) {
            let met = self.meetings.update(sim.time(), sim.contacts(), self.hold);
            events.extend(met);
        }
        self.tables.events(&events)?;
        self.due(sim)?;
        if self.at_events {
            for (index, event) in events.iter().enumerate() {
                self.picture_event(sim, event.event, before + index)?;
            }
        }
        Ok(events)
    }

    fn picture_event(
        &mut self,
        sim: &Simulation,
        kind: EventKind,
        index: usize,
    ) -> Result<(), RunError> {
        let earlier = self.tracker.events()[..index]
            .iter()
            .filter(|e| e.event == kind)
            .count();
        let tag = format!("{}-{}", kind.name(), earlier + 1);
        let slices = self.pictures.slices(&self.run, sim, &tag)?;
        let grains = self.pictures.grains(&self.run, sim, &tag)?;
        self.show(slices.into_iter().chain(grains))
    }

    fn due(&mut self, sim: &Simulation) -> Result<(), RunError> {
        let time = sim.time();
        let mut pictures = Vec::new();
        for (index, series) in SERIES.into_iter().enumerate() {
            let interval = self.intervals[index];
            if interval == 0.0 || time < self.next[index] as f64 * interval - SAME_TIME * interval {
                continue;
            }
            let tag = format!("{:06}", self.next[index]);
            match series {
                Series::Tables => {
                    self.tables.rows(sim, &self.tracker)?;
                    self.last_row = Some(time);
                }
                Series::Slices => pictures.extend(self.pictures.slices(&self.run, sim, &tag)?),
                Series::Fields => pictures.extend(self.pictures.fields(&self.run, sim, &tag)?),
                Series::Surfaces => pictures.extend(self.pictures.grains(&self.run, sim, &tag)?),
            }
            self.next[index] += 1;
        }
        if pictures.is_empty() {
            Ok(())
        } else {
            self.show(pictures)
        }
    }

    fn show(&mut self, pictures: impl IntoIterator<Item = Picture>) -> Result<(), RunError> {
        self.shown.extend(pictures);
        self.write_collection()
    }

    fn write_collection(&self) -> Result<(), RunError> {
        let path = self.run.join("run.pvd");
        pvd::write(&path, &self.shown).context("write", &path)
    }

    /// Writes the outputs of the last state, where they are not there yet.
    pub fn finish(&mut self, sim: &Simulation) -> Result<(), RunError> {
        if self.last_row != Some(sim.time()) {
            self.tables.rows(sim, &self.tracker)?;
            self.last_row = Some(sim.time());
            let slices = self.pictures.slices(&self.run, sim, "end")?;
            let grains = self.pictures.grains(&self.run, sim, "end")?;
            self.show(slices.into_iter().chain(grains))?;
        }
        Ok(())
    }

    /// Writes a checkpoint of this state.
    pub fn checkpoint(&mut self, sim: &Simulation) -> Result<(), RunError> {
        let record = Record {
            digest: self.digest.clone(),
            time: sim.time(),
            steps: sim.steps(),
            lengths: self.tables.sync()?,
            next: self.next,
            pictures: self.shown.clone(),
            max_divergence: self.max_divergence,
            max_cfl: self.max_cfl,
            last_row: self.last_row,
            tracker: self.tracker.state().clone(),
            meetings: self.meetings.clone(),
        };
        checkpoint::write(&self.run, &record, sim)
    }

    /// What has happened so far.
    pub fn tracker(&self) -> &Tracker {
        &self.tracker
    }

    /// Everything that has happened, in the order in which it became certain.
    fn events(&self) -> Vec<Event> {
        let mut events = self.tracker.events().to_vec();
        events.extend_from_slice(&self.meetings.events);
        // A stable sort: what became certain in one step stays in the order of the log.
        events.sort_by(|a, b| a.confirmed.total_cmp(&b.confirmed));
        events
    }

    /// The results so far.
    pub fn summary(&self, sim: &Simulation, wall_s: f64, ended_by: &str) -> Summary {
        let tracker = &self.tracker;
        let grains = sim
            .grains()
            .iter()
            .enumerate()
            .map(|(i, grain)| GrainSummary {
                equivalent_diameter_m: grain.shape.equivalent_diameter(),
                density: grain.density,
                peak_settling_speed_m_per_s: tracker.peak_settling_speeds()[i],
                landing_time_s: tracker.landing_times()[i],
                position_m: grain.pose.position.to_array(),
            });
        Summary {
            steps: sim.steps(),
            end_time_s: sim.time(),
            wall_s,
            events: self.events(),
            max_divergence: self.max_divergence,
            max_cfl: self.max_cfl,
            ended_by: ended_by.into(),
            pair: tracker.phase().map(|phase| PairSummary {
                kiss_time_s: tracker.kiss_time(),
                tumble_time_s: tracker.tumble_time(),
                separation_time_s: tracker.separation_time(),
                role_changes: tracker.role_changes(),
                phase: phase.name().into(),
            }),
            grains: grains.collect(),
        }
    }
}

/// Gap between the surfaces of a pair [m].
fn pair_gap(sim: &Simulation, enclosure: &Enclosure) -> Option<f64> {
    match sim.grains() {
        [a, b] => Some(surface_gap(a, b, enclosure)),
        _ => None,
    }
}

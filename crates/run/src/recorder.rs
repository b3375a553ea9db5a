//! Outputs after each step.

use std::path::{Path, PathBuf};

use grainwake_formats::disk;
use grainwake_formats::events::{Event, EventKind};
use grainwake_formats::pvd::{Collection, Entry};
use grainwake_formats::summary::{Cost, EndReason, GrainSummary, PairSummary, Scales, Summary};
use grainwake_solver::sim::Simulation;

use crate::contact_events::{MAX_GRAINS, WallEvents};
use crate::error::{Context, RunError};
use crate::job::Job;
use crate::plan::RunPlan;
use crate::run_folder::checkpoint::{self, Record};
use crate::run_folder::{ExtraTable, Tables, VtkOutput, contact_files, remove_if_there};
use crate::series::{self, Content, Series};
use crate::watch::Watch;

/// Index of the VTK files.
const INDEX: &str = "run.pvd";
/// End of the names of the VTK files of the last state.
const LAST: &str = "end";

/// Recorder of a run: tables, VTK files, events, checkpoints.
pub(crate) struct Recorder {
    run: PathBuf,
    end: f64,
    at_events: bool,
    tables: Tables,
    vtk: VtkOutput,
    /// Index of the VTK files.
    collection: Collection,
    /// Watch of events and stop condition.
    pub watch: Watch,
    /// Whether contacts with walls are events.
    with_walls: bool,
    series: Vec<Series>,
    extra: Vec<ExtraTable>,
    /// Number of VTK files whose content is on the disk.
    synced_vtk_files: usize,
    scales: Option<Scales>,
    kept_checkpoints: usize,
    /// Record of the next checkpoint; its time, tables, series and tracker are set with it.
    record: Record,
}

impl Recorder {
    fn build(run: &Path, job: &Job, sim: &Simulation, tables: Tables) -> Recorder {
        let plan = &job.plan;
        let extra = ExtraTable::all(plan);
        let intervals: Vec<f64> = extra.iter().map(ExtraTable::interval).collect();
        let watch = Watch::new(&job.setup, sim, plan.stop);
        let mut record = Record::new(&job.digest, sim, watch.tracker.state());
        record.last_extra_rows = vec![None; extra.len()];
        Recorder {
            run: run.into(),
            end: plan.end,
            at_events: plan.at_events && sim.grains().len() <= 2,
            tables,
            vtk: VtkOutput::new(&plan.planes, sim),
            collection: Collection::new(&run.join(INDEX)),
            watch,
            with_walls: plan.wall_events,
            series: Series::of(plan, &intervals),
            extra,
            synced_vtk_files: 0,
            scales: plan.scales,
            kept_checkpoints: plan.kept_during_run(),
            record,
        }
    }

    /// Starts the record of a run at t = 0 and writes the first outputs.
    pub fn start(run: &Path, job: &Job, sim: &Simulation) -> Result<Recorder, RunError> {
        let mut recorder = Recorder::build(run, job, sim, new_tables(run, &job.plan)?);
        recorder.write_due(sim)?;
        recorder.checkpoint(sim)?;
        Ok(recorder)
    }

    /// Starts the record of a run from a checkpoint of its parent and writes the first outputs.
    ///
    /// The events of the parent are kept, because the phase of a pair follows from them. Largest
    /// divergence, CFL number and overlap are those of the new run.
    pub fn branch(
        run: &Path,
        job: &Job,
        parent: Record,
        sim: &Simulation,
    ) -> Result<Recorder, RunError> {
        let mut recorder = Recorder::build(run, job, sim, new_tables(run, &job.plan)?);
        recorder.watch.tracker.restore(parent.tracker);
        recorder.record.contact_events = parent.contact_events;
        if recorder.with_walls {
            recorder.record.wall_events = parent.wall_events;
        }
        recorder.record.overlaps.mean_now = parent.overlaps.mean_now;
        recorder.series.iter_mut().for_each(|series| series.start_after(sim.time()));
        let events = recorder.events();
        recorder.tables.append_events(&events)?;
        recorder.write_series(sim, |series| series.is_on().then(|| "start".to_owned()))?;
        recorder.checkpoint(sim)?;
        Ok(recorder)
    }

    /// Writes an output of each series for which `tag` returns the end of the file names.
    fn write_series(
        &mut self,
        sim: &Simulation,
        tag: impl Fn(&mut Series) -> Option<String>,
    ) -> Result<(), RunError> {
        let mut files = Vec::new();
        for index in 0..self.series.len() {
            let series = &mut self.series[index];
            let content = series.content;
            if let Some(tag) = tag(series) {
                files.extend(self.write(content, sim, &tag)?);
            }
        }
        if files.is_empty() { Ok(()) } else { self.add(files) }
    }

    /// Continues the record of a run from a checkpoint.
    pub fn resume(
        run: &Path,
        job: &Job,
        mut record: Record,
        sim: &Simulation,
    ) -> Result<Recorder, RunError> {
        let extra = ExtraTable::all(&job.plan);
        let tables = Tables::reopen(run, &record.lengths, &extra, job.plan.scales.as_ref())?;
        let mut recorder = Recorder::build(run, job, sim, tables);
        recorder.watch.tracker.restore(record.tracker.clone());
        for (series, next) in recorder.series.iter_mut().zip(&record.next) {
            series.next = *next;
        }
        record.last_extra_rows.resize(extra.len(), None);
        if !recorder.with_walls {
            record.wall_events = WallEvents::default();
        }
        // A finished run that goes on has files of its earlier end, which belong to no series.
        let is_last = |entry: &mut Entry| {
            let stem = entry.file.rsplit_once('.').map_or("", |(stem, _)| stem);
            stem.strip_suffix(LAST).is_some_and(|stem| stem.ends_with('_'))
        };
        for entry in record.vtk_files.extract_if(.., is_last) {
            remove_if_there(&run.join(&entry.file), disk::remove_file)?;
        }
        recorder.synced_vtk_files = record.vtk_files.len();
        recorder.record = record;
        recorder.write_collection()?;
        Ok(recorder)
    }

    /// Returns the time from `now` to the next output, to the end or to the time `wanted` by the
    /// caller [s]; `step` [s] is the usual step.
    pub fn until_next(&self, wanted: f64, now: f64, step: f64) -> f64 {
        series::until_next(&self.series, [self.end, wanted], now, step)
    }

    /// Updates the record with the state after a step, writes the outputs that are due, and returns
    /// the new events.
    pub fn after_step(&mut self, sim: &Simulation) -> Result<Vec<Event>, RunError> {
        let record = &mut self.record;
        record.max_divergence = record.max_divergence.max(sim.max_divergence());
        record.max_cfl = record.max_cfl.max(sim.cfl());
        record.overlaps.add(sim);
        record.contact_work.add(sim);
        let before = self.watch.tracker.events().len();
        let mut events = self.watch.update(sim);
        let (time, contacts, hold) = (sim.time(), sim.contacts(), self.watch.separation_hold);
        if (3..=MAX_GRAINS).contains(&sim.grains().len()) {
            events.extend(record.contact_events.update(time, contacts, hold));
        }
        let of_grains = events.len();
        if self.with_walls {
            events.extend(record.wall_events.update(time, contacts, hold));
        }
        self.tables.append_events(&events)?;
        self.write_due(sim)?;
        if self.at_events {
            for (index, event) in events[..of_grains].iter().enumerate() {
                self.write_event(sim, event.kind, before + index)?;
            }
        }
        Ok(events)
    }

    fn write_event(
        &mut self,
        sim: &Simulation,
        kind: EventKind,
        index: usize,
    ) -> Result<(), RunError> {
        let earlier =
            self.watch.tracker.events()[..index].iter().filter(|e| e.kind == kind).count();
        let tag = format!("{}-{}", kind.name(), earlier + 1);
        let slices = self.vtk.slices(&self.run, sim, &tag)?;
        let grains = self.vtk.grains(&self.run, sim, &tag)?;
        self.add(slices.into_iter().chain(grains))
    }

    fn write_due(&mut self, sim: &Simulation) -> Result<(), RunError> {
        self.write_series(sim, |series| {
            let tag = series.is_due(sim.time()).then(|| format!("{:06}", series.next));
            series.next += u64::from(tag.is_some());
            tag
        })
    }

    /// Writes one output and returns its VTK files; `tag` ends their names.
    fn write(
        &mut self,
        content: Content,
        sim: &Simulation,
        tag: &str,
    ) -> Result<Vec<Entry>, RunError> {
        match content {
            Content::Tables => self.append_rows(sim)?,
            Content::Slices => return self.vtk.slices(&self.run, sim, tag),
            Content::Fields => return self.vtk.fields(&self.run, sim, tag),
            Content::Surfaces => return self.vtk.grains(&self.run, sim, tag),
            Content::Contacts => return contact_files(&self.run, sim, tag),
            Content::Extra(table) => self.append_extra(table, sim)?,
        }
        Ok(Vec::new())
    }

    fn append_rows(&mut self, sim: &Simulation) -> Result<(), RunError> {
        self.tables.append_rows(sim, self.watch.tracker.gap(), &self.record.overlaps)?;
        self.record.overlaps.largest_since_row = 0.0;
        self.record.last_row = Some(sim.time());
        Ok(())
    }

    /// Appends rows of the present state to an extra table.
    fn append_extra(&mut self, table: usize, sim: &Simulation) -> Result<(), RunError> {
        self.tables.append_extra(table, &self.extra[table].rows(sim))?;
        self.record.last_extra_rows[table] = Some(sim.time());
        Ok(())
    }

    fn add(&mut self, files: impl IntoIterator<Item = Entry>) -> Result<(), RunError> {
        self.record.vtk_files.extend(files);
        self.write_collection()
    }

    /// Adds the new VTK files to their index, unless there are none at all.
    fn write_collection(&mut self) -> Result<(), RunError> {
        if self.record.vtk_files.is_empty() {
            return Ok(());
        }
        let updated = self.collection.update(&self.record.vtk_files);
        updated.context("write", &self.run.join(INDEX))
    }

    /// Writes the outputs of the last state, unless they have been written.
    pub fn finish(&mut self, sim: &Simulation) -> Result<(), RunError> {
        let mut files = Vec::new();
        for index in 0..self.series.len() {
            let series = &self.series[index];
            let wanted = series.is_on() || series.content == Content::Tables;
            if wanted && !self.is_written(series.content, sim.time()) {
                files.extend(self.write(series.content, sim, LAST)?);
            }
        }
        if files.is_empty() { Ok(()) } else { self.add(files) }
    }

    /// Returns whether the outputs of the last state, at `time` [s], are there.
    fn is_written(&self, content: Content, time: f64) -> bool {
        let record = &self.record;
        let holds = |group: &str| {
            let mut now = record.vtk_files.iter().rev().take_while(|entry| entry.time >= time);
            now.any(|entry| entry.group.starts_with(group))
        };
        match content {
            Content::Tables => record.last_row == Some(time),
            Content::Extra(table) => record.last_extra_rows[table] == Some(time),
            Content::Slices => holds("slice "),
            Content::Surfaces => holds("grains"),
            Content::Contacts => holds("contact"),
            // Full fields are large; the last state is in the checkpoint.
            Content::Fields => true,
        }
    }

    /// Makes the VTK files and their index durable.
    fn sync_vtk_files(&mut self) -> Result<(), RunError> {
        let all = &self.record.vtk_files;
        let new = all[self.synced_vtk_files..].iter().map(|entry| entry.file.as_str());
        let index = (!all.is_empty()).then_some(INDEX);
        for path in new.chain(index).map(|file| self.run.join(file)) {
            disk::sync_file(&path).context("write", &path)?;
        }
        self.synced_vtk_files = all.len();
        Ok(())
    }

    /// Writes a checkpoint. All files that it refers to are durable before it is.
    pub fn checkpoint(&mut self, sim: &Simulation) -> Result<(), RunError> {
        self.sync_vtk_files()?;
        let record = &mut self.record;
        (record.time, record.steps) = (sim.time(), sim.steps());
        record.lengths = self.tables.sync()?;
        record.next = self.series.iter().map(|series| series.next).collect();
        record.tracker = self.watch.tracker.state().clone();
        checkpoint::write(&self.run, record, sim, self.kept_checkpoints)
    }

    /// Returns all events in the order of their confirmation.
    fn events(&self) -> Vec<Event> {
        let mut events = self.watch.tracker.events().to_vec();
        events.extend_from_slice(&self.record.contact_events.events);
        events.extend_from_slice(&self.record.wall_events.events);
        // The sort is stable: events of one step keep the order of the log.
        events.sort_by(|a, b| a.confirmed.total_cmp(&b.confirmed));
        events
    }

    /// Returns the results so far, of a run that has taken this time.
    pub fn summary(&self, sim: &Simulation, cost: Cost, ended_by: EndReason) -> Summary {
        let tracker = &self.watch.tracker;
        let grains = sim.grains().iter().enumerate().map(|(i, grain)| GrainSummary {
            equivalent_diameter_m: grain.shape.equivalent_diameter(),
            density: grain.density,
            peak_settling_speed_m_per_s: tracker.peak_settling_speeds()[i],
            landing_time_s: tracker.landing_times()[i],
            position_m: (!grain.has_left()).then(|| grain.pose.position.to_array()),
        });
        Summary {
            steps: sim.steps(),
            end_time_s: sim.time(),
            cost,
            events: self.events(),
            max_divergence: self.record.max_divergence,
            max_cfl: self.record.max_cfl,
            max_overlap: self.record.overlaps.largest,
            mean_overlap: self.record.overlaps.mean(),
            substeps: self.record.contact_work.substeps(),
            contact_pairs: self.record.contact_work.pairs(),
            scales: self.scales,
            ended_by,
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

fn new_tables(run: &Path, plan: &RunPlan) -> Result<Tables, RunError> {
    Tables::create(run, &ExtraTable::all(plan), plan.scales.as_ref())
}

//! A case that resumes a run: intervals that it leaves out are those of the started run.

use std::path::Path;

use super::located::Located;
use super::quantity::{Quantity, Time};
use super::raw::RawCase;
use super::{Case, CaseError, Source, digest, write};
use crate::{Existing, Job, RESOLVED};
use grainwake_formats::bounded_file::{SETTINGS, read_text};
use grainwake_solver::sim::StepRule;

impl Case {
    /// Returns the input of the run loop for a run in `folder`.
    ///
    /// Default intervals of the outputs and the default longest step depend on the end of the run,
    /// which may be later when the run is resumed. Where the case does not give them, a resumed run
    /// keeps those of its start.
    ///
    /// # Errors
    /// [`CaseError`] if the case cannot be written.
    pub fn job_in(&self, folder: &Path, existing: Existing) -> Result<Job, CaseError> {
        let mut job = self.job();
        let resumes = matches!(existing, Existing::Resume | Existing::ResumeOrStart);
        let Some(started) = resumes.then(|| started(folder)).flatten() else { return Ok(job) };
        let mut raw = self.raw.clone();
        let (output, before) = (&mut raw.output, &started.output);
        self.keep("output.tables", &mut output.tables, &before.tables, &mut job.plan.tables);
        self.keep("output.slices", &mut output.slices, &before.slices, &mut job.plan.slices);
        self.keep(
            "output.surfaces",
            &mut output.surfaces,
            &before.surfaces,
            &mut job.plan.surfaces,
        );
        let probes = raw.probe.iter_mut().zip(&started.probe).zip(&mut job.plan.probes);
        for (index, ((now, before), planned)) in probes.enumerate() {
            let key = format!("probe.{index}.every");
            self.keep(&key, &mut now.value.every, &before.value.every, &mut planned.every);
        }
        if let StepRule::Limits { max_step, .. } = &mut job.setup.step {
            self.keep("time.max_step", &mut raw.time.max_step, &started.time.max_step, max_step);
        }
        job.resolved = write(&raw)?;
        job.digest = digest(&raw, &self.shapes)?;
        Ok(job)
    }

    /// Keeps a time of the started run if this case does not give it.
    fn keep(
        &self,
        key: &str,
        now: &mut Option<Located<Quantity<Time>>>,
        before: &Option<Located<Quantity<Time>>>,
        planned: &mut f64,
    ) {
        if let (None, Some(before)) = (self.source.value_of(key), before) {
            *now = Some(before.clone());
            *planned = before.si;
        }
    }
}

/// Returns the resolved case of the run in a folder; none if it cannot be read.
fn started(folder: &Path) -> Option<RawCase> {
    let text = read_text(&folder.join(RESOLVED), SETTINGS).ok()?;
    Source::parse(RESOLVED, &text, &[]).ok().map(|(_, raw)| raw)
}

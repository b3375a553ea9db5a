//! Tables that a case requests: probes and contacts.

use grainwake_formats::contacts;
use grainwake_solver::sim::Simulation;

use super::contacts::table_rows;
use crate::plan::{Probe, RunPlan};

/// Table that a case requests.
#[derive(Clone, Debug)]
pub(crate) enum ExtraTable {
    /// Table of a probe.
    Probe(Probe),
    /// Table of the contacts, with this interval [s].
    Contacts(f64),
}

impl ExtraTable {
    /// Returns the tables of a plan.
    pub fn all(plan: &RunPlan) -> Vec<ExtraTable> {
        let probes = plan.probes.iter().cloned().map(ExtraTable::Probe);
        let contacts = (plan.contacts > 0.0).then_some(ExtraTable::Contacts(plan.contacts));
        probes.chain(contacts).collect()
    }

    /// Returns the path in the run folder.
    pub fn file(&self) -> String {
        match self {
            ExtraTable::Probe(probe) => probe.file(),
            ExtraTable::Contacts(_) => contacts::FILE.into(),
        }
    }

    /// Returns the first line, without its line break.
    pub fn header(&self) -> &'static str {
        match self {
            ExtraTable::Probe(probe) => probe.header(),
            ExtraTable::Contacts(_) => contacts::HEADER,
        }
    }

    /// Returns the interval of the rows [s]; zero for none.
    pub fn interval(&self) -> f64 {
        match self {
            ExtraTable::Probe(probe) => probe.every,
            ExtraTable::Contacts(interval) => *interval,
        }
    }

    /// Returns the rows of the present state.
    pub fn rows(&self, sim: &Simulation) -> String {
        match self {
            ExtraTable::Probe(probe) => probe.rows(sim),
            ExtraTable::Contacts(_) => table_rows(sim),
        }
    }
}

//! Checkpoints of a simulation in memory.
//!
//! Layout, little-endian: 8 bytes signature, u32 version, digest of the case, state of the events
//! as JSON (null without a stop condition), state of the simulation, SHA-256 of all preceding
//! bytes.

use std::io::{self, Cursor, Write};
use std::path::PathBuf;

use grainwake_formats::codec::{Decoder, Encoder};
use grainwake_formats::disk::write_atomically;
use grainwake_run::case::Case;
use grainwake_solver::grid::Mesh;
use grainwake_solver::sim::events::TrackerState;
use grainwake_solver::sim::{Setup, Simulation, StepRule};
use pyo3::prelude::*;
use sha2::{Digest, Sha256};

use super::{Ended, PySimulation, changing, computing, watch};
use crate::error::{input, system};

const SIGNATURE: &[u8; 8] = b"GWSTATE\n";
const VERSION: u32 = 3;
const CHECKSUM: usize = 32;

impl PySimulation {
    fn encode(&self) -> io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        let mut encoder = Encoder::new(&mut bytes);
        encoder.raw(SIGNATURE)?;
        encoder.u32(VERSION)?;
        encoder.bytes(self.case.get().case.digest.as_bytes())?;
        let events = self.watch.as_ref().map(|watch| watch.tracker.state());
        encoder.bytes(&serde_json::to_vec(&events)?)?;
        self.sim.save(&mut bytes)?;
        let checksum = Sha256::digest(&bytes);
        bytes.write_all(&checksum)?;
        Ok(bytes)
    }

    /// Replaces the simulation by a new one in the state of a checkpoint: nothing that was set or
    /// that failed since is left.
    fn decode(&mut self, case: &Case, bytes: &[u8]) -> Result<(), String> {
        let text = |error: io::Error| error.to_string();
        let Some(body) = bytes.len().checked_sub(CHECKSUM).and_then(|end| bytes.get(..end)) else {
            return Err("it is cut off".into());
        };
        if !body.starts_with(SIGNATURE) {
            return Err("it is not a checkpoint of a simulation".into());
        }
        if Sha256::digest(body).as_slice() != &bytes[body.len()..] {
            return Err("its checksum does not match: it is damaged or cut off".into());
        }
        let mut rest = Cursor::new(&body[SIGNATURE.len()..]);
        let mut decoder = Decoder::new(&mut rest);
        let version = decoder.u32().map_err(text)?;
        if version != VERSION {
            return Err(format!("its version is {version}, this program reads version {VERSION}"));
        }
        if decoder.bytes().map_err(text)? != case.digest.as_bytes() {
            return Err("it belongs to another case".into());
        }
        let events =
            serde_json::from_slice::<Option<TrackerState>>(&decoder.bytes().map_err(text)?)
                .map_err(|error| error.to_string())?;
        self.failed = Some(Ended::Step("the state could not be restored".into()));
        self.pool.clone().install(|| {
            // The memory of the old simulation is free before the new one is built.
            let empty = Setup::new(Mesh::cubic([1; 3], 1.0)).with_step(StepRule::Fixed(1.0));
            self.sim = Simulation::new(empty).map_err(|error| error.to_string())?;
            self.sim = Simulation::new(case.setup.clone()).map_err(|error| error.to_string())?;
            self.watch = watch(case, &self.sim);
            self.sim.restore(&mut rest).map_err(text)
        })?;
        if let (Some(watch), Some(events)) = (&mut self.watch, events) {
            watch.tracker.restore(events);
        }
        self.failed = None;
        Ok(())
    }
}

#[pymethods]
impl PySimulation {
    /// Write the exact state to a file.
    ///
    /// Parameters
    /// ----------
    /// path : path-like
    ///     File; an existing one is replaced.
    ///
    /// Raises
    /// ------
    /// SolverError
    ///     The numerics have failed.
    /// OSError
    ///     Writing failed.
    ///
    /// Notes
    /// -----
    /// Prescribed motions and external loads are not part of the state: set them again after
    /// `restore_checkpoint`.
    fn save_checkpoint(slf: &Bound<'_, Self>, path: PathBuf) -> PyResult<()> {
        let this = &*computing(slf)?;
        this.is_sound()?;
        let written = slf.py().detach(|| {
            let bytes = this.encode()?;
            write_atomically(&path, true, |out| out.write_all(&bytes))
        });
        written.map_err(|e| system(e.kind(), format!("cannot write {}: {e}", path.display())))
    }

    /// Restore a state written by `save_checkpoint` of a simulation of the same case. The
    /// simulation then continues bitwise identically, also after a `SolverError`.
    ///
    /// Parameters
    /// ----------
    /// path : path-like
    ///     File.
    ///
    /// Raises
    /// ------
    /// CaseError
    ///     The file is damaged or belongs to another case, or the simulation has a run folder.
    /// BufferError
    ///     An array shows the fields of the present state.
    ///
    /// Notes
    /// -----
    /// Prescribed motions and external loads set before are removed: the case alone moves the
    /// grains from then on.
    fn restore_checkpoint(slf: &Bound<'_, Self>, path: PathBuf) -> PyResult<()> {
        let this = &mut *changing(slf)?;
        this.has_no_views()?;
        if this.output.is_some() {
            return Err(input(
                "a simulation with a run folder continues with Simulation(case, output=..., resume=True)",
            ));
        }
        let bytes = std::fs::read(&path)
            .map_err(|e| system(e.kind(), format!("cannot read {}: {e}", path.display())))?;
        let case = this.case.clone_ref(slf.py());
        let case = &case.get().case;
        slf.py()
            .detach(|| this.decode(case, &bytes))
            .map_err(|why| input(format!("{} cannot be restored: {why}", path.display())))
    }
}

//! The growing files `grains.csv`, `diagnostics.csv` and `events.jsonl`: rows are appended, and cut
//! back to the checkpoint when a run is resumed.

use std::fs::{File, OpenOptions};
use std::io::{self, BufRead, BufReader, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use grainwake_formats::diagnostics::{self, DiagnosticsRow};
use grainwake_formats::events::{self, Event};
use grainwake_formats::grains::{self, GrainRow};
use grainwake_solver::dem::Partner;
use grainwake_solver::sim::Simulation;
use serde::{Deserialize, Serialize};

use crate::error::{Context, RunError};
use crate::overlaps::Overlaps;

/// The growing files of a run.
pub const FILES: [&str; 3] = [grains::FILE, diagnostics::FILE, events::FILE];

/// Lengths of the three files [bytes].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Lengths([u64; 3]);

/// The three growing files, open for appending.
pub struct Tables {
    files: [(PathBuf, File); 3],
    /// Columns of `diagnostics.csv`; a run of an earlier program has fewer.
    diagnostics_columns: usize,
    lengths: Lengths,
}

impl Tables {
    /// Creates the tables with their headers.
    pub fn create(folder: &Path) -> Result<Tables, RunError> {
        let open = |name: &str| {
            let path = folder.join(name);
            let file = File::create(&path).context("create", &path)?;
            Ok::<_, RunError>((path, file))
        };
        let mut tables = Tables {
            files: [open(FILES[0])?, open(FILES[1])?, open(FILES[2])?],
            diagnostics_columns: columns(diagnostics::HEADER),
            lengths: Lengths::default(),
        };
        tables.append(0, &format!("{}\n", grains::HEADER))?;
        tables.append(1, &format!("{}\n", diagnostics::HEADER))?;
        Ok(tables)
    }

    /// Opens the tables of a run and cuts them back to these lengths.
    pub fn reopen(folder: &Path, lengths: Lengths) -> Result<Tables, RunError> {
        let open = |index: usize| {
            let path = folder.join(FILES[index]);
            let mut file = OpenOptions::new().write(true).open(&path).context("open", &path)?;
            let found = file.metadata().context("read", &path)?.len();
            if found < lengths.0[index] {
                let message =
                    format!("it has {found} bytes; at the checkpoint it had {}", lengths.0[index]);
                return Err(io::Error::new(io::ErrorKind::UnexpectedEof, message))
                    .context("continue", &path);
            }
            file.set_len(lengths.0[index]).context("cut back", &path)?;
            file.seek(SeekFrom::End(0)).context("continue", &path)?;
            Ok((path, file))
        };
        let files = [open(0)?, open(1)?, open(2)?];
        let path = &files[1].0;
        let header = BufReader::new(File::open(path).context("read", path)?).lines().next();
        let header = header.transpose().context("read", path)?.unwrap_or_default();
        Ok(Tables { files, diagnostics_columns: columns(&header), lengths })
    }

    fn append(&mut self, index: usize, text: &str) -> Result<(), RunError> {
        let (path, file) = &mut self.files[index];
        file.write_all(text.as_bytes()).context("write", path)?;
        self.lengths.0[index] += text.len() as u64;
        Ok(())
    }

    /// Appends a row for each grain and one of diagnostics.
    pub fn append_rows(
        &mut self,
        sim: &Simulation,
        gap: Option<f64>,
        overlaps: &Overlaps,
    ) -> Result<(), RunError> {
        let (grains, diagnostics) = (grain_rows(sim), diagnostics_row(sim, gap, overlaps));
        self.append(0, &grains)?;
        let line = diagnostics.to_line();
        let known = line.trim_end().split(',').take(self.diagnostics_columns);
        self.append(1, &format!("{}\n", known.collect::<Vec<_>>().join(",")))
    }

    /// Appends events to the log.
    pub fn append_events(&mut self, events: &[Event]) -> Result<(), RunError> {
        for event in events {
            let line =
                (event.to_line().map_err(io::Error::from)).context("write", &self.files[2].0)?;
            self.append(2, &line)?;
        }
        Ok(())
    }

    /// Makes the tables durable and returns their lengths.
    pub fn sync(&mut self) -> Result<Lengths, RunError> {
        for (path, file) in &self.files {
            file.sync_data().context("write", path)?;
        }
        Ok(self.lengths)
    }
}

/// Returns the number of columns of a table with this header.
fn columns(header: &str) -> usize {
    header.split(',').count()
}

fn grain_rows(sim: &Simulation) -> String {
    let mut contacts = vec![0; sim.grains().len()];
    for contact in sim.contacts() {
        contacts[contact.grain] += 1;
        if let Partner::Grain(other) = contact.partner {
            contacts[other] += 1;
        }
    }
    let mut text = String::new();
    let all = sim.grains().iter().zip(sim.loads()).enumerate();
    for (index, (grain, load)) in all.filter(|(_, (grain, _))| !grain.has_left()) {
        let row = GrainRow {
            time: sim.time(),
            grain: index,
            position: grain.pose.position,
            velocity: grain.velocity,
            orientation: grain.pose.orientation,
            angular_velocity: grain.angular_velocity,
            force: Some(load.force),
            torque: Some(load.torque),
            contacts: Some(contacts[index]),
        };
        row.append_to(&mut text);
    }
    text
}

fn diagnostics_row(sim: &Simulation, gap: Option<f64>, overlaps: &Overlaps) -> DiagnosticsRow {
    let measured = sim.diagnostics();
    DiagnosticsRow {
        time: sim.time(),
        step: sim.steps(),
        dt: sim.time_step(),
        cfl: measured.cfl,
        max_divergence: measured.max_divergence,
        max_velocity: measured.max_velocity,
        slip: measured.slip,
        fluid_kinetic_energy: measured.fluid_kinetic_energy,
        grain_kinetic_energy: measured.grain_kinetic_energy,
        momentum: measured.momentum,
        momentum_residual: measured.momentum_residual,
        contacts: sim.contacts().len(),
        gap,
        max_overlap: overlaps.largest_since_row,
        mean_overlap: overlaps.mean_now,
    }
}

#[cfg(test)]
mod tests {
    use grainwake_solver::grid::Mesh;
    use grainwake_solver::sim::{Setup, StepRule};

    use super::*;

    #[test]
    fn a_run_of_an_earlier_program_keeps_its_columns() {
        let folder = tempfile::tempdir().unwrap();
        let old = "time,step,dt,cfl,max_divergence,max_velocity,slip,fluid_kinetic_energy,\
                   grain_kinetic_energy,momentum_x,momentum_y,momentum_z,momentum_residual,\
                   contacts,gap\n";
        let texts = [format!("{}\n", grains::HEADER), old.to_owned(), String::new()];
        for (name, text) in FILES.iter().zip(&texts) {
            std::fs::write(folder.path().join(name), text).unwrap();
        }
        let lengths = Lengths([0, 1, 2].map(|index: usize| texts[index].len() as u64));
        let setup = Setup::new(Mesh::cubic([1; 3], 1.0));
        let sim = Simulation::new(setup.with_step(StepRule::Fixed(1.0))).unwrap();
        let mut tables = Tables::reopen(folder.path(), lengths).unwrap();
        tables.append_rows(&sim, None, &Overlaps::default()).unwrap();
        let text = std::fs::read_to_string(folder.path().join(diagnostics::FILE)).unwrap();
        let counts: Vec<usize> = text.lines().map(columns).collect();
        assert_eq!(counts, [15, 15]);
    }
}

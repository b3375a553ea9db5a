//! The growing files: `grains.csv`, `diagnostics.csv`, `events.jsonl`, and the tables that a case
//! asks for. Rows are appended, and cut back to the checkpoint when a run is resumed.

use std::fs::{File, OpenOptions};
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use grainwake_formats::diagnostics::{self, DiagnosticsRow};
use grainwake_formats::disk::{self, Output};
use grainwake_formats::events::{self, Event};
use grainwake_formats::grains::{self, GrainRow};
use grainwake_formats::summary::Scales;
use grainwake_solver::dem::Partner;
use grainwake_solver::sim::Simulation;
use serde::{Deserialize, Serialize};

use super::extra::ExtraTable;
use super::scaled::{ScaledColumns, plain_columns};
use crate::error::{Context, RunError};
use crate::overlaps::Overlaps;

/// The growing files of every run.
pub const FILES: [&str; 3] = [grains::FILE, diagnostics::FILE, events::FILE];

/// Lengths of the growing files [bytes], the extra tables last.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Lengths(Vec<u64>);

impl Lengths {
    /// Returns what the growing files in a run folder lack to have a row that ends at this length;
    /// none if they have.
    pub(super) fn lacking(&self, run: &Path, extra: &[ExtraTable]) -> Option<String> {
        names(extra).zip(&self.0).find_map(|(name, length)| {
            let file = run.join(&name);
            match std::fs::metadata(&file).map(|data| data.len()) {
                Ok(found) if found >= *length => match row_ends_at(&file, *length) {
                    Ok(true) => None,
                    Ok(false) => Some(format!("{name} was changed: no row ends at byte {length}")),
                    Err(error) => Some(format!("{name} cannot be read: {error}")),
                },
                Ok(found) => Some(format!("{name} has {found} bytes, and then it had {length}")),
                Err(error) if error.kind() == io::ErrorKind::NotFound => {
                    Some(format!("{name} is missing"))
                }
                Err(error) => Some(format!("{name} cannot be read: {error}")),
            }
        })
    }
}

/// Returns whether the byte before `length` ends a row.
fn row_ends_at(file: &Path, length: u64) -> io::Result<bool> {
    let Some(last) = length.checked_sub(1) else { return Ok(true) };
    let mut file = File::open(file)?;
    file.seek(SeekFrom::Start(last))?;
    let mut byte = [0];
    file.read_exact(&mut byte)?;
    Ok(byte == *b"\n")
}

/// Returns the names of the growing files, the extra tables last.
fn names(extra: &[ExtraTable]) -> impl Iterator<Item = String> {
    FILES.map(str::to_owned).into_iter().chain(extra.iter().map(ExtraTable::file))
}

/// Returns whether the tables in a run folder hold rows after those of the first state.
pub(super) fn has_later_rows(run: &Path) -> bool {
    File::open(run.join(diagnostics::FILE))
        .is_ok_and(|file| BufReader::new(file).lines().nth(2).is_some())
}

/// Growing file, open for appending.
struct GrowingFile {
    path: PathBuf,
    file: Output,
    /// Bytes written.
    length: u64,
    /// Columns that are repeated without dimension.
    scaled: ScaledColumns,
}

impl GrowingFile {
    fn create(path: PathBuf) -> Result<GrowingFile, RunError> {
        let file = Output::create(&path).context("create", &path)?;
        Ok(GrowingFile { path, file, length: 0, scaled: ScaledColumns::default() })
    }

    /// Creates a table with this header and dimensionless columns.
    fn table(path: PathBuf, header: &str, scales: Option<&Scales>) -> Result<Self, RunError> {
        let mut file = GrowingFile::create(path)?;
        let scaled = ScaledColumns::of(header, scales);
        file.append(&format!("{}\n", scaled.header(header)))?;
        Ok(GrowingFile { scaled, ..file })
    }

    /// Opens the file and cuts it back to `length` bytes.
    fn reopen(path: PathBuf, length: u64) -> Result<GrowingFile, RunError> {
        let file = Output::open(&path, OpenOptions::new().write(true)).context("open", &path)?;
        let found = file.file().metadata().context("read", &path)?.len();
        if found < length {
            let message = format!("it has {found} bytes; at the checkpoint it had {length}");
            return Err(io::Error::new(io::ErrorKind::UnexpectedEof, message))
                .context("continue", &path);
        }
        file.set_len(length).context("cut back", &path)?;
        file.file().seek(SeekFrom::End(0)).context("continue", &path)?;
        Ok(GrowingFile { path, file, length, scaled: ScaledColumns::default() })
    }

    /// Appends rows of a table.
    fn append_rows(&mut self, rows: &str) -> Result<(), RunError> {
        let rows = self.scaled.extend(rows);
        self.append(&rows)
    }

    fn append(&mut self, text: &str) -> Result<(), RunError> {
        self.file.write_all(text.as_bytes()).context("write", &self.path)?;
        self.length += text.len() as u64;
        Ok(())
    }
}

/// The growing files of a run.
pub struct Tables {
    /// The files of every run, then the extra tables.
    files: Vec<GrowingFile>,
    /// Columns of `diagnostics.csv`; a run of an earlier program has fewer.
    diagnostics_columns: usize,
}

impl Tables {
    /// Creates the tables with their headers.
    pub fn create(
        folder: &Path,
        extra: &[ExtraTable],
        scales: Option<&Scales>,
    ) -> Result<Tables, RunError> {
        let mut files = Vec::new();
        for (name, header) in [(FILES[0], grains::HEADER), (FILES[1], diagnostics::HEADER)] {
            files.push(GrowingFile::table(folder.join(name), header, scales)?);
        }
        files.push(GrowingFile::create(folder.join(FILES[2]))?);
        for table in extra {
            let path = folder.join(table.file());
            if let Some(parent) = path.parent() {
                disk::create_folder(parent).context("create", parent)?;
            }
            files.push(GrowingFile::table(path, table.header(), scales)?);
        }
        Ok(Tables { files, diagnostics_columns: plain_columns(diagnostics::HEADER) })
    }

    /// Opens the tables of a run and cuts them back to these lengths.
    pub fn reopen(
        folder: &Path,
        lengths: &Lengths,
        extra: &[ExtraTable],
        scales: Option<&Scales>,
    ) -> Result<Tables, RunError> {
        let files = names(extra).zip(&lengths.0);
        let mut files = files
            .map(|(name, length)| GrowingFile::reopen(folder.join(name), *length))
            .collect::<Result<Vec<_>, _>>()?;
        let path = &files[1].path;
        let header = BufReader::new(File::open(path).context("read", path)?).lines().next();
        let header = header.transpose().context("read", path)?.unwrap_or_default();
        let headers = [grains::HEADER, diagnostics::HEADER].into_iter().map(Some).chain([None]);
        let headers = headers.chain(extra.iter().map(|table| Some(table.header())));
        for (file, header) in files.iter_mut().zip(headers) {
            file.scaled = header.map_or_else(Default::default, |h| ScaledColumns::of(h, scales));
        }
        Ok(Tables { files, diagnostics_columns: plain_columns(&header) })
    }

    /// Appends a row for each grain and one of diagnostics.
    pub fn append_rows(
        &mut self,
        sim: &Simulation,
        gap: Option<f64>,
        overlaps: &Overlaps,
    ) -> Result<(), RunError> {
        let (grains, diagnostics) = (grain_rows(sim), diagnostics_row(sim, gap, overlaps));
        self.files[0].append_rows(&grains)?;
        let line = diagnostics.to_line();
        let known = line.trim_end().split(',').take(self.diagnostics_columns);
        self.files[1].append_rows(&format!("{}\n", known.collect::<Vec<_>>().join(",")))
    }

    /// Appends events to the log.
    pub fn append_events(&mut self, events: &[Event]) -> Result<(), RunError> {
        for event in events {
            let line =
                (event.to_line().map_err(io::Error::from)).context("write", &self.files[2].path)?;
            self.files[2].append(&line)?;
        }
        Ok(())
    }

    /// Appends rows to an extra table.
    pub fn append_extra(&mut self, index: usize, rows: &str) -> Result<(), RunError> {
        self.files[FILES.len() + index].append_rows(rows)
    }

    /// Makes the tables durable and returns their lengths.
    pub fn sync(&mut self) -> Result<Lengths, RunError> {
        for file in &self.files {
            file.file.sync().context("write", &file.path)?;
        }
        Ok(Lengths(self.files.iter().map(|file| file.length).collect()))
    }
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
        let velocity = sim.grain_velocity(index);
        let row = GrainRow {
            time: sim.time(),
            grain: index,
            position: grain.pose.position,
            velocity: velocity.linear,
            orientation: grain.pose.orientation,
            angular_velocity: velocity.angular,
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
        let lengths = Lengths(texts.iter().map(|text| text.len() as u64).collect());
        let setup = Setup::new(Mesh::cubic([1; 3], 1.0));
        let sim = Simulation::new(setup.with_step(StepRule::Fixed(1.0))).unwrap();
        let mut tables = Tables::reopen(folder.path(), &lengths, &[], None).unwrap();
        tables.append_rows(&sim, None, &Overlaps::default()).unwrap();
        let text = std::fs::read_to_string(folder.path().join(diagnostics::FILE)).unwrap();
        let counts: Vec<usize> = text.lines().map(plain_columns).collect();
        assert_eq!(counts, [15, 15]);
    }
}

//! `grains.csv`, `diagnostics.csv` and `events.jsonl`: rows are appended, and cut back to the
//! checkpoint when a run is resumed. Numbers are written so that they read back bit for bit.

use std::fmt::Write as _;
use std::fs::{File, OpenOptions};
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::error::{Context, RunError};
use crate::dem::Partner;
use crate::sim::Simulation;
use crate::sim::events::{Event, Tracker};

/// Header of `grains.csv`.
pub const GRAINS_HEADER: &str =
    "time,grain,x,y,z,vx,vy,vz,qw,qx,qy,qz,wx,wy,wz,fx,fy,fz,tx,ty,tz,contacts";
/// Header of `diagnostics.csv`.
pub const DIAGNOSTICS_HEADER: &str = "time,step,dt,cfl,max_divergence,max_velocity,slip,fluid_kinetic_energy,grain_kinetic_energy,momentum_x,momentum_y,momentum_z,momentum_residual,contacts,gap";

const NAMES: [&str; 3] = ["grains.csv", "diagnostics.csv", "events.jsonl"];

/// Lengths of the three files [bytes].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Lengths([u64; 3]);

/// The three growing files.
pub(super) struct Tables {
    files: [(PathBuf, File); 3],
    lengths: Lengths,
}

impl Tables {
    /// New tables with their headers.
    pub fn create(folder: &Path) -> Result<Tables, RunError> {
        let open = |name: &str| {
            let path = folder.join(name);
            let file = File::create(&path).context("create", &path)?;
            Ok::<_, RunError>((path, file))
        };
        let mut tables = Tables {
            files: [open(NAMES[0])?, open(NAMES[1])?, open(NAMES[2])?],
            lengths: Lengths::default(),
        };
        tables.append(0, &format!("{GRAINS_HEADER}\n"))?;
        tables.append(1, &format!("{DIAGNOSTICS_HEADER}\n"))?;
        Ok(tables)
    }

    /// The tables of a run as they were when they had these lengths.
    pub fn reopen(folder: &Path, lengths: Lengths) -> Result<Tables, RunError> {
        let open = |index: usize| {
            let path = folder.join(NAMES[index]);
            let mut file = OpenOptions::new()
                .write(true)
                .open(&path)
                .context("open", &path)?;
            let found = file.metadata().context("read", &path)?.len();
            if found < lengths.0[index] {
                let message = format!(
                    "it has {found} bytes, the checkpoint knows of {}",
                    lengths.0[index]
                );
                return Err(io::Error::new(io::ErrorKind::UnexpectedEof, message))
                    .context("continue", &path);
            }
            file.set_len(lengths.0[index]).context("cut back", &path)?;
            file.seek(SeekFrom::End(0)).context("continue", &path)?;
            Ok((path, file))
        };
        Ok(Tables {
            files: [open(0)?, open(1)?, open(2)?],
            lengths,
        })
    }

    fn append(&mut self, index: usize, text: &str) -> Result<(), RunError> {
        let (path, file) = &mut self.files[index];
        file.write_all(text.as_bytes()).context("write", path)?;
        self.lengths.0[index] += text.len() as u64;
        Ok(())
    }

    /// One row of each table.
    pub fn rows(&mut self, sim: &Simulation, tracker: &Tracker) -> Result<(), RunError> {
        let (grains, diagnostics) = (grain_rows(sim), diagnostics_row(sim, tracker));
        self.append(0, &grains)?;
        self.append(1, &diagnostics)
    }

    /// One line for each event.
    pub fn events(&mut self, events: &[Event]) -> Result<(), RunError> {
        for event in events {
            let line = serde_json::to_string(event)
                .map_err(io::Error::from)
                .context("write", &self.files[2].0)?;
            self.append(2, &format!("{line}\n"))?;
        }
        Ok(())
    }

    /// Makes everything written so far last, and says how much that is.
    pub fn sync(&mut self) -> Result<Lengths, RunError> {
        for (path, file) in &self.files {
            file.sync_data().context("write", path)?;
        }
        Ok(self.lengths)
    }
}

fn grain_rows(sim: &Simulation) -> String {
    let time = sim.time();
    let mut contacts = vec![0; sim.grains().len()];
    for contact in sim.contacts() {
        contacts[contact.grain] += 1;
        if let Partner::Grain(other) = contact.partner {
            contacts[other] += 1;
        }
    }
    let mut text = String::new();
    for (i, (grain, load)) in sim.grains().iter().zip(sim.loads()).enumerate() {
        let (x, v, w, q) = (
            grain.pose.position,
            grain.velocity,
            grain.angular_velocity,
            grain.pose.orientation,
        );
        let (f, t) = (load.force, load.torque);
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "{time:?},{i},{:?},{:?},{:?},{:?},{:?},{:?},{:?},{:?},{:?},{:?},{:?},{:?},{:?},{:?},{:?},{:?},{:?},{:?},{:?},{}",
            x.x,
            x.y,
            x.z,
            v.x,
            v.y,
            v.z,
            q.w,
            q.x,
            q.y,
            q.z,
            w.x,
            w.y,
            w.z,
            f.x,
            f.y,
            f.z,
            t.x,
            t.y,
            t.z,
            contacts[i]
        );
    }
    text
}

fn diagnostics_row(sim: &Simulation, tracker: &Tracker) -> String {
    let d = sim.diagnostics();
    let gap = tracker
        .gap()
        .map_or(String::new(), |gap| format!("{gap:?}"));
    format!(
        "{:?},{},{:?},{:?},{:?},{:?},{:?},{:?},{:?},{:?},{:?},{:?},{:?},{},{gap}\n",
        sim.time(),
        sim.steps(),
        sim.time_step(),
        d.cfl,
        d.max_divergence,
        d.max_velocity,
        d.slip,
        d.fluid_kinetic_energy,
        d.grain_kinetic_energy,
        d.momentum.x,
        d.momentum.y,
        d.momentum.z,
        d.momentum_residual,
        sim.contacts().len()
    )
}

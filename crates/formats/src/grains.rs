//! Motion of the grains (`grains.csv`): one row per output time and grain, SI units, space frame.

use std::path::Path;

use glam::{DQuat, DVec3};

use crate::error::FormatError;
use crate::table::{Damage, REST, Table, append_cells};

/// Name of the file in a run folder.
pub const FILE: &str = "grains.csv";
/// Header of the table.
pub const HEADER: &str =
    "time,grain,x,y,z,vx,vy,vz,qw,qx,qy,qz,wx,wy,wz,fx,fy,fz,tx,ty,tz,contacts";
/// Largest index of a grain that is read.
const LARGEST_INDEX: f64 = 1e7;

/// Row of `grains.csv`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GrainRow {
    /// Simulated time [s].
    pub time: f64,
    /// Index of the grain.
    pub grain: usize,
    /// Centroid [m].
    pub position: DVec3,
    /// Velocity of the centroid [m/s].
    pub velocity: DVec3,
    /// Rotation from the body frame to the space frame.
    pub orientation: DQuat,
    /// Angular velocity [rad/s].
    pub angular_velocity: DVec3,
    /// Hydrodynamic force [N], buoyancy excluded, if the table has it.
    pub force: Option<DVec3>,
    /// Hydrodynamic torque about the centroid [N m], if the table has it.
    pub torque: Option<DVec3>,
    /// Number of contacts, if the table has it.
    pub contacts: Option<u32>,
}

impl GrainRow {
    /// Appends the row to a text; numbers are read back exactly, missing ones are NaN.
    pub fn append_to(&self, text: &mut String) {
        let q = self.orientation;
        let [force, torque] = [self.force, self.torque].map(|v| v.unwrap_or(DVec3::NAN));
        let vectors = [self.angular_velocity, force, torque];
        let numbers = [self.position, self.velocity]
            .into_iter()
            .flat_map(|v| v.to_array())
            .chain([q.w, q.x, q.y, q.z])
            .chain(vectors.into_iter().flat_map(|v| v.to_array()));
        *text += &format!("{:?},{}", self.time, self.grain);
        append_cells(text, numbers);
        *text += &self.contacts.map_or(",NaN\n".into(), |contacts| format!(",{contacts}\n"));
    }
}

/// Reads the rows of `grains.csv`, or of a copy without loads and contacts.
///
/// # Errors
/// [`FormatError`] with the first damaged line.
pub fn read(file: &Path, notes: &mut Vec<String>) -> Result<Vec<GrainRow>, FormatError> {
    read_with(file, notes, Damage::Refuse)
}

/// Reads the rows with the given treatment of a damaged line.
///
/// # Errors
/// [`FormatError`] if the file or its header is unreadable, or with the first damaged line if
/// damage is refused.
pub fn read_with(
    file: &Path,
    notes: &mut Vec<String>,
    damage: Damage,
) -> Result<Vec<GrainRow>, FormatError> {
    let table = Table::read_with(file, notes, damage)?;
    let column = |name: &str| {
        let names = || table.names().join(", ");
        let missing = || format!("the column '{name}' is missing; found: {}", names());
        (table.column(name)).ok_or_else(|| FormatError::line(file, 1, missing()))
    };
    let vector = |names: [&str; 3]| {
        let [x, y, z] = names.map(column);
        Ok::<_, FormatError>([x?, y?, z?])
    };
    let (time, grain) = (column("time")?, column("grain")?);
    let (position, velocity) = (vector(["x", "y", "z"])?, vector(["vx", "vy", "vz"])?);
    let [qx, qy, qz] = vector(["qx", "qy", "qz"])?;
    let qw = column("qw")?;
    let angular_velocity = vector(["wx", "wy", "wz"])?;
    let force = vector(["fx", "fy", "fz"]).ok();
    let torque = vector(["tx", "ty", "tz"]).ok();
    let contacts = table.column("contacts");
    let at = |columns: [&[f64]; 3], row: usize| DVec3::from_array(columns.map(|c| c[row]));
    let rows = (0..table.rows()).map(|row| {
        let damaged = |what: String| FormatError::line(file, row + 2, what);
        let index = grain[row];
        if !(index >= 0.0 && index.fract() == 0.0 && index < LARGEST_INDEX) {
            return Err(damaged(format!("{index} is not the index of a grain")));
        }
        if index >= table.rows() as f64 {
            let rows = table.rows();
            return Err(damaged(format!("grain {index} in a table of {rows} rows")));
        }
        let position = at(position, row);
        if !time[row].is_finite() || !position.is_finite() {
            return Err(damaged("time or position is not finite".to_owned()));
        }
        let orientation = DQuat::from_xyzw(qx[row], qy[row], qz[row], qw[row]);
        let valid = orientation.is_finite() && orientation.length() > 1e-6;
        Ok(GrainRow {
            time: time[row],
            grain: index as usize,
            position,
            velocity: at(velocity, row),
            orientation: if valid { orientation.normalize() } else { DQuat::IDENTITY },
            angular_velocity: at(angular_velocity, row),
            force: force.map(|columns| at(columns, row)),
            torque: torque.map(|columns| at(columns, row)),
            contacts: contacts.and_then(|column| count(column[row])),
        })
    });
    let mut read = Vec::with_capacity(table.rows());
    for row in rows {
        let Some(row) = damage.accept(row, REST, notes)? else { break };
        read.push(row);
    }
    Ok(read)
}

/// Returns a number of the table as a count; none for NaN, fractions and negative numbers.
fn count(number: f64) -> Option<u32> {
    let valid = number.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&number);
    valid.then_some(number as u32)
}

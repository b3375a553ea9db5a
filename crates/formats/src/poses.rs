//! Tables of poses, from which grains are placed: `grains.csv` of a run, or a table of one's own.
//! Rows are in SI units and in the space frame.
//!
//! | columns | meaning | if absent |
//! |---|---|---|
//! | `x`, `y`, `z` | centroid [m] | required |
//! | `qw`, `qx`, `qy`, `qz` | rotation from the body frame to the space frame | no rotation |
//! | `vx`, `vy`, `vz`, `wx`, `wy`, `wz` | velocity [m/s], angular velocity [rad/s] | at rest |
//! | `grain` | index of the grain | number of the row, from 0 |
//! | `time` | time of the row [s] | all rows belong together |
//! | `equivalent_diameter` | size [m] | that of the shape |
//! | `density` | density [kg/m^3] | given elsewhere |

use std::collections::BTreeSet;
use std::path::Path;

use glam::{DQuat, DVec3};

use crate::error::FormatError;
use crate::table::Table;

/// Columns of `grains.csv` that say nothing about a pose.
const IGNORED: [&str; 7] = ["fx", "fy", "fz", "tx", "ty", "tz", "contacts"];
/// End of the names of columns in other units, which repeat those of `grains.csv`.
const SCALED: &str = "_scaled";
/// Columns that are read.
const READ: &str =
    "time, grain, x, y, z, qw, qx, qy, qz, vx, vy, vz, wx, wy, wz, equivalent_diameter, density";
/// Relative tolerance of times.
const SAME_TIME: f64 = 1e-9;
/// Largest difference of the length of a quaternion from one.
const UNIT_LENGTH: f64 = 1e-3;

/// Pose of one grain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Index of the grain in the table.
    pub grain: usize,
    /// Centroid [m].
    pub position: DVec3,
    /// Rotation from the body frame to the space frame.
    pub orientation: DQuat,
    /// Velocity of the centroid [m/s].
    pub velocity: DVec3,
    /// Angular velocity [rad/s].
    pub angular_velocity: DVec3,
    /// Diameter of the sphere of equal volume [m], if the table gives it.
    pub equivalent_diameter: Option<f64>,
    /// Density [kg/m^3], if the table gives it.
    pub density: Option<f64>,
}

/// Poses of all grains at one time, by index of the grain.
#[derive(Clone, Debug, PartialEq)]
pub struct Poses {
    /// Time of the rows [s], if the table has one.
    pub time: Option<f64>,
    /// The poses.
    pub poses: Vec<Pose>,
    /// Number of rows at the time before; none for the first time.
    pub rows_before: Option<usize>,
    /// Whether the table has velocities or angular velocities.
    pub has_velocities: bool,
}

/// Origin of a table of poses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// A run, which may have been interrupted: an unfinished last line is left out.
    Run,
    /// A file of one's own: its last line is whole, although it may lack its line break.
    Own,
}

/// Reads the poses at the latest time that is not after `at` [s], or at the last time of all.
///
/// # Errors
/// [`FormatError`] with the first damaged line, or if no row is at or before `at`.
pub fn read(file: &Path, origin: Origin, at: Option<f64>) -> Result<Poses, FormatError> {
    let table = match origin {
        Origin::Run => Table::read(file, &mut Vec::new())?,
        Origin::Own => Table::read_whole(file)?,
    };
    let known = || READ.split(", ").chain(IGNORED);
    let is_known = |name: &str| {
        let name = name.strip_suffix(SCALED).unwrap_or(name);
        known().any(|known| known == name)
    };
    if let Some(name) = table.names().iter().find(|name| !is_known(name)) {
        let what = format!("unknown column '{name}'; known are {READ}");
        return Err(FormatError::line(file, 1, what));
    }
    let vector = |names: [&str; 3]| -> Result<Option<[&[f64]; 3]>, FormatError> {
        match names.map(|name| table.column(name)) {
            [Some(x), Some(y), Some(z)] => Ok(Some([x, y, z])),
            [None, None, None] => Ok(None),
            _ => {
                let what = format!("the columns {} must be given together", names.join(", "));
                Err(FormatError::line(file, 1, what))
            }
        }
    };
    let position = vector(["x", "y", "z"])?
        .ok_or_else(|| FormatError::line(file, 1, "the columns x, y, z are missing"))?;
    let (velocity, spin) = (vector(["vx", "vy", "vz"])?, vector(["wx", "wy", "wz"])?);
    let axis = vector(["qx", "qy", "qz"])?;
    let turned = match (table.column("qw"), axis) {
        (Some(w), Some([x, y, z])) => Some([w, x, y, z]),
        (None, None) => None,
        _ => {
            let what = "the columns qw, qx, qy, qz must be given together";
            return Err(FormatError::line(file, 1, what));
        }
    };
    let Rows { rows, time, rows_before } = rows_at(file, table.column("time"), table.rows(), at)?;
    let mut seen = BTreeSet::new();
    let mut poses = Vec::with_capacity(rows.len());
    for row in rows {
        let damaged = |what: String| FormatError::line(file, row + 2, what);
        let finite = |columns: [&[f64]; 3], name: &str| {
            let v = DVec3::from_array(columns.map(|column| column[row]));
            if v.is_finite() { Ok(v) } else { Err(damaged(format!("the {name} is not finite"))) }
        };
        let positive = |name: &str| match table.column(name).map(|column| column[row]) {
            Some(value) if !(value.is_finite() && value > 0.0) => {
                Err(damaged(format!("{value} under '{name}' is not a positive number")))
            }
            value => Ok(value),
        };
        let grain = match table.column("grain").map(|column| column[row]) {
            Some(index) if !(index >= 0.0 && index.fract() == 0.0 && index < 1e9) => {
                return Err(damaged(format!("{index} is not the index of a grain")));
            }
            index => index.map_or(row, |index| index as usize),
        };
        if !seen.insert(grain) {
            return Err(damaged(format!("a second row for grain {grain} at this time")));
        }
        let orientation = match turned {
            None => DQuat::IDENTITY,
            Some([w, x, y, z]) => {
                let q = DQuat::from_xyzw(x[row], y[row], z[row], w[row]);
                if !q.is_finite() || (q.length() - 1.0).abs() > UNIT_LENGTH {
                    let what = "qw, qx, qy, qz are no unit quaternion".to_owned();
                    return Err(damaged(what));
                }
                q
            }
        };
        let motion = |columns: Option<[&[f64]; 3]>, name: &str| {
            columns.map_or(Ok(DVec3::ZERO), |columns| finite(columns, name))
        };
        poses.push(Pose {
            grain,
            position: finite(position, "position")?,
            orientation,
            velocity: motion(velocity, "velocity")?,
            angular_velocity: motion(spin, "angular velocity")?,
            equivalent_diameter: positive("equivalent_diameter")?,
            density: positive("density")?,
        });
    }
    poses.sort_by_key(|pose| pose.grain);
    let has_velocities = velocity.is_some() || spin.is_some();
    Ok(Poses { time, poses, rows_before, has_velocities })
}

/// Rows of a table at one time.
struct Rows {
    rows: Vec<usize>,
    time: Option<f64>,
    /// Number of rows at the time before.
    rows_before: Option<usize>,
}

/// Returns the rows at the wanted time.
fn rows_at(
    file: &Path,
    times: Option<&[f64]>,
    count: usize,
    at: Option<f64>,
) -> Result<Rows, FormatError> {
    if count == 0 {
        return Err(FormatError::line(file, 1, "the table has no rows"));
    }
    let Some(times) = times else {
        return match at {
            Some(_) => Err(FormatError::line(file, 1, "the table has no column 'time'")),
            None => Ok(Rows { rows: (0..count).collect(), time: None, rows_before: None }),
        };
    };
    if let Some(row) = times.iter().position(|time| !time.is_finite()) {
        return Err(FormatError::line(file, row + 2, "the time is not finite"));
    }
    let latest = at.map_or(f64::INFINITY, |at| at + SAME_TIME * at.abs());
    let last_before = |limit: &dyn Fn(f64) -> bool| {
        times.iter().copied().filter(|time| limit(*time)).reduce(f64::max)
    };
    let Some(time) = last_before(&|time| time <= latest) else {
        let first = times.iter().copied().fold(f64::INFINITY, f64::min);
        let what = format!("the first rows are at {first} s, after {} s", at.unwrap_or(latest));
        return Err(FormatError::line(file, 2, what));
    };
    let at_time = |wanted: f64| (0..count).filter(move |row| times[*row] == wanted);
    let before = last_before(&|earlier| earlier < time);
    let rows_before = before.map(|earlier| at_time(earlier).count());
    Ok(Rows { rows: at_time(time).collect(), time: Some(time), rows_before })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(text: &str, at: Option<f64>) -> Result<Poses, String> {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("poses.csv");
        std::fs::write(&file, text).unwrap();
        read(&file, Origin::Own, at).map_err(|error| error.to_string())
    }

    #[test]
    fn the_last_line_of_a_table_of_ones_own_may_lack_its_line_break() {
        let text = "grain,x,y,z\n0,1,0,0\n1,2,0,0";
        let of_both = of(text, None).unwrap();
        assert_eq!(of_both.poses.len(), 2);
        assert_eq!(of_both.poses[1].position, DVec3::new(2.0, 0.0, 0.0));
        assert!(!of_both.has_velocities);
        let cut = of(&text[..text.len() - 2], None).unwrap_err();
        assert!(cut.contains("line 3: 3 values under 4 columns"), "{cut}");
        // A run that was interrupted may have written a part of its last line.
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("grains.csv");
        std::fs::write(&file, text).unwrap();
        assert_eq!(read(&file, Origin::Run, None).unwrap().poses.len(), 1);
        let spins = of("x,y,z,wx,wy,wz\n1,2,3,4,5,6\n", None).unwrap();
        assert!(spins.has_velocities);
    }

    #[test]
    fn the_rows_of_one_time_are_found_and_ordered() {
        let text = "time,grain,x,y,z,contacts\n0,0,1,0,0,0\n0,1,2,0,0,0\n0.5,1,4,0,0,2\n\
                    0.5,0,3,0,0,1\n1,0,5,0,0,0\n";
        let middle = of(text, Some(0.7)).unwrap();
        assert_eq!((middle.time, middle.rows_before), (Some(0.5), Some(2)));
        let x: Vec<f64> = middle.poses.iter().map(|pose| pose.position.x).collect();
        assert_eq!(x, [3.0, 4.0]);
        assert_eq!(middle.poses[0].orientation, DQuat::IDENTITY);
        let last = of(text, None).unwrap();
        assert_eq!((last.time, last.poses.len(), last.rows_before), (Some(1.0), 1, Some(2)));
        assert_eq!(of(text, Some(0.0)).unwrap().rows_before, None);
        let early = of(text, Some(-1.0)).unwrap_err();
        assert!(early.contains("the first rows are at 0 s"), "{early}");
        // Columns in other units are left out.
        let scaled = of("time,x,y,z,time_scaled,x_scaled\n0,1,2,3,4,5\n", None).unwrap();
        assert_eq!(scaled.poses[0].position, DVec3::new(1.0, 2.0, 3.0));
    }

    #[test]
    fn damaged_tables_are_refused_with_their_line() {
        for (text, said) in [
            ("x,y\n1,2\n", "line 1: the columns x, y, z must be given together"),
            ("grain\n1\n", "line 1: the columns x, y, z are missing"),
            ("x,y,z,diameter\n1,2,3,4\n", "line 1: unknown column 'diameter'"),
            ("x,y,z,qw\n1,2,3,1\n", "line 1: the columns qw, qx, qy, qz must"),
            ("x,y,z\n", "line 1: the table has no rows"),
            ("x,y,z,x\n1,2,3,4\n", "line 1: two columns of the name 'x'"),
            ("x,y,z\n1,2,\n", "line 2: the position is not finite"),
            ("x,y,z,density\n1,2,3,-1\n", "line 2: -1 under 'density'"),
            ("grain,x,y,z\n0,1,2,3\n0,1,2,3\n", "line 3: a second row for grain 0"),
            ("grain,x,y,z\n0.5,1,2,3\n", "line 2: 0.5 is not the index"),
            ("x,y,z,qw,qx,qy,qz\n1,2,3,2,0,0,0\n", "line 2: qw, qx, qy, qz are no unit"),
            ("time,x,y,z\nnan,1,2,3\n", "line 2: the time is not finite"),
        ] {
            let error = of(text, None).unwrap_err();
            assert!(error.contains(said), "{text}: {error}");
        }
    }
}

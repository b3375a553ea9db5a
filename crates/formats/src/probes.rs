//! Tables of probes (`probes/NAME.csv`): one row per output time and point, or one per output time
//! of a plane. SI units, space frame.

use glam::DVec3;

use crate::table::append_cells;

/// Folder of the tables in a run folder.
pub const FOLDER: &str = "probes";
/// Header of the table of points.
pub const POINTS_HEADER: &str = "time,point,x,y,z,vx,vy,vz,pressure,solid_fraction";
/// Header of the table of a plane.
pub const PLANE_HEADER: &str = "time,volume_flux,grain_flux,solid_fraction,pressure";

/// Row of a table of points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointRow {
    /// Simulated time [s].
    pub time: f64,
    /// Index of the point.
    pub point: usize,
    /// Position of the point [m].
    pub position: DVec3,
    /// Velocity [m/s].
    pub velocity: DVec3,
    /// Dynamic pressure [Pa].
    pub pressure: f64,
    /// Solid fraction around the point.
    pub solid_fraction: f64,
}

impl PointRow {
    /// Appends the row to a text; numbers are read back exactly.
    pub fn append_to(&self, text: &mut String) {
        let (x, v) = (self.position, self.velocity);
        let numbers = [x.x, x.y, x.z, v.x, v.y, v.z, self.pressure, self.solid_fraction];
        *text += &format!("{:?},{}", self.time, self.point);
        append_cells(text, numbers);
        text.push('\n');
    }
}

/// Row of the table of a plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaneRow {
    /// Simulated time [s].
    pub time: f64,
    /// Volume of fluid and grains that crosses the plane [m^3/s].
    pub volume_flux: f64,
    /// Volume of grains that crosses the plane [m^3/s].
    pub grain_flux: f64,
    /// Part of the plane inside grains.
    pub solid_fraction: f64,
    /// Mean dynamic pressure outside grains [Pa]; NaN if grains cover the plane.
    pub pressure: f64,
}

impl PlaneRow {
    /// Appends the row to a text; numbers are read back exactly.
    pub fn append_to(&self, text: &mut String) {
        let numbers = [self.volume_flux, self.grain_flux, self.solid_fraction, self.pressure];
        *text += &format!("{:?}", self.time);
        append_cells(text, numbers);
        text.push('\n');
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_have_the_columns_of_their_header() {
        let point = PointRow {
            time: 0.1,
            point: 2,
            position: DVec3::new(1.0, 2.0, 3.0),
            velocity: DVec3::new(0.1, 0.2, 1e-9),
            pressure: -4.5,
            solid_fraction: 0.25,
        };
        let plane = PlaneRow {
            time: 0.1,
            volume_flux: 1e-6,
            grain_flux: -2e-7,
            solid_fraction: 1.0,
            pressure: f64::NAN,
        };
        let (mut points, mut planes) = (String::new(), String::new());
        point.append_to(&mut points);
        plane.append_to(&mut planes);
        assert_eq!(points, "0.1,2,1.0,2.0,3.0,0.1,0.2,1e-9,-4.5,0.25\n");
        assert_eq!(planes, "0.1,1e-6,-2e-7,1.0,NaN\n");
        let columns = |text: &str| text.split(',').count();
        assert_eq!(columns(&points), columns(POINTS_HEADER));
        assert_eq!(columns(&planes), columns(PLANE_HEADER));
    }
}

//! Diagnostics against time (`diagnostics.csv`).

use glam::DVec3;

use crate::table::append_cells;

/// Name of the file in a run folder.
pub const FILE: &str = "diagnostics.csv";
/// Header of the table.
pub const HEADER: &str = "time,step,dt,cfl,max_divergence,max_velocity,slip,\
     fluid_kinetic_energy,grain_kinetic_energy,momentum_x,momentum_y,momentum_z,\
     momentum_residual,contacts,gap,max_overlap,mean_overlap";

/// Row of `diagnostics.csv`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiagnosticsRow {
    /// Simulated time [s].
    pub time: f64,
    /// Time steps taken.
    pub step: u64,
    /// Length of the last time step [s].
    pub dt: f64,
    /// CFL number.
    pub cfl: f64,
    /// Largest |div u| [1/s].
    pub max_divergence: f64,
    /// Largest velocity component [m/s].
    pub max_velocity: f64,
    /// Root mean square of the slip at the surfaces [m/s].
    pub slip: f64,
    /// Kinetic energy of the fluid [J].
    pub fluid_kinetic_energy: f64,
    /// Kinetic energy of the grains [J].
    pub grain_kinetic_energy: f64,
    /// Momentum of fluid and grains [kg m/s].
    pub momentum: DVec3,
    /// Change of momentum in the last step that no force explains [kg m/s].
    pub momentum_residual: f64,
    /// Number of contacts.
    pub contacts: usize,
    /// Gap between the surfaces of a pair [m].
    pub gap: Option<f64>,
    /// Largest overlap since the last row, over the smaller equivalent diameter.
    pub max_overlap: f64,
    /// Mean overlap of the contacts at this time, over the smaller equivalent diameter.
    pub mean_overlap: f64,
}

impl DiagnosticsRow {
    /// Returns the line of the table, with its line break; numbers are read back exactly.
    pub fn to_line(&self) -> String {
        let mut line = format!("{:?},{}", self.time, self.step);
        let speeds = [self.max_divergence, self.max_velocity, self.slip];
        let energies = [self.fluid_kinetic_energy, self.grain_kinetic_energy];
        append_cells(&mut line, [self.dt, self.cfl].into_iter().chain(speeds).chain(energies));
        append_cells(
            &mut line,
            self.momentum.to_array().into_iter().chain([self.momentum_residual]),
        );
        let gap = self.gap.map_or(String::new(), |gap| format!("{gap:?}"));
        line += &format!(",{},{gap}", self.contacts);
        append_cells(&mut line, [self.max_overlap, self.mean_overlap]);
        line + "\n"
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_fits_its_header() {
        let row = DiagnosticsRow {
            time: 0.1,
            step: 3,
            dt: 1e-3,
            cfl: 0.2,
            max_divergence: 1e-15,
            max_velocity: 0.1,
            slip: 0.0,
            fluid_kinetic_energy: 1e-6,
            grain_kinetic_energy: 2e-6,
            momentum: DVec3::new(1.0, 2.0, 3.0),
            momentum_residual: 0.0,
            contacts: 2,
            gap: Some(1.0 / 3.0),
            max_overlap: 0.02,
            mean_overlap: 1.0 / 7.0,
        };
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join(FILE);
        std::fs::write(&file, format!("{HEADER}\n{}", row.to_line())).unwrap();
        let table = crate::table::Table::read(&file, &mut Vec::new()).unwrap();
        assert_eq!(table.column("momentum_z"), Some(&[3.0][..]));
        assert_eq!(table.column("contacts"), Some(&[2.0][..]));
        assert_eq!(table.column("gap"), Some(&[1.0 / 3.0][..]));
        assert_eq!(table.column("mean_overlap"), Some(&[1.0 / 7.0][..]));
    }
}

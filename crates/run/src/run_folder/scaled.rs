//! Columns of the tables in units of the scales of a case.

use std::borrow::Cow;
use std::fmt::Write as _;

use grainwake_formats::summary::Scales;

/// End of the name of a dimensionless column.
const SUFFIX: &str = "_scaled";

/// Columns of a table that are repeated in units of the scales.
#[derive(Clone, Debug, Default)]
pub(super) struct ScaledColumns {
    /// Index and unit of each column.
    columns: Vec<(usize, f64)>,
}

impl ScaledColumns {
    /// Returns the columns of a table with this header that have a unit; none without scales.
    pub fn of(header: &str, scales: Option<&Scales>) -> ScaledColumns {
        let Some(scales) = scales else {
            return ScaledColumns::default();
        };
        let columns = header.split(',').enumerate();
        let unit = |(index, name): (usize, &str)| Some((index, unit(name, scales)?));
        ScaledColumns { columns: columns.filter_map(unit).collect() }
    }

    /// Appends the names of the dimensionless columns to the header.
    pub fn header(&self, header: &str) -> String {
        let names: Vec<&str> = header.split(',').collect();
        let added = self.columns.iter().map(|(index, _)| format!(",{}{SUFFIX}", names[*index]));
        format!("{header}{}", added.collect::<String>())
    }

    /// Appends the dimensionless values to each row; an empty cell stays empty.
    pub fn extend<'a>(&self, rows: &'a str) -> Cow<'a, str> {
        if self.columns.is_empty() {
            return Cow::Borrowed(rows);
        }
        let mut text = String::new();
        for row in rows.lines() {
            text.push_str(row);
            let cells: Vec<&str> = row.split(',').collect();
            for (index, unit) in &self.columns {
                text.push(',');
                // A cell that is no number is empty.
                if let Some(value) = cells.get(*index).and_then(|cell| cell.parse::<f64>().ok()) {
                    // Writing to a string cannot fail.
                    let _ = write!(text, "{:?}", value / unit);
                }
            }
            text.push('\n');
        }
        Cow::Owned(text)
    }
}

/// Returns the number of columns in SI units of a table with this header.
pub(super) fn plain_columns(header: &str) -> usize {
    header.split(',').filter(|name| !name.ends_with(SUFFIX)).count()
}

/// Returns the unit of a column; `None` for a count, a direction or a ratio.
fn unit(name: &str, scales: &Scales) -> Option<f64> {
    let Scales { length_m, time_s, velocity_m_per_s, density_kg_per_m3 } = *scales;
    let pressure = density_kg_per_m3 * velocity_m_per_s * velocity_m_per_s;
    let force = pressure * length_m * length_m;
    Some(match name {
        "time" | "dt" => time_s,
        "x" | "y" | "z" | "gap" | "overlap" => length_m,
        "vx" | "vy" | "vz" | "max_velocity" | "slip" => velocity_m_per_s,
        "wx" | "wy" | "wz" | "max_divergence" => 1.0 / time_s,
        "fx" | "fy" | "fz" => force,
        "tx" | "ty" | "tz" | "fluid_kinetic_energy" | "grain_kinetic_energy" => force * length_m,
        "momentum_x" | "momentum_y" | "momentum_z" => force * length_m / velocity_m_per_s,
        "pressure" => pressure,
        "volume_flux" | "grain_flux" => velocity_m_per_s * length_m * length_m,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_with_a_unit_are_repeated() {
        let scales = Scales {
            length_m: 2e-3,
            time_s: 0.5,
            velocity_m_per_s: 4e-3,
            density_kg_per_m3: 1000.0,
        };
        let header = "time,grain,x,vx,qw,fx,gap";
        let columns = ScaledColumns::of(header, Some(&scales));
        let extended = columns.header(header);
        assert_eq!(
            extended,
            "time,grain,x,vx,qw,fx,gap,time_scaled,x_scaled,vx_scaled,fx_scaled,gap_scaled"
        );
        assert_eq!(plain_columns(&extended), 7);
        // The force is density * velocity^2 * length^2 = 6.4e-8 N.
        let rows = columns.extend("0.25,3,0.001,0.002,0.7,6.4e-8,\n1.0,3,NaN,0.0,0.7,0.0,0.004\n");
        let added: Vec<Vec<&str>> =
            rows.lines().map(|row| row.split(',').skip(7).collect()).collect();
        let number = |text: &str| text.parse::<f64>().unwrap();
        assert_eq!(added[0][..3], ["0.5", "0.5", "0.5"]);
        assert!((number(added[0][3]) - 1.0).abs() < 1e-12 && added[0][4].is_empty(), "{rows}");
        assert_eq!(added[1], ["2.0", "NaN", "0.0", "0.0", "2.0"]);
        let none = ScaledColumns::of(header, None);
        assert_eq!((none.header(header).as_str(), &*none.extend("1,2\n")), (header, "1,2\n"));
    }
}

//! Fields of a simulation: whole components as arrays, and the list of fields at cells.

use glam::DVec3;

use super::Simulation;
use crate::grid::{Axis, FieldView};
use crate::math::Real;

/// Read-only view of a whole field component in the precision of the run.
#[derive(Clone, Copy, Debug)]
pub enum AnyFieldView<'a> {
    /// Field of single precision.
    Single(FieldView<'a, f32>),
    /// Field of double precision.
    Double(FieldView<'a, f64>),
}

impl<'a> From<FieldView<'a, f32>> for AnyFieldView<'a> {
    fn from(view: FieldView<'a, f32>) -> Self {
        AnyFieldView::Single(view)
    }
}
impl<'a> From<FieldView<'a, f64>> for AnyFieldView<'a> {
    fn from(view: FieldView<'a, f64>) -> Self {
        AnyFieldView::Double(view)
    }
}

/// Evaluates an expression of the view in either precision.
macro_rules! with_view {
    ($any:expr, $view:ident => $value:expr) => {
        match $any {
            AnyFieldView::Single($view) => $value,
            AnyFieldView::Double($view) => $value,
        }
    };
}

impl AnyFieldView<'_> {
    /// Number of entries along z, y, x.
    pub fn shape(&self) -> [usize; 3] {
        with_view!(self, view => view.shape())
    }
    /// Distance in memory between neighbours along z, y, x [entries].
    pub fn strides(&self) -> [usize; 3] {
        with_view!(self, view => view.strides())
    }
    /// Axis normal to the faces that hold the values; none for values at cell centres.
    pub fn normal(&self) -> Option<Axis> {
        with_view!(self, view => view.normal())
    }
    /// Position of entry [0, 0, 0] [m].
    pub fn origin(&self) -> DVec3 {
        with_view!(self, view => view.origin())
    }
    /// Distance between neighbours along x, y, z [m].
    pub fn spacing(&self) -> DVec3 {
        with_view!(self, view => view.spacing())
    }
    /// Position of entry [k, j, i] [m].
    pub fn position(&self, entry: [usize; 3]) -> DVec3 {
        with_view!(self, view => view.position(entry))
    }
    /// Value of entry [k, j, i] in double precision. Panics outside the shape.
    pub fn get(&self, entry: [usize; 3]) -> f64 {
        with_view!(self, view => Real::wide(view.get(entry)))
    }
}

/// Field with a value in each cell, as written to files.
pub struct CellField {
    /// Name in files.
    pub name: &'static str,
    /// Unit of the values.
    pub unit: &'static str,
    /// Components of a value: 1 for a scalar, 3 for a vector.
    pub components: usize,
    value: fn(&Simulation, [usize; 3]) -> DVec3,
}

impl CellField {
    /// Value in cell (i, j, k), counted from 0; a scalar is the first component.
    pub fn at(&self, sim: &Simulation, cell: [usize; 3]) -> DVec3 {
        (self.value)(sim, cell)
    }
}

/// Fields written to slices and field files, in the order of the files. A further field needs an
/// entry here with its function, and a row in `docs/reference/run-folder.md`.
pub static CELL_FIELDS: &[CellField] = &[
    CellField { name: "velocity", unit: "m/s", components: 3, value: Simulation::velocity_at },
    CellField { name: "vorticity", unit: "1/s", components: 3, value: Simulation::vorticity_at },
    CellField {
        name: "pressure",
        unit: "Pa",
        components: 1,
        value: |sim, cell| DVec3::new(sim.pressure_at(cell), 0.0, 0.0),
    },
    CellField {
        name: "solid_fraction",
        unit: "1",
        components: 1,
        value: |sim, cell| DVec3::new(sim.solid_fraction_at(cell), 0.0, 0.0),
    },
];

impl Simulation {
    /// Velocity component along `axis` on its faces [m/s], at the end of the last step; `None`
    /// without fluid.
    pub fn velocity(&self, axis: Axis) -> Option<AnyFieldView<'_>> {
        Some(self.fluid.as_ref()?.velocity(axis))
    }
    /// Dynamic pressure over density at the cell centres [m^2/s^2]; `None` without fluid.
    pub fn kinematic_pressure(&self) -> Option<AnyFieldView<'_>> {
        Some(self.fluid.as_ref()?.kinematic_pressure())
    }
    /// Cell-centred velocity [m/s] of cell (i, j, k), counted from 0; zero without fluid.
    pub fn velocity_at(&self, cell: [usize; 3]) -> DVec3 {
        (self.fluid.as_ref()).map_or(DVec3::ZERO, |fluid| fluid.velocity_at(cell))
    }
    /// Vorticity [1/s] at the centre of cell (i, j, k), counted from 0; zero without fluid.
    pub fn vorticity_at(&self, cell: [usize; 3]) -> DVec3 {
        (self.fluid.as_ref()).map_or(DVec3::ZERO, |fluid| fluid.vorticity_at(cell))
    }
    /// Dynamic pressure [Pa] of cell (i, j, k), counted from 0; zero without fluid.
    pub fn pressure_at(&self, [i, j, k]: [usize; 3]) -> f64 {
        let density = self.setup.fluid.map_or(0.0, |fluid| fluid.density);
        (self.kinematic_pressure()).map_or(0.0, |pressure| density * pressure.get([k, j, i]))
    }
    /// Velocity [m/s] at a point by trilinear interpolation of each component between its own
    /// faces; `None` outside the box or without fluid.
    ///
    /// In the half cell next to a side, the second value is the velocity that the side prescribes.
    /// Where it prescribes none, the value is extrapolated from the two nearest ones. Linear
    /// velocities are exact.
    pub fn interpolate_velocity(&self, x: DVec3) -> Option<DVec3> {
        self.fluid.as_ref()?.interpolate_velocity(x)
    }
}

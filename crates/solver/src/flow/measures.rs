//! Measures of the flow.

use glam::DVec3;

/// Measures of the flow over the whole grid after a projection.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FlowMeasures {
    /// Largest |div u| [1/s].
    pub max_divergence: f64,
    /// Largest sum of |u_a| / h_a of a cell [1/s].
    pub max_rate: f64,
    /// Largest speed of a face [m/s].
    pub max_velocity: f64,
    /// Kinetic energy of the box per density [m^5/s^2].
    pub kinetic_energy: f64,
    /// Momentum of all unknown faces per density [m^4/s].
    pub momentum: DVec3,
}

//! Coupling schemes.

use serde::{Deserialize, Serialize};

/// Scheme by which the coupling imposes rigidity.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scheme {
    /// Smoothed ghost-Dirichlet drag with aperture-corrected advection (the default).
    #[default]
    Aperture,
    /// Scheme of the paper: solve without the grain, blend by solid fraction, project again.
    Paper,
}

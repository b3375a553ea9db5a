//! Precision of the numbers of fields.

use serde::{Deserialize, Serialize};

use super::Real;

/// Precision of the fields of a simulation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Precision {
    /// Single precision: half the memory, up to twice the speed.
    #[serde(rename = "f32")]
    Single,
    /// Double precision.
    #[default]
    #[serde(rename = "f64")]
    Double,
}

impl std::str::FromStr for Precision {
    type Err = String;
    fn from_str(name: &str) -> Result<Precision, String> {
        match name {
            "f64" => Ok(Precision::Double),
            "f32" => Ok(Precision::Single),
            _ => Err("accepted: f64, f32".into()),
        }
    }
}

impl std::fmt::Display for Precision {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Precision::Single => "f32",
            Precision::Double => "f64",
        })
    }
}

impl Precision {
    /// Bytes of a number.
    pub fn bytes(self) -> usize {
        match self {
            Precision::Single => f32::BYTES,
            Precision::Double => f64::BYTES,
        }
    }
}

//! Provenance of a shape.

use glam::{DQuat, DVec3};

/// Origin of a shape. It holds no date, so that equal sources give equal files.
#[derive(Clone, Debug, PartialEq)]
pub struct Provenance {
    /// `analytic`, `mesh` or `scan`.
    pub method: String,
    /// Name of the source file, empty for closed forms.
    pub source: String,
    /// SHA-256 of the source file in hexadecimal, empty for closed forms.
    pub source_sha256: String,
    /// Parameters by name, in order of application.
    pub parameters: Vec<(String, String)>,
    /// Version of the program that built the shape.
    pub program_version: String,
    /// Position of the shape's centroid in the source's frame [m].
    pub centroid: DVec3,
    /// Rotation from the principal frame to the source's frame.
    pub rotation: DQuat,
    /// Scale factor since construction: x_source = centroid + rotation * x / scale.
    pub scale: f64,
}

impl Provenance {
    pub(crate) fn new(method: &str) -> Provenance {
        Provenance {
            method: method.to_owned(),
            source: String::new(),
            source_sha256: String::new(),
            parameters: Vec::new(),
            program_version: env!("CARGO_PKG_VERSION").to_owned(),
            centroid: DVec3::ZERO,
            rotation: DQuat::IDENTITY,
            scale: 1.0,
        }
    }

    pub(crate) fn with(mut self, name: &str, value: impl ToString) -> Provenance {
        self.parameters.push((name.to_owned(), value.to_string()));
        self
    }
}

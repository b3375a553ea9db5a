//! `.grain` files: one shape with its provenance, versioned and checksummed.
//!
//! Layout, little-endian: 8 bytes signature, u32 version, u64 length of the body, the body, and the
//! SHA-256 of all preceding bytes. The body holds provenance, mass properties, morphology, quality,
//! nodes and the field; the levels of the field are deflated differences from a predictor. Files
//! hold no date: equal shapes give equal files.

mod content;
mod levels;

use crate::error::{Result, ShapeError};
use crate::shape::Shape;
use content::in_memory;
use grainwake_formats::codec::Decoder;
use grainwake_formats::disk::write_atomically;
use sha2::{Digest, Sha256};
use std::io;
use std::path::Path;

/// A non-text byte and both line endings make damage by text-mode transfers detectable.
const SIGNATURE: &[u8; 8] = b"\x8fGRAIN\r\n";
/// Version of written files; files of this and older versions are read. Version 2 added the
/// inscribed sphere and the Feret diameters.
const VERSION: u32 = 2;
const CHECKSUM: usize = 32;
/// Largest file size that is read [bytes].
const LARGEST: u64 = 1 << 30;

impl Shape {
    /// Writes the shape to `path` atomically: to a temporary file in the same folder, then renamed.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn save(&self, path: &Path) -> Result<()> {
        write_atomically(path, true, |out| out.write_all(&self.to_bytes()))
            .map_err(|e| ShapeError::io(path, e))
    }

    /// Reads a shape exactly as saved.
    ///
    /// # Errors
    /// The file cannot be read, or is no undamaged `.grain` file of a version that this program
    /// reads.
    pub fn load(path: &Path) -> Result<Shape> {
        let limits = crate::ReadLimits { file_bytes: LARGEST, ..Default::default() };
        let (bytes, _) = crate::limits::read_bytes(path, &limits)?;
        Shape::from_bytes(&bytes, path)
    }

    /// Returns the hash of the geometry (field, nodes, mass properties) in hexadecimal: equal for
    /// equal shapes, independent of their provenance.
    pub fn digest(&self) -> String {
        content::digest(self)
    }

    /// Returns the content of a `.grain` file.
    pub fn to_bytes(&self) -> Vec<u8> {
        let body = content::encode(self);
        let mut bytes = in_memory(|out| {
            out.raw(SIGNATURE)?;
            out.u32(VERSION)?;
            out.bytes(&body)
        });
        let checksum = Sha256::digest(&bytes);
        bytes.extend_from_slice(&checksum);
        bytes
    }

    /// Decodes the content of a `.grain` file; `path` is used in messages only.
    ///
    /// # Errors
    /// The bytes are no undamaged `.grain` file of a version that this program reads.
    pub fn from_bytes(bytes: &[u8], path: &Path) -> Result<Shape> {
        let Some(mut rest) = bytes.strip_prefix(SIGNATURE) else {
            let reason = "it does not begin with the signature of a grain file";
            return Err(ShapeError::malformed(path, reason));
        };
        let early = |_| ShapeError::malformed(path, "the grain file ends early");
        let mut head = Decoder::new(&mut rest);
        let version = head.u32().map_err(early)?;
        // Checked before the checksum, the position of which may differ in a newer version.
        if version > VERSION {
            let reason = format!(
                "grain file of version {version}, this program reads up to {VERSION}; update the \
                 program"
            );
            return Err(ShapeError::unsupported(path, reason));
        }
        let body = head.bytes().map_err(early)?;
        if rest.len() < CHECKSUM {
            return Err(early(io::ErrorKind::UnexpectedEof.into()));
        }
        let (content, checksum) = bytes.split_at(bytes.len() - CHECKSUM);
        if Sha256::digest(content).as_slice() != checksum {
            let reason =
                "the checksum of the grain file does not match; make it again from its source";
            return Err(ShapeError::malformed(path, reason));
        }
        let mut body = &body[..];
        let invalid = |what| ShapeError::malformed(path, format!("invalid grain file: {what}"));
        let shape = content::decode(&mut Decoder::new(&mut body), version);
        let shape = shape.map_err(|error| invalid(error.to_string()))?;
        if body.is_empty() { Ok(shape) } else { Err(invalid("it has surplus bytes".into())) }
    }
}

#[cfg(test)]
mod tests;

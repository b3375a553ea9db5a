//! `.grain` files: one shape with its provenance, versioned and checksummed.
//!
//! Layout, little-endian: 8 bytes signature, u32 version, u64 length of the body, the body, and the
//! SHA-256 of all preceding bytes. The body holds provenance, mass properties, morphology, quality,
//! nodes and the field; the levels of the field are deflated differences from a predictor. Files
//! hold no date: equal shapes give equal files.

mod levels;

use crate::error::{Result, ShapeError};
use crate::field::SampledField;
use crate::limits::hex;
use crate::morphology::Morphology;
use crate::provenance::Provenance;
use crate::quality::Quality;
use crate::shape::{Field, Shape, SurfaceNode};
use grainwake_formats::codec::{Decoder, Encoder, encode, invalid};
use sha2::{Digest, Sha256};
use std::io::{self, Write};
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
    pub fn save(&self, path: &Path) -> Result<()> {
        let io = |e| ShapeError::io(path, e);
        let mut name = path.file_name().unwrap_or_default().to_owned();
        name.push(format!(".{}.tmp", std::process::id()));
        let temporary = path.with_file_name(name);
        let write = || {
            let mut file = std::fs::File::create(&temporary)?;
            file.write_all(&self.to_bytes())?;
            file.sync_all()?;
            std::fs::rename(&temporary, path)
        };
        write().map_err(|e| {
            // Best-effort clean-up; the first error is reported.
            let _ = std::fs::remove_file(&temporary);
            io(e)
        })
    }

    /// Reads a shape, bit for bit as saved.
    pub fn load(path: &Path) -> Result<Shape> {
        let limits = crate::ReadLimits {
            file_bytes: LARGEST,
            ..Default::default()
        };
        let (bytes, _) = crate::limits::read_bytes(path, &limits)?;
        Shape::from_bytes(&bytes, path)
    }

    /// Returns the content of a `.grain` file.
    pub fn to_bytes(&self) -> Vec<u8> {
        let body = in_memory(|out| {
            encode_provenance(out, &self.provenance)?;
            encode_measures(out, self)?;
            match &self.field {
                Field::Sphere(radius) => {
                    out.u8(0)?;
                    out.f64(*radius)
                }
                Field::Sampled(field) => {
                    out.u8(1)?;
                    encode_grid(out, field)?;
                    out.bytes(&levels::pack(field.levels(), field.dims()))
                }
            }
        });
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
    pub fn from_bytes(bytes: &[u8], path: &Path) -> Result<Shape> {
        let Some(mut rest) = bytes.strip_prefix(SIGNATURE) else {
            return Err(ShapeError::NotAGrainFile {
                path: path.to_owned(),
            });
        };
        let early = |_| ShapeError::malformed(path, "the grain file ends early");
        let mut head = Decoder::new(&mut rest);
        let version = head.u32().map_err(early)?;
        // Checked before the checksum, the position of which may differ in a newer version.
        if version > VERSION {
            let path = path.to_owned();
            return Err(ShapeError::FutureVersion {
                path,
                found: version,
                supported: VERSION,
            });
        }
        let body = head.bytes().map_err(early)?;
        if rest.len() < CHECKSUM {
            return Err(early(io::ErrorKind::UnexpectedEof.into()));
        }
        let (content, checksum) = bytes.split_at(bytes.len() - CHECKSUM);
        if Sha256::digest(content).as_slice() != checksum {
            return Err(ShapeError::Checksum {
                path: path.to_owned(),
            });
        }
        let mut body = &body[..];
        let shape = decode(&mut Decoder::new(&mut body), version).ok();
        shape
            .filter(|_| body.is_empty())
            .ok_or_else(|| ShapeError::malformed(path, "the content of the grain file is invalid"))
    }
}

/// Encodes into memory, which cannot fail.
fn in_memory(fill: impl FnOnce(&mut Encoder) -> io::Result<()>) -> Vec<u8> {
    encode(fill).unwrap_or_default()
}

/// Returns the SHA-256 of the geometry in hexadecimal.
pub(crate) fn digest(shape: &Shape) -> String {
    let content = in_memory(|out| {
        encode_mass(out, shape)?;
        match &shape.field {
            Field::Sphere(radius) => out.f64(*radius),
            Field::Sampled(field) => {
                encode_grid(out, field)?;
                out.reals(field.levels())
            }
        }
    });
    hex(&Sha256::digest(content))
}

fn encode_provenance(out: &mut Encoder, p: &Provenance) -> io::Result<()> {
    for text in [&p.method, &p.source, &p.source_sha256, &p.program_version] {
        out.text(text)?;
    }
    out.u32(p.parameters.len() as u32)?;
    for (name, value) in &p.parameters {
        out.text(name)?;
        out.text(value)?;
    }
    out.vector(p.centroid)?;
    out.quaternion(p.rotation)?;
    out.f64(p.scale)
}

fn decode_provenance(from: &mut Decoder) -> io::Result<Provenance> {
    let (method, source) = (from.text()?, from.text()?);
    let (source_sha256, program_version) = (from.text()?, from.text()?);
    let count = from.u32()? as usize;
    Ok(Provenance {
        method,
        source,
        source_sha256,
        parameters: from.list(count, |from| Ok((from.text()?, from.text()?)))?,
        program_version,
        centroid: from.vector()?,
        rotation: from.quaternion()?,
        scale: from.f64()?,
    })
}

/// Encodes volume, inertia, bounds and nodes.
fn encode_mass(out: &mut Encoder, shape: &Shape) -> io::Result<()> {
    out.f64(shape.volume)?;
    for v in [shape.inertia, shape.lower, shape.upper] {
        out.vector(v)?;
    }
    out.f64(shape.bounding_radius)?;
    out.u32(shape.nodes.len() as u32)?;
    for node in &shape.nodes {
        out.vector(node.position)?;
        out.f64(node.area)?;
    }
    Ok(())
}

fn encode_measures(out: &mut Encoder, shape: &Shape) -> io::Result<()> {
    encode_mass(out, shape)?;
    let m = &shape.morphology;
    out.reals(&[m.a, m.b, m.c, m.area])?;
    out.reals(&[m.krumbein_sphericity, m.wadell_sphericity])?;
    out.option(m.wadell_roundness)?;
    out.option(m.convexity)?;
    out.option(m.inscribed_radius)?;
    for n in 0..3 {
        out.option(m.feret.map(|lengths| lengths[n]))?;
    }
    out.option(shape.quality.map(|q| q.gradient_error))?;
    out.option(shape.quality.and_then(|q| q.volume_error))
}

fn decode(from: &mut Decoder, version: u32) -> io::Result<Shape> {
    let provenance = decode_provenance(from)?;
    let volume = from.f64()?;
    let (inertia, lower, upper) = (from.vector()?, from.vector()?, from.vector()?);
    let bounding_radius = from.f64()?;
    let count = from.u32()? as usize;
    let nodes = from.list(count, |from| {
        Ok(SurfaceNode {
            position: from.vector()?,
            area: from.f64()?,
        })
    })?;
    let mut morphology = Morphology {
        a: from.f64()?,
        b: from.f64()?,
        c: from.f64()?,
        area: from.f64()?,
        krumbein_sphericity: from.f64()?,
        wadell_sphericity: from.f64()?,
        wadell_roundness: from.option()?,
        inscribed_radius: None,
        feret: None,
        convexity: from.option()?,
    };
    if version >= 2 {
        morphology.inscribed_radius = from.option()?;
        if let (Some(l), Some(w), Some(t)) = (from.option()?, from.option()?, from.option()?) {
            morphology.feret = Some([l, w, t]);
        }
    }
    let gradient_error = from.option()?;
    let volume_error = from.option()?;
    let field = match from.u8()? {
        0 => Field::Sphere(from.f64()?),
        1 => Field::Sampled(decode_grid(from)?),
        other => return Err(invalid(format!("field of kind {other}"))),
    };
    let finite = inertia.is_finite() && lower.is_finite() && upper.is_finite();
    let positive = [volume, bounding_radius, morphology.a, inertia.min_element()];
    if !finite || positive.iter().any(|v| !v.is_finite() || *v <= 0.0) {
        return Err(invalid("a size is not positive"));
    }
    Ok(Shape {
        field,
        nodes,
        volume,
        inertia,
        lower,
        upper,
        bounding_radius,
        morphology,
        quality: gradient_error.map(|gradient_error| Quality {
            gradient_error,
            volume_error,
        }),
        provenance,
    })
}

fn encode_grid(out: &mut Encoder, field: &SampledField) -> io::Result<()> {
    out.vector(field.lower())?;
    out.f64(field.spacing())?;
    out.f64(field.quantum())?;
    (field.dims().into_iter()).try_for_each(|n| out.u32(n as u32))
}

fn decode_grid(from: &mut Decoder) -> io::Result<SampledField> {
    let lower = from.vector()?;
    let (spacing, quantum) = (from.f64()?, from.f64()?);
    let dims = [from.u32()?, from.u32()?, from.u32()?].map(|n| n as usize);
    let samples = (dims.iter()).try_fold(1u64, |n, d| n.checked_mul(*d as u64));
    let valid = lower.is_finite()
        && [spacing, quantum].iter().all(|v| v.is_finite() && *v > 0.0)
        && dims.iter().all(|n| *n >= 2)
        && samples.is_some_and(|n| n <= crate::field::MAX_SAMPLES);
    let levels = match valid {
        true => levels::unpack(&from.bytes()?, dims),
        false => None,
    };
    let levels = levels.ok_or_else(|| invalid("the distance field"))?;
    Ok(SampledField::from_levels(
        lower, spacing, dims, quantum, levels,
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ShapeOptions, analytic};

    /// Length of signature, version and body length.
    const HEAD: usize = 8 + 4 + 8;

    fn egg() -> Shape {
        let options = ShapeOptions {
            cells: 16,
            nodes: Some(100),
            ..Default::default()
        };
        analytic::ellipsoid(2e-3, 1.5e-3, 1e-3, &options).unwrap()
    }

    #[test]
    fn files_round_trip_bit_for_bit() {
        let folder = tempfile::tempdir().unwrap();
        for shape in [egg(), Shape::sphere(1e-3, 50), egg().scaled(1.7).unwrap()] {
            let path = folder.path().join("egg.grain");
            shape.save(&path).unwrap();
            let back = Shape::load(&path).unwrap();
            assert_eq!(back, shape);
            assert_eq!(back.to_bytes(), shape.to_bytes());
            assert_eq!(back.digest(), shape.digest());
        }
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn every_flipped_byte_is_noticed() {
        let path = Path::new("egg.grain");
        let good = egg().to_bytes();
        for at in (0..good.len())
            .step_by(97)
            .chain(0..40)
            .chain(good.len() - 40..good.len())
        {
            let mut bad = good.clone();
            bad[at] ^= 0x10;
            assert!(Shape::from_bytes(&bad, path).is_err(), "byte {at}");
        }
        for length in (0..good.len()).step_by(101).chain([good.len() - 1]) {
            assert!(
                Shape::from_bytes(&good[..length], path).is_err(),
                "length {length}"
            );
        }
    }

    #[test]
    fn errors_tell_damage_from_age() {
        let path = Path::new("egg.grain");
        let good = egg().to_bytes();
        let mut newer = good.clone();
        newer[8] = 200;
        let error = Shape::from_bytes(&newer, path).unwrap_err();
        assert!(
            matches!(error, ShapeError::FutureVersion { found: 200, .. }),
            "{error}"
        );
        let mut damaged = good.clone();
        let middle = damaged.len() / 2;
        damaged[middle] ^= 1;
        let error = Shape::from_bytes(&damaged, path).unwrap_err();
        assert!(matches!(error, ShapeError::Checksum { .. }), "{error}");
        let error = Shape::from_bytes(b"solid cube", path).unwrap_err();
        assert!(matches!(error, ShapeError::NotAGrainFile { .. }), "{error}");
        let missing = Shape::load(Path::new("/nonexistent/egg.grain")).unwrap_err();
        assert!(matches!(missing, ShapeError::Io { .. }), "{missing}");
    }

    /// Invalid content with a valid checksum must not panic.
    #[test]
    fn forged_content_is_refused() {
        let good = egg().to_bytes();
        let mut refused = 0;
        for at in (HEAD..good.len() - CHECKSUM).step_by(61) {
            for value in [0u8, 0xff, 0x7f] {
                let mut forged = good[..good.len() - CHECKSUM].to_vec();
                forged[at] = value;
                let checksum = Sha256::digest(&forged);
                forged.extend_from_slice(&checksum);
                refused += usize::from(Shape::from_bytes(&forged, Path::new("x")).is_err());
            }
        }
        assert!(refused > 0);
    }

    #[test]
    fn the_digest_is_of_the_geometry() {
        let shape = egg();
        let mut renamed = shape.clone();
        renamed.provenance.source = "elsewhere".into();
        assert_eq!(shape.digest(), renamed.digest());
        assert_ne!(shape.digest(), shape.scaled(1.0 + 1e-12).unwrap().digest());
        assert_eq!(shape.digest().len(), 64);
    }
}

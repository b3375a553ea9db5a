//! Content of a `.grain` file: encoding and decoding of a shape, and the hash of its geometry.

use super::levels;
use crate::error::check_length;
use crate::field::SampledField;
use crate::limits::hex;
use crate::morphology::Morphology;
use crate::nodes::SurfaceNode;
use crate::provenance::Provenance;
use crate::quality::Quality;
use crate::shape::{Field, Shape};
use glam::DVec3;
use grainwake_formats::codec::{self, Decoder, Encoder, invalid};
use sha2::{Digest, Sha256};
use std::io;

/// Encodes into memory, which cannot fail.
pub(super) fn in_memory(fill: impl FnOnce(&mut Encoder) -> io::Result<()>) -> Vec<u8> {
    codec::encode(fill).unwrap_or_default()
}

pub(super) fn encode(shape: &Shape) -> Vec<u8> {
    in_memory(|out| {
        encode_provenance(out, &shape.provenance)?;
        encode_measures(out, shape)?;
        match &shape.field {
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
    })
}

/// Returns the SHA-256 of the geometry in hexadecimal.
pub(super) fn digest(shape: &Shape) -> String {
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

pub(super) fn decode(from: &mut Decoder, version: u32) -> io::Result<Shape> {
    let provenance = decode_provenance(from)?;
    let volume = from.f64()?;
    let (inertia, lower, upper) = (from.vector()?, from.vector()?, from.vector()?);
    let bounding_radius = from.f64()?;
    let count = from.u32()? as usize;
    let nodes =
        from.list(count, |from| Ok(SurfaceNode { position: from.vector()?, area: from.f64()? }))?;
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
    let shape = Shape {
        field,
        nodes,
        volume,
        inertia,
        lower,
        upper,
        bounding_radius,
        morphology,
        quality: gradient_error.map(|gradient_error| Quality { gradient_error, volume_error }),
        provenance,
    };
    check(&shape)?;
    Ok(shape)
}

/// Refuses sizes that contradict each other, which a damaged file with a correct checksum may hold.
fn check(shape: &Shape) -> io::Result<()> {
    let radius = shape.bounding_radius;
    check_length("bounding radius", radius).map_err(|error| invalid(error.to_string()))?;
    // Rounding, and nodes and bounds that lie a little outside the surface.
    let limit = 1.1 * radius;
    let is_length = |length: f64| length > 0.0 && length <= 2.0 * limit;
    let is_inside = |x: DVec3| x.is_finite() && x.abs().max_element() <= limit;
    let is_area = |area: f64| area > 0.0 && area.is_finite();

    let (volume, inertia) = (shape.volume, shape.inertia);
    let is_volume = volume > 0.0 && volume <= (2.0 * limit).powi(3);
    let is_inertia = |moment: f64| moment > 0.0 && moment <= volume * limit * limit;
    if !is_volume || !inertia.to_array().into_iter().all(is_inertia) {
        return Err(invalid("the volume or the moments of inertia"));
    }
    if !(is_inside(shape.lower) && is_inside(shape.upper) && shape.lower.cmplt(shape.upper).all()) {
        return Err(invalid("the bounding box"));
    }
    if !shape.nodes.iter().all(|node| is_inside(node.position) && is_area(node.area)) {
        return Err(invalid("the surface nodes"));
    }
    let m = &shape.morphology;
    if ![m.a, m.b, m.c].into_iter().all(is_length) || !is_area(m.area) {
        return Err(invalid("the principal axes or the area"));
    }
    let p = &shape.provenance;
    if !(p.centroid.is_finite() && p.rotation.is_finite() && p.scale.is_finite()) {
        return Err(invalid("the pose in the source"));
    }
    let fits = match &shape.field {
        Field::Sphere(own) => (own / radius - 1.0).abs() < 1e-9,
        Field::Sampled(field) => {
            let covers =
                field.lower().cmple(shape.lower).all() && field.upper().cmpge(shape.upper).all();
            let (quantum, spacing) = (field.quantum(), field.spacing());
            covers && spacing <= radius && quantum <= spacing && quantum >= 1e-12 * spacing
        }
    };
    if fits { Ok(()) } else { Err(invalid("the distance field does not fit the shape")) }
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
    Ok(SampledField::from_levels(lower, spacing, dims, quantum, levels))
}

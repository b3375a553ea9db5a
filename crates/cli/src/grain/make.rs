//! `grain make`: shapes of closed form.

use grainwake_shape::{Shape, ShapeOptions, analytic, check_length};

use super::{diameter, grain_file, length, may_write, options, save, sized};
use crate::args::Body;
use crate::exit::Exit;

/// Creates a grain of closed form.
pub fn make(body: &Body) -> Result<(), Exit> {
    let new = match body {
        Body::Sphere { new, .. }
        | Body::Ellipsoid { new, .. }
        | Body::RoundedBox { new, .. }
        | Body::Cylinder { new, .. }
        | Body::Capsule { new, .. }
        | Body::Superquadric { new, .. } => new,
    };
    grain_file(&new.output)?;
    may_write(&new.output, new.common.force)?;
    let diameter = diameter(new)?;
    save(&sized(build(body, &options(new))?, diameter, "the sizes")?, new)
}

fn build(body: &Body, options: &ShapeOptions) -> Result<Shape, Exit> {
    // Lengths are checked as given: radii and semi-axes are half of them.
    let size = |name: &'static str, text: &str| -> Result<f64, Exit> {
        let value = length(name, text)?;
        check_length(name, value)?;
        Ok(value)
    };
    let three = |name: &'static str, texts: &[String]| -> Result<[f64; 3], Exit> {
        let mut values = [f64::NAN; 3];
        for (value, text) in values.iter_mut().zip(texts) {
            *value = size(name, text)?;
        }
        Ok(values)
    };
    let round = |diameter: &str, height: &str| -> Result<(f64, f64), Exit> {
        Ok((0.5 * size("diameter", diameter)?, size("height", height)?))
    };
    Ok(match body {
        Body::Sphere { diameter, .. } => {
            analytic::sphere(0.5 * size("diameter", diameter)?, options)?
        }
        Body::Ellipsoid { axes, .. } => {
            let [a, b, c] = three("axes", axes)?.map(|x| 0.5 * x);
            analytic::ellipsoid(a, b, c, options)?
        }
        Body::RoundedBox { edges, radius, .. } => {
            let [a, b, c] = three("edges", edges)?;
            analytic::rounded_box(a, b, c, length("--radius", radius)?, options)?
        }
        Body::Cylinder { diameter, height, .. } => {
            let (radius, height) = round(diameter, height)?;
            analytic::cylinder(radius, height, options)?
        }
        Body::Capsule { diameter, height, .. } => {
            let (radius, height) = round(diameter, height)?;
            analytic::capsule(radius, height, options)?
        }
        Body::Superquadric { axes, exponents, .. } => {
            let semi_axes = three("axes", axes)?.map(|x| 0.5 * x);
            analytic::superquadric(semi_axes, exponents[0], exponents[1], options)?
        }
    })
}

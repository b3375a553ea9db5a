//! `grain export`.

use grainwake_shape::Shape;
use grainwake_shape::mesh::{MeshFormat, write_mesh};

use super::{may_write, mesh_unit, not_input};
use crate::args::ExportArgs;
use crate::exit::Exit;
use crate::print;

/// Writes the surface of a grain in its principal frame, with the centroid at the origin.
pub fn export(args: &ExportArgs) -> Result<(), Exit> {
    let ending = args.output.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    let Some(format) = MeshFormat::of_ending(&ending) else {
        return Err(Exit::refused(
            format!("{} does not name a mesh format", args.output.display()),
            "the output ends in .stl, .ply, .obj or .vtp",
        ));
    };
    let unit = mesh_unit(&args.unit)?;
    if !(unit.is_finite() && unit > 0.0) {
        return Err(Exit::input("--unit: the length must be positive"));
    }
    not_input(&args.output, &args.grain)?;
    may_write(&args.output, args.force)?;
    let shape = Shape::load(&args.grain)?;
    let (mut points, triangles) = shape.surface_mesh();
    points.iter_mut().for_each(|point| *point /= unit);
    write_mesh(&args.output, format, &points, &triangles)?;
    let (points, triangles) = (points.len(), triangles.len());
    print(&format!("{}: {points} points, {triangles} triangles", args.output.display()))
}

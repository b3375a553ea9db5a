//! `grain from-mesh`.

use grainwake_shape::ReadLimits;
use grainwake_shape::mesh::{MeshOptions, read_mesh, shape_from_mesh};

use super::{length, may_write, options, plausible, save};
use crate::args::FromMeshArgs;
use crate::exit::Exit;

/// A grain from a closed surface mesh.
pub fn from_mesh(args: &FromMeshArgs) -> Result<(), Exit> {
    may_write(&args.new.output, args.new.force)?;
    let unit = length("--unit", &args.unit)?;
    let (mesh, source) = read_mesh(&args.mesh, unit, &ReadLimits::default())?;
    let shape = shape_from_mesh(
        &mesh,
        &source,
        &MeshOptions {
            shape: options(&args.new),
            flip: args.flip,
        },
    )?;
    plausible(&shape, &args.new, "--unit")?;
    save(shape, &args.new)
}

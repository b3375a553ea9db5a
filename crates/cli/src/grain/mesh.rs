//! `grain from-mesh`.

use grainwake_shape::ReadLimits;
use grainwake_shape::mesh::{MeshOptions, read_mesh, shape_from_mesh};

use super::{diameter, grain_file, may_write, mesh_unit, not_input, options, save, sized};
use crate::args::FromMeshArgs;
use crate::exit::Exit;

/// Creates a grain from a closed surface mesh.
pub fn from_mesh(args: &FromMeshArgs) -> Result<(), Exit> {
    not_input(&args.new.output, &args.mesh)?;
    grain_file(&args.new.output)?;
    may_write(&args.new.output, args.new.common.force)?;
    let (unit, diameter) = (mesh_unit(&args.unit)?, diameter(&args.new)?);
    let (mesh, source) = read_mesh(&args.mesh, unit, &ReadLimits::default())?;
    let shape = shape_from_mesh(
        &mesh,
        &source,
        &MeshOptions { shape: options(&args.new), flip: args.flip },
    )?;
    save(&sized(shape, diameter, "--unit")?, &args.new)
}

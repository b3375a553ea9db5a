//! `grain from-mesh`.

use grainwake_shape::ReadLimits;
use grainwake_shape::mesh::{MeshOptions, read_mesh, shape_from_mesh};

use super::{grain_file, length, may_write, not_input, options, plausible, save};
use crate::args::FromMeshArgs;
use crate::exit::Exit;

/// Creates a grain from a closed surface mesh.
pub fn from_mesh(args: &FromMeshArgs) -> Result<(), Exit> {
    not_input(&args.new.output, &args.mesh)?;
    grain_file(&args.new.output)?;
    may_write(&args.new.output, args.new.common.force)?;
    // A bare unit such as "mm" means "1 mm" here; in other options it is an error.
    let bare = args.unit.chars().all(char::is_alphabetic);
    let unit = if bare { format!("1 {}", args.unit) } else { args.unit.clone() };
    let unit = length("--unit", &unit)?;
    let (mesh, source) = read_mesh(&args.mesh, unit, &ReadLimits::default())?;
    let shape = shape_from_mesh(
        &mesh,
        &source,
        &MeshOptions { shape: options(&args.new), flip: args.flip },
    )?;
    plausible(&shape, &args.new, "--unit")?;
    save(shape, &args.new)
}

//! `grain family`.

use grainwake_report::grain_sheet::GrainPanel;
use grainwake_shape::family::{FamilyTarget, family_grain, family_options};
use grainwake_shape::{ShapeError, write_table};

use super::{create, drawn, folder, length, may_write, show};
use crate::args::FamilyArgs;
use crate::exit::Exit;

/// Pixels of one view in the contact sheet.
const PIXELS: usize = 130;

/// Generates one grain for each pair of sphericity and roundness, numbered row by row.
pub fn family(args: &FamilyArgs) -> Result<(), Exit> {
    folder(&args.output)?;
    let diameter = length("--equivalent-diameter", &args.equivalent_diameter)?;
    let mut options = family_options();
    options.nodes = args.common.nodes;
    options.cells = args.common.cells.or(options.cells);
    let count = args.sphericity.len() * args.roundness.len();
    if count > 999 {
        return Err(Exit::input(format!("the family has {count} grains, the maximum is 999")));
    }
    let file = |n: usize| args.output.join(format!("{n:02}.grain"));
    let (table, sheet) = (args.output.join("table.csv"), args.output.join("sheet.png"));
    for path in (1..=count).map(file).chain([table.clone(), sheet.clone()]) {
        may_write(&path, args.common.force)?;
    }
    // All grains are built before any is written, so that bad input writes nothing.
    let mut shapes = Vec::with_capacity(count);
    for &sphericity in &args.sphericity {
        for &roundness in &args.roundness {
            let mut target = FamilyTarget::new(sphericity, roundness, diameter);
            target.flatness = args.flatness.unwrap_or(target.flatness);
            let shape = family_grain(&target, args.seed, &options);
            shapes.push(shape.map_err(|error| refused(error, sphericity))?);
        }
    }
    create(&args.output)?;
    let (mut rows, mut pictures) = (Vec::new(), Vec::new());
    for (n, shape) in shapes.iter().enumerate() {
        let path = file(n + 1);
        shape.save(&path)?;
        show(shape, &path, args.common.json)?;
        let name = format!("{:02}", n + 1);
        pictures.push(GrainPanel::three_sides(&name, shape, PIXELS, false));
        rows.push((name, shape.record()));
    }
    write_table(&table, &rows, &[])?;
    drawn::save(&sheet, pictures, args.roundness.len())
}

/// Adds the admissible range to an error about the flatness.
fn refused(error: ShapeError, sphericity: f64) -> Exit {
    let ShapeError::BadParameter { name: "flatness", .. } = error else {
        return error.into();
    };
    let least = (1e3 * sphericity.powi(3).max(0.2) - 1e-3).ceil() / 1e3;
    Exit::refused(
        error.to_string(),
        format!(
            "with --sphericity {sphericity} the flatness can be {least} to 1; omit --flatness for the default"
        ),
    )
}

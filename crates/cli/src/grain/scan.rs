//! `grain from-scan`.

use std::path::PathBuf;

use grainwake_shape::ReadLimits;
use grainwake_shape::scan::{ScanOptions, ScannedGrain, read_volume, shapes_from_volume};
use serde_json::json;

use super::{finish, length, may_write, options, save};
use crate::args::FromScanArgs;
use crate::exit::{BAD_INPUT, Exit};
use crate::print;

/// One grain, or all grains of an image.
pub fn from_scan(args: &FromScanArgs) -> Result<(), Exit> {
    let one_file = args.new.output.extension().is_some_and(|e| e == "grain");
    if one_file {
        may_write(&args.new.output, args.new.force)?;
    }
    let mut how = ScanOptions::new(length("--voxel", &args.voxel)?);
    how.label = args.label;
    how.threshold = args.threshold;
    how.split = args.split;
    how.pad = args.pad;
    how.largest_piece = args.largest_piece;
    how.smoothing = args.smoothing.unwrap_or(how.smoothing);
    how.shape = options(&args.new);
    let (volume, source) = read_volume(&args.image, &ReadLimits::default())?;
    let mut grains = shapes_from_volume(&volume, &source, &how)?;
    if !one_file {
        return all(args, grains);
    }
    let Some(grain) = grains.pop().filter(|_| grains.is_empty()) else {
        let labels: Vec<String> = grains
            .iter()
            .take(10)
            .map(|g| g.label.to_string())
            .collect();
        let message = format!(
            "the image holds {} grains, the first with labels {}",
            grains.len() + 1,
            labels.join(", ")
        );
        return Err(Exit::with_help(
            BAD_INPUT,
            message,
            "choose one with --label N, or give -o a folder to take them all",
        ));
    };
    save(grain.shape?, &args.new)
}

/// Every grain into a folder; those that are refused are listed with the reason.
fn all(args: &FromScanArgs, grains: Vec<ScannedGrain>) -> Result<(), Exit> {
    let path = |label: u32| -> PathBuf { args.new.output.join(format!("label-{label:05}.grain")) };
    for grain in grains.iter().filter(|g| g.shape.is_ok()) {
        may_write(&path(grain.label), args.new.force)?;
    }
    let (mut kept, mut refused) = (0, 0);
    for grain in grains {
        match grain.shape {
            Ok(shape) => {
                kept += 1;
                let file = path(grain.label);
                let record = finish(shape, &file, &args.new)?.record();
                if args.new.json {
                    print(&json!({ "label": grain.label, "voxels": grain.voxels, "file": file, "record": record }).to_string())?;
                } else {
                    print(&format!(
                        "{}  {} voxels, equivalent diameter {:.4} mm, Krumbein sphericity {:.3}",
                        file.display(),
                        grain.voxels,
                        1e3 * record.equivalent_diameter_m,
                        record.krumbein_sphericity
                    ))?;
                }
            }
            Err(reason) => {
                refused += 1;
                eprintln!(
                    "label {} ({} voxels) left out: {reason}",
                    grain.label, grain.voxels
                );
            }
        }
    }
    eprintln!("{kept} grains written, {refused} left out");
    if kept == 0 {
        Err(Exit::new(BAD_INPUT, "no grain of the image can be used"))
    } else {
        Ok(())
    }
}

//! `grain from-scan`.

use std::ops::ControlFlow;

use grainwake_shape::ReadLimits;
use grainwake_shape::scan::{
    ScanOptions, ScannedGrain, Threshold, grey_notes, read_volume_and_voxel, scan_volume,
};
use indicatif::{ProgressBar, ProgressStyle};

use super::refused::lines;
use super::treated::treated;
use super::{
    diameter, folder, length, may_draw, may_write, not_input, options, preview, save, scan_folder,
    sized,
};
use crate::args::FromScanArgs;
use crate::exit::Exit;
use crate::progress::count;
use crate::{print, tell};

/// Creates one grain, or all grains of an image.
pub fn from_scan(args: &FromScanArgs) -> Result<(), Exit> {
    let output = &args.new.output;
    let one_file = output.extension().is_some_and(|e| e == "grain");
    not_input(output, &args.image)?;
    if one_file {
        may_write(output, args.new.common.force)?;
    } else {
        folder(output)?;
        if args.preview.is_none() {
            for file in scan_folder::existing(output) {
                may_write(&file, args.new.common.force)?;
            }
        }
    }
    let (mut how, diameter) = (how(args)?, diameter(&args.new)?);
    if let Some(picture) = &args.preview {
        may_draw("--preview", picture, &[&args.image])?;
        may_write(picture, args.new.common.force)?;
        // Acceptance does not depend on it.
        how.shape.roundness = false;
    }
    let limits = ReadLimits::of_this_machine(how.bytes_per_voxel());
    let (volume, source, stated) = read_volume_and_voxel(&args.image, &limits)?;
    if let Some(stated) = stated.filter(|stated| stated.contradicts(how.voxel)) {
        tell!(
            "note: {} states voxels of {stated}, unlike --voxel {}; the grains have the size of --voxel",
            args.image.display(),
            args.voxel
        );
    }
    let bar = ProgressBar::new(0);
    if let Ok(style) = ProgressStyle::with_template("{msg:10} {bar:40} {pos}/{len} {eta}") {
        bar.set_style(style);
    }
    let scan = scan_volume(&volume, &source, &how, &|what, done, total| {
        bar.set_message(what.to_owned());
        bar.set_length(total);
        bar.set_position(done);
        ControlFlow::Continue(())
    });
    bar.finish_and_clear();
    let scan = scan?;
    if let Some(threshold) = scan.threshold {
        tell!("threshold {threshold}");
    }
    if let Some(masked) = scan.masked {
        tell!(
            "note: {:.0} % of the image lie outside the field of view or mask and have the value {}; the threshold ignores them, and grains at their edge count as cut",
            100.0 * masked.share,
            masked.value
        );
    }
    grey_notes(&scan.grains).iter().for_each(|note| tell!("note: {note}"));
    if let Some(picture) = &args.preview {
        preview::draw(picture, args, how.voxel, &volume, &scan)?;
        let lines = treated(&scan.grains).into_iter().chain(lines(&scan.refusals, args.rescue));
        lines.for_each(|line| tell!("{line}"));
        let kept = scan.grains.iter().filter(|g| g.shape.is_ok()).count();
        let rejected = scan.grains.len() - kept;
        tell!("{} kept, {rejected} rejected; none written", count(kept, "grain"));
        return print(&picture.display().to_string());
    }
    drop(volume);
    if !one_file {
        return scan_folder::write(args, scan, diameter);
    }
    let grain = match <[ScannedGrain; 1]>::try_from(scan.grains) {
        Ok([grain]) => grain,
        Err(grains) => {
            let labels: Vec<String> = grains.iter().map(|g| g.label.to_string()).collect();
            let message = format!(
                "{} holds {} grains, but the output {} is one file; the labels are {}{}",
                args.image.display(),
                grains.len(),
                output.display(),
                labels[..labels.len().min(10)].join(", "),
                if labels.len() > 10 { ", ..." } else { "" }
            );
            return Err(Exit::refused(
                message,
                "select one with --label N, or write all to a folder with -o DIR; if the values are grey values instead of labels, add --threshold otsu",
            ));
        }
    };
    treated(std::slice::from_ref(&grain)).iter().for_each(|line| tell!("{line}"));
    save(&sized(grain.shape?, diameter, "--voxel")?, &args.new)
}

fn how(args: &FromScanArgs) -> Result<ScanOptions, Exit> {
    let mut how = ScanOptions::new(length("--voxel", &args.voxel)?);
    how.label = args.label;
    how.labels = args.labels;
    how.threshold = match args.threshold.as_deref() {
        None => None,
        Some("otsu") => Some(Threshold::Otsu),
        Some("otsu3") => Some(Threshold::Otsu3),
        Some(text) => Some(Threshold::Value(text.parse().map_err(|_| {
            Exit::refused(
                format!("--threshold: {text:?} is not a number"),
                "use a grey value, otsu or otsu3",
            )
        })?)),
    };
    how.median = args.median;
    how.split = args.split;
    how.separate = args.separate;
    how.sub_voxel = !args.from_mask;
    how.pad = args.pad;
    how.largest_piece = args.largest_piece;
    how.smoothing = args.smoothing;
    how.rescue = args.rescue;
    how.advise = true;
    how.shape = options(&args.new);
    how.shape.roundness = !args.no_roundness;
    how.check()?;
    Ok(how)
}

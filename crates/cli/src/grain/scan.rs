//! `grain from-scan`.

use std::path::{Path, PathBuf};

use grainwake_report::grain_sheet::GrainPanel;
use grainwake_shape::scan::{
    Scan, ScanOptions, ScannedGrain, Threshold, grey_notes, read_volume_and_voxel, scan_volume,
};
use grainwake_shape::{ReadLimits, Shape, write_table};
use indicatif::{ProgressBar, ProgressStyle};
use rayon::prelude::*;
use serde_json::json;

use super::preview;
use super::refused::{advice, lines, named};
use super::{
    create, diameter, drawn, folder, length, may_draw, may_write, not_input, options, plausible,
    save, sized, table,
};
use crate::args::FromScanArgs;
use crate::exit::{BAD_INPUT, Exit};
use crate::progress::count;
use crate::{print, tell};

/// Contact sheet: pixels per grain, grains per row, and maximum number of grains.
const SHEET: (usize, usize, usize) = (110, 12, 600);

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
            for file in earlier(output).iter().chain(&tables(output)) {
                may_write(file, args.new.common.force)?;
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
        return all(args, scan, diameter);
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

/// Fraction of the surface cut from neighbours above which the roundness is doubtful.
const MUCH_SHARED: f64 = 0.01;

/// Share of filled cavities in the volume of a grain from which on the output names the grain.
const CAVITIES_TOLD: f64 = 1e-3;

/// Describes what was changed on grains: specks removed, cavities filled, and labels rescued, by
/// cure.
fn treated(grains: &[ScannedGrain]) -> Vec<String> {
    let mut lines = Vec::new();
    let cleaned: Vec<&ScannedGrain> = grains.iter().filter(|g| g.specks_removed() > 0.0).collect();
    let most = cleaned.iter().map(|g| g.specks_removed()).fold(0.0, f64::max);
    let labels: Vec<u32> = cleaned.iter().map(|g| g.label).collect();
    if !labels.is_empty() {
        lines.push(format!(
            "specks removed from {}, at most {:.2} % of the volume: {}",
            count(labels.len(), "grain"),
            100.0 * most.max(5e-5),
            named(&labels)
        ));
    }
    let hollow = grains.iter().filter(|g| g.cavities_filled() >= CAVITIES_TOLD);
    let hollow: Vec<&ScannedGrain> = hollow.collect();
    let most = hollow.iter().map(|g| g.cavities_filled()).fold(0.0, f64::max);
    let labels: Vec<u32> = hollow.iter().map(|g| g.label).collect();
    if !labels.is_empty() {
        lines.push(format!(
            "cavities filled in {}, at most {:.2} % of the volume: {}",
            count(labels.len(), "grain"),
            100.0 * most,
            named(&labels)
        ));
    }
    let mut cures: Vec<(String, Vec<u32>)> = Vec::new();
    for (cure, label) in grains.iter().filter_map(|g| Some((g.rescued?.to_string(), g.label))) {
        match cures.iter_mut().find(|(other, _)| *other == cure) {
            Some((_, labels)) => labels.push(label),
            None => cures.push((cure, vec![label])),
        }
    }
    lines.extend(cures.iter().map(|(cure, labels)| {
        format!("{} rescued with {cure}: {}", count(labels.len(), "grain"), named(labels))
    }));
    lines
}

/// Returns the grain files of an earlier command in a folder.
fn earlier(folder: &Path) -> Vec<PathBuf> {
    let ours = |path: &PathBuf| {
        let name = path.file_name().and_then(|name| name.to_str());
        let number = name.and_then(|n| n.strip_prefix("label-")?.strip_suffix(".grain"));
        number.is_some_and(|n| n.len() >= 5 && n.bytes().all(|b| b.is_ascii_digit()))
    };
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.path()).filter(ours).collect();
    files.sort();
    files
}

/// Table, contact sheet and label image of a folder of grains.
fn tables(place: &Path) -> [PathBuf; 3] {
    ["table.csv", "sheet.png", "labels.tif"].map(|name| place.join(name))
}

/// Writes every grain into a folder, with table, contact sheet and label image, and lists rejected
/// labels with the reason.
fn all(args: &FromScanArgs, scan: Scan, diameter: Option<f64>) -> Result<(), Exit> {
    let Scan { mut grains, labels, refusals, .. } = scan;
    let place = &args.new.output;
    let name = |label: u32| format!("label-{label:05}");
    let path = |label: u32| place.join(name(label) + ".grain");
    let [table_file, sheet, image] = tables(place);
    let earlier = earlier(place);
    if let Some(diameter) = diameter {
        for grain in &mut grains {
            if let Ok(shape) = &mut grain.shape {
                *shape = shape.scaled_to_equivalent_diameter(diameter)?;
            }
        }
    }
    let usable = || grains.iter().filter_map(|g| Some((g.label, g.shape.as_ref().ok()?)));
    // Only the largest grain is checked, because fragments may be small.
    let size = |shape: &Shape| shape.equivalent_diameter();
    let largest = usable().max_by(|a, b| size(a.1).total_cmp(&size(b.1)));
    if let Some((_, shape)) = largest.filter(|_| diameter.is_none()) {
        plausible(shape, "--voxel")?;
    }
    for file in [&table_file, &sheet, &image] {
        not_input(file, &args.image)?;
    }
    // Grains of an earlier command are not part of the new table and label image.
    for file in earlier.iter().filter(|_| largest.is_some()) {
        std::fs::remove_file(file).map_err(Exit::cannot("remove", file))?;
    }
    if largest.is_some() {
        create(place)?;
    }
    let advice = advice(&grains);
    let treated = treated(&grains);
    let rejected = grains.iter().filter(|g| g.shape.is_err()).count();
    let pictured: Vec<u32> = usable().take(SHEET.2).map(|(label, _)| label).collect();
    let outcomes: Vec<_> = grains
        .into_par_iter()
        .filter_map(|grain| {
            let specks = grain.specks_removed();
            let ScannedGrain { label, voxels, shared_surface, shape, rescued } = grain;
            let written = shape.ok().map(|shape| {
                let file = path(label);
                shape.save(&file)?;
                let picture = pictured
                    .binary_search(&label)
                    .is_ok()
                    .then(|| GrainPanel::broad(&name(label), &shape, SHEET.0));
                Ok::<_, Exit>((file, shape.record(), picture))
            })?;
            Some((label, voxels, shared_surface, specks, rescued, written))
        })
        .collect();
    let (mut rows, mut pictures) = (Vec::new(), Vec::new());
    let (mut shared, mut removed) = (Vec::new(), Vec::new());
    for (label, voxels, shared_surface, specks, rescued, written) in outcomes {
        let (file, record, picture) = written?;
        pictures.extend(picture);
        if args.new.common.json {
            let rescued = rescued.map(|cure| cure.to_string());
            print(&json!({ "label": label, "voxels": voxels, "shared_surface": shared_surface, "specks_removed": specks, "rescued": rescued, "file": file, "record": record }).to_string())?;
        } else {
            print(&format!(
                "{}  {} voxels, equivalent diameter {}, Krumbein sphericity {:.3}",
                file.display(),
                voxels,
                table::LengthUnit::of(record.equivalent_diameter_m)
                    .text(record.equivalent_diameter_m, 4),
                record.krumbein_sphericity
            ))?;
        }
        rows.push((name(label), record));
        shared.push(shared_surface);
        removed.push(specks);
    }
    treated.iter().for_each(|line| tell!("{line}"));
    lines(&refusals, args.rescue).iter().for_each(|line| tell!("{line}"));
    tell!("{} written, {rejected} rejected", count(rows.len(), "grain"));
    if rows.is_empty() {
        let message = "no label of the image gives a valid grain";
        return Err(Exit::with_hint(BAD_INPUT, message, advice));
    }
    if let Some(advice) = advice {
        tell!("note: {advice}");
    }
    let cut = shared.iter().filter(|part| **part > MUCH_SHARED).count();
    if cut > 0 && !args.no_roundness {
        tell!(
            "note: {cut} of {} grains were cut from neighbours over more than {:.0} % of their surface (shared_surface in {}); their roundness is measured away from the cuts, and missing where too little surface remains",
            rows.len(),
            100.0 * MUCH_SHARED,
            table_file.display()
        );
    }
    write_table(&table_file, &rows, &[("shared_surface", shared), ("specks_removed", removed)])?;
    drawn::save(&sheet, pictures, SHEET.1)?;
    labels.save_labels(&image)?;
    Ok(())
}

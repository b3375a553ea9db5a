//! `grain from-scan` into a folder: a file per grain, table, contact sheet and label image.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use grainwake_formats::disk;
use grainwake_report::grain_sheet::GrainPanel;
use grainwake_shape::scan::{Cure, Scan, ScannedGrain, Volume};
use grainwake_shape::{Record, write_table};
use rayon::prelude::*;
use serde_json::json;

use super::refused::{advice, lines};
use super::treated::treated;
use super::{create, drawn, not_input, plausible, table};
use crate::args::FromScanArgs;
use crate::exit::{BAD_INPUT, Exit};
use crate::progress::count;
use crate::{print, tell};

/// Contact sheet: pixels per grain, grains per row, and maximum number of grains.
const SHEET: (usize, usize, usize) = (110, 12, 600);

/// Fraction of the surface cut from neighbours above which the roundness is doubtful.
const MUCH_SHARED: f64 = 0.01;

/// Returns the files that a command may replace in a folder.
pub fn existing(folder: &Path) -> Vec<PathBuf> {
    earlier(folder).into_iter().chain(tables(folder)).collect()
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
fn tables(folder: &Path) -> [PathBuf; 3] {
    ["table.csv", "sheet.png", "labels.tif"].map(|name| folder.join(name))
}

/// A grain whose file is written.
struct Saved {
    label: u32,
    voxels: u64,
    shared_surface: f64,
    specks: f64,
    rescued: Option<Cure>,
    file: PathBuf,
    record: Record,
    /// Picture for the contact sheet, which holds a limited number of grains.
    picture: Option<GrainPanel>,
}

/// Writes every grain into a folder, with table, contact sheet and label image, and lists rejected
/// labels with the reason.
pub fn write(args: &FromScanArgs, scan: Scan, diameter: Option<f64>) -> Result<(), Exit> {
    let Scan { mut grains, labels, refusals, .. } = scan;
    let folder = &args.new.output;
    rescale(&mut grains, diameter)?;
    for file in &tables(folder) {
        not_input(file, &args.image)?;
    }
    let mut told = treated(&grains);
    told.extend(lines(&refusals, args.rescue));
    let rejected = grains.iter().filter(|g| g.shape.is_err()).count();
    let kept = grains.len() - rejected;
    told.push(format!("{} written, {rejected} rejected", count(kept, "grain")));
    let advice = advice(&grains);
    if kept == 0 {
        told.iter().for_each(|line| tell!("{line}"));
        let message = "no label of the image gives a valid grain";
        return Err(Exit::with_hint(BAD_INPUT, message, advice));
    }
    let grains = replace(folder, grains, &labels)?;
    for grain in &grains {
        print(&line(grain, args.new.common.json))?;
    }
    told.iter().for_each(|line| tell!("{line}"));
    if let Some(advice) = advice {
        tell!("note: {advice}");
    }
    if !args.no_roundness {
        note_on_cuts(&grains, folder);
    }
    Ok(())
}

/// Rescales the grains to a diameter. Without one refuses an implausible size.
fn rescale(grains: &mut [ScannedGrain], diameter: Option<f64>) -> Result<(), Exit> {
    let shapes = grains.iter_mut().filter_map(|grain| grain.shape.as_mut().ok());
    if let Some(diameter) = diameter {
        for shape in shapes {
            *shape = shape.scaled_to_equivalent_diameter(diameter)?;
        }
        return Ok(());
    }
    // Only the largest grain is checked, because fragments may be small.
    let largest = shapes.max_by(|a, b| a.equivalent_diameter().total_cmp(&b.equivalent_diameter()));
    largest.map_or(Ok(()), |shape| plausible(shape, "--voxel"))
}

/// Writes the files of the grains, the table, the contact sheet and the label image. At last
/// removes the grains of an earlier command that these no longer list: a failure, such as a full
/// disk, loses none.
fn replace(folder: &Path, grains: Vec<ScannedGrain>, labels: &Volume) -> Result<Vec<Saved>, Exit> {
    let earlier = earlier(folder);
    let [table, sheet, image] = tables(folder);
    create(folder)?;
    let mut grains = save(folder, grains)?;
    let rows: Vec<_> = grains.iter().map(|g| (name(g.label), g.record.clone())).collect();
    let shared = grains.iter().map(|g| g.shared_surface).collect();
    let specks = grains.iter().map(|g| g.specks).collect();
    write_table(&table, &rows, &[("shared_surface", shared), ("specks_removed", specks)])?;
    let pictures = grains.iter_mut().filter_map(|g| g.picture.take()).collect();
    drawn::save(&sheet, pictures, SHEET.1)?;
    labels.save_labels(&image)?;
    let written: HashSet<&Path> = grains.iter().map(|g| g.file.as_path()).collect();
    for file in earlier.iter().filter(|file| !written.contains(file.as_path())) {
        disk::remove_file(file).map_err(Exit::cannot("remove", file))?;
    }
    Ok(grains)
}

/// Writes the files of the grains in parallel.
fn save(folder: &Path, grains: Vec<ScannedGrain>) -> Result<Vec<Saved>, Exit> {
    let usable = grains.iter().filter(|grain| grain.shape.is_ok());
    let pictured: HashSet<u32> = usable.take(SHEET.2).map(|grain| grain.label).collect();
    let save = |grain: ScannedGrain| {
        let specks = grain.specks_removed();
        let ScannedGrain { label, voxels, shared_surface, shape, rescued } = grain;
        let shape = shape.ok()?;
        let file = folder.join(name(label) + ".grain");
        let picture = || GrainPanel::broad(&name(label), &shape, SHEET.0);
        Some(shape.save(&file).map(|()| Saved {
            label,
            voxels,
            shared_surface,
            specks,
            rescued,
            record: shape.record(),
            picture: pictured.contains(&label).then(picture),
            file,
        }))
    };
    let saved: Vec<_> = grains.into_par_iter().filter_map(save).collect();
    // The first error in the order of the labels is reported.
    Ok(saved.into_iter().collect::<Result<_, _>>()?)
}

/// Name of a grain in files and tables.
fn name(label: u32) -> String {
    format!("label-{label:05}")
}

/// Describes a grain on a line of the output.
fn line(grain: &Saved, as_json: bool) -> String {
    let Saved { label, voxels, shared_surface, specks, file, record, .. } = grain;
    if as_json {
        let rescued = grain.rescued.map(|cure| cure.to_string());
        return json!({ "label": label, "voxels": voxels, "shared_surface": shared_surface, "specks_removed": specks, "rescued": rescued, "file": file.to_string_lossy(), "record": record }).to_string();
    }
    format!(
        "{}  {voxels} voxels, equivalent diameter {}, Krumbein sphericity {:.3}",
        file.display(),
        table::LengthUnit::of(record.equivalent_diameter_m).text(record.equivalent_diameter_m, 4),
        record.krumbein_sphericity
    )
}

/// Notes that the roundness of grains cut from neighbours is doubtful, if there are any.
fn note_on_cuts(grains: &[Saved], folder: &Path) {
    let cut = grains.iter().filter(|grain| grain.shared_surface > MUCH_SHARED).count();
    let [table, ..] = tables(folder);
    if cut > 0 {
        tell!(
            "note: {cut} of {} grains were cut from neighbours over more than {:.0} % of their surface (shared_surface in {}); their roundness is measured away from the cuts, and missing where too little surface remains",
            grains.len(),
            100.0 * MUCH_SHARED,
            table.display()
        );
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::ffi::OsString;

    use clap::Parser;
    use grainwake_formats::disk::faults::{Fault, inject};

    use super::super::grain;
    use super::*;
    use crate::args::{Cli, Command};

    /// Writes the grains of an image with two balls of these labels into the folder `out`.
    fn from_scan(folder: &Path, labels: [u8; 2]) -> Result<(), Exit> {
        const N: usize = 24;
        let image = folder.join("image.nrrd");
        let voxel = |n: usize| {
            let ball = |x: f64| {
                let place = [n % N, n / N % N, n / N / N].map(|i| i as f64 + 0.5);
                (place[0] - x).hypot(place[1] - 12.0).hypot(place[2] - 12.0) < 4.5
            };
            labels[0] * u8::from(ball(6.2)) + labels[1] * u8::from(ball(17.7))
        };
        let header = format!("NRRD0004\ntype: uint8\nsizes: {N} {N} {N}\nencoding: raw\n\n");
        let voxels: Vec<u8> = (0..N * N * N).map(voxel).collect();
        std::fs::write(&image, [header.as_bytes(), &voxels].concat()).unwrap();
        let words = "grainwake grain from-scan --no-roundness --force --nodes 100 --voxel 1mm";
        let words = words.split(' ').map(OsString::from);
        let files = [image.into(), "-o".into(), folder.join("out").into()];
        let words = words.chain(files);
        let Command::Grain(command) = Cli::try_parse_from(words).unwrap().command else {
            panic!("not a command for grains");
        };
        grain(&command)
    }

    fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
        let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
        entries.map(|path| (path.clone(), std::fs::read(path).unwrap())).collect()
    }

    #[test]
    fn a_failure_removes_no_grain_of_an_earlier_command() {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("out");
        from_scan(folder.path(), [2, 3]).unwrap();
        let new = files(&out);
        std::fs::remove_dir_all(&out).unwrap();
        from_scan(folder.path(), [1, 2]).unwrap();
        let old = files(&out);
        let only_old = out.join("label-00001.grain");
        assert!(old.len() == 5 && !new.contains_key(&only_old));
        for fault in [Fault::Full, Fault::Error] {
            for at in 0.. {
                std::fs::remove_dir_all(&out).unwrap();
                std::fs::create_dir(&out).unwrap();
                old.iter().for_each(|(path, bytes)| std::fs::write(path, bytes).unwrap());
                let planned = inject(&out, fault, at);
                let done = from_scan(folder.path(), [2, 3]);
                let struck = planned.struck();
                drop(planned);
                let now = files(&out);
                let Some(struck) = struck else {
                    done.unwrap();
                    assert_eq!(now, new);
                    // Folder, two grains, table, contact sheet, label image, earlier grain.
                    assert!(at > 1 + 2 * 4 + 4 + 3 + 4, "only {at} changes can be made to fail");
                    break;
                };
                done.unwrap_err();
                assert!(now.contains_key(&only_old), "{fault:?} at {struck}: a grain is lost");
                for (path, bytes) in now {
                    let whole = [&old, &new].iter().any(|files| files.get(&path) == Some(&bytes));
                    assert!(whole, "{fault:?} at {struck}: {} is not whole", path.display());
                }
            }
        }
    }
}

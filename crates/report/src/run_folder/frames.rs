//! VTK files of a run folder.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use grainwake_formats::vti::{self, Image};
use grainwake_formats::{pvd, vtp};

use super::{FrameFile, RunFolder};

impl RunFolder {
    /// Returns the times of the files that `run.pvd` lists, and notes those that are missing.
    pub(super) fn collection(&mut self) -> BTreeMap<String, f64> {
        let file = self.path.join("run.pvd");
        let entries = if file.is_file() { pvd::read(&file) } else { Ok(Vec::new()) };
        let entries = entries.unwrap_or_else(|what| {
            self.notes.push(format!("run.pvd could not be read ({what})"));
            Vec::new()
        });
        let times: BTreeMap<String, f64> =
            entries.into_iter().map(|entry| (entry.file, entry.time)).collect();
        let mut counts: BTreeMap<&str, [usize; 2]> = BTreeMap::new();
        for file in times.keys() {
            let folder = file.split_once('/').map_or("", |(folder, _)| folder);
            let [listed, missing] = counts.entry(folder).or_default();
            *listed += 1;
            *missing += usize::from(!self.path.join(file).is_file());
        }
        for (folder, [listed, missing]) in counts.into_iter().filter(|(_, [_, n])| *n > 0) {
            let note =
                format!("{folder}: {missing} of {listed} files that run.pvd lists are missing");
            self.notes.push(note);
        }
        times
    }

    /// Lists the files of a subfolder with their times, from `run.pvd` or else from the files.
    pub(super) fn frames(
        &mut self,
        folder: &str,
        extension: &str,
        times: &BTreeMap<String, f64>,
    ) -> Vec<FrameFile> {
        let Ok(entries) = std::fs::read_dir(self.path.join(folder)) else {
            return Vec::new();
        };
        let mut files: Vec<PathBuf> =
            entries.filter_map(|entry| entry.ok().map(|entry| entry.path())).collect();
        files.retain(|file| file.extension().is_some_and(|e| e == extension));
        files.sort();
        let mut out = Vec::new();
        for file in files {
            let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let listed = times.get(&format!("{folder}/{name}")).copied();
            let time = listed.map(Ok).unwrap_or_else(|| time_inside(&file, extension));
            match time {
                Ok(time) => out.push(FrameFile { grain: grain_of_name(&name), file, time }),
                Err(what) => self.notes.push(format!("{folder}/{name} was left out: {what}")),
            }
        }
        out.sort_by(|a, b| a.time.total_cmp(&b.time).then(a.grain.cmp(&b.grain)));
        out
    }
}

fn time_inside(file: &Path, extension: &str) -> Result<f64, String> {
    let time = match extension {
        "vti" => Some(read_image(file)?.frame.time),
        _ => vtp::read(file)?.time,
    };
    time.filter(|t| t.is_finite()).ok_or_else(|| "it holds no time".to_owned())
}

pub(super) fn read_image(file: &Path) -> Result<Image, String> {
    vti::read(file).map_err(|error| error.to_string())
}

/// Returns the number after "grain" in a file name such as `grain1_000040.vti`.
fn grain_of_name(name: &str) -> Option<usize> {
    let rest = name.split("grain").nth(1)?.trim_start_matches(['_', '-', '.']);
    let digits: String = rest.chars().take_while(char::is_ascii_digit).collect();
    digits.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_tell_the_grain() {
        assert_eq!(grain_of_name("grain1_000040.vti"), Some(1));
        assert_eq!(grain_of_name("slice_000040_grain_0.vti"), Some(0));
        assert_eq!(grain_of_name("centre_000040.vti"), None);
        assert_eq!(grain_of_name("grains_000040.vtp"), None);
    }

    #[test]
    fn files_that_are_listed_and_missing_are_noted() {
        let folder = crate::testing::folder();
        std::fs::write(folder.join("summary.json"), "{}").unwrap();
        std::fs::create_dir(folder.join("slices")).unwrap();
        std::fs::write(folder.join("slices/a_000001.vti"), "").unwrap();
        let entry = |file: &str| format!("<DataSet timestep=\"0\" group=\"s\" file=\"{file}\"/>");
        let entries = ["slices/a_000001.vti", "slices/a_000002.vti", "grains/g_000001.vtp"];
        let text = format!(
            "<VTKFile type=\"Collection\"><Collection>{}</Collection></VTKFile>",
            entries.map(entry).concat()
        );
        std::fs::write(folder.join("run.pvd"), text).unwrap();
        let notes = RunFolder::open(&folder).unwrap().notes.join("\n");
        assert!(notes.contains("slices: 1 of 2 files that run.pvd lists are missing"), "{notes}");
        assert!(notes.contains("grains: 1 of 1 files that run.pvd lists are missing"), "{notes}");
        std::fs::remove_dir_all(folder).unwrap();
    }
}

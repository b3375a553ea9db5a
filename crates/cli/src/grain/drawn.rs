//! Pictures of grains, with the names of their files.

use std::collections::HashMap;
use std::path::Path;

use grainwake_report::grain_sheet::{GrainPanel, sheet};
use grainwake_report::write_file;

use crate::exit::Exit;

/// Width of one of three sides [pixels].
pub const SIDE: usize = 320;

/// Returns the names of grain files without their ending; equal names also have their folder.
pub fn names<F: AsRef<Path>>(files: &[F]) -> Vec<String> {
    let text =
        |part: Option<&std::ffi::OsStr>| part.unwrap_or_default().to_string_lossy().into_owned();
    let stem = |file: &Path| text(file.file_stem());
    let mut count: HashMap<String, usize> = HashMap::new();
    for file in files {
        *count.entry(stem(file.as_ref())).or_default() += 1;
    }
    let name = |file: &F| {
        let (file, own) = (file.as_ref(), stem(file.as_ref()));
        if count[&own] == 1 { own } else { file.with_extension("").display().to_string() }
    };
    files.iter().map(name).collect()
}

/// Writes the panels in rows of `columns`.
pub fn save(path: &Path, panels: Vec<GrainPanel>, columns: usize) -> Result<(), Exit> {
    let picture = sheet(panels, columns).and_then(|picture| picture.to_png());
    let png = picture.map_err(Exit::cannot("draw", path))?;
    write_file(path, &png).map_err(Exit::cannot("write", path))
}

#[cfg(test)]
mod tests {
    use super::names;

    #[test]
    fn equal_names_have_their_folder() {
        assert_eq!(names(&["a/x.grain", "b/y.grain"]), ["x", "y"]);
        assert_eq!(names(&["a/x.grain", "y.grain", "x.grain"]), ["a/x", "y", "x"]);
    }
}

//! The list of pictures in order of time (`run.pvd`).

use std::path::Path;

use roxmltree::Document;

/// Time of every file that a collection (`run.pvd`) lists, by its path as written there.
pub fn read(file: &Path) -> Result<Vec<(String, f64)>, String> {
    let text = std::fs::read_to_string(file).map_err(|error| error.to_string())?;
    let document = Document::parse(&text).map_err(|error| format!("not XML: {error}"))?;
    let sets = document
        .descendants()
        .filter(|node| node.has_tag_name("DataSet"));
    Ok(sets
        .filter_map(|node| {
            Some((
                node.attribute("file")?.to_owned(),
                node.attribute("timestep")?.parse().ok()?,
            ))
        })
        .collect())
}

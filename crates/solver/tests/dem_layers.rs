//! Imports inside `dem` point downwards: motion, contact, search, then grains, materials and the
//! box.

use std::fs;
use std::path::Path;

/// Modules from the top down; files of the last one lie directly in `dem`.
const ORDER: [&str; 4] = ["motion", "contact", "search", ""];

#[test]
fn modules_of_dem_import_downwards_only() {
    let dem = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/dem");
    let mut imports = 0;
    for (rank, module) in ORDER.iter().enumerate() {
        for entry in fs::read_dir(dem.join(module)).expect("a module of dem").flatten() {
            let path = entry.path();
            if path.extension().is_none_or(|e| e != "rs") || path.ends_with("dem/mod.rs") {
                continue;
            }
            let text = fs::read_to_string(&path).expect("a readable source");
            imports += text.matches("use crate::dem::").count();
            imports += text.matches("use super::").count();
            for above in &ORDER[..rank] {
                for path_to_module in [format!("dem::{above}"), format!("super::{above}::")] {
                    assert!(!text.contains(&path_to_module), "{} imports {above}", path.display());
                }
            }
        }
    }
    assert!(imports > 20, "only {imports} imports found");
}

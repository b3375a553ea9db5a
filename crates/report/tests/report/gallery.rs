//! Draws every kind of report into the folder named by GRAINWAKE_GALLERY, to be looked at.

use crate::synthetic::{flows, heap, pair};

#[test]
#[ignore = "makes pictures to look at; set GRAINWAKE_GALLERY"]
fn gallery() {
    let root =
        std::path::PathBuf::from(std::env::var("GRAINWAKE_GALLERY").expect("GRAINWAKE_GALLERY"));
    let fresh = |name: &str| {
        let path = root.join(name);
        std::fs::create_dir_all(&path).unwrap();
        path
    };
    pair::pair(&fresh("pair-in-plane"), 0.0, 0.25e-3);
    pair::pair(&fresh("pair-swinging"), 0.9, 0.25e-3);
    flows::single(&fresh("single"));
    flows::cavity(&fresh("cavity"));
    heap::heap(&fresh("heap"), 200, true);
    for name in ["pair-in-plane", "pair-swinging", "single", "cavity", "heap"] {
        let start = std::time::Instant::now();
        let rendered = grainwake_report::render(&root.join(name)).unwrap();
        let size = std::fs::metadata(&rendered.page).unwrap().len();
        println!(
            "{name}: {} figures, page {size} bytes, {:.2} s, notes {:?}",
            rendered.png.len(),
            start.elapsed().as_secs_f64(),
            rendered.notes
        );
    }
}

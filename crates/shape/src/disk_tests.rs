//! Test of functions that write a file: after a fault of the disk an existing file is unchanged.

use crate::error::Result;
use grainwake_formats::disk::faults::{Fault, inject};
use std::path::Path;

/// Lets every change on the disk fail that `write` makes, one after the other.
pub(crate) fn fails_as_a_whole(name: &str, write: impl Fn(&Path) -> Result<()>) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    for fault in [Fault::Error, Fault::Full] {
        // Create, write, sync and rename.
        for at in 0..4 {
            std::fs::write(&path, "earlier").unwrap();
            let fault = inject(folder.path(), fault, at);
            write(&path).unwrap_err();
            assert!(fault.struck().is_some());
            drop(fault);
            assert_eq!(std::fs::read(&path).unwrap(), b"earlier", "change {at}");
            assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 1, "change {at}");
        }
    }
    write(&path).unwrap();
    assert_ne!(std::fs::read(&path).unwrap(), b"earlier");
}

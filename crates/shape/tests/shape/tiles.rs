//! Tiled TIFF and BigTIFF.

use crate::tiled::{Layout, SIZE, value};
use grainwake_shape::ReadLimits;
use grainwake_shape::scan::{Voxels, read_volume};

#[test]
fn tiles_are_put_together() {
    let folder = tempfile::tempdir().unwrap();
    for wide in [false, true] {
        let path = folder.path().join(format!("tiles-{wide}.tif"));
        std::fs::write(&path, Layout { wide }.file()).unwrap();
        let (volume, _) = read_volume(&path, &ReadLimits::default()).unwrap();
        assert_eq!(volume.dims, SIZE);
        let Voxels::Labels(found) = volume.voxels else {
            panic!("whole numbers are labels");
        };
        for (n, found) in found.into_iter().enumerate() {
            let (x, y, z) = (n % SIZE[0], n / SIZE[0] % SIZE[1], n / SIZE[0] / SIZE[1]);
            assert_eq!(found, u32::from(value(x, y, z)), "wide {wide}: {x} {y} {z}");
        }
    }
}

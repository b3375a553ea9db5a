//! Images and volumes; the first byte chooses the format.

#![no_main]

mod folder;

use grainwake_shape::ReadLimits;
use grainwake_shape::scan::read_volume;
use libfuzzer_sys::fuzz_target;

const FORMATS: [&str; 7] = ["a.tif", "a.npy", "a.npz", "a.nrrd", "a.mha", "a.nhdr", "a.mhd"];

fuzz_target!(|bytes: &[u8]| {
    let Some((format, bytes)) = bytes.split_first() else { return };
    // Data beside a detached header.
    folder::file("a.raw", &[7; 60]);
    let path = folder::file(FORMATS[usize::from(*format) % FORMATS.len()], bytes);
    let limits = ReadLimits { file_bytes: 1 << 20, voxels: 1 << 20, ..Default::default() };
    if let Ok((volume, _)) = read_volume(&path, &limits) {
        let cells = volume.dims;
        assert!(cells[0] * cells[1] * cells[2] <= 1 << 20);
    }
});

//! Surface meshes; the first byte chooses the format.

#![no_main]

mod folder;

use grainwake_shape::ReadLimits;
use grainwake_shape::mesh::read_mesh;
use libfuzzer_sys::fuzz_target;

const FORMATS: [&str; 4] = ["a.stl", "a.ply", "a.obj", "a.anm"];

fuzz_target!(|bytes: &[u8]| {
    let Some((format, bytes)) = bytes.split_first() else { return };
    let path = folder::file(FORMATS[usize::from(*format) % FORMATS.len()], bytes);
    let limits = ReadLimits { file_bytes: 1 << 20, mesh_elements: 1 << 14, ..Default::default() };
    drop(read_mesh(&path, 1e-3, &limits));
});

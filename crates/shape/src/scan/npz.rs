//! NPZ archives (numpy.savez) with one array.

use super::npy;
use super::volume::Volume;
use crate::error::{Result, ShapeError, first_few};
use crate::limits::ReadLimits;
use std::io::{Cursor, Read};
use std::path::Path;

pub(super) fn read(path: &Path, bytes: &[u8], limits: &ReadLimits) -> Result<Volume> {
    let damaged = |e: zip::result::ZipError| ShapeError::malformed(path, e);
    let unreadable = |e: std::io::Error| ShapeError::malformed(path, e);
    let mut archive = zip::ZipArchive::new(Cursor::new(bytes)).map_err(damaged)?;
    let names: Vec<String> = archive.file_names().map(str::to_owned).collect();
    let [name] = &names[..] else {
        let reason = format!(
            "it holds {} arrays ({}); save the one volume alone",
            names.len(),
            first_few(&names, 5)
        );
        return Err(ShapeError::unsupported(path, reason));
    };
    let mut file = archive.by_name(name).map_err(damaged)?;
    let mut plain = Vec::new();
    // The header is decompressed first, so that an oversized array is refused before allocation.
    file.by_ref().take(npy::HEAD).read_to_end(&mut plain).map_err(unreadable)?;
    let array = npy::header(path, &plain, limits)?;
    if array.bytes() > limits.file_bytes {
        let claimed = format!("{} bytes unpacked", array.bytes());
        let limit = limits.file_bytes;
        return Err(ShapeError::too_large(path, &claimed, limit, "bytes"));
    }
    // One additional byte: it reveals surplus data, and at the end of the data the archive's
    // checksum is compared.
    let rest = (array.bytes() + 1).saturating_sub(plain.len() as u64);
    file.take(rest).read_to_end(&mut plain).map_err(unreadable)?;
    array.volume(path, &plain, false)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    fn archive(names: &[&str]) -> Vec<u8> {
        packed(names, "(1, 2, 3)", &[0, 1, 2, 3, 4, 5])
    }

    fn packed(names: &[&str], shape: &str, data: &[u8]) -> Vec<u8> {
        let mut writer = zip::ZipWriter::new(Cursor::new(Vec::new()));
        for name in names {
            let options = zip::write::SimpleFileOptions::default();
            writer.start_file(*name, options).unwrap();
            let header =
                format!("{{'descr': '|u1', 'fortran_order': False, 'shape': {shape}, }}\n");
            writer.write_all(b"\x93NUMPY\x01\x00").unwrap();
            writer.write_all(&(header.len() as u16).to_le_bytes()).unwrap();
            writer.write_all(header.as_bytes()).unwrap();
            writer.write_all(data).unwrap();
        }
        writer.finish().unwrap().into_inner()
    }

    #[test]
    fn one_array_is_read_several_are_refused_and_damage_is_no_panic() {
        let limits = ReadLimits::default();
        let path = Path::new("a.npz");
        let good = archive(&["volume.npy"]);
        let expect = Volume::from_labels([3, 2, 1], vec![0, 1, 2, 3, 4, 5]).unwrap();
        assert_eq!(read(path, &good, &limits).unwrap(), expect);
        let several = read(path, &archive(&["a.npy", "b.npy"]), &limits);
        assert!(matches!(several, Err(ShapeError::Unsupported { .. })));
        for cut in 0..good.len() {
            assert!(read(path, &good[..cut], &limits).is_err());
        }
        for at in 0..good.len() {
            let mut bad = good.clone();
            bad[at] ^= 0x55;
            let _ = read(path, &bad, &limits);
        }
    }

    #[test]
    fn what_the_header_states_is_refused_before_it_is_unpacked() {
        let limits = ReadLimits { file_bytes: 1 << 20, voxels: 1 << 21, ..Default::default() };
        let data = vec![0; 3 << 20];
        for (shape, stated) in
            [("(128, 128, 192)", "192 x 128 x 128 voxels"), ("(128, 128, 96)", "bytes unpacked")]
        {
            let file = packed(&["a.npy"], shape, &data);
            let error = read(Path::new("a.npz"), &file, &limits).unwrap_err();
            assert!(error.to_string().contains(stated), "{error}");
        }
        // Surplus data are refused; at most one byte after the array is decompressed.
        let file = packed(&["a.npy"], "(1, 2, 3)", &data);
        let error = read(Path::new("a.npz"), &file, &limits).unwrap_err().to_string();
        let words = "the header states 3 x 2 x 1 voxels of 1 bytes, 6 bytes; the file has more";
        assert!(error.contains(words), "{error}");
    }
}

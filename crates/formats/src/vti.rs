//! VTK image files (`.vti`): cell data in single precision, raw appended. ParaView and PyVista
//! open them.

use std::io;
use std::path::Path;

use glam::DVec3;
use roxmltree::{Document, Node};

use crate::bounded_file::{DATA, read_bytes};
use crate::disk::write_atomically;
use crate::vtk_xml::{
    ArrayElements, ArrayReader, child, close_appended, damaged, open_appended, split, write_head,
    write_length,
};

/// Uniform grid with values at its cells.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Geometry.
    pub frame: Frame,
    /// Values at the cells.
    pub arrays: Vec<Array>,
}

/// Geometry and time of an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Cells along x, y, z.
    pub cells: [usize; 3],
    /// Cell edges [m].
    pub spacing: DVec3,
    /// Lower corner [m].
    pub origin: DVec3,
    /// Simulated time [s].
    pub time: f64,
}

/// Named values at the cells.
#[derive(Clone, Debug, PartialEq)]
pub struct Array {
    /// Name.
    pub name: String,
    /// Components of each value: 1 or 3.
    pub components: usize,
    /// Values, components fastest, then x, y, z.
    pub data: Vec<f32>,
}

/// Array whose values are computed cell by cell while it is written.
pub struct Source<'a> {
    /// Name.
    pub name: &'a str,
    /// Components of each value: 1 to 3.
    pub components: usize,
    /// Value of cell (i, j, k), counted from 0; further components are ignored.
    pub value: &'a dyn Fn([usize; 3]) -> [f32; 3],
}

/// Writes an image.
///
/// # Errors
/// Errors of the operating system; `InvalidInput` if an array does not fit the cells.
pub fn write(path: &Path, image: &Image) -> io::Result<()> {
    let [nx, ny, _] = image.frame.cells;
    let count: usize = image.frame.cells.iter().product();
    for array in &image.arrays {
        if !matches!(array.components, 1..=3) || array.data.len() != count * array.components {
            let message = format!(
                "array {} has {} numbers for {count} cells of {}",
                array.name,
                array.data.len(),
                array.components
            );
            return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
        }
    }
    let value_of = |array: &Array, [i, j, k]: [usize; 3]| {
        let first = ((k * ny + j) * nx + i) * array.components;
        let mut value = [0.0; 3];
        value[..array.components].copy_from_slice(&array.data[first..first + array.components]);
        value
    };
    let values: Vec<_> =
        (image.arrays.iter()).map(|array| move |cell| value_of(array, cell)).collect();
    let sources: Vec<Source> = (image.arrays.iter().zip(&values))
        .map(|(array, value)| Source { name: &array.name, components: array.components, value })
        .collect();
    write_from(path, &image.frame, &sources)
}

/// Writes an image whose values are computed cell by cell, so that no array is held in memory.
///
/// # Errors
/// Errors of the operating system.
pub fn write_from(path: &Path, frame: &Frame, sources: &[Source]) -> io::Result<()> {
    let [nx, ny, nz] = frame.cells;
    let bytes = |source: &Source| (4 * source.components * nx * ny * nz) as u64;
    write_atomically(path, false, |out| {
        let (h, o) = (frame.spacing, frame.origin);
        let extent = format!("0 {nx} 0 {ny} 0 {nz}");
        let attributes = format!(
            " WholeExtent=\"{extent}\" Origin=\"{:?} {:?} {:?}\" Spacing=\"{:?} {:?} {:?}\"",
            o.x, o.y, o.z, h.x, h.y, h.z
        );
        write_head(out, "ImageData", &attributes, frame.time)?;
        writeln!(out, "<Piece Extent=\"{extent}\">\n<CellData>")?;
        let mut elements = ArrayElements::default();
        for source in sources {
            let element = elements.next("Float32", source.name, source.components, bytes(source));
            writeln!(out, "{element}")?;
        }
        writeln!(out, "</CellData>\n</Piece>\n</ImageData>")?;
        open_appended(out)?;
        let mut row = Vec::with_capacity(nx * 12);
        for source in sources {
            write_length(out, bytes(source))?;
            for (k, j) in (0..nz).flat_map(|k| (0..ny).map(move |j| (k, j))) {
                row.clear();
                for i in 0..nx {
                    let value = (source.value)([i, j, k]);
                    for component in value.iter().take(source.components) {
                        row.extend_from_slice(&component.to_le_bytes());
                    }
                }
                out.write_all(&row)?;
            }
        }
        close_appended(out)
    })
}

/// Reads an image written by [`write()`] or [`write_from`].
///
/// # Errors
/// `InvalidData` with the damage, or errors of the operating system.
pub fn read(path: &Path) -> io::Result<Image> {
    parse(&read_bytes(path, DATA)?).map_err(|what| damaged(path, what))
}

fn parse(bytes: &[u8]) -> Result<Image, String> {
    let (xml, data) = split(bytes)?;
    let document = Document::parse(&xml).map_err(|error| format!("not XML: {error}"))?;
    let reader = ArrayReader::new(&document, "ImageData", data)?;
    let image = child(document.root_element(), "ImageData")?;
    let extent: [usize; 6] = numbers(image, "WholeExtent")?;
    let cells = [extent[1], extent[3], extent[5]];
    let count = cells
        .iter()
        .try_fold(1usize, |n, c| n.checked_mul(*c))
        .filter(|n| (1..=1 << 40).contains(n))
        .ok_or_else(|| format!("extent {extent:?}"))?;
    let arrays = reader.arrays::<f32>(child(child(image, "Piece")?, "CellData")?)?;
    let arrays = arrays.into_iter().map(|(name, array)| {
        let (components, found) = (array.components, array.values.len());
        if components > 3 || count.checked_mul(components) != Some(found) {
            let fault = format!("array {name} has {found} numbers");
            return Err(format!("{fault} for {count} cells of {components}"));
        }
        Ok(Array { name, components, data: array.values })
    });
    Ok(Image {
        arrays: arrays.collect::<Result<_, _>>()?,
        frame: Frame {
            cells,
            spacing: numbers(image, "Spacing").map(DVec3::from_array)?,
            origin: numbers(image, "Origin").map(DVec3::from_array)?,
            time: reader.time(image)?.ok_or("no TimeValue")?,
        },
    })
}

fn numbers<T: std::str::FromStr, const N: usize>(node: Node, name: &str) -> Result<[T; N], String> {
    let value = node.attribute(name).ok_or_else(|| format!("no {name}"))?;
    let list: Vec<T> = value.split_whitespace().filter_map(|v| v.parse().ok()).collect();
    list.try_into().map_err(|_| format!("{name}=\"{value}\""))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Image {
        let count = 4 * 3 * 2;
        Image {
            frame: Frame {
                cells: [4, 3, 2],
                spacing: DVec3::new(0.1, 0.2, 0.25e-3),
                origin: DVec3::new(-1.0, 0.0, 1.0 / 3.0),
                time: 0.1 + 0.2,
            },
            arrays: vec![
                Array {
                    name: "pressure".into(),
                    components: 1,
                    data: (0..count).map(|i| i as f32 * 0.1).collect(),
                },
                Array {
                    name: "velocity".into(),
                    components: 3,
                    data: (0..3 * count).map(|i| -(i as f32)).collect(),
                },
            ],
        }
    }

    #[test]
    fn an_image_survives_a_round_trip() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.vti");
        write(&path, &sample()).unwrap();
        assert_eq!(read(&path).unwrap(), sample());
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "no temporary file stays");
    }

    #[test]
    fn damage_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.vti");
        write(&path, &sample()).unwrap();
        let good = std::fs::read(&path).unwrap();
        for length in [0, 10, 300, good.len() - 60] {
            std::fs::write(&path, &good[..length]).unwrap();
            assert_eq!(
                read(&path).unwrap_err().kind(),
                io::ErrorKind::InvalidData,
                "{length} bytes"
            );
        }
        let huge = String::from_utf8_lossy(&good[..500])
            .replace("0 4 0 3 0 2", "0 999999999 0 999999999 0 999999999");
        assert!(parse(&[huge.as_bytes(), &good[500..]].concat()).is_err());
    }

    #[test]
    fn an_array_that_does_not_fit_is_refused() {
        let mut image = sample();
        image.arrays[0].data.pop();
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(
            write(&folder.path().join("a.vti"), &image).unwrap_err().kind(),
            io::ErrorKind::InvalidInput
        );
    }
}

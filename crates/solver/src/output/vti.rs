//! VTK image files (`.vti`): cell data, Float32, raw appended. Open in ParaView and PyVista.

use std::io::{self, Read};
use std::path::Path;

use glam::DVec3;

use super::file::write_whole;

/// A uniform grid with values at its cells.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Cells along x, y, z.
    pub cells: [usize; 3],
    /// Cell edges [m].
    pub spacing: DVec3,
    /// Lower corner [m].
    pub origin: DVec3,
    /// Simulated time [s].
    pub time: f64,
    /// Values at the cells.
    pub arrays: Vec<Array>,
}

/// Named values, x fastest, components together.
#[derive(Clone, Debug, PartialEq)]
pub struct Array {
    /// Name.
    pub name: String,
    /// Numbers for each cell: 1 or 3.
    pub components: usize,
    /// The numbers.
    pub data: Vec<f32>,
}

/// Geometry of an image, without values.
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

/// Where the values of one array come from, cell by cell.
pub struct Source<'a> {
    /// Name.
    pub name: &'a str,
    /// Numbers for each cell, 1 to 3.
    pub components: usize,
    /// Values of cell (i, j, k); components beyond the given number are ignored.
    pub value: &'a dyn Fn([usize; 3]) -> [f32; 3],
}

/// Writes an image.
///
/// # Errors
/// What the system says; `InvalidInput` where an array does not fit the cells.
pub fn write(path: &Path, image: &Image) -> io::Result<()> {
    let [nx, ny, _] = image.cells;
    let count: usize = image.cells.iter().product();
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
    let values: Vec<_> = image
        .arrays
        .iter()
        .map(|array| {
            move |[i, j, k]: [usize; 3]| {
                let at = ((k * ny + j) * nx + i) * array.components;
                let mut value = [0.0; 3];
                value[..array.components].copy_from_slice(&array.data[at..at + array.components]);
                value
            }
        })
        .collect();
    let sources: Vec<Source> = image
        .arrays
        .iter()
        .zip(&values)
        .map(|(a, value)| Source {
            name: &a.name,
            components: a.components,
            value,
        })
        .collect();
    let Image {
        cells,
        spacing,
        origin,
        time,
        ..
    } = *image;
    write_from(
        path,
        &Frame {
            cells,
            spacing,
            origin,
            time,
        },
        &sources,
    )
}

/// Writes an image whose values are computed on the way, so that none is held in memory.
///
/// # Errors
/// What the system says.
pub fn write_from(path: &Path, frame: &Frame, sources: &[Source]) -> io::Result<()> {
    let [nx, ny, nz] = frame.cells;
    let count = (nx * ny * nz) as u64;
    write_whole(path, false, |out| {
        let (h, o) = (frame.spacing, frame.origin);
        let extent = format!("0 {nx} 0 {ny} 0 {nz}");
        writeln!(out, "<?xml version=\"1.0\"?>")?;
        writeln!(
            out,
            "<VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">"
        )?;
        writeln!(
            out,
            "<ImageData WholeExtent=\"{extent}\" Origin=\"{:?} {:?} {:?}\" Spacing=\"{:?} {:?} {:?}\">",
            o.x, o.y, o.z, h.x, h.y, h.z
        )?;
        writeln!(
            out,
            "<FieldData><DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" format=\"ascii\">{:?}</DataArray></FieldData>",
            frame.time
        )?;
        writeln!(out, "<Piece Extent=\"{extent}\">")?;
        writeln!(out, "<CellData>")?;
        let mut offset = 0;
        for source in sources {
            writeln!(
                out,
                "<DataArray type=\"Float32\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"appended\" offset=\"{offset}\"/>",
                source.name, source.components
            )?;
            offset += 8 + 4 * source.components as u64 * count;
        }
        writeln!(out, "</CellData>\n</Piece>\n</ImageData>")?;
        write!(out, "<AppendedData encoding=\"raw\">\n_")?;
        let mut line = Vec::with_capacity(nx * 12);
        for source in sources {
            out.write_all(&(4 * source.components as u64 * count).to_le_bytes())?;
            for k in 0..nz {
                for j in 0..ny {
                    line.clear();
                    for i in 0..nx {
                        let value = (source.value)([i, j, k]);
                        for component in value.iter().take(source.components) {
                            line.extend_from_slice(&component.to_le_bytes());
                        }
                    }
                    out.write_all(&line)?;
                }
            }
        }
        writeln!(out, "\n</AppendedData>\n</VTKFile>")
    })
}

/// Largest head of a file that is read [bytes].
const LARGEST_HEAD: usize = 1 << 16;

/// Reads an image written by [`write()`] or [`write_from`].
///
/// # Errors
/// `InvalidData` with what does not fit, or what the system says.
pub fn read(path: &Path) -> io::Result<Image> {
    let mut bytes = Vec::new();
    std::fs::File::open(path)?.read_to_end(&mut bytes)?;
    parse(&bytes).map_err(|what| {
        io::Error::new(
            io::ErrorKind::InvalidData,
            format!("{}: {what}", path.display()),
        )
    })
}

fn parse(bytes: &[u8]) -> Result<Image, String> {
    let marker = b"<AppendedData encoding=\"raw\">\n_";
    let head_end = bytes
        .windows(marker.len())
        .take(LARGEST_HEAD)
        .position(|w| w == marker);
    let head_end = head_end.ok_or("no raw appended data; not an image of this program")?;
    let head = std::str::from_utf8(&bytes[..head_end]).map_err(|_| "the head is not text")?;
    let data = &bytes[head_end + marker.len()..];
    if !head.contains("type=\"ImageData\"")
        || !head.contains("header_type=\"UInt64\"")
        || !head.contains("LittleEndian")
    {
        return Err("not a little-endian image with 64-bit headers".into());
    }
    let image = element(head, "ImageData ").ok_or("no ImageData")?;
    let extent: [usize; 6] = numbers(image, "WholeExtent")?;
    let cells = [extent[1], extent[3], extent[5]];
    let count = cells
        .iter()
        .try_fold(1usize, |n, c| n.checked_mul(*c))
        .filter(|n| (1..=1 << 40).contains(n));
    let count = count.ok_or_else(|| format!("extent {extent:?}"))?;
    let time_text = head
        .split("Name=\"TimeValue\"")
        .nth(1)
        .and_then(|rest| rest.split(['>', '<']).nth(1));
    let time = time_text
        .and_then(|t| t.trim().parse().ok())
        .ok_or("no TimeValue")?;
    let mut arrays = Vec::new();
    let cell_data = head.split("<CellData>").nth(1).ok_or("no CellData")?;
    for text in cell_data.split("<DataArray ").skip(1) {
        let name = attribute(text, "Name")
            .ok_or("an array without a name")?
            .to_string();
        let [components]: [usize; 1] = numbers(text, "NumberOfComponents")?;
        let [offset]: [usize; 1] = numbers(text, "offset")?;
        let cut = || format!("array {name} is cut off");
        let length = data
            .get(offset..)
            .and_then(|d| d.first_chunk::<8>())
            .ok_or_else(cut)?;
        let length = u64::from_le_bytes(*length) as usize;
        if !(1..=3).contains(&components) || count.checked_mul(4 * components) != Some(length) {
            return Err(format!(
                "array {name} has {length} bytes for {count} cells of {components}"
            ));
        }
        let values = data
            .get(offset + 8..)
            .and_then(|d| d.get(..length))
            .ok_or_else(cut)?;
        let values = values
            .as_chunks::<4>()
            .0
            .iter()
            .map(|b| f32::from_le_bytes(*b))
            .collect();
        arrays.push(Array {
            name,
            components,
            data: values,
        });
    }
    Ok(Image {
        cells,
        spacing: vector(image, "Spacing")?,
        origin: vector(image, "Origin")?,
        time,
        arrays,
    })
}

fn element<'a>(text: &'a str, name: &str) -> Option<&'a str> {
    let start = text.find(&format!("<{name}"))?;
    text[start..].split('>').next()
}

fn attribute<'a>(text: &'a str, name: &str) -> Option<&'a str> {
    let mark = format!("{name}=\"");
    let start = text.find(&mark)? + mark.len();
    text[start..].split('"').next()
}

fn numbers<T: std::str::FromStr, const N: usize>(text: &str, name: &str) -> Result<[T; N], String> {
    let value = attribute(text, name).ok_or_else(|| format!("no {name}"))?;
    let list: Vec<T> = value
        .split_whitespace()
        .filter_map(|v| v.parse().ok())
        .collect();
    list.try_into().map_err(|_| format!("{name}=\"{value}\""))
}

fn vector(text: &str, name: &str) -> Result<DVec3, String> {
    numbers::<f64, 3>(text, name).map(DVec3::from_array)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Image {
        let count = 4 * 3 * 2;
        Image {
            cells: [4, 3, 2],
            spacing: DVec3::new(0.1, 0.2, 0.25e-3),
            origin: DVec3::new(-1.0, 0.0, 1.0 / 3.0),
            time: 0.1 + 0.2,
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
    fn what_is_written_is_read_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.vti");
        write(&path, &sample()).unwrap();
        assert_eq!(read(&path).unwrap(), sample());
        assert_eq!(
            std::fs::read_dir(folder.path()).unwrap().count(),
            1,
            "no temporary file stays"
        );
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
            write(&folder.path().join("a.vti"), &image)
                .unwrap_err()
                .kind(),
            io::ErrorKind::InvalidInput
        );
    }
}

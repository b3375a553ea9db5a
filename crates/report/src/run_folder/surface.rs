//! Surfaces of grains (`.vtp`): VTK XML with ascii or raw appended data.

use std::collections::BTreeMap;
use std::path::Path;

use glam::DVec3;
use roxmltree::{Document, Node};

/// Values of one array, component fastest.
#[derive(Clone, Debug)]
struct Array {
    /// Numbers for each cell or point.
    components: usize,
    /// All numbers.
    values: Vec<f64>,
}

/// A triangulated surface.
#[derive(Clone, Debug)]
pub struct Surface {
    /// Points [m].
    pub points: Vec<DVec3>,
    /// Triangles as indices of points.
    pub triangles: Vec<[usize; 3]>,
    /// Index of the grain each triangle belongs to, where the file says so.
    pub grains: Option<Vec<usize>>,
    /// Time [s], where the file says so.
    pub time: Option<f64>,
}

/// Reads a surface of polygons; polygons of more than three corners are cut into triangles.
pub fn read(file: &Path) -> Result<Surface, String> {
    let bytes = std::fs::read(file).map_err(|error| error.to_string())?;
    let (xml, data) = split(&bytes)?;
    let document = Document::parse(&xml).map_err(|error| format!("not XML: {error}"))?;
    let reader = Reader::new(&document, data)?;
    let grid = child(document.root_element(), "PolyData")?;
    let piece = child(grid, "Piece")?;
    let points = reader
        .arrays(child(piece, "Points")?)?
        .into_values()
        .next()
        .ok_or("no points")?;
    if points.components != 3 {
        return Err("points without three coordinates".to_owned());
    }
    let points: Vec<DVec3> = points
        .values
        .chunks_exact(3)
        .map(DVec3::from_slice)
        .collect();
    if points.iter().any(|p| !p.is_finite()) {
        return Err("a point is not finite".to_owned());
    }
    let polygons = reader.arrays(child(piece, "Polys")?)?;
    let list = |name: &str| {
        polygons
            .get(name)
            .ok_or_else(|| format!("the polygons have no '{name}'"))
    };
    let (corners, ends) = (list("connectivity")?, list("offsets")?);
    let mut triangles = Vec::new();
    let mut owner = Vec::new();
    let mut start = 0;
    for (polygon, end) in ends.values.iter().enumerate() {
        let end = *end as usize;
        let ring = corners
            .values
            .get(start..end)
            .ok_or("polygon offsets point outside")?;
        let ring: Vec<usize> = ring.iter().map(|i| *i as usize).collect();
        if ring.iter().any(|i| *i >= points.len()) {
            return Err("a polygon names a point that is not there".to_owned());
        }
        for i in 2..ring.len() {
            triangles.push([ring[0], ring[i - 1], ring[i]]);
            owner.push(polygon);
        }
        start = end;
    }
    let of_cells = child(piece, "CellData")
        .ok()
        .map(|node| reader.arrays(node))
        .transpose()?;
    let by_cell = of_cells
        .as_ref()
        .and_then(|arrays| arrays.get("grain"))
        .map(|grain| {
            owner
                .iter()
                .map(|polygon| grain.values.get(*polygon).map(|g| *g as usize))
                .collect::<Option<Vec<_>>>()
        });
    Ok(Surface {
        points,
        triangles,
        grains: by_cell.flatten(),
        time: reader.time(grid)?,
    })
}

/// The XML part, closed, and the raw bytes after the underscore.
fn split(bytes: &[u8]) -> Result<(String, &[u8]), String> {
    let find = |from: usize, what: &[u8]| {
        bytes[from..]
            .windows(what.len())
            .position(|w| w == what)
            .map(|i| from + i)
    };
    let Some(tag) = find(0, b"<AppendedData") else {
        let text =
            std::str::from_utf8(bytes).map_err(|_| "neither XML nor appended data".to_owned())?;
        return Ok((text.to_owned(), &[]));
    };
    let open = find(tag, b">").ok_or("the appended data are cut off")?;
    let mark = find(open, b"_").ok_or("the appended data are cut off")?;
    let head =
        std::str::from_utf8(&bytes[..=open]).map_err(|_| "the head is not text".to_owned())?;
    if !head[tag..].contains("raw") {
        return Err("the appended data are not raw".to_owned());
    }
    Ok((
        format!("{head}</AppendedData></VTKFile>"),
        &bytes[mark + 1..],
    ))
}

/// What is needed to read the arrays of one file.
struct Reader<'a> {
    data: &'a [u8],
    wide: bool,
}

impl<'a> Reader<'a> {
    fn new(document: &Document, data: &'a [u8]) -> Result<Reader<'a>, String> {
        let root = document.root_element();
        if root.tag_name().name() != "VTKFile" || root.attribute("type") != Some("PolyData") {
            return Err("not a VTK file of type PolyData".to_owned());
        }
        if root
            .attribute("byte_order")
            .is_some_and(|order| order != "LittleEndian")
        {
            return Err("big-endian data are not read".to_owned());
        }
        if root.attribute("compressor").is_some() {
            return Err("compressed data are not read".to_owned());
        }
        Ok(Reader {
            data,
            wide: root.attribute("header_type") == Some("UInt64"),
        })
    }

    /// All arrays below `node`.
    fn arrays(&self, node: Node) -> Result<BTreeMap<String, Array>, String> {
        let mut out = BTreeMap::new();
        for array in node
            .children()
            .filter(|child| child.has_tag_name("DataArray"))
        {
            let name = array.attribute("Name").unwrap_or("").to_owned();
            let values = self
                .values(array)
                .map_err(|what| format!("array '{name}': {what}"))?;
            let components = array
                .attribute("NumberOfComponents")
                .map_or(Ok(1), str::parse);
            let components = components.ok().filter(|n| (1..=16).contains(n));
            let components =
                components.ok_or_else(|| format!("array '{name}': bad NumberOfComponents"))?;
            out.insert(name, Array { components, values });
        }
        Ok(out)
    }

    fn time(&self, grid: Node) -> Result<Option<f64>, String> {
        let Ok(node) = child(grid, "FieldData") else {
            return Ok(None);
        };
        let arrays = self.arrays(node)?;
        let time = arrays
            .get("TimeValue")
            .and_then(|array| array.values.first());
        Ok(time.copied().filter(|time| time.is_finite()))
    }

    fn values(&self, array: Node) -> Result<Vec<f64>, String> {
        let kind = array.attribute("type").unwrap_or("");
        if array.attribute("format") == Some("ascii") {
            let text = array.text().unwrap_or("");
            return text
                .split_whitespace()
                .map(|v| v.parse().map_err(|_| format!("'{v}' is not a number")))
                .collect();
        }
        if array.attribute("format") != Some("appended") {
            return Err("neither appended nor ascii".to_owned());
        }
        let offset: usize = array
            .attribute("offset")
            .and_then(|v| v.parse().ok())
            .ok_or("no offset")?;
        let cut = || "its data are cut off".to_owned();
        let rest = self.data.get(offset..).ok_or_else(cut)?;
        let head = if self.wide { 8 } else { 4 };
        let length = rest.get(..head).ok_or_else(cut)?;
        let length = length
            .iter()
            .rev()
            .fold(0u64, |sum, byte| (sum << 8) | u64::from(*byte));
        let bytes = usize::try_from(length)
            .ok()
            .and_then(|n| rest.get(head..head.checked_add(n)?))
            .ok_or_else(cut)?;
        macro_rules! decode {
            ($type:ty) => {
                Ok(bytes
                    .as_chunks::<{ size_of::<$type>() }>()
                    .0
                    .iter()
                    .map(|b| <$type>::from_le_bytes(*b) as f64)
                    .collect())
            };
        }
        match kind {
            "Float32" => decode!(f32),
            "Float64" => decode!(f64),
            "Int32" => decode!(i32),
            "Int64" => decode!(i64),
            "UInt32" => decode!(u32),
            "UInt64" => decode!(u64),
            "Int8" => decode!(i8),
            "UInt8" => decode!(u8),
            other => Err(format!("type '{other}' is not read")),
        }
    }
}

fn child<'a, 'b>(node: Node<'a, 'b>, name: &str) -> Result<Node<'a, 'b>, String> {
    node.children()
        .find(|child| child.has_tag_name(name))
        .ok_or_else(|| format!("no <{name}>"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn appended() -> Vec<u8> {
        let mut out = b"<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<PolyData>\n<FieldData><DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" format=\"ascii\">0.75</DataArray></FieldData>\n<Piece><Points><DataArray type=\"Float32\" Name=\"Points\" NumberOfComponents=\"3\" format=\"appended\" offset=\"0\"/></Points>\n<Polys><DataArray type=\"Int32\" Name=\"connectivity\" format=\"appended\" offset=\"44\"/><DataArray type=\"Int32\" Name=\"offsets\" format=\"appended\" offset=\"64\"/></Polys></Piece></PolyData>\n<AppendedData encoding=\"raw\">\n_".to_vec();
        out.extend(36u64.to_le_bytes());
        out.extend((0..9).flat_map(|i| (i as f32).to_le_bytes()));
        out.extend(12u64.to_le_bytes());
        out.extend([0i32, 1, 2].into_iter().flat_map(i32::to_le_bytes));
        out.extend(4u64.to_le_bytes());
        out.extend(3i32.to_le_bytes());
        out.extend(b"\n</AppendedData></VTKFile>\n");
        out
    }

    fn with_file<T>(bytes: &[u8], read: impl Fn(&Path) -> T) -> T {
        let folder = crate::testing::folder();
        let file = folder.join("file");
        std::fs::write(&file, bytes).unwrap();
        let out = read(&file);
        std::fs::remove_dir_all(folder).unwrap();
        out
    }

    #[test]
    fn a_surface_is_read_back() {
        let surface = with_file(&appended(), read).unwrap();
        assert_eq!(surface.points[1], DVec3::new(3.0, 4.0, 5.0));
        assert_eq!(
            (surface.triangles.as_slice(), surface.time),
            (&[[0, 1, 2]][..], Some(0.75))
        );
        assert!(surface.grains.is_none());
    }

    #[test]
    fn no_damage_brings_the_reader_down() {
        let whole = appended();
        for cut in 0..whole.len() - 30 {
            assert!(with_file(&whole[..cut], read).is_err(), "cut at {cut}");
        }
        let text = String::from_utf8_lossy(&whole).into_owned();
        let refused =
            |from: &str, to: &str| with_file(text.replace(from, to).as_bytes(), read).unwrap_err();
        assert!(refused("Float32", "Float16").contains("'Float16' is not read"));
        assert!(refused("PolyData", "ImageData").contains("not a VTK file of type PolyData"));
        assert!(refused("offset=\"0\"", "offset=\"99\"").contains("cut off"));
    }

    #[test]
    fn polygons_become_triangles() {
        let text = "<VTKFile type=\"PolyData\" byte_order=\"LittleEndian\"><PolyData><Piece>\
            <CellData><DataArray type=\"Int32\" Name=\"grain\" format=\"ascii\">5 6</DataArray></CellData>\
            <Points><DataArray type=\"Float32\" Name=\"Points\" NumberOfComponents=\"3\" format=\"ascii\">0 0 0 1 0 0 1 1 0 0 1 0</DataArray></Points>\
            <Polys><DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">0 1 2 3 0 1 3</DataArray>\
            <DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">4 7</DataArray></Polys></Piece></PolyData></VTKFile>";
        let surface = with_file(text.as_bytes(), read).unwrap();
        assert_eq!(surface.triangles, [[0, 1, 2], [0, 2, 3], [0, 1, 3]]);
        assert_eq!(surface.grains, Some(vec![5, 5, 6]));
        let outside = text.replace("0 1 2 3 0 1 3", "0 1 2 9 0 1 3");
        assert!(
            with_file(outside.as_bytes(), read)
                .unwrap_err()
                .contains("not there")
        );
    }
}

//! VTK XML files with raw appended data: images (`.vti`) and surfaces (`.vtp`).

use std::collections::BTreeMap;
use std::path::Path;

use glam::DVec3;
use roxmltree::{Document, Node};

/// Values of one array, component fastest.
#[derive(Clone, Debug)]
pub struct Array {
    /// Numbers for each cell or point.
    pub components: usize,
    /// All numbers.
    pub values: Vec<f64>,
}

/// A uniform grid with values at its cells.
#[derive(Clone, Debug)]
pub struct Image {
    /// Cells along x, y, z.
    pub cells: [usize; 3],
    /// Cell edges [m].
    pub spacing: DVec3,
    /// Lower corner [m].
    pub lower: DVec3,
    /// Arrays over the cells, x fastest.
    pub arrays: BTreeMap<String, Array>,
    /// Values that belong to the whole file.
    pub fields: BTreeMap<String, f64>,
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
    /// Values that belong to the whole file.
    pub fields: BTreeMap<String, f64>,
}

/// Reads an image.
pub fn read_image(file: &Path) -> Result<Image, String> {
    let bytes = std::fs::read(file).map_err(|error| error.to_string())?;
    let (xml, data) = split(&bytes)?;
    let document = Document::parse(&xml).map_err(|error| format!("not XML: {error}"))?;
    let reader = Reader::new(&document, "ImageData", data)?;
    let grid = child(document.root_element(), "ImageData")?;
    let extent: Vec<i64> = numbers(grid, "WholeExtent")?;
    let spacing = vector(grid, "Spacing")?;
    let origin = vector(grid, "Origin")?;
    let [x0, x1, y0, y1, z0, z1] = extent[..] else {
        return Err("WholeExtent does not have six numbers".to_owned());
    };
    let first = [x0, y0, z0];
    let mut cells = [0; 3];
    for (cells, (low, high)) in cells.iter_mut().zip([(x0, x1), (y0, y1), (z0, z1)]) {
        let size = high.checked_sub(low).filter(|n| (1..=1 << 20).contains(n));
        *cells = size.ok_or_else(|| format!("WholeExtent '{extent:?}' has no cells or too many"))?
            as usize;
    }
    if !(spacing.min_element() > 0.0 && spacing.is_finite() && origin.is_finite()) {
        return Err("Spacing or Origin is not usable".to_owned());
    }
    let count = cells
        .iter()
        .try_fold(1usize, |n, m| n.checked_mul(*m))
        .ok_or("too many cells")?;
    let piece = child(grid, "Piece")?;
    let arrays = reader.arrays(child(piece, "CellData")?, Some(count))?;
    let lower = origin + spacing * DVec3::from_array(first.map(|i| i as f64));
    Ok(Image {
        cells,
        spacing,
        lower,
        arrays,
        fields: reader.fields(grid)?,
    })
}

/// Reads a surface of polygons; polygons of more than three corners are cut into triangles.
pub fn read_surface(file: &Path) -> Result<Surface, String> {
    let bytes = std::fs::read(file).map_err(|error| error.to_string())?;
    let (xml, data) = split(&bytes)?;
    let document = Document::parse(&xml).map_err(|error| format!("not XML: {error}"))?;
    let reader = Reader::new(&document, "PolyData", data)?;
    let grid = child(document.root_element(), "PolyData")?;
    let piece = child(grid, "Piece")?;
    let points = reader
        .arrays(child(piece, "Points")?, None)?
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
    let polygons = reader.arrays(child(piece, "Polys")?, None)?;
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
        .map(|node| reader.arrays(node, None))
        .transpose()?;
    let of_points = child(piece, "PointData")
        .ok()
        .map(|node| reader.arrays(node, None))
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
    let by_point = of_points
        .as_ref()
        .and_then(|arrays| arrays.get("grain"))
        .map(|grain| {
            triangles
                .iter()
                .map(|t| grain.values.get(t[0]).map(|g| *g as usize))
                .collect::<Option<Vec<_>>>()
        });
    Ok(Surface {
        points,
        triangles,
        grains: by_cell.or(by_point).flatten(),
        fields: reader.fields(grid)?,
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
    fn new(document: &Document, kind: &str, data: &'a [u8]) -> Result<Reader<'a>, String> {
        let root = document.root_element();
        if root.tag_name().name() != "VTKFile" || root.attribute("type") != Some(kind) {
            return Err(format!("not a VTK file of type {kind}"));
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

    /// All arrays below `node`; each must have `count` tuples, if given.
    fn arrays(&self, node: Node, count: Option<usize>) -> Result<BTreeMap<String, Array>, String> {
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
            if let Some(count) =
                count.filter(|count| count.checked_mul(components) != Some(values.len()))
            {
                return Err(format!(
                    "array '{name}': {} values for {count} cells of {components}",
                    values.len()
                ));
            }
            out.insert(name, Array { components, values });
        }
        Ok(out)
    }

    /// First value of every array in the file's FieldData.
    fn fields(&self, grid: Node) -> Result<BTreeMap<String, f64>, String> {
        let Ok(node) = child(grid, "FieldData") else {
            return Ok(BTreeMap::new());
        };
        let arrays = self.arrays(node, None)?;
        Ok(arrays
            .into_iter()
            .filter_map(|(name, array)| Some((name, *array.values.first()?)))
            .collect())
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

fn numbers<T: std::str::FromStr>(node: Node, name: &str) -> Result<Vec<T>, String> {
    let text = node
        .attribute(name)
        .ok_or_else(|| format!("no attribute {name}"))?;
    text.split_whitespace()
        .map(|v| {
            v.parse()
                .map_err(|_| format!("{name}: '{v}' is not a number"))
        })
        .collect()
}

fn vector(node: Node, name: &str) -> Result<DVec3, String> {
    match numbers(node, name)?[..] {
        [x, y, z] => Ok(DVec3::new(x, y, z)),
        _ => Err(format!("{name} does not have three numbers")),
    }
}

/// Time of every file that a collection (`run.pvd`) lists, by its path as written there.
pub fn read_collection(file: &Path) -> Result<Vec<(String, f64)>, String> {
    let text = std::fs::read_to_string(file).map_err(|error| error.to_string())?;
    let document = Document::parse(&text).map_err(|error| format!("not XML: {error}"))?;
    let sets = document
        .descendants()
        .filter(|node| node.has_tag_name("DataSet"));
    Ok(sets
        .filter_map(|node| {
            Some((
                node.attribute("file")?.to_owned(),
                node.attribute("timestep")?.parse().ok()?,
            ))
        })
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image_bytes() -> Vec<u8> {
        let mut out = b"<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<ImageData WholeExtent=\"0 2 3 4 0 2\" Origin=\"0 0 0\" Spacing=\"0.5 0.25 1\">\n<FieldData><DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" format=\"ascii\">0.75</DataArray></FieldData>\n<Piece Extent=\"0 2 3 4 0 2\"><CellData><DataArray type=\"Float32\" Name=\"pressure\" format=\"appended\" offset=\"0\"/></CellData></Piece></ImageData>\n<AppendedData encoding=\"raw\">\n_".to_vec();
        out.extend(16u64.to_le_bytes());
        for value in [1.0f32, 2.0, 3.0, 4.0] {
            out.extend(value.to_le_bytes());
        }
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
    fn an_image_is_read_back() {
        let image = with_file(&image_bytes(), read_image).unwrap();
        assert_eq!(image.cells, [2, 1, 2]);
        assert_eq!(image.lower, DVec3::new(0.0, 0.75, 0.0));
        assert_eq!(image.arrays["pressure"].values, [1.0, 2.0, 3.0, 4.0]);
        assert_eq!(image.fields["TimeValue"], 0.75);
    }

    #[test]
    fn no_damage_brings_the_reader_down() {
        let whole = image_bytes();
        for cut in 0..whole.len() - 40 {
            assert!(
                with_file(&whole[..cut], read_image).is_err(),
                "cut at {cut}"
            );
        }
        let text = String::from_utf8_lossy(&whole).into_owned();
        let refused = |from: &str, to: &str| {
            with_file(text.replace(from, to).as_bytes(), read_image).unwrap_err()
        };
        assert!(refused("0 2 3 4 0 2", "0 999999999999 3 4 0 2").contains("too many"));
        assert!(refused("Spacing=\"0.5", "Spacing=\"-1").contains("not usable"));
        assert!(refused("Float32", "Float16").contains("'Float16' is not read"));
        assert!(refused("ImageData", "PolyData").contains("not a VTK file of type ImageData"));
        assert!(refused("offset=\"0\"", "offset=\"99\"").contains("cut off"));
    }

    #[test]
    fn polygons_become_triangles() {
        let text = "<VTKFile type=\"PolyData\" byte_order=\"LittleEndian\"><PolyData><Piece>\
            <CellData><DataArray type=\"Int32\" Name=\"grain\" format=\"ascii\">5 6</DataArray></CellData>\
            <Points><DataArray type=\"Float32\" Name=\"Points\" NumberOfComponents=\"3\" format=\"ascii\">0 0 0 1 0 0 1 1 0 0 1 0</DataArray></Points>\
            <Polys><DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">0 1 2 3 0 1 3</DataArray>\
            <DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">4 7</DataArray></Polys></Piece></PolyData></VTKFile>";
        let surface = with_file(text.as_bytes(), read_surface).unwrap();
        assert_eq!(surface.triangles, [[0, 1, 2], [0, 2, 3], [0, 1, 3]]);
        assert_eq!(surface.grains, Some(vec![5, 5, 6]));
        let outside = text.replace("0 1 2 3 0 1 3", "0 1 2 9 0 1 3");
        assert!(
            with_file(outside.as_bytes(), read_surface)
                .unwrap_err()
                .contains("not there")
        );
    }
}

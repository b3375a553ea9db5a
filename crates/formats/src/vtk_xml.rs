//! VTK XML files with raw appended data: the parts that image and polygonal data share.
//!
//! Layout: XML with one `DataArray` element per array, each with its offset; `<AppendedData>`; an
//! underscore; for each array a 64-bit length in bytes and the little-endian numbers.

use std::collections::BTreeMap;
use std::io::{self, Write};

use roxmltree::{Document, Node};

/// Writes the XML down to the field data: `kind` is the data set, `attributes` its attributes.
pub fn write_head(out: &mut dyn Write, kind: &str, attributes: &str, time: f64) -> io::Result<()> {
    write!(
        out,
        "<?xml version=\"1.0\"?>\n\
         <VTKFile type=\"{kind}\" version=\"1.0\" byte_order=\"LittleEndian\" \
         header_type=\"UInt64\">\n<{kind}{attributes}>\n\
         <FieldData><DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" \
         format=\"ascii\">{time:?}</DataArray></FieldData>\n"
    )
}

/// Opens the appended data.
pub fn open_appended(out: &mut dyn Write) -> io::Result<()> {
    write!(out, "<AppendedData encoding=\"raw\">\n_")
}

/// Writes the length of an array in front of its numbers.
pub fn write_length(out: &mut dyn Write, bytes: u64) -> io::Result<()> {
    out.write_all(&bytes.to_le_bytes())
}

/// Closes the appended data and the file.
pub fn close_appended(out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, "\n</AppendedData>\n</VTKFile>")
}

/// Elements of the appended arrays, in the order of their data.
#[derive(Default)]
pub struct ArrayElements {
    offset: u64,
}

impl ArrayElements {
    /// Returns the element of the next array, with its length in bytes.
    pub fn next(&mut self, kind: &str, name: &str, components: usize, bytes: u64) -> String {
        let offset = self.offset;
        self.offset += 8 + bytes;
        format!(
            "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" \
             format=\"appended\" offset=\"{offset}\"/>"
        )
    }
}

/// Splits a file into its XML, closed, and the raw bytes after the underscore.
pub fn split(bytes: &[u8]) -> Result<(String, &[u8]), String> {
    let find = |from: usize, what: &[u8]| {
        bytes[from..].windows(what.len()).position(|window| window == what).map(|i| from + i)
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
    Ok((format!("{head}</AppendedData></VTKFile>"), &bytes[mark + 1..]))
}

/// Values of one array.
#[derive(Clone, Debug)]
pub struct DataArray<T> {
    /// Components of each tuple.
    pub components: usize,
    /// Values, components fastest.
    pub values: Vec<T>,
}

/// Reader of the arrays of one file.
pub struct ArrayReader<'a> {
    data: &'a [u8],
    wide_lengths: bool,
}

impl<'a> ArrayReader<'a> {
    /// Checks the head of a file that must hold data of this kind, "ImageData" or "PolyData".
    pub fn new(document: &Document, kind: &str, data: &'a [u8]) -> Result<ArrayReader<'a>, String> {
        let root = document.root_element();
        if root.tag_name().name() != "VTKFile" || root.attribute("type") != Some(kind) {
            return Err(format!("not a VTK file of type {kind}"));
        }
        let order = root.attribute("byte_order");
        if order.is_some_and(|order| order != "LittleEndian") {
            return Err("big-endian data are not read".to_owned());
        }
        if root.attribute("compressor").is_some() {
            return Err("compressed data are not read".to_owned());
        }
        Ok(ArrayReader { data, wide_lengths: root.attribute("header_type") == Some("UInt64") })
    }

    /// Reads all arrays below `node` in the order of the file, with their names.
    pub fn arrays<T: Value>(&self, node: Node) -> Result<Vec<(String, DataArray<T>)>, String> {
        let elements = node.children().filter(|child| child.has_tag_name("DataArray"));
        elements
            .map(|element| {
                let name = element.attribute("Name").unwrap_or("").to_owned();
                let values =
                    self.values(element).map_err(|what| format!("array '{name}': {what}"))?;
                let components = element
                    .attribute("NumberOfComponents")
                    .map_or(Ok(1), str::parse)
                    .ok()
                    .filter(|n| (1..=16).contains(n))
                    .ok_or_else(|| format!("array '{name}': bad NumberOfComponents"))?;
                Ok((name, DataArray { components, values }))
            })
            .collect()
    }

    /// Reads all arrays below `node` by name.
    pub fn by_name<T: Value>(&self, node: Node) -> Result<BTreeMap<String, DataArray<T>>, String> {
        Ok(self.arrays(node)?.into_iter().collect())
    }

    /// Reads the simulated time [s] from the field data, if there is one.
    pub fn time(&self, data_set: Node) -> Result<Option<f64>, String> {
        let Ok(node) = child(data_set, "FieldData") else {
            return Ok(None);
        };
        let arrays = self.by_name::<f64>(node)?;
        let time = arrays.get("TimeValue").and_then(|array| array.values.first());
        Ok(time.copied().filter(|time| time.is_finite()))
    }

    fn values<T: Value>(&self, element: Node) -> Result<Vec<T>, String> {
        let kind = element.attribute("type").unwrap_or("");
        match element.attribute("format") {
            Some("ascii") => {
                let text = element.text().unwrap_or("");
                return text
                    .split_whitespace()
                    .map(|v| v.parse().map_err(|_| format!("'{v}' is not a number")))
                    .collect();
            }
            Some("appended") => {}
            _ => return Err("neither appended nor ascii".to_owned()),
        }
        let offset: usize =
            element.attribute("offset").and_then(|v| v.parse().ok()).ok_or("no offset")?;
        let cut = || "its data are cut off".to_owned();
        let rest = self.data.get(offset..).ok_or_else(cut)?;
        let head = if self.wide_lengths { 8 } else { 4 };
        let length = rest.get(..head).ok_or_else(cut)?;
        let length = length.iter().rev().fold(0u64, |sum, byte| (sum << 8) | u64::from(*byte));
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
                    .map(|b| T::from_f64(<$type>::from_le_bytes(*b) as f64))
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

/// Number type that arrays are read into.
pub trait Value: std::str::FromStr {
    /// Converts from double precision.
    fn from_f64(value: f64) -> Self;
}
impl Value for f64 {
    fn from_f64(value: f64) -> f64 {
        value
    }
}
impl Value for f32 {
    fn from_f64(value: f64) -> f32 {
        value as f32
    }
}

/// Returns the first child element with this name.
pub fn child<'a, 'b>(node: Node<'a, 'b>, name: &str) -> Result<Node<'a, 'b>, String> {
    node.children().find(|child| child.has_tag_name(name)).ok_or_else(|| format!("no <{name}>"))
}

/// Returns an error of kind `InvalidData` that names the file.
pub fn damaged(path: &std::path::Path, what: String) -> io::Error {
    crate::codec::invalid(format!("{}: {what}", path.display()))
}

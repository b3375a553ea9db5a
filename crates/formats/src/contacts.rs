//! Contacts of the grains: the table `contacts.csv`, and VTK polygonal files of the contact points
//! and of the contact network. SI units, space frame.
//!
//! The second body of a contact has one number: the index of a grain, or a negative number for a
//! side of the box ([`wall_code`]).

use std::io;
use std::path::Path;

use glam::DVec3;

use crate::polygonal::{self, Array};
use crate::table::append_cells;

/// Name of the table in a run folder.
pub const FILE: &str = "contacts.csv";
/// Folder of the VTK files in a run folder.
pub const FOLDER: &str = "contacts";
/// Header of the table.
pub const HEADER: &str = "time,grain,partner,x,y,z,nx,ny,nz,overlap,fx,fy,fz";

/// Names of the sides of the box in the order of their codes.
const WALLS: [&str; 6] = ["lower x", "upper x", "lower y", "upper y", "lower z", "upper z"];

/// Returns the number of a side of the box as a second body: -1 for lower x, -2 for upper x, and so
/// on to -6 for upper z.
pub fn wall_code(axis: u8, side: u8) -> i64 {
    -1 - i64::from(2 * axis + side)
}

/// Returns the name of a side of the box, "lower z".
pub fn wall_name(axis: u8, side: u8) -> &'static str {
    WALLS[usize::from(2 * axis + side).min(WALLS.len() - 1)]
}

/// Row of the table: one contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactRow {
    /// Simulated time [s].
    pub time: f64,
    /// Index of the first grain.
    pub grain: usize,
    /// Index of the second grain, or number of a wall.
    pub partner: i64,
    /// Contact point [m].
    pub point: DVec3,
    /// Unit normal, out of `grain`.
    pub normal: DVec3,
    /// Overlap [m].
    pub overlap: f64,
    /// Force on `grain` [N]; the partner receives the opposite force.
    pub force: DVec3,
    /// Centroid of `grain` [m]; not part of the table.
    pub centre: DVec3,
    /// Centroid of the partner in the image that touches, or the contact point at a wall [m]; not
    /// part of the table.
    pub partner_centre: DVec3,
}

impl ContactRow {
    /// Appends the row to a text; numbers are read back exactly.
    pub fn append_to(&self, text: &mut String) {
        let (x, n, f) = (self.point, self.normal, self.force);
        let numbers = [x.x, x.y, x.z, n.x, n.y, n.z, self.overlap, f.x, f.y, f.z];
        *text += &format!("{:?},{},{}", self.time, self.grain, self.partner);
        append_cells(text, numbers);
        text.push('\n');
    }
}

/// Writes the contact points in single precision, with forces, normals and overlaps.
///
/// # Errors
/// Errors of the operating system.
pub fn write_points(path: &Path, time: f64, contacts: &[ContactRow]) -> io::Result<()> {
    let points: Vec<DVec3> = contacts.iter().map(|c| c.point).collect();
    let [overlap, grain, partner] = shared_arrays(contacts);
    let force = Array::vectors("force", contacts.iter().map(|c| c.force));
    let normal = Array::vectors("normal", contacts.iter().map(|c| c.normal));
    let of_points = vec![force, normal, overlap, grain, partner];
    let data = vec![("PointData", of_points), ("CellData", Vec::new())];
    polygonal::write(path, time, &points, data, ("Verts", 1), 0..points.len())
}

/// Writes the contact network in single precision: one line per contact between the centroids of
/// its grains, at a wall from the centroid to the contact point.
///
/// # Errors
/// Errors of the operating system.
pub fn write_network(path: &Path, time: f64, contacts: &[ContactRow]) -> io::Result<()> {
    let points: Vec<DVec3> = contacts.iter().flat_map(|c| [c.centre, c.partner_centre]).collect();
    let magnitudes = || contacts.iter().map(|c| c.force.length() as f32);
    let [overlap, grain, partner] = shared_arrays(contacts);
    let force = Array::vectors("force", contacts.iter().map(|c| c.force));
    let magnitude = Array::singles("force_magnitude", magnitudes());
    let of_lines = vec![force, magnitude, overlap, grain, partner];
    // The magnitude is also at the points, where filters for tubes look for it.
    let at_points = magnitudes().flat_map(|force| [force; 2]);
    let of_points = vec![Array::singles("force_magnitude", at_points)];
    let data = vec![("PointData", of_points), ("CellData", of_lines)];
    polygonal::write(path, time, &points, data, ("Lines", 2), 0..points.len())
}

/// Returns overlaps, grains and partners.
fn shared_arrays(contacts: &[ContactRow]) -> [Array; 3] {
    [
        Array::singles("overlap", contacts.iter().map(|c| c.overlap as f32)),
        Array::integers("grain", contacts.iter().map(|c| c.grain as i64)),
        Array::integers("partner", contacts.iter().map(|c| c.partner)),
    ]
}

#[cfg(test)]
mod tests {
    use roxmltree::Document;

    use super::*;
    use crate::vtk_xml::{ArrayReader, child, split};

    fn contacts() -> Vec<ContactRow> {
        let contact = ContactRow {
            time: 0.25,
            grain: 0,
            partner: 1,
            point: DVec3::new(1.0, 2.0, 3.5),
            normal: DVec3::Z,
            overlap: 1e-6,
            force: DVec3::new(0.0, 0.5, -2.0),
            centre: DVec3::new(1.0, 2.0, 3.0),
            partner_centre: DVec3::new(1.0, 2.0, 4.0),
        };
        let floor = ContactRow { partner: wall_code(2, 0), force: DVec3::Z, ..contact };
        vec![contact, floor]
    }

    /// Arrays of one section of the file that `write` writes.
    fn arrays(
        write: fn(&Path, f64, &[ContactRow]) -> io::Result<()>,
        contacts: &[ContactRow],
        section: &str,
    ) -> Vec<(String, Vec<f64>)> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("contacts.vtp");
        write(&path, 0.25, contacts).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let (xml, data) = split(&bytes).unwrap();
        let document = Document::parse(&xml).unwrap();
        let reader = ArrayReader::new(&document, "PolyData", data).unwrap();
        let data_set = child(document.root_element(), "PolyData").unwrap();
        assert_eq!(reader.time(data_set), Ok(Some(0.25)));
        let piece = child(data_set, "Piece").unwrap();
        let arrays = reader.arrays::<f64>(child(piece, section).unwrap()).unwrap();
        arrays.into_iter().map(|(name, array)| (name, array.values)).collect()
    }

    #[test]
    fn rows_have_the_columns_of_the_header() {
        let mut text = String::new();
        contacts()[1].append_to(&mut text);
        assert_eq!(text, "0.25,0,-5,1.0,2.0,3.5,0.0,0.0,1.0,1e-6,0.0,0.0,1.0\n");
        assert_eq!(text.split(',').count(), HEADER.split(',').count());
        assert_eq!((wall_code(0, 0), wall_code(2, 1)), (-1, -6));
        assert_eq!((wall_name(0, 1), wall_name(2, 0)), ("upper x", "lower z"));
    }

    #[test]
    fn points_and_network_are_read_back() {
        let data = arrays(write_points, &contacts(), "PointData");
        assert_eq!(data[0], ("force".into(), vec![0.0, 0.5, -2.0, 0.0, 0.0, 1.0]));
        assert_eq!(data[4], ("partner".into(), vec![1.0, -5.0]));
        let verts = arrays(write_points, &contacts(), "Verts");
        assert_eq!(verts[1], ("offsets".into(), vec![1.0, 2.0]));

        let lines = arrays(write_network, &contacts(), "Lines");
        assert_eq!(lines[0].1, [0.0, 1.0, 2.0, 3.0]);
        assert_eq!(lines[1].1, [2.0, 4.0]);
        let points = arrays(write_network, &contacts(), "Points");
        assert_eq!(points[0].1[..6], [1.0, 2.0, 3.0, 1.0, 2.0, 4.0]);
        let data = arrays(write_network, &contacts(), "CellData");
        assert!((data[1].1[0] - 4.25f64.sqrt()).abs() < 1e-6);
        assert!(arrays(write_network, &[], "Lines").iter().all(|(_, values)| values.is_empty()));
    }
}

//! VTK surface files (`.vtp`): the grains as they stand, raw appended.

use std::io::{self, Write};
use std::path::Path;
use std::sync::Arc;

use glam::DVec3;
use grainwake_shape::Shape;

use super::file::write_whole;
use crate::dem::Grain;

/// More triangles than this in one file are thinned out.
const MOST_TRIANGLES: usize = 400_000;

/// A closed surface in the frame of the body.
#[derive(Clone, Debug)]
struct Surface {
    points: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
}

/// Surfaces of the grains of a run, built once for each shape.
pub(super) struct Surfaces {
    by_grain: Vec<Arc<Surface>>,
}

impl Surfaces {
    /// For these grains.
    pub fn new(grains: &[Grain]) -> Surfaces {
        let mut known: Vec<(*const Shape, Arc<Surface>)> = Vec::new();
        let mut by_grain = Vec::with_capacity(grains.len());
        for grain in grains {
            let key = Arc::as_ptr(&grain.shape);
            let surface = known
                .iter()
                .find(|(k, _)| *k == key)
                .map(|(_, s)| s.clone())
                .unwrap_or_else(|| {
                    let (points, triangles) = grain.shape.surface_mesh();
                    let mut surface = Surface { points, triangles };
                    if surface.triangles.len() * grains.len() > MOST_TRIANGLES {
                        surface = surface.thinned(grain.shape.equivalent_diameter() / 10.0);
                    }
                    let surface = Arc::new(surface);
                    known.push((key, surface.clone()));
                    surface
                });
            by_grain.push(surface);
        }
        Surfaces { by_grain }
    }

    /// Writes the grains as they stand. Cells carry the index of the grain, points its velocity.
    pub fn write(&self, path: &Path, grains: &[Grain], time: f64) -> io::Result<()> {
        let points: usize = self.by_grain.iter().map(|s| s.points.len()).sum();
        let triangles: usize = self.by_grain.iter().map(|s| s.triangles.len()).sum();
        let pairs = || grains.iter().zip(&self.by_grain);
        write_whole(path, false, |out| {
            writeln!(out, "<?xml version=\"1.0\"?>")?;
            writeln!(
                out,
                "<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<PolyData>"
            )?;
            writeln!(
                out,
                "<FieldData><DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" format=\"ascii\">{time:?}</DataArray></FieldData>"
            )?;
            writeln!(
                out,
                "<Piece NumberOfPoints=\"{points}\" NumberOfVerts=\"0\" NumberOfLines=\"0\" NumberOfStrips=\"0\" NumberOfPolys=\"{triangles}\">"
            )?;
            let mut offset = 0;
            let mut array = |kind: &str, name: &str, components: usize, bytes: usize| {
                let text = format!(
                    "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"appended\" offset=\"{offset}\"/>"
                );
                offset += 8 + bytes;
                text
            };
            writeln!(
                out,
                "<Points>{}</Points>",
                array("Float32", "Points", 3, 12 * points)
            )?;
            writeln!(
                out,
                "<PointData>{}</PointData>",
                array("Float32", "velocity", 3, 12 * points)
            )?;
            writeln!(
                out,
                "<CellData>{}</CellData>",
                array("Int32", "grain", 1, 4 * triangles)
            )?;
            let (corners, ends) = (
                array("Int32", "connectivity", 1, 12 * triangles),
                array("Int32", "offsets", 1, 4 * triangles),
            );
            writeln!(out, "<Polys>{corners}{ends}</Polys>")?;
            write!(
                out,
                "</Piece>\n</PolyData>\n<AppendedData encoding=\"raw\">\n_"
            )?;
            let head =
                |out: &mut dyn Write, bytes: usize| out.write_all(&(bytes as u64).to_le_bytes());
            let vector = |out: &mut dyn Write, v: DVec3| {
                v.to_array()
                    .iter()
                    .try_for_each(|c| out.write_all(&(*c as f32).to_le_bytes()))
            };
            let number = |out: &mut dyn Write, n: usize| out.write_all(&(n as i32).to_le_bytes());
            head(out, 12 * points)?;
            for (grain, surface) in pairs() {
                surface
                    .points
                    .iter()
                    .try_for_each(|p| vector(out, grain.pose.to_space(*p)))?;
            }
            head(out, 12 * points)?;
            for (grain, surface) in pairs() {
                surface
                    .points
                    .iter()
                    .try_for_each(|p| vector(out, grain.velocity_at(grain.pose.to_space(*p))))?;
            }
            head(out, 4 * triangles)?;
            for (index, (_, surface)) in pairs().enumerate() {
                surface
                    .triangles
                    .iter()
                    .try_for_each(|_| number(out, index))?;
            }
            head(out, 12 * triangles)?;
            let mut first = 0;
            for (_, surface) in pairs() {
                surface
                    .triangles
                    .iter()
                    .flatten()
                    .try_for_each(|corner| number(out, first + *corner as usize))?;
                first += surface.points.len();
            }
            head(out, 4 * triangles)?;
            (1..=triangles).try_for_each(|n| number(out, 3 * n))?;
            writeln!(out, "\n</AppendedData>\n</VTKFile>")
        })
    }
}

impl Surface {
    /// Merges the points of each cube of edge `cell` [m]; triangles that collapse disappear.
    fn thinned(&self, cell: f64) -> Surface {
        let mut clusters = std::collections::BTreeMap::new();
        let mut points: Vec<(DVec3, f64)> = Vec::new();
        let of_point: Vec<u32> = self
            .points
            .iter()
            .map(|p| {
                let key = (*p / cell).floor().to_array().map(|c| c as i64);
                let index = *clusters.entry(key).or_insert_with(|| {
                    points.push((DVec3::ZERO, 0.0));
                    points.len() - 1
                });
                points[index].0 += *p;
                points[index].1 += 1.0;
                index as u32
            })
            .collect();
        let mut triangles: Vec<[u32; 3]> = Vec::new();
        let mut seen = std::collections::BTreeSet::new();
        for t in &self.triangles {
            let [a, b, c] = t.map(|i| of_point[i as usize]);
            let turned = if a <= b && a <= c {
                [a, b, c]
            } else if b <= c {
                [b, c, a]
            } else {
                [c, a, b]
            };
            if a != b && b != c && c != a && seen.insert(turned) {
                triangles.push(turned);
            }
        }
        Surface {
            points: points.iter().map(|(sum, n)| *sum / *n).collect(),
            triangles,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_the_shape() {
        let (points, triangles) = Shape::sphere(1.0, 100).surface_mesh();
        let thin = Surface { points, triangles }.thinned(0.2);
        assert!(
            (200..2500).contains(&thin.triangles.len()),
            "{}",
            thin.triangles.len()
        );
        let volume: f64 = thin
            .triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|i| thin.points[i as usize]);
                a.dot(b.cross(c)) / 6.0
            })
            .sum();
        assert!(
            (volume / (4.0 / 3.0 * std::f64::consts::PI) - 1.0).abs() < 0.05,
            "{volume}"
        );
    }
}

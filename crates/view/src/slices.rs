//! Slices of the fields: 8 bits per value, thinned in space and time.

use grainwake_formats::vti::{Array, Image};
use grainwake_report::run_folder::{FrameFile, RunFolder};
use serde::Serialize;

use crate::frame_cache::{Frame, FrameCache, FrameKey, Stamp};
use crate::packed::Packed;

/// Names of the fields of a frame, in the order of their bytes.
const FIELDS: [&str; 7] = ["speed", "u", "v", "w", "vorticity", "pressure", "solid"];

/// Slices along one plane, in order of time.
#[derive(Clone, Debug, Serialize)]
pub struct Series {
    /// Name of the plane, `y-grain0`.
    pub name: String,
    /// Axis normal to the plane: 0, 1, 2 for x, y, z.
    pub axis: usize,
    /// Names of the fields.
    pub fields: [&'static str; 7],
    /// Frames.
    pub frames: Vec<Frame>,
    /// Every n-th frame is kept.
    pub stride: usize,
    /// Cells of the run along an edge of a cell of the frames.
    pub coarsening: usize,
}

/// Limits of the slices of a run.
#[derive(Clone, Copy, Debug)]
pub struct SliceLimits {
    /// Cells of one frame; larger frames are coarsened.
    pub cells: usize,
    /// Cells of all frames; further frames are thinned.
    pub total: usize,
}

/// A plane with its files.
struct Plane<'a> {
    name: String,
    files: Vec<&'a FrameFile>,
    /// Axis of the middle layer of full fields; `None` for slices.
    middle: Option<usize>,
}

/// Encodes the slices of a run or, without slices, the middle layers of its full fields.
pub fn series(
    run: &RunFolder,
    limits: SliceLimits,
    cache: &mut FrameCache,
    notes: &mut Vec<String>,
) -> Vec<Series> {
    let planes = planes(run);
    let count = planes.len().max(1);
    cache.begin();
    let encoded =
        planes.iter().filter_map(|plane| encode(run, plane, count, limits, cache, notes)).collect();
    cache.end(&run.path);
    encoded
}

fn planes(run: &RunFolder) -> Vec<Plane<'_>> {
    let mut planes: Vec<Plane> = Vec::new();
    for file in &run.slices {
        let stem = file.file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let name = stem.rsplit_once('_').map_or(stem.as_str(), |(name, _)| name).to_owned();
        match planes.iter_mut().find(|plane| plane.name == name) {
            Some(plane) => plane.files.push(file),
            None => planes.push(Plane { name, files: vec![file], middle: None }),
        }
    }
    planes.sort_by(|a, b| a.name.cmp(&b.name));
    if planes.is_empty() && !run.fields.is_empty() {
        let layer = |axis: usize| Plane {
            name: format!("{}-middle", ["x", "y", "z"][axis]),
            files: run.fields.iter().collect(),
            middle: Some(axis),
        };
        // The vertical plane along x first, as the default of slices.
        planes.extend([1, 0, 2].map(layer));
    }
    planes
}

fn encode(
    run: &RunFolder,
    plane: &Plane,
    planes: usize,
    limits: SliceLimits,
    cache: &mut FrameCache,
    notes: &mut Vec<String>,
) -> Option<Series> {
    let mut axis = plane.middle;
    let (mut coarsening, mut stride) = (None, 1);
    let mut frames = Vec::new();
    let mut next = 0;
    let last = plane.files.len() - 1;
    for (index, file) in plane.files.iter().enumerate() {
        if index < next && index != last {
            continue;
        }
        let key = |n| FrameKey { file: file.file.clone(), middle: plane.middle, coarsening: n };
        let stamp = Stamp::of(&file.file);
        let frame = coarsening.and_then(|n| cache.get(&key(n), stamp));
        let frame = match frame.zip(axis) {
            Some((frame, _)) => frame,
            None => {
                let image = match run.slice(file) {
                    Ok(image) => image,
                    Err(what) => {
                        let name = run.short_name(&file.file);
                        notes.push(format!("{name} was left out: {what}"));
                        continue;
                    }
                };
                let normal = axis.unwrap_or_else(|| flat_axis(&image));
                axis = Some(normal);
                let layer = Layer::of(&image, normal);
                let n = *coarsening.get_or_insert_with(|| {
                    let cells = layer.cells[0] * layer.cells[1];
                    let n = (1..).find(|n| cells / (n * n) <= limits.cells).unwrap_or(1);
                    let total = cells / (n * n) * planes * plane.files.len();
                    stride = total.div_ceil(limits.total.max(1)).max(1);
                    n
                });
                let frame = layer.coarsened(n).encode(file.time);
                cache.insert(key(n), stamp, frame.clone());
                frame
            }
        };
        next = index + stride;
        frames.push(frame);
    }
    let axis = axis.filter(|_| !frames.is_empty())?;
    let coarsening = coarsening.unwrap_or(1);
    Some(Series { name: plane.name.clone(), axis, fields: FIELDS, frames, stride, coarsening })
}

/// Returns the axis along which the image has the fewest cells.
fn flat_axis(image: &Image) -> usize {
    (0..3).min_by_key(|axis| image.frame.cells[*axis]).unwrap_or(1)
}

/// Fields of one layer of cells.
struct Layer {
    cells: [usize; 2],
    corner: [f64; 3],
    spacing: [f64; 2],
    fields: [Option<Vec<f32>>; 7],
}

impl Layer {
    /// Extracts the middle layer normal to `axis`.
    fn of(image: &Image, axis: usize) -> Layer {
        let frame = &image.frame;
        let count = frame.cells;
        let [a, b] = plane_axes(axis);
        let middle = count[axis] / 2;
        let mut corner = frame.origin.to_array();
        corner[axis] += (middle as f64 + 0.5) * frame.spacing[axis];
        let index = |i: usize, j: usize| {
            let mut cell = [middle; 3];
            (cell[a], cell[b]) = (i, j);
            (cell[2] * count[1] + cell[1]) * count[0] + cell[0]
        };
        let cells: Vec<usize> = (0..count[b])
            .flat_map(|j| (0..count[a]).map(move |i| (i, j)))
            .map(|(i, j)| index(i, j))
            .collect();
        let array = |name: &str| image.arrays.iter().find(|array| array.name == name);
        let component = |array: &Array, c: usize| -> Option<Vec<f32>> {
            let n = array.components;
            (c < n).then(|| cells.iter().map(|cell| array.data[cell * n + c]).collect())
        };
        let velocity = |c: usize| component(array("velocity")?, c);
        let [u, v, w] = [0, 1, 2].map(velocity);
        let speed = u.as_ref().zip(v.as_ref()).zip(w.as_ref()).map(|((u, v), w)| {
            let size = |(i, u): (usize, &f32)| (u * u + v[i] * v[i] + w[i] * w[i]).sqrt();
            u.iter().enumerate().map(size).collect()
        });
        let scalar = |name: &str| component(array(name)?, 0);
        let vorticity = array("vorticity").and_then(|array| component(array, axis));
        let fields = [speed, u, v, w, vorticity, scalar("pressure"), scalar("solid_fraction")];
        let spacing = [frame.spacing[a], frame.spacing[b]];
        Layer { cells: [count[a], count[b]], corner, spacing, fields }
    }

    /// Averages squares of n x n cells; incomplete squares at the upper ends average what is there.
    fn coarsened(self, n: usize) -> Layer {
        if n == 1 {
            return self;
        }
        let [width, height] = self.cells;
        let cells = [width.div_ceil(n), height.div_ceil(n)];
        let average = |field: Vec<f32>| {
            let mut out = Vec::with_capacity(cells[0] * cells[1]);
            for j in 0..cells[1] {
                for i in 0..cells[0] {
                    let columns = i * n..((i + 1) * n).min(width);
                    let rows = j * n..((j + 1) * n).min(height);
                    let count = (columns.len() * rows.len()) as f32;
                    let sum: f32 =
                        rows.map(|r| field[r * width..][columns.clone()].iter().sum::<f32>()).sum();
                    out.push(sum / count);
                }
            }
            out
        };
        let fields = self.fields.map(|field| field.map(average));
        Layer { cells, spacing: self.spacing.map(|h| h * n as f64), fields, ..self }
    }

    fn encode(&self, time: f64) -> Frame {
        let mut codes = Vec::with_capacity(7 * self.cells[0] * self.cells[1]);
        let ranges = std::array::from_fn(|f| match &self.fields[f] {
            Some(values) => quantise(values, &mut codes),
            None => {
                codes.resize(codes.len() + self.cells[0] * self.cells[1], 0);
                [0.0, 0.0]
            }
        });
        let Layer { cells, corner, spacing, .. } = *self;
        Frame { time, cells, corner, spacing, ranges, codes: Packed::bytes(&codes) }
    }
}

/// Returns the two axes of a plane, in the order x, y, z.
fn plane_axes(normal: usize) -> [usize; 2] {
    [[1, 2], [0, 2], [0, 1]][normal]
}

/// Appends the codes of values; returns the values of the codes 0 and 255.
fn quantise(values: &[f32], codes: &mut Vec<u8>) -> [f64; 2] {
    let finite = || values.iter().copied().filter(|v| v.is_finite());
    let low = f64::from(finite().fold(f32::INFINITY, f32::min));
    let high = f64::from(finite().fold(f32::NEG_INFINITY, f32::max));
    if low > high {
        codes.resize(codes.len() + values.len(), 0);
        return [0.0, 0.0];
    }
    let factor = if high > low { 255.0 / (high - low) } else { 0.0 };
    // The conversion of NaN is 0.
    codes.extend(values.iter().map(|v| ((f64::from(*v) - low) * factor).round() as u8));
    [low, high]
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use grainwake_formats::vti;

    use super::*;
    use crate::packed::tests::inflated;

    fn image() -> Image {
        let cells = [4, 1, 2];
        let data = (0..8).flat_map(|i| [i as f32, 0.0, 0.0]).collect();
        Image {
            frame: vti::Frame {
                cells,
                spacing: DVec3::new(0.1, 0.2, 0.3),
                origin: DVec3::new(1.0, 2.0, 3.0),
                time: 0.5,
            },
            arrays: vec![Array { name: "velocity".into(), components: 3, data }],
        }
    }

    #[test]
    fn a_layer_keeps_its_place_and_its_values() {
        let image = image();
        let layer = Layer::of(&image, flat_axis(&image));
        assert_eq!((layer.cells, layer.corner), ([4, 2], [1.0, 2.1, 3.0]));
        let frame = layer.encode(0.5);
        assert_eq!(frame.ranges[0], [0.0, 7.0]);
        let codes = inflated(&frame.codes);
        let codes: Vec<u8> = codes
            .iter()
            .scan(0u8, |sum, d| {
                *sum = sum.wrapping_add(*d);
                Some(*sum)
            })
            .collect();
        let expected: Vec<u8> =
            (0..8).map(|i| (255.0 * f64::from(i) / 7.0).round() as u8).collect();
        assert_eq!(codes[..8], expected);
        assert_eq!(codes[8..16], expected, "the component u");
        assert_eq!(codes.len(), 7 * 8);
    }

    #[test]
    fn coarse_cells_are_averages() {
        let image = image();
        let layer = Layer::of(&image, 1).coarsened(2);
        assert_eq!((layer.cells, layer.spacing), ([2, 1], [0.2, 0.6]));
        assert_eq!(layer.fields[1].as_deref(), Some(&[2.5, 4.5][..]));
    }
}

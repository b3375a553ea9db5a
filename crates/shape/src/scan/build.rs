//! Shapes from a volume.

use super::regions::{Region, crop, fill_cavities, labels_of, pieces, regions};
use super::{Mask, Volume, smooth, transform};
use crate::Shape;
use crate::assemble::ShapeOptions;
use crate::error::{Result, ShapeError, positive};
use crate::limits::SourceFile;
use crate::mesh::{TriangleMesh, from_closed};
use crate::provenance::Provenance;
use crate::surface::{Samples, extract};
use glam::DVec3;

/// How a volume is turned into shapes.
#[derive(Clone, Debug, PartialEq)]
pub struct ScanOptions {
    /// Edge of a voxel [m].
    pub voxel: f64,
    /// The one label wanted; none for every label.
    pub label: Option<u32>,
    /// Grey value from which a voxel is solid; needed for grey images.
    pub threshold: Option<f64>,
    /// Number the connected pieces of all solid voxels and take each as a grain.
    pub split: bool,
    /// Take grains that touch the image border too, as cut there: for tight crops.
    pub pad: bool,
    /// Of a label with several pieces, keep the largest.
    pub largest_piece: bool,
    /// Standard deviation of the smoothing [voxels].
    pub smoothing: f64,
    /// Resolution, nodes and bounds.
    pub shape: ShapeOptions,
}

impl ScanOptions {
    /// Defaults with this edge of a voxel [m].
    pub fn new(voxel: f64) -> ScanOptions {
        ScanOptions {
            voxel,
            label: None,
            threshold: None,
            split: false,
            pad: false,
            largest_piece: false,
            smoothing: 1.5,
            shape: ShapeOptions::default(),
        }
    }
}

/// What became of one label.
#[derive(Debug)]
pub struct ScannedGrain {
    /// Label in the image (after splitting: number of the piece).
    pub label: u32,
    /// Its voxels.
    pub voxels: u64,
    /// The shape, or why there is none.
    pub shape: Result<Shape>,
}

const UNTHRESHOLDED: ShapeError = ShapeError::BadParameter {
    name: "threshold",
    value: f64::NAN,
    reason: "must be given: the image has grey values, not labels",
};
/// Fewest voxels of a grain: a ball of five voxels across.
const FEWEST: u64 = 64;
/// Cells across a grain below which the smoothed field is refined before its surface is taken.
const FINE: usize = 64;
/// Share of the surface that pieces broken off by smoothing may have.
const CRUMBS: f64 = 0.02;

/// Shapes of the grains in a volume, in the order of their labels. Errors that concern the
/// volume as a whole are returned at once, those of one grain with that grain.
pub fn shapes_from_volume(
    volume: &Volume,
    source: &SourceFile,
    options: &ScanOptions,
) -> Result<Vec<ScannedGrain>> {
    positive("voxel size", options.voxel)?;
    if !(0.5..=5.0).contains(&options.smoothing) {
        let value = options.smoothing;
        let reason = "must lie between 0.5 and 5 voxels";
        return Err(ShapeError::BadParameter {
            name: "smoothing",
            value,
            reason,
        });
    }
    if let Some(value) = options.threshold.filter(|t| !t.is_finite()) {
        let reason = "must be finite";
        return Err(ShapeError::BadParameter {
            name: "threshold",
            value,
            reason,
        });
    }
    let labels = labels_of(volume, options.threshold, options.split).ok_or(UNTHRESHOLDED)?;
    let dims = volume.dims;
    let found = regions(dims, &labels);
    if found.is_empty() {
        return Err(ShapeError::EmptyVolume);
    }
    if found.len() == 1 && found.values().all(|r| r.voxels == labels.len() as u64) {
        return Err(ShapeError::SolidVolume);
    }
    let grain = |label: u32, region: &Region| ScannedGrain {
        label,
        voxels: region.voxels,
        shape: one(dims, &labels, label, region, source, options),
    };
    match options.label {
        None => Ok(found
            .iter()
            .map(|(label, region)| grain(*label, region))
            .collect()),
        Some(label) => match found.get(&label) {
            Some(region) => Ok(vec![grain(label, region)]),
            None => {
                let shown: Vec<String> = found.keys().take(10).map(u32::to_string).collect();
                let more = if found.len() > 10 { ", ..." } else { "" };
                let present = format!("{}{more}", shown.join(", "));
                Err(ShapeError::NoSuchLabel { label, present })
            }
        },
    }
}

fn one(
    dims: [usize; 3],
    labels: &[u32],
    label: u32,
    region: &Region,
    source: &SourceFile,
    options: &ScanOptions,
) -> Result<Shape> {
    let faces = region.faces(dims);
    if !faces.is_empty() && !options.pad {
        return Err(ShapeError::CutByBorder { label, faces });
    }
    let margin = (4.0 * options.smoothing).ceil() as usize + 3;
    let mut mask = crop(dims, labels, label, region, margin);
    let voxels = one_piece(&mut mask, label, options.largest_piece)?;
    if voxels < FEWEST {
        return Err(ShapeError::TooFewVoxels {
            label,
            voxels,
            needed: FEWEST,
        });
    }
    let filled = fill_cavities(&mut mask);
    let longest = (0..3)
        .map(|a| region.upper[a] - region.lower[a] + 1)
        .max()
        .unwrap_or(1);
    let factor = FINE.div_ceil(longest).clamp(1, 4);
    let volume = (voxels + filled) as f64;
    let mut mesh = surface(&mask, volume, options.smoothing, factor)?;
    // Voxel i spans i to i + 1 edges from the image's corner, its centre is at i + 1/2.
    let shift = DVec3::from_array(region.lower.map(|low| low as f64 - margin as f64 + 0.5));
    for v in &mut mesh.vertices {
        *v = options.voxel * (*v + shift);
    }
    let mut provenance = Provenance::new("scan")
        .with("voxel_m", options.voxel)
        .with("label", label)
        .with("voxels", voxels)
        .with("cavity_voxels_filled", filled)
        .with("smoothing_voxels", options.smoothing)
        .with("split", options.split)
        .with("pad", options.pad);
    if let Some(threshold) = options.threshold {
        provenance = provenance.with("threshold", threshold);
    }
    provenance.source.clone_from(&source.name);
    provenance.source_sha256.clone_from(&source.sha256);
    from_closed(&mesh, provenance, &options.shape)
}

/// Refuses, or on request drops, all but the largest piece; returns the voxels kept.
fn one_piece(mask: &mut Mask, label: u32, largest: bool) -> Result<u64> {
    let (number, sizes) = pieces(mask.dims, |n| mask.solid[n]);
    let mut order: Vec<usize> = (0..sizes.len()).collect();
    order.sort_by_key(|n| std::cmp::Reverse(sizes[*n]));
    if sizes.len() > 1 && !largest {
        let shown: Vec<String> = order
            .iter()
            .take(5)
            .map(|n| sizes[*n].to_string())
            .collect();
        let more = if sizes.len() > 5 { ", ..." } else { "" };
        let sizes = format!("{}{more}", shown.join(", "));
        return Err(ShapeError::SeveralPieces {
            label,
            count: order.len(),
            sizes,
        });
    }
    let kept = order[0];
    for (solid, number) in mask.solid.iter_mut().zip(number) {
        *solid = number == kept as u32 + 1;
    }
    Ok(sizes[kept])
}

/// Closed smooth surface of a mask in voxel units (voxel centres at whole numbers), enclosing
/// `volume` voxels: the smoothed signed distance at the level that gives that volume, taken on
/// a grid `factor` times as fine.
fn surface(mask: &Mask, volume: f64, sigma: f64, factor: usize) -> Result<TriangleMesh> {
    let distance = smooth::unshrinking(&transform::signed(mask), mask.dims, sigma);
    let (mut fine, dims) = smooth::refine(&distance, mask.dims, factor);
    let spacing = 1.0 / factor as f64;
    let mut mesh = TriangleMesh::default();
    // Newton's method: the volume changes by the area for every unit of level.
    for _ in 0..5 {
        let samples = Samples {
            dims,
            lower: DVec3::ZERO,
            spacing,
            values: &fine,
        };
        mesh = extract(&samples)
            .largest_piece(CRUMBS)
            .ok_or_else(|| ShapeError::Quality {
                reason: "smoothing leaves no single surface (a neck of a voxel or two breaks); \
                     reduce the smoothing"
                    .into(),
            })?;
        let missing = (volume - mesh.signed_volume()) / mesh.area();
        if missing.abs() < 1e-5 {
            break;
        }
        for value in &mut fine {
            *value -= missing as f32;
        }
    }
    Ok(mesh)
}

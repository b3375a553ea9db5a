//! The shape of one grain of a volume.

use super::cure::Cure;
use super::regions::{Region, crop, cuts};
use super::segments::Segments;
use super::threshold::median;
use super::{Mask, ScanOptions, smooth, transform};
use crate::assemble::DEFAULT_CELLS;
use crate::error::{Defect, Result, ShapeError, first_few};
use crate::filter::refine;
use crate::grid::{coordinates, index, place};
use crate::limits::SourceFile;
use crate::mesh::{TriangleMesh, from_closed};
use crate::provenance::Provenance;
use crate::roundness::Surface;
use crate::runs::{fill_cavities, pieces};
use crate::surface::{Samples, extract};
use crate::{Shape, specks};
use glam::DVec3;

/// Parameters of the provenance with the number of solid voxels and of those of filled cavities.
pub(super) const VOXELS: &str = "voxels";
pub(super) const CAVITIES: &str = "cavity_voxels_filled";
/// Minimum number of voxels of a grain: a ball of diameter 5 voxels.
const FEWEST: u64 = 64;
/// Number of cells across a grain below which the smoothed field is refined before surface
/// extraction, for grey values and for a mask.
const FINE: [usize; 2] = [40, 64];
/// Default cells of the final field per voxel across a grain, and their minimum number.
const CELLS: (f64, usize) = (1.25, 24);
/// Smoothing for grey values and for a mask [voxels].
const SMOOTHING: [f64; 2] = [1.1, 1.5];

/// The segmented volume.
pub(super) struct Context<'a> {
    pub dims: [usize; 3],
    pub segments: &'a Segments,
    pub source: &'a SourceFile,
    pub options: &'a ScanOptions,
}

impl Context<'_> {
    /// Returns the smoothing of the image [voxels].
    pub fn smoothing(&self) -> f64 {
        let default = SMOOTHING[usize::from(self.segments.grey.is_none())];
        self.options.smoothing.unwrap_or(default)
    }
}

/// Builds the shape of the grain `label`, which lies in `region`, with the options of the image as
/// changed by `cure`.
pub(super) fn shape(context: &Context, label: u32, region: &Region, cure: Cure) -> Result<Shape> {
    let Context { dims, segments, source, options } = *context;
    let labels = &segments.labels;
    let faces = region.faces(dims);
    if !faces.is_empty() && !options.pad {
        return Err(ShapeError::CutByBorder { label, faces });
    }
    if segments.cut_by_view.contains(&label) && !options.pad {
        return Err(ShapeError::CutByView { label });
    }
    let smoothing = cure.smoothing.unwrap_or_else(|| context.smoothing());
    let margin = (4.0 * smoothing).ceil() as usize + 4;
    let mut mask = crop(dims, labels, label, region, margin);
    let low = region.lower.map(|n| n as isize - margin as isize);
    if cure.median {
        filter(&mut mask, context, low, label);
    }
    let largest = options.largest_piece || options.separate.is_some() || cure.largest_piece;
    let (voxels, dropped) = one_piece(&mut mask, label, largest)?;
    if voxels < FEWEST {
        return Err(ShapeError::TooFewVoxels { label, voxels, needed: FEWEST });
    }
    let solid = Mask { dims: mask.dims, solid: mask.solid.clone() };
    let filled = fill_cavities(mask.dims, &mut mask.solid);
    let earlier = segments.filled.get(&label).copied().unwrap_or(0);
    let longest = (0..3).map(|a| region.upper[a] - region.lower[a] + 1).max().unwrap_or(1);
    let factor = FINE[usize::from(segments.grey.is_none())].div_ceil(longest).clamp(1, 4);
    let mut provenance = Provenance::new("scan")
        .with("voxel_m", options.voxel)
        .with("label", label)
        .with(VOXELS, voxels.saturating_sub(earlier))
        .with(CAVITIES, filled + earlier)
        .with("smoothing_voxels", smoothing)
        .with("split", options.split)
        .with("pad", options.pad);
    if cure != Cure::default() {
        provenance = provenance.with("rescued", cure);
    }
    if dropped > 0 {
        let share = dropped as f64 / voxels as f64;
        provenance = provenance.with(&format!("mask_{}", specks::REMOVED), share);
    }
    if let Some(threshold) = segments.threshold {
        provenance = provenance.with("threshold", threshold);
    }
    if let Some(neck) = options.separate {
        provenance = provenance.with("separate", neck);
    }
    let (field, volume, image) = match &segments.grey {
        Some(grey) => {
            let cut = grey.cut(&mask, &solid, low, label, smoothing);
            for (assumed, grey) in cut.assumed {
                provenance = provenance.with(assumed.parameter(), format!("{grey:.6}"));
            }
            provenance =
                provenance.with("surface", "grey").with("blur_voxels", format!("{:.3}", cut.blur));
            (cut.field, cut.volume, cut.kernel)
        }
        None => {
            let distance = transform::signed(&mask);
            let field = smooth::unshrinking(&distance, mask.dims, smoothing);
            let kernel = smooth::kernel(smoothing);
            (field, (voxels + filled) as f64, kernel)
        }
    };
    let (mut mesh, crumbs) = surface(&field, mask.dims, volume, factor)?;
    if crumbs > 0.0 {
        provenance = provenance.with(&format!("surface_{}", specks::REMOVED), crumbs);
    }
    // Voxel i extends from i to i + 1 edge lengths from the image corner; its centre is at i + 1/2.
    let shift = DVec3::from_array(region.lower.map(|low| low as f64 - margin as f64 + 0.5));
    for v in &mut mesh.vertices {
        *v = options.voxel * (*v + shift);
    }
    provenance.source.clone_from(&source.name);
    provenance.source_sha256.clone_from(&source.sha256);
    let mut finish = options.shape.clone();
    let enough = ((CELLS.0 * longest as f64).ceil() as usize).max(CELLS.1);
    finish.cells.get_or_insert(enough.min(DEFAULT_CELLS));
    let places = cuts(dims, labels, label, region);
    let surface = Surface::Scanned {
        image: image.map(|(weight, deviation)| (weight, options.voxel * deviation)),
        cuts: places.into_iter().map(|x| options.voxel * x).collect(),
    };
    from_closed(&mesh, surface, provenance, &finish)
}

/// Applies a median of 27 voxels to the mask of a label, which gains no voxel of another label.
fn filter(mask: &mut Mask, context: &Context, low: [isize; 3], label: u32) {
    let values: Vec<f32> = mask.solid.iter().map(|s| f32::from(u8::from(*s))).collect();
    let filtered = median(&values, mask.dims);
    for (n, (solid, value)) in mask.solid.iter_mut().zip(filtered).enumerate() {
        let at = place(mask.dims, n);
        let at: [usize; 3] =
            std::array::from_fn(|a| low[a].saturating_add_unsigned(at[a]) as usize);
        let free = || {
            let inside = (0..3).all(|a| at[a] < context.dims[a]);
            let own = |other: u32| other == 0 || other == label;
            inside && own(context.segments.labels[index(context.dims, at)])
        };
        *solid = value > 0.5 && free();
    }
}

/// Drops specks, on request all pieces but the largest, and refuses larger pieces; returns the
/// numbers of voxels kept and dropped.
fn one_piece(mask: &mut Mask, label: u32, largest: bool) -> Result<(u64, u64)> {
    let (number, sizes) = pieces(mask.dims, |n| mask.solid[n]);
    let mut order: Vec<usize> = (0..sizes.len()).collect();
    order.sort_by_key(|n| std::cmp::Reverse(sizes[*n]));
    let Some(&kept) = order.first() else {
        return Err(ShapeError::TooFewVoxels { label, voxels: 0, needed: FEWEST });
    };
    let dropped = sizes.iter().sum::<u64>() - sizes[kept];
    if dropped as f64 > specks::LIMIT * sizes[kept] as f64 && !largest {
        return Err(ShapeError::SeveralPieces {
            label,
            count: order.len(),
            sizes: first_few(order.iter().map(|n| sizes[*n]), 5),
        });
    }
    for (solid, number) in mask.solid.iter_mut().zip(number) {
        *solid = number == kept as u32 + 1;
    }
    Ok((sizes[kept], dropped))
}

/// Extracts a closed smooth surface in voxel units (voxel centres at integers) that encloses
/// `volume` voxels. The field approximates the signed distance; its level is set to give that
/// volume, on a grid refined by `factor`. Also returns the relative volume of dropped pieces.
fn surface(
    field: &[f32],
    dims: [usize; 3],
    volume: f64,
    factor: usize,
) -> Result<(TriangleMesh, f64)> {
    let (field, dims, lower) = near_surface(field, dims);
    let (mut fine, dims) = refine(&field, dims, factor);
    let spacing = 1.0 / factor as f64;
    let (mut mesh, mut crumbs) = (TriangleMesh::default(), 0.0);
    // Newton's method: the derivative of the volume with respect to the level is the area.
    for _ in 0..5 {
        let samples = Samples { dims, lower, spacing, values: &fine };
        let largest = extract(&samples).largest_piece();
        (mesh, crumbs) = largest.filter(|(_, rest)| *rest <= specks::LIMIT).ok_or_else(|| {
            let reason = "the smoothed surface falls into pieces; smooth more if noise causes \
                          them, and less if a neck of a voxel or two breaks";
            ShapeError::quality(Defect::Broken, reason)
        })?;
        let missing = (volume - mesh.signed_volume()) / mesh.area();
        if missing.abs() < 1e-4 {
            break;
        }
        for value in &mut fine {
            *value -= missing as f32;
        }
    }
    Ok((mesh, crumbs))
}

/// Margin [samples] of the extraction box around the interior of the field; exceeds the range of
/// the level and of the interpolation.
const AROUND: usize = 4;

/// Returns the part of a field around the body, its dimensions, and its origin.
fn near_surface(field: &[f32], dims: [usize; 3]) -> (Vec<f32>, [usize; 3], DVec3) {
    let (mut low, mut high) = (dims, [0; 3]);
    for (n, _) in field.iter().enumerate().filter(|(_, value)| **value < 0.0) {
        for (axis, i) in place(dims, n).into_iter().enumerate() {
            low[axis] = low[axis].min(i);
            high[axis] = high[axis].max(i);
        }
    }
    if (0..3).any(|axis| low[axis] > high[axis]) {
        return (field.to_vec(), dims, DVec3::ZERO);
    }
    let low = low.map(|n| n.saturating_sub(AROUND));
    let high: [usize; 3] = std::array::from_fn(|a| (high[a] + AROUND + 1).min(dims[a]));
    let size: [usize; 3] = std::array::from_fn(|axis| high[axis] - low[axis]);
    let mut part = Vec::with_capacity(size.iter().product());
    for k in low[2]..high[2] {
        for j in low[1]..high[1] {
            let row = index(dims, [0, j, k]);
            part.extend_from_slice(&field[row + low[0]..row + high[0]]);
        }
    }
    (part, size, coordinates(low))
}

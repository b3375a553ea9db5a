//! Rejected labels of an image: list of the reasons, and advice on the options.

use grainwake_shape::ShapeError;
use grainwake_shape::scan::{Volume, Voxels};

use crate::args::FromScanArgs;
use crate::exit::shape_help;

/// Maximum number of labels with the same reason that are listed on separate lines.
const FEW: usize = 3;
/// Maximum number of labels named on a common line.
const NAMED: usize = 12;
/// Minimum number of rejected labels that indicates a grey image.
const VALUES: usize = 16;
/// Fraction of differing neighbours that indicates a grey image; labels of grains have less.
const DIFFERENT: f64 = 1.0 / 3.0;

/// A rejected label.
pub struct Refused {
    pub label: u32,
    pub voxels: u64,
    pub why: ShapeError,
}

/// Lists the rejected labels with the reason, grouped if more than [`FEW`] share it.
pub fn lines(refused: &[Refused]) -> Vec<String> {
    let mut groups: Vec<(String, Vec<&Refused>)> = Vec::new();
    for one in refused {
        let reason = reason(&one.why);
        match groups.iter_mut().find(|(other, _)| *other == reason) {
            Some((_, group)) => group.push(one),
            None => groups.push((reason, vec![one])),
        }
    }
    let lines = groups.iter().flat_map(|(reason, group)| {
        if group.len() > FEW {
            return vec![together(reason, group)];
        }
        let alone =
            |r: &&Refused| format!("label {} ({} voxels) rejected: {}", r.label, r.voxels, r.why);
        group.iter().map(alone).collect()
    });
    lines.collect()
}

fn together(reason: &str, group: &[&Refused]) -> String {
    let named = group.iter().take(NAMED).map(|r| r.label.to_string());
    let more = if group.len() > NAMED { ", ..." } else { "" };
    format!(
        "{} labels rejected, {reason}: {}{more}",
        group.len(),
        named.collect::<Vec<_>>().join(", ")
    )
}

/// Returns the reason without the data of the single label.
fn reason(why: &ShapeError) -> String {
    match why {
        ShapeError::CutByBorder { .. } => "cut by the image border".into(),
        ShapeError::CutByView { .. } => "cut by the edge of the field of view".into(),
        ShapeError::SeveralPieces { .. } => "each of several separate pieces".into(),
        ShapeError::TooFewVoxels { needed, .. } => format!("each of fewer than {needed} voxels"),
        other => other.to_string(),
    }
}

/// Returns advice on the options if most labels were rejected and the cause is evident.
pub fn advice(
    refused: &[Refused],
    written: usize,
    labels: &Volume,
    args: &FromScanArgs,
) -> Option<String> {
    if refused.len() <= written {
        return None;
    }
    let as_labels = args.threshold.is_none() && !args.split && args.separate.is_none();
    if as_labels && refused.len() > VALUES && many_neighbours_differ(labels) {
        return Some("this looks like a grey image: add --threshold otsu".into());
    }
    // A label with most of the solid voxels may be a whole phase.
    let largest = refused.iter().max_by_key(|r| r.voxels)?;
    let all: u64 = refused.iter().map(|r| r.voxels).sum();
    let most = 2 * largest.voxels > all;
    most.then(|| shape_help(&largest.why)).flatten()
}

fn many_neighbours_differ(labels: &Volume) -> bool {
    let Voxels::Labels(values) = &labels.voxels else {
        return false;
    };
    let (mut solid, mut different) = (0_u64, 0_u64);
    for row in values.chunks_exact(labels.dims[0]) {
        for pair in row.windows(2).filter(|pair| !pair.contains(&0)) {
            solid += 1;
            different += u64::from(pair[0] != pair[1]);
        }
    }
    different as f64 > DIFFERENT * solid as f64
}

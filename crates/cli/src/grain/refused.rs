//! Labels of an image that gave no grain: told by reason, and what the image itself looks like.

use grainwake_shape::ShapeError;
use grainwake_shape::scan::{Volume, Voxels};

use crate::args::FromScanArgs;
use crate::exit::shape_help;

/// As many labels with the same reason have a line each; more share one.
const FEW: usize = 3;
/// As many labels are named in a line that they share.
const NAMED: usize = 12;
/// A grey image has more values than this.
const VALUES: usize = 16;
/// Share of neighbours that differ: grains of ten voxels across have less, grey values more.
const DIFFERENT: f64 = 1.0 / 3.0;

/// A label that gave no grain.
pub struct Refused {
    pub label: u32,
    pub voxels: u64,
    pub why: ShapeError,
}

/// Which labels were left out and why, in the order in which the reasons occur.
pub fn lines(refused: &[Refused]) -> Vec<String> {
    let mut groups: Vec<(String, Vec<&Refused>)> = Vec::new();
    for one in refused {
        let reason = reason(&one.why);
        match groups.iter_mut().find(|(known, _)| *known == reason) {
            Some((_, group)) => group.push(one),
            None => groups.push((reason, vec![one])),
        }
    }
    let lines = groups.iter().flat_map(|(reason, group)| {
        if group.len() > FEW {
            return vec![together(reason, group)];
        }
        let alone = |r: &&Refused| {
            format!(
                "label {} ({} voxels) left out: {}",
                r.label, r.voxels, r.why
            )
        };
        group.iter().map(alone).collect()
    });
    lines.collect()
}

fn together(reason: &str, group: &[&Refused]) -> String {
    let named = group.iter().take(NAMED).map(|r| r.label.to_string());
    let more = if group.len() > NAMED { ", ..." } else { "" };
    format!(
        "{} labels left out, {reason}: {}{more}",
        group.len(),
        named.collect::<Vec<_>>().join(", ")
    )
}

/// The reason without what belongs to one label alone.
fn reason(why: &ShapeError) -> String {
    match why {
        ShapeError::CutByBorder { .. } => "cut by the image border".into(),
        ShapeError::CutByView { .. } => "cut by the edge of the field of view".into(),
        ShapeError::SeveralPieces { .. } => "each of several separate pieces".into(),
        ShapeError::TooFewVoxels { needed, .. } => format!("each of fewer than {needed} voxels"),
        other => other.to_string(),
    }
}

/// What to do with an image that gave few grains or none, where it shows.
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
        return Some("this looks like a grey image: give --threshold otsu".into());
    }
    // One label that holds most of the solid may be a whole phase.
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

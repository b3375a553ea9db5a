//! Rejected labels of an image: one line per reason, and advice on the options.

use grainwake_shape::scan::{Refusal, ScannedGrain};

use crate::exit::shape_help;
use crate::progress::count;

/// Maximum number of labels named on a line.
const NAMED: usize = 12;

/// Lists labels, at most [`NAMED`].
pub fn named(labels: &[u32]) -> String {
    let shown: Vec<String> = labels.iter().take(NAMED).map(u32::to_string).collect();
    format!("{}{}", shown.join(", "), if labels.len() > NAMED { ", ..." } else { "" })
}

/// Returns one line per reason, followed by the result of the trials if there were any.
pub fn lines(refusals: &[Refusal], rescue: bool) -> Vec<String> {
    refusals
        .iter()
        .flat_map(|refusal| [Some(line(refusal)), trial(refusal, rescue)])
        .flatten()
        .collect()
}

/// Returns the reason with the labels and their sizes.
pub fn line(refusal: &Refusal) -> String {
    let [fewest, most] = refusal.voxels;
    let range = if fewest == most { String::new() } else { format!("{fewest} to ") };
    format!(
        "{} rejected, {}: {} ({range}{})",
        count(refusal.labels.len(), "label"),
        refusal.reason,
        named(&refusal.labels),
        count(most as usize, "voxel")
    )
}

/// Describes which options would accept how many labels of a group.
pub fn trial(refusal: &Refusal, rescue: bool) -> Option<String> {
    let advice = refusal.advice?;
    let (count, tried) = (refusal.labels.len(), advice.tried);
    let of = match (tried < count, count) {
        (true, _) => format!("the {tried} tried"),
        (false, 1) => "1".into(),
        (false, _) => format!("these {count}"),
    };
    let Some(cure) = advice.cure else {
        let none = "neither more smoothing nor a median accepts";
        return Some(format!("  {none} any of {of}; the image resolves them too poorly"));
    };
    let alone = if rescue || cure.largest_piece {
        ""
    } else {
        "; --rescue applies it to the rejected labels only"
    };
    Some(format!("  {cure} would accept {} of {of}{alone}", advice.accepted))
}

/// Returns advice on the options if most labels were rejected and the cause is evident.
pub fn advice(grains: &[ScannedGrain]) -> Option<String> {
    let refused: Vec<&ScannedGrain> = grains.iter().filter(|g| g.shape.is_err()).collect();
    if 2 * refused.len() <= grains.len() {
        return None;
    }
    // A label with most of the solid voxels may be a whole phase.
    let largest = refused.iter().max_by_key(|g| g.voxels)?;
    let all: u64 = refused.iter().map(|g| g.voxels).sum();
    let why = largest.shape.as_ref().err().filter(|_| 2 * largest.voxels > all)?;
    shape_help(why)
}

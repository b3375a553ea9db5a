//! Notes about the grains of a scan.

use super::ScannedGrain;
use super::assumed::Assumed;
use crate::error::first_few;

/// Maximum number of labels in a note.
const NAMED: usize = 12;

impl ScannedGrain {
    /// Returns the grey values that were not measured on this grain.
    pub fn assumed(&self) -> Vec<Assumed> {
        let parameters = self.shape.as_ref().map_or(&[][..], |s| &s.provenance().parameters);
        let has = |a: &Assumed| parameters.iter().any(|(name, _)| name == a.parameter());
        Assumed::ALL.into_iter().filter(has).collect()
    }
}

/// Returns one note for each kind of grey value that was not measured on some grains, with their
/// labels.
pub fn grey_notes(grains: &[ScannedGrain]) -> Vec<String> {
    let note = |assumed: Assumed| {
        let some = grains.iter().filter(|grain| grain.assumed().contains(&assumed));
        let labels: Vec<u32> = some.map(|grain| grain.label).collect();
        let count = match labels.len() {
            0 => return None,
            1 => "1 grain".to_owned(),
            n => format!("{n} grains"),
        };
        Some(format!("{}: label {}", assumed.note(&count), first_few(labels, NAMED)))
    };
    Assumed::ALL.into_iter().filter_map(note).collect()
}

//! Grey values that could not be measured on single grains, and the notes about them.

use super::ScannedGrain;
use crate::error::first_few;

/// Grey value for which too few voxels of a grain are free of blur.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Assumed {
    /// The void around the grain is assumed to have the mean grey of the void of the image.
    Void,
    /// The grey of the grain is that of its core, corrected for the blur that darkens it.
    Solid,
}

/// Maximum number of labels in a note.
const NAMED: usize = 12;

impl Assumed {
    const ALL: [Assumed; 2] = [Assumed::Void, Assumed::Solid];

    /// Returns the name of the parameter in the provenance that holds the grey value.
    pub(super) fn parameter(self) -> &'static str {
        match self {
            Assumed::Void => "assumed_void_grey",
            Assumed::Solid => "uncertain_grey",
        }
    }

    fn note(self, grains: &str) -> String {
        match self {
            Assumed::Void => format!(
                "the void has the mean grey value of the image for {grains} with too few voxels \
                 free of blur around; if the image has several phases beside the grains, volumes \
                 may be wrong by tens of percent"
            ),
            Assumed::Solid => format!(
                "the grey value of the solid is uncertain for {grains} with too few voxels free of \
                 blur (thin or small); volumes may be wrong by several percent, of plates of 3 \
                 voxels by 10 % and more"
            ),
        }
    }
}

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

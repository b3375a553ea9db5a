//! Grey values that could not be measured on single grains.

/// Grey value for which too few voxels of a grain are free of blur.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Assumed {
    /// The void around the grain is assumed to have the mean grey of the void of the image.
    Void,
    /// The grey of the grain is that of its core, corrected for the blur that darkens it.
    Solid,
}

impl Assumed {
    pub(super) const ALL: [Assumed; 2] = [Assumed::Void, Assumed::Solid];

    /// Returns the name of the parameter in the provenance that holds the grey value.
    pub(super) fn parameter(self) -> &'static str {
        match self {
            Assumed::Void => "assumed_void_grey",
            Assumed::Solid => "uncertain_grey",
        }
    }

    /// Returns the note about some `grains`.
    pub(super) fn note(self, grains: &str) -> String {
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

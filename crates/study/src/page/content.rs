//! Contents of the report page.

use grainwake_report::WrittenFigure;

use crate::analysis::correlation::Correlation;
use crate::analysis::kissing::KissingResults;
use crate::analysis::verdict::Finding;
use crate::measure::record::RunRecord;
use crate::plan::Plan;

/// Contents of the page.
pub(crate) struct Content<'a> {
    pub plan: &'a Plan,
    pub records: &'a [RunRecord],
    pub findings: &'a [Finding],
    pub correlations: &'a [Correlation],
    pub kissing: Option<&'a KissingResults>,
    pub figures: &'a [WrittenFigure],
    pub notes: &'a [String],
}

impl Content<'_> {
    /// Returns whether any run has measured values of settling grains.
    pub fn has_settling(&self) -> bool {
        self.records.iter().any(|r| r.settling.is_some())
    }

    /// Returns whether any finished run is a pair, or no run has finished.
    pub fn has_pairs(&self) -> bool {
        !self.has_settling() || self.records.iter().any(|r| r.pair.is_some())
    }

    /// Returns whether every model was run only once.
    pub fn without_ensemble(&self) -> bool {
        self.records.iter().all(|r| r.member == 0)
    }
}

/// Returns a paragraph with a heading in bold.
pub(super) fn paragraph(heading: &str, text: &maud::Markup) -> maud::Markup {
    maud::html! { p { b { (heading) } ": " (text) } }
}

//! Failure of a step: its symptom, its likely cause, and a remedy.

use std::fmt;

use super::Simulation;
use crate::dem::{ContactLawKind, Outside, Partner, RelativeOverlap, Side, outside};

/// Overlap for which a stiffness is suggested [smaller equivalent diameters].
const SUGGESTED_OVERLAP: f64 = 0.01;

/// Remedy of a failed run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Remedy {
    /// A smaller time step or a softer contact.
    StepOrContact,
    /// A smaller time step or a finer grid.
    StepOrGrid,
    /// A finer grid or a smaller time step; the last slices may show the cause.
    GridOrStepOrSlices,
    /// An open face farther away, or an end of the run before a grain reaches it.
    FartherFace,
    /// A run without a refined box.
    Unrefined,
    /// A stiffer contact, at which the overlap would be 1 % of the smaller diameter.
    StifferContact {
        /// Force law.
        law: ContactLawKind,
        /// Suggested over present stiffness, or Young's modulus.
        factor: f64,
        /// Suggested stiffness [N/m] or Young's modulus [Pa].
        value: f64,
    },
}

/// Names of the means of a remedy, as the user of a program knows them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RemedyTerms {
    /// "a smaller time step".
    pub smaller_step: &'static str,
    /// "a normal stiffness".
    pub stiffness: &'static str,
    /// "a Young's modulus".
    pub youngs_modulus: &'static str,
}

impl Default for RemedyTerms {
    fn default() -> RemedyTerms {
        RemedyTerms {
            smaller_step: "a smaller time step",
            stiffness: "a normal stiffness",
            youngs_modulus: "a Young's modulus",
        }
    }
}

impl Remedy {
    /// Returns the advice in the given terms.
    pub fn advice(self, terms: &RemedyTerms) -> String {
        let smaller_step = terms.smaller_step;
        match self {
            Remedy::StepOrContact => format!("{smaller_step} or a softer contact"),
            Remedy::StepOrGrid => format!("{smaller_step} or a finer grid"),
            Remedy::GridOrStepOrSlices => {
                format!("a finer grid, {smaller_step}, or a look at the last slices")
            }
            Remedy::FartherFace => {
                format!(
                    "a box in which the grain stays inside, an end before it reaches the face, or \
                     {smaller_step}"
                )
            }
            Remedy::Unrefined => "smaller cells instead of the refinement".into(),
            Remedy::StifferContact { law, factor, value } => {
                let (term, unit) = match law {
                    ContactLawKind::Linear => (terms.stiffness, "N/m"),
                    ContactLawKind::HertzMindlin => (terms.youngs_modulus, "Pa"),
                };
                format!(
                    "{term} of {value:.2e} {unit}, {factor:.0} times the present one, for an \
                     overlap of {:.0} %",
                    100.0 * SUGGESTED_OVERLAP
                )
            }
        }
    }
}

impl fmt::Display for Remedy {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.advice(&RemedyTerms::default()))
    }
}

/// Failure of a step: the state is not finite, the CFL number is too large, grains overlap too far,
/// or a grain of a run with a refined box reaches a free surface.
#[derive(Debug, thiserror::Error)]
#[error("{}; try {remedy}", symptom(*time, *step, what, remedy))]
pub struct StepError {
    /// Time [s].
    pub time: f64,
    /// Number of the step.
    pub step: u64,
    /// Observed symptom.
    pub what: String,
    /// Suggested remedy.
    pub remedy: Remedy,
}

/// Reason why a simulation did not reach a time.
#[derive(Debug, thiserror::Error)]
pub enum AdvanceError {
    /// The time is not finite; the state of the simulation has not changed.
    #[error("the time to advance to must be finite, not {time} s")]
    NotFinite {
        /// Time [s].
        time: f64,
    },
    /// A step failed.
    #[error(transparent)]
    Step(#[from] StepError),
}

impl StepError {
    /// Returns the message with an advice in the given terms.
    pub fn message(&self, terms: &RemedyTerms) -> String {
        let StepError { time, step, what, remedy } = self;
        format!("{}; try {}", symptom(*time, *step, what, remedy), remedy.advice(terms))
    }
}

fn symptom(time: f64, step: u64, what: &str, remedy: &Remedy) -> String {
    let failure = match remedy {
        Remedy::StifferContact { .. } | Remedy::Unrefined => "the run was stopped",
        _ => "the run became unstable",
    };
    let time = if time < 1e-3 { format!("{time:.6e}") } else { format!("{time:.6}") };
    format!("{failure} at t = {time} s (step {step}): {what}")
}

fn side_name(axis: usize, side: usize) -> String {
    format!("{} {}", ["lower", "upper"][side], ["x", "y", "z"][axis])
}

impl Simulation {
    /// Adds the likely cause to a symptom of the flow: a grain in an open face of the box. The
    /// remedy is `otherwise` without such a grain.
    pub fn with_cause(&self, symptom: String, otherwise: Remedy) -> (String, Remedy) {
        let enclosure = self.setup.enclosure();
        let present = |o: &Outside| !self.setup.grains[o.grain].has_left();
        let open = |o: &Outside| present(o) && enclosure.sides[o.axis][o.side] == Side::Open;
        match outside(&self.setup.grains, &enclosure).into_iter().find(open) {
            Some(Outside { grain, axis, side, .. }) => {
                let side = side_name(axis, side);
                let what = format!("{symptom} while grain {grain} crosses the open {side} side");
                (what, Remedy::FartherFace)
            }
            None => (symptom, otherwise),
        }
    }

    /// Describes an overlap beyond the limit, with its remedy.
    pub(super) fn describe_overlap(&self, overlap: RelativeOverlap) -> (String, Remedy) {
        let (params, grains) = (&self.setup.contact, &self.setup.grains);
        let RelativeOverlap { grain, partner, depth, relative } = overlap;
        let (other, with) = match partner {
            Partner::Grain(other) => (Some(other), format!("grain {other}")),
            Partner::Wall { axis, side } => {
                (None, format!("the {} wall", side_name(axis as usize, side as usize)))
            }
        };
        let what = format!(
            "grain {grain} overlaps {with} by {:.4} mm, {:.1} % of the equivalent diameter; the \
             limit is {:.0} %",
            1e3 * depth,
            100.0 * relative,
            100.0 * params.overlap_limit
        );
        let partner = other.map(|other| &grains[other]);
        let velocity = grains[grain].velocity - partner.map_or(glam::DVec3::ZERO, |p| p.velocity);
        let wanted = SUGGESTED_OVERLAP * depth / relative;
        let factor = params.stiffening(&grains[grain], partner, velocity.length(), depth, wanted);
        let value = factor
            * match params.law {
                ContactLawKind::Linear => params.normal_stiffness,
                ContactLawKind::HertzMindlin => grains[grain].material.youngs_modulus,
            };
        (what, Remedy::StifferContact { law: params.law, factor, value })
    }
}

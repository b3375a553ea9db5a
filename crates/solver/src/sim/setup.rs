//! Set-up of a simulation and its validation.

use glam::DVec3;

use crate::dem::{ContactLawKind, ContactParams, Enclosure, Grain, MotionConstraint, Side};
use crate::flow::{Boundaries, Boundary, FluidParams, RefinedBox};
use crate::grid::Mesh;
use crate::immersed::{Scheme, Start};
use crate::math::Precision;

use super::Prescription;
use super::refinement::box_around;

/// Smallest density ratio of a free grain and the fluid, tested for spheres, flat and long grains.
/// At a tenth of this ratio some grains become unstable.
pub const LIGHTEST_FREE_GRAIN: f64 = 0.01;

/// Rule for the length of the time step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StepRule {
    /// Constant step [s], shortened so that steps end at the output times.
    Fixed(f64),
    /// Largest step within all limits; the default has CFL number 0.4 and viscous number 0.2.
    Limits {
        /// Largest CFL number dt * max(sum |u_a| / h_a).
        cfl: f64,
        /// Largest viscous number nu dt sum 1/h_a^2.
        viscous: f64,
        /// Largest step [s].
        max_step: f64,
    },
}

impl StepRule {
    /// Default limits of the CFL number and the viscous number.
    pub const DEFAULT_LIMITS: (f64, f64) = (0.4, 0.2);
}

impl Default for StepRule {
    fn default() -> StepRule {
        let (cfl, viscous) = StepRule::DEFAULT_LIMITS;
        StepRule::Limits { cfl, viscous, max_step: f64::INFINITY }
    }
}

/// Set-up of a simulation: everything that determines its course.
///
/// [`Setup::new`] has defaults for all but the grid, and the `with_` methods replace them. All
/// lengths are in metres, vectors in the space frame; [`Simulation::new`](super::Simulation::new)
/// validates the set-up.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Setup {
    /// The grid.
    pub mesh: Mesh,
    /// Conditions on the faces of the box; by default no-slip walls at rest.
    pub boundaries: Boundaries,
    /// The fluid; by default none, which leaves contact and motion alone (a dry run).
    pub fluid: Option<FluidParams>,
    /// Floating-point precision of the fields; by default double.
    pub precision: Precision,
    /// Cells along the edge of a cell of the grid in a box around the grains, which moves with
    /// them: 1, the default, refines nothing; 2 halves the spacing there.
    pub refinement: usize,
    /// Least distance from the grains to the sides of the refined box along x, y, z [m]. The
    /// default is 0.4 equivalent diameters; three cells is the minimum.
    pub refinement_margin: Option<DVec3>,
    /// Coupling scheme.
    pub scheme: Scheme,
    /// Start of grains that have a velocity relative to the fluid; by default impulsive.
    pub start: Start,
    /// Gravity [m/s^2]; by default zero.
    pub gravity: DVec3,
    /// The grains at t = 0; during a run, in their present state.
    pub grains: Vec<Grain>,
    /// Parameters of the contact law.
    pub contact: ContactParams,
    /// Rule for the time step.
    pub step: StepRule,
    /// Quantities prescribed by formulas.
    pub prescription: Prescription,
}

/// Set-up that cannot be simulated.
#[derive(Debug, thiserror::Error)]
pub enum SetupError {
    /// Contradiction between values.
    #[error("{0}")]
    Inconsistent(String),
}

fn bounded(x: f64) -> bool {
    x.is_finite() && x > 0.0
}

impl Setup {
    /// Set-up of a box with walls, without fluid, grains and gravity.
    pub fn new(mesh: Mesh) -> Setup {
        Setup {
            mesh,
            boundaries: Boundaries([[Boundary::WALL; 2]; 3]),
            fluid: None,
            precision: Precision::Double,
            refinement: 1,
            refinement_margin: None,
            scheme: Scheme::default(),
            start: Start::default(),
            gravity: DVec3::ZERO,
            grains: Vec::new(),
            contact: ContactParams::default(),
            step: StepRule::default(),
            prescription: Prescription::default(),
        }
    }
    /// Replaces the boundary conditions, lower and upper side of each axis.
    pub fn with_boundaries(mut self, boundaries: [[Boundary; 2]; 3]) -> Setup {
        self.boundaries = Boundaries(boundaries);
        self
    }
    /// Fills the box with a fluid; `None` leaves it empty.
    pub fn with_fluid(mut self, fluid: impl Into<Option<FluidParams>>) -> Setup {
        self.fluid = fluid.into();
        self
    }
    /// Replaces the floating-point precision of the fields.
    pub fn with_precision(mut self, precision: Precision) -> Setup {
        self.precision = precision;
        self
    }
    /// Replaces the refinement around the grains, 1 or 2.
    pub fn with_refinement(mut self, refinement: usize) -> Setup {
        self.refinement = refinement;
        self
    }
    /// Replaces the least distance from the grains to the sides of the refined box [m].
    pub fn with_refinement_margin(mut self, margin: impl Into<Option<DVec3>>) -> Setup {
        self.refinement_margin = margin.into();
        self
    }
    /// Replaces the coupling scheme.
    pub fn with_scheme(mut self, scheme: Scheme) -> Setup {
        self.scheme = scheme;
        self
    }
    /// Replaces the start of grains that have a velocity relative to the fluid.
    pub fn with_start(mut self, start: Start) -> Setup {
        self.start = start;
        self
    }
    /// Replaces gravity [m/s^2].
    pub fn with_gravity(mut self, gravity: DVec3) -> Setup {
        self.gravity = gravity;
        self
    }
    /// Adds grains, whose indices follow those already there.
    pub fn with_grains(mut self, grains: impl IntoIterator<Item = Grain>) -> Setup {
        self.grains.extend(grains);
        self
    }
    /// Replaces the parameters of the contact law.
    pub fn with_contact(mut self, contact: ContactParams) -> Setup {
        self.contact = contact;
        self
    }
    /// Replaces the rule for the time step.
    pub fn with_step(mut self, step: StepRule) -> Setup {
        self.step = step;
        self
    }
    /// Replaces the quantities prescribed by formulas.
    pub fn with_prescription(mut self, prescription: Prescription) -> Setup {
        self.prescription = prescription;
        self
    }

    /// Spacing of the grid around the grains [m].
    pub fn finest_spacing(&self) -> DVec3 {
        self.refined_mesh().map_or(self.mesh.spacing, |mesh| mesh.spacing)
    }

    /// Longest step [s] in which an `acceleration` [m/s^2] from rest moves nothing by more than
    /// `cfl` cells.
    pub(super) fn longest_step_from_rest(&self, acceleration: f64) -> f64 {
        let spacing = self.finest_spacing();
        let axes = self.mesh.resolved_axes().map(|axis| spacing[axis]);
        match self.step {
            StepRule::Limits { cfl, .. } if acceleration > 0.0 => {
                (cfl * axes.fold(f64::INFINITY, f64::min) / acceleration).sqrt()
            }
            _ => f64::INFINITY,
        }
    }

    /// Refined box around the present grains, if the set-up has one.
    pub(super) fn refined_box(&self) -> Option<RefinedBox> {
        let is_refined = self.refinement > 1 && self.fluid.is_some();
        let margin = self.refinement_margin;
        let place = || box_around(&self.mesh, &self.boundaries, &self.grains, margin, None);
        is_refined.then(place).flatten()
    }

    /// Grid of the refined box around the present grains, if the set-up has one.
    pub fn refined_mesh(&self) -> Option<Mesh> {
        self.refined_box().map(|place| place.mesh(&self.mesh))
    }

    /// Walls and periodic axes of the box for contact.
    pub fn enclosure(&self) -> Enclosure {
        Setup::enclosure_of(&self.mesh, &self.boundaries)
    }

    /// Walls and periodic axes of a box with this mesh and these boundaries for contact.
    pub fn enclosure_of(mesh: &Mesh, boundaries: &Boundaries) -> Enclosure {
        let side = |boundary: Boundary| match boundary {
            Boundary::Wall { velocity } => Side::Wall { velocity },
            Boundary::Slip => Side::Frictionless,
            _ => Side::Open,
        };
        Enclosure {
            lower: mesh.origin,
            upper: mesh.upper(),
            periodic: boundaries.periodic(),
            sides: boundaries.0.map(|sides| sides.map(side)),
        }
    }

    /// Checks the parts of the set-up against each other.
    ///
    /// # Errors
    /// [`SetupError::Inconsistent`] names the contradiction.
    pub fn validate(&self) -> Result<(), SetupError> {
        self.check_sides()
            .and_then(|()| self.check_materials())
            .and_then(|()| self.check_motions())
            .and_then(|()| self.check_refinement())
            .and_then(|()| self.check_step())
            .map_err(SetupError::Inconsistent)
    }

    /// Checks the conditions on the sides of the box.
    fn check_sides(&self) -> Result<(), String> {
        let fluid_enters = |side: &Boundary| matches!(side, Boundary::Inflow { .. });
        let sides = || self.boundaries.0.iter().flatten();
        for (axis, [lower, upper]) in self.boundaries.0.iter().enumerate() {
            let name = ["x", "y", "z"][axis];
            if (*lower == Boundary::Periodic) != (*upper == Boundary::Periodic) {
                return Err(format!("axis {name} is periodic on one side only"));
            }
            for side in [lower, upper] {
                if let Boundary::Wall { velocity } = side
                    && (velocity[axis] != 0.0 || !velocity.is_finite())
                {
                    return Err(format!(
                        "a wall normal to {name} has the velocity {velocity} m/s: it must be finite \
                         and in the plane of the wall"
                    ));
                }
            }
            if self.fluid.is_some() && self.mesh.cells[axis] == 1 && *lower != Boundary::Periodic {
                return Err(format!(
                    "axis {name} has one cell, so both its sides must be periodic"
                ));
            }
        }
        if sides().any(fluid_enters) && !sides().any(|side| *side == Boundary::Outflow) {
            return Err(
                "fluid enters the box but no side lets it out: make one side an outflow".into()
            );
        }
        if sides().filter(|side| **side == Boundary::FreeSurface).count() > 1 {
            return Err("the box can have one free surface, not several".into());
        }
        Ok(())
    }

    /// Checks the grid and the constants of fluid, grains and contact.
    fn check_materials(&self) -> Result<(), String> {
        if !self.mesh.spacing.to_array().into_iter().all(bounded) || self.mesh.cells.contains(&0) {
            return Err("the grid needs at least one cell of positive size along each axis".into());
        }
        let is_fluid = |p: FluidParams| bounded(p.density) && bounded(p.kinematic_viscosity);
        if !self.fluid.is_none_or(is_fluid) {
            return Err("density and viscosity of the fluid must be positive".into());
        }
        if let Some(i) = self.grains.iter().position(|grain| !bounded(grain.density)) {
            return Err(format!("the density of grain {i} must be positive"));
        }
        self.contact.validate()?;
        if self.contact.law == ContactLawKind::HertzMindlin {
            for (i, grain) in self.grains.iter().enumerate() {
                grain.material.validate().map_err(|message| format!("grain {i}: {message}"))?;
            }
        }
        Ok(())
    }

    /// Checks how grains move.
    fn check_motions(&self) -> Result<(), String> {
        let motions = &self.prescription.motions;
        let by_formula = |i| motions.iter().any(|m| m.grain == i && m.velocity.is_some());
        let is_free = |grain: &Grain| grain.translation == MotionConstraint::Free;
        let too_light = |(i, grain)| is_free(grain) && self.is_too_light(grain) && !by_formula(i);
        if let Some(i) = self.grains.iter().enumerate().position(too_light) {
            return Err(format!(
                "grain {i} is lighter than {LIGHTEST_FREE_GRAIN} times the fluid: free grains \
                 become unstable below it; prescribe its velocity, or take a denser grain"
            ));
        }
        if let Some(axis) = self.flat_axis()
            && let Some(i) = self.grains.iter().position(|grain| grain.leaves_plane(axis))
        {
            let name = ["x", "y", "z"][axis];
            return Err(format!(
                "grain {i} starts out of the plane of the flow, which has one cell along {name}: \
                 its velocity along {name} and its angular velocity about the other axes must be \
                 0, or prescribed"
            ));
        }
        if let Some(motion) = motions.iter().find(|m| m.grain >= self.grains.len()) {
            let grain = motion.grain;
            return Err(format!("a motion is given for grain {grain}, which is not there"));
        }
        Ok(())
    }

    /// Checks the refined box.
    fn check_refinement(&self) -> Result<(), String> {
        if self.refinement != 1 {
            let flat = (0..3).any(|axis| !self.mesh.is_resolved(axis));
            if self.refinement != 2 {
                return Err(format!("the refinement must be 1 or 2, not {}", self.refinement));
            } else if self.scheme == Scheme::Paper {
                return Err("the paper's scheme works on one grid, without refinement".into());
            } else if flat {
                return Err("a box with a flat axis cannot be refined".into());
            }
        }
        if self.refinement_margin.is_some_and(|margin| !margin.to_array().into_iter().all(bounded))
        {
            return Err("the margin of the refined box must be positive".into());
        }
        Ok(())
    }

    /// Checks the time step.
    fn check_step(&self) -> Result<(), String> {
        let step = match self.step {
            StepRule::Limits { max_step, .. } if self.fluid.is_none() => max_step,
            StepRule::Limits { max_step, .. } => max_step.min(f64::MAX),
            StepRule::Fixed(step) => step,
        };
        if !bounded(step) {
            return Err("the time step must be positive and, without a fluid, finite".into());
        }
        Ok(())
    }

    /// Axis along which the flow has one cell, if any. Free grains move in the plane normal to it.
    pub fn flat_axis(&self) -> Option<usize> {
        (0..3).find(|axis| self.fluid.is_some() && !self.mesh.is_resolved(*axis))
    }

    /// Returns whether a grain is too light for the coupling if it moves freely.
    pub(super) fn is_too_light(&self, grain: &Grain) -> bool {
        self.fluid.is_some_and(|fluid| grain.density < LIGHTEST_FREE_GRAIN * fluid.density)
    }
}

impl Prescription {
    /// Largest sum of the absolute components of the initial velocity [m/s], sampled at about
    /// thirty points along each axis of `mesh`; NaN if a formula is undefined at one of them.
    pub fn initial_speed(&self, mesh: &Mesh) -> Option<f64> {
        let formula = self.initial_velocity.as_ref()?;
        let points = |axis: usize| {
            let count = mesh.cells[axis].min(30);
            (0..=count).map(move |i| i as f64 / count as f64)
        };
        let mut largest: f64 = 0.0;
        for z in points(2) {
            for y in points(1) {
                for x in points(0) {
                    let at = mesh.origin + mesh.extent() * DVec3::new(x, y, z);
                    let speed = formula.at(&at.to_array()).abs().element_sum();
                    if !speed.is_finite() {
                        return Some(f64::NAN);
                    }
                    largest = largest.max(speed);
                }
            }
        }
        Some(largest)
    }
}

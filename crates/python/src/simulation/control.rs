//! Control of the grains from Python.

use glam::DVec3;
use grainwake_run::case::quantity::{AngularVelocity, Force, Kind, Torque, Velocity};
use grainwake_run::number_format::number_of_grains;
use grainwake_solver::dem::{Grain, MotionConstraint};
use grainwake_solver::math::Load;
use grainwake_solver::sim::MotionComponent;
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;

use super::{PySimulation, changing};
use crate::arguments::{Whole, flags, vector};
use crate::error::{Raise, input};

fn optional<K: Kind>(name: &str, value: Option<&Bound<'_, PyAny>>) -> PyResult<Option<DVec3>> {
    value.map(|value| vector::<K>(name, value)).transpose()
}

/// Velocities of the motion, each with its component; at least one is required.
fn motions(
    velocity: Option<&Bound<'_, PyAny>>,
    angular_velocity: Option<&Bound<'_, PyAny>>,
) -> PyResult<Vec<(MotionComponent, DVec3)>> {
    let linear = optional::<Velocity>("velocity", velocity)?;
    let angular = optional::<AngularVelocity>("angular_velocity", angular_velocity)?;
    let linear = linear.map(|v| (MotionComponent::Translation, v));
    let both: Vec<_> =
        linear.into_iter().chain(angular.map(|w| (MotionComponent::Rotation, w))).collect();
    if both.is_empty() {
        return Err(input("give velocity, angular_velocity or both"));
    }
    Ok(both)
}

impl PySimulation {
    /// Returns the index of a grain, or the exception of an index that no grain has.
    fn index(&self, grain: &Whole) -> PyResult<usize> {
        let count = self.sim.grains().len();
        let number = grain.number("grain")?.and_then(|grain| usize::try_from(grain).ok());
        number.filter(|grain| *grain < count).ok_or_else(|| {
            let has = number_of_grains(count);
            PyIndexError::new_err(format!(
                "there is no grain {}: the simulation has {has}, counted from 0",
                grain.text()
            ))
        })
    }
}

/// Returns the simulation and the index of a grain that may be controlled: not after a failed step
/// and not after the run folder was closed, where control has no effect.
fn controlled<'py>(
    slf: &Bound<'py, PySimulation>,
    grain: &Whole,
) -> PyResult<(PyRefMut<'py, PySimulation>, usize)> {
    let this = changing(slf)?;
    this.may_continue()?;
    let grain = this.index(grain)?;
    Ok((this, grain))
}

#[pymethods]
impl PySimulation {
    /// Set the present velocity of a free grain.
    ///
    /// Parameters
    /// ----------
    /// grain : int
    ///     Index of the grain.
    /// velocity : sequence of float or str, optional
    ///     Velocity of the centroid [m/s].
    /// angular_velocity : sequence of float or str, optional
    ///     Angular velocity in the space frame [rad/s].
    ///
    /// Raises
    /// ------
    /// IndexError
    ///     There is no such grain.
    /// CaseError
    ///     The motion is prescribed, a component is not finite, or the run folder is closed.
    ///
    /// Notes
    /// -----
    /// The change acts as a blow: over the next two to five steps the grain shares its momentum
    /// with the fluid, and the velocity undershoots in between. With a density ratio of 1.1,
    /// 0.1 m/s becomes 0.095, 0.049, 0.063, 0.059 and 0.060 m/s.
    #[pyo3(signature = (grain, velocity = None, angular_velocity = None))]
    fn set_velocity(
        slf: &Bound<'_, Self>,
        grain: Whole,
        velocity: Option<&Bound<'_, PyAny>>,
        angular_velocity: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let (mut this, grain) = controlled(slf, &grain)?;
        let Grain { translation, rotation, .. } = this.sim.grains()[grain];
        let mut motions = motions(velocity, angular_velocity)?;
        // A prescribed motion is refused before the other one has changed.
        motions.sort_by_key(|(component, _)| match component {
            MotionComponent::Translation => translation == MotionConstraint::Free,
            MotionComponent::Rotation => rotation == MotionConstraint::Free,
        });
        for (component, value) in motions {
            this.sim.set_velocity(grain, component, value).raise()?;
        }
        Ok(())
    }

    /// Prescribe the motion of a grain from now on; zero holds it.
    ///
    /// Parameters
    /// ----------
    /// grain : int
    ///     Index of the grain.
    /// velocity : sequence of float or str, optional
    ///     Velocity of the centroid [m/s]; left as it is if not given.
    /// angular_velocity : sequence of float or str, optional
    ///     Angular velocity in the space frame [rad/s]; left as it is if not given.
    ///
    /// See Also
    /// --------
    /// release : let the grain move freely again.
    #[pyo3(signature = (grain, velocity = None, angular_velocity = None))]
    fn prescribe_motion(
        slf: &Bound<'_, Self>,
        grain: Whole,
        velocity: Option<&Bound<'_, PyAny>>,
        angular_velocity: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let (mut this, grain) = controlled(slf, &grain)?;
        for (component, value) in motions(velocity, angular_velocity)? {
            this.sim.prescribe_velocity(grain, component, value).raise()?;
        }
        Ok(())
    }

    /// Let a grain move freely from now on, starting from its present velocity.
    ///
    /// Parameters
    /// ----------
    /// grain : int
    ///     Index of the grain.
    /// translation, rotation : bool, default True
    ///     Motions to release.
    ///
    /// Raises
    /// ------
    /// CaseError
    ///     The grain is too light to translate freely in the fluid, or the run folder is closed.
    #[pyo3(signature = (grain, *, translation = true, rotation = true))]
    fn release(
        slf: &Bound<'_, Self>,
        grain: Whole,
        #[pyo3(from_py_with = flags::translation)] translation: bool,
        #[pyo3(from_py_with = flags::rotation)] rotation: bool,
    ) -> PyResult<()> {
        let (mut this, grain) = controlled(slf, &grain)?;
        let chosen =
            [(MotionComponent::Translation, translation), (MotionComponent::Rotation, rotation)];
        for (component, _) in chosen.into_iter().filter(|(_, chosen)| *chosen) {
            this.sim.release(grain, component).raise()?;
        }
        Ok(())
    }

    /// Set the external load on a grain, which acts in every step until it is replaced. Weight,
    /// buoyancy, contact and fluid act besides.
    ///
    /// Parameters
    /// ----------
    /// grain : int
    ///     Index of the grain.
    /// force : sequence of float or str, optional
    ///     Force [N] in the space frame; zero if not given.
    /// torque : sequence of float or str, optional
    ///     Torque about the centroid [N m] in the space frame; zero if not given.
    #[pyo3(signature = (grain, force = None, torque = None))]
    fn set_load(
        slf: &Bound<'_, Self>,
        grain: Whole,
        force: Option<&Bound<'_, PyAny>>,
        torque: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let (mut this, grain) = controlled(slf, &grain)?;
        let load = Load {
            force: optional::<Force>("force", force)?.unwrap_or(DVec3::ZERO),
            torque: optional::<Torque>("torque", torque)?.unwrap_or(DVec3::ZERO),
        };
        this.sim.set_external_load(grain, load).raise()
    }
}

//! Lubrication force of a pair whose surfaces are close but do not touch.

use super::kinematics::PairKinematics;
use super::law::PairProperties;
use super::params::ContactParams;
use super::record::PairLoads;
use crate::dem::search::ClosestPoint;
use crate::math::Load;

/// Gap below which the lubrication force acts [m]; zero if it is switched off.
pub(super) fn range(params: &ContactParams) -> f64 {
    if params.lubrication_viscosity > 0.0 { params.lubrication_gap.max(0.0) } else { 0.0 }
}

/// Leading-order squeeze-film force between the equal-volume spheres,
/// 6 pi mu R*^2 v_n (1/h - 1/h_0), with h at least the height of the asperities.
pub(super) fn lubrication(
    params: &ContactParams,
    closest: &ClosestPoint,
    properties: &PairProperties,
    pair: &PairKinematics,
    step: f64,
) -> PairLoads {
    let range = range(params);
    if closest.gap >= range {
        return PairLoads::default();
    }
    let strength = 6.0
        * std::f64::consts::PI
        * params.lubrication_viscosity
        * properties.reduced_radius.powi(2);
    let film = closest.gap.max(params.roughness).min(range);
    let mut resistance = strength * (1.0 / film - 1.0 / range);
    // An explicit dashpot must not reverse the approach within a sub-step.
    if step * properties.inverse_mass > 0.0 {
        resistance = resistance.min(0.5 / (step * properties.inverse_mass));
    }
    let lever_arm_b = closest.lever_arm + pair.branch;
    let [a, b] = &pair.end_of_step;
    let approach = (a.at(closest.lever_arm) - b.at(lever_arm_b)).dot(closest.normal);
    let force = -resistance * approach * closest.normal;
    PairLoads {
        overlap: -closest.gap,
        on_grain: Load { force, torque: closest.lever_arm.cross(force) },
        on_partner: Load { force: -force, torque: -lever_arm_b.cross(force) },
        lever_arm: closest.lever_arm,
        normal: closest.normal,
        elastic_energy: 0.0,
    }
}

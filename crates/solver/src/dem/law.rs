//! Forces of one pair from its penetrating points (Eqs 9-18).
//!
//! The normal force of the pair is one linear spring, k_n delta with delta the deepest overlap,
//! spread over the penetrating points in proportion to area times depth, so that the stiffness does
//! not depend on the number of nodes; with a single point it is Eq. 9.

use glam::{DQuat, DVec3};

use super::history::{Memory, Outcome, Slot};
use super::narrow_phase::{Closest, Touch};
use super::params::ContactParams;
use crate::math::Load;

/// Lubrication saturates at this part of its range.
const SATURATION: f64 = 0.01;

/// Motion of a body at the contact.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Motion {
    /// Velocity of the centroid [m/s].
    pub velocity: DVec3,
    /// Angular velocity [rad/s].
    pub spin: DVec3,
}

impl Motion {
    fn at(&self, arm: DVec3) -> DVec3 {
        self.velocity + self.spin.cross(arm)
    }
}

/// The two bodies of a pair, as far as forces need them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pair {
    /// Vector from the partner's centroid (its image) to the first grain's [m].
    pub apart: DVec3,
    /// Mid-step motion of both, for the slip increment (Eqs 12-13).
    pub during: [Motion; 2],
    /// Motion expected at the end of the sub-step, for the dashpots.
    pub now: [Motion; 2],
    /// 1/m_a + 1/m_b [1/kg].
    pub inverse_mass: f64,
    /// Reduced radius of the equivalent spheres [m].
    pub radius: f64,
    /// Whether the partner is a wall.
    pub wall: bool,
}

/// The contact law with what it derives from its parameters.
#[derive(Clone, Copy, Debug)]
pub(super) struct Law {
    pub params: ContactParams,
    damping_ratio: f64,
}

/// Turns `v` by the smallest rotation that takes `from` to `to` (R of Eq. 14).
fn carry(v: DVec3, from: DVec3, to: DVec3) -> DVec3 {
    let turned = DQuat::from_rotation_arc(from, to) * v;
    turned - turned.dot(to) * to
}

impl Law {
    pub fn new(params: ContactParams) -> Law {
        Law {
            params,
            damping_ratio: params.damping_ratio(),
        }
    }

    /// Surfaces nearer than this are looked for [m].
    pub fn reach(&self) -> f64 {
        if self.params.lubrication_viscosity > 0.0 {
            self.params.lubrication_gap.max(0.0)
        } else {
            0.0
        }
    }

    /// Loads of the pair at the end of a sub-step of length `step` [s] (zero: the state as it is),
    /// into `slot.outcome`; moves the memory on.
    pub fn apply(&self, slot: &mut Slot, closest: Option<Closest>, pair: &Pair, step: f64) {
        let overlap = slot.touches.iter().map(|t| t.depth).fold(0.0, f64::max);
        if overlap <= 0.0 {
            slot.clear();
            if let Some(closest) = closest {
                slot.outcome = self.lubrication(&closest, pair, step);
            }
            return;
        }
        let Slot {
            touching,
            mean,
            memory,
            next,
            touches,
            outcome,
            ..
        } = slot;
        let total: f64 = touches.iter().map(|t| t.area * t.depth).sum();
        let (mut normal, mut arm, mut approach) = (DVec3::ZERO, DVec3::ZERO, 0.0);
        for touch in touches.iter() {
            let share = touch.area * touch.depth / total;
            normal += share * touch.normal;
            arm += share * touch.arm;
            approach += share * relative(&pair.now, touch, pair.apart).dot(touch.normal);
        }
        // Normals of one patch hardly differ; those of opposite flanks may cancel, and then the
        // force is what the flanks leave over.
        let scale = 1.0 / normal.length().max(0.9);
        let k = self.params.normal_stiffness;
        let dashpot = if pair.inverse_mass > 0.0 {
            2.0 * self.damping_ratio * (k / pair.inverse_mass).sqrt()
        } else {
            0.0
        };
        let press = (k * overlap + dashpot * approach).max(0.0);
        let friction = if pair.wall {
            self.params.wall_friction
        } else {
            self.params.friction
        };
        let tangential = k * self.params.tangential_ratio;
        let rub = dashpot * self.params.tangential_damping;
        let sliding = friction > 0.0 && tangential > 0.0;
        // A new contact began somewhere inside the sub-step.
        let since = if *touching || approach * step <= overlap {
            step
        } else {
            overlap / approach
        };

        next.clear();
        let mut load = [Load::default(); 2];
        let (mut slips, mut stored) = (DVec3::ZERO, 0.0);
        let mut known = memory.iter().peekable();
        let center = normal.normalize_or(touches[0].normal);
        for touch in touches.iter() {
            let share = touch.area * touch.depth / total;
            let mut force = -(press * share * scale) * touch.normal;
            if sliding {
                while known.next_if(|m| m.code < touch.code).is_some() {}
                let old = known
                    .next_if(|m| m.code == touch.code)
                    .or(touching.then_some(&*mean));
                let mut slip = match old {
                    Some(old) => {
                        let twist = 0.5
                            * step
                            * (pair.during[0].spin + pair.during[1].spin).dot(touch.normal);
                        let carried = carry(old.slip, old.normal, touch.normal);
                        if twist == 0.0 {
                            carried
                        } else {
                            DQuat::from_axis_angle(touch.normal, twist) * carried
                        }
                    }
                    None => DVec3::ZERO,
                };
                let across = |v: DVec3| v - v.dot(touch.normal) * touch.normal;
                slip += since * across(relative(&pair.during, touch, pair.apart));
                let drag = rub * across(relative(&pair.now, touch, pair.apart));
                let mut pull = -(tangential * slip + drag);
                let limit = friction * press;
                if pull.length_squared() > limit * limit {
                    pull *= limit / pull.length();
                    slip = -(pull + drag) / tangential;
                }
                force += share * pull;
                slips += share * carry(slip, touch.normal, center);
                stored += 0.5 * share * tangential * slip.length_squared();
                next.push(Memory {
                    code: touch.code,
                    normal: touch.normal,
                    slip,
                });
            }
            load[0] += Load {
                force,
                torque: touch.arm.cross(force),
            };
            load[1] += Load {
                force: -force,
                torque: -(touch.arm + pair.apart).cross(force),
            };
        }
        std::mem::swap(memory, next);
        *touching = true;
        *mean = Memory {
            code: 0,
            normal: center,
            slip: slips,
        };
        *outcome = Outcome {
            overlap,
            first: load[0],
            second: load[1],
            arm,
            normal: center,
            elastic_energy: 0.5 * k * overlap * overlap + stored,
        };
    }

    /// Leading-order squeeze-film force between equal-volume spheres,
    /// 6 pi mu R^2 v_n (1/h - 1/h_0), saturated at a hundredth of the range h_0.
    fn lubrication(&self, closest: &Closest, pair: &Pair, step: f64) -> Outcome {
        let range = self.reach();
        if closest.gap >= range {
            return Outcome::default();
        }
        let gap = closest.gap.max(SATURATION * range);
        let strength =
            6.0 * std::f64::consts::PI * self.params.lubrication_viscosity * pair.radius.powi(2);
        let mut resistance = strength * (1.0 / gap - 1.0 / range);
        // An explicit dashpot must not reverse the approach within a sub-step.
        if step * pair.inverse_mass > 0.0 {
            resistance = resistance.min(0.5 / (step * pair.inverse_mass));
        }
        let arm_b = closest.arm + pair.apart;
        let approach = (pair.now[0].at(closest.arm) - pair.now[1].at(arm_b)).dot(closest.normal);
        let force = -resistance * approach * closest.normal;
        Outcome {
            overlap: -closest.gap,
            first: Load {
                force,
                torque: closest.arm.cross(force),
            },
            second: Load {
                force: -force,
                torque: -arm_b.cross(force),
            },
            arm: closest.arm,
            normal: closest.normal,
            elastic_energy: 0.0,
        }
    }
}

/// Velocity of the first body against the second at a touch (Eq. 12) [m/s].
fn relative(motion: &[Motion; 2], touch: &Touch, apart: DVec3) -> DVec3 {
    motion[0].at(touch.arm) - motion[1].at(touch.arm + apart)
}

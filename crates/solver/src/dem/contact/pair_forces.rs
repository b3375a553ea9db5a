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
    /// k_zeta [N/m].
    tangential: f64,
}

/// What the points of a patch have in common.
#[derive(Clone, Copy, Debug)]
struct Mean {
    /// Deepest overlap [m].
    overlap: f64,
    /// Sum of area times depth [m^3].
    total: f64,
    /// Mean of the normals: shorter than one where they differ.
    normal: DVec3,
    arm: DVec3,
    /// Closing speed along the normals [m/s].
    approach: f64,
}

impl Mean {
    fn of(touches: &[Touch], pair: &Pair) -> Option<Mean> {
        let overlap = touches.iter().map(|t| t.depth).fold(0.0, f64::max);
        let total: f64 = touches.iter().map(|t| t.area * t.depth).sum();
        if overlap <= 0.0 || total <= 0.0 {
            return None;
        }
        let mut mean = Mean {
            overlap,
            total,
            normal: DVec3::ZERO,
            arm: DVec3::ZERO,
            approach: 0.0,
        };
        for touch in touches {
            let share = touch.area * touch.depth / total;
            mean.normal += share * touch.normal;
            mean.arm += share * touch.arm;
            mean.approach += share * relative(&pair.now, touch, pair.apart).dot(touch.normal);
        }
        Some(mean)
    }
}

/// What the friction of every point of a patch depends on.
#[derive(Clone, Copy, Debug)]
struct Rub {
    /// Tangential dashpot [N s/m].
    dashpot: f64,
    /// Part of the sub-step in contact, and all of it [s].
    since: f64,
    step: f64,
}

/// Turns `v` by the smallest rotation that takes `from` to `to` (R of Eq. 14).
fn carry(v: DVec3, from: DVec3, to: DVec3) -> DVec3 {
    let turned = DQuat::from_rotation_arc(from, to) * v;
    turned - turned.dot(to) * to
}

impl Law {
    pub fn new(params: ContactParams) -> Law {
        let tangential = params.normal_stiffness * params.tangential_ratio;
        Law {
            params,
            damping_ratio: params.damping_ratio(),
            tangential,
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
        let Some(mean) = Mean::of(&slot.patch.touches, pair) else {
            slot.part();
            if let Some(closest) = closest {
                slot.outcome = self.lubrication(&closest, pair, step);
            }
            return;
        };
        let k = self.params.normal_stiffness;
        // A new contact began somewhere inside the sub-step: its dashpot, which does not start from
        // zero, has acted for `since` of it.
        let begins = !slot.touching && mean.approach * step > mean.overlap;
        let since = if begins {
            mean.overlap / mean.approach
        } else {
            step
        };
        slot.onset = match (begins, step > 0.0 && slot.touching) {
            (true, _) => 0.5 + since / step,
            (false, true) => 1.0,
            // The same moment looked at again, or grains that overlap from the start.
            (false, false) => slot.onset,
        };
        let dashpot = slot.onset * self.dashpot(pair);
        let rub = Rub {
            dashpot: dashpot * self.params.tangential_damping,
            since,
            step,
        };
        // Normals of one patch hardly differ; those of opposite flanks may cancel, and then the
        // force is what the flanks leave over.
        let scale = 1.0 / mean.normal.length().max(0.9);
        let center = mean.normal.normalize_or(slot.patch.touches[0].normal);

        let mut outcome = Outcome {
            overlap: mean.overlap,
            arm: mean.arm,
            normal: center,
            elastic_energy: 0.5 * k * mean.overlap * mean.overlap,
            ..Default::default()
        };
        let (mut slips, mut known) = (DVec3::ZERO, 0);
        slot.next.clear();
        for touch in &slot.patch.touches {
            let share = touch.area * touch.depth / mean.total;
            // The local approach speed, so that rocking on a face is damped as well.
            let approach = relative(&pair.now, touch, pair.apart).dot(touch.normal);
            let press = (k * mean.overlap + dashpot * approach).max(0.0);
            let mut force = -(press * share * scale) * touch.normal;
            if self.tangential > 0.0 && self.friction(pair) > 0.0 {
                while slot.memory.get(known).is_some_and(|m| m.code < touch.code) {
                    known += 1;
                }
                let own = slot.memory.get(known).filter(|m| m.code == touch.code);
                let old = own.or(slot.touching.then_some(&slot.mean));
                let (pull, slip) = self.friction_at(touch, press, old, pair, &rub);
                force += share * pull;
                slips += share * carry(slip, touch.normal, center);
                outcome.elastic_energy += 0.5 * share * self.tangential * slip.length_squared();
                slot.next.push(Memory {
                    code: touch.code,
                    normal: touch.normal,
                    slip,
                });
            }
            outcome.first += Load {
                force,
                torque: touch.arm.cross(force),
            };
            outcome.second += Load {
                force: -force,
                torque: -(touch.arm + pair.apart).cross(force),
            };
        }
        std::mem::swap(&mut slot.memory, &mut slot.next);
        slot.touching = true;
        slot.mean = Memory {
            code: 0,
            normal: center,
            slip: slips,
        };
        slot.outcome = outcome;
    }

    /// Coefficient of the normal dashpot [N s/m].
    fn dashpot(&self, pair: &Pair) -> f64 {
        if pair.inverse_mass > 0.0 {
            2.0 * self.damping_ratio * (self.params.normal_stiffness / pair.inverse_mass).sqrt()
        } else {
            0.0
        }
    }

    fn friction(&self, pair: &Pair) -> f64 {
        if pair.wall {
            self.params.wall_friction
        } else {
            self.params.friction
        }
    }

    /// Tangential force on the first grain as if this point carried the whole pair, and its
    /// displacement (Eqs 13-15). Both Coulomb's bound and the stiffness scale with the share, so the
    /// bound on the displacement does not depend on it.
    fn friction_at(
        &self,
        touch: &Touch,
        press: f64,
        old: Option<&Memory>,
        pair: &Pair,
        rub: &Rub,
    ) -> (DVec3, DVec3) {
        let across = |v: DVec3| v - v.dot(touch.normal) * touch.normal;
        let kept = old.map_or(DVec3::ZERO, |old| {
            // The pair may turn as a whole about its normal, and the spring with it.
            let twist =
                0.5 * rub.step * (pair.during[0].spin + pair.during[1].spin).dot(touch.normal);
            DQuat::from_axis_angle(touch.normal, twist) * carry(old.slip, old.normal, touch.normal)
        });
        let slip = kept + rub.since * across(relative(&pair.during, touch, pair.apart));
        let drag = rub.dashpot * across(relative(&pair.now, touch, pair.apart));
        let pull = -(self.tangential * slip + drag);
        let limit = self.friction(pair) * press;
        if pull.length_squared() <= limit * limit {
            return (pull, slip);
        }
        let pull = pull * (limit / pull.length());
        (pull, -(pull + drag) / self.tangential)
    }

    /// Leading-order squeeze-film force between equal-volume spheres,
    /// 6 pi mu R^2 v_n (1/h - 1/h_0), where asperities keep the surfaces `roughness` apart.
    fn lubrication(&self, closest: &Closest, pair: &Pair, step: f64) -> Outcome {
        let range = self.reach();
        if closest.gap >= range {
            return Outcome::default();
        }
        let strength =
            6.0 * std::f64::consts::PI * self.params.lubrication_viscosity * pair.radius.powi(2);
        let film = closest.gap.max(self.params.roughness).min(range);
        let mut resistance = strength * (1.0 / film - 1.0 / range);
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

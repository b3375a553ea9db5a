//! Motion of all grains on common times.

use glam::DVec3;
use grainwake_report::run_folder::{History, RunFolder};
use serde::Serialize;

use crate::packed::Packed;

/// Motion of the grains. Arrays run over times, then grains, then components.
#[derive(Clone, Debug, Serialize)]
pub struct Poses {
    /// Number of grains.
    pub grains: usize,
    /// Times [s].
    pub time: Packed,
    /// Centroids [m].
    pub position: Packed,
    /// Orientations: x, y, z, w of the quaternion from the body frame to the space frame.
    pub orientation: Packed,
    /// Velocities [m/s].
    pub velocity: Packed,
    /// Angular velocities [rad/s].
    pub spin: Packed,
    /// Hydrodynamic forces [N], if known.
    pub force: Option<Packed>,
    /// Magnitudes of the contact forces [N], from the balance of momentum, if known.
    pub contact_force: Option<Packed>,
    /// Numbers of contacts, if known.
    pub contacts: Option<Packed>,
    /// Every n-th output time is kept.
    pub stride: usize,
}

/// Collects the motion of all grains, thinned to at most `limit` poses.
pub fn poses(run: &RunFolder, diameters: &[Option<f64>], limit: usize) -> Option<Poses> {
    let longest = run.grains.iter().max_by_key(|history| history.len())?;
    let count = run.grains.len();
    let stride = (longest.len() * count).div_ceil(limit.max(1)).max(1);
    let last = longest.len().checked_sub(1)?;
    let rows = (0..=last).filter(|row| row % stride == 0 || *row == last);
    let times: Vec<f64> = rows.map(|row| longest.time[row]).collect();
    // A grain that has left the box has no rows any more.
    let present = |history: &&History, time: f64| {
        history
            .time
            .first()
            .zip(history.time.last())
            .is_some_and(|(a, b)| (*a..=*b).contains(&time))
    };
    let row = |history: &History, time: f64| {
        Some(history).filter(|history| present(history, time))?.nearest(time)
    };
    let at: Vec<Vec<Option<usize>>> = (times.iter())
        .map(|time| run.grains.iter().map(|history| row(history, *time)).collect())
        .collect();
    let all = |value: &dyn Fn(usize, &History, usize) -> Vec<f64>, empty: &[f64]| -> Vec<f64> {
        let of = |(grain, row): (usize, &Option<usize>)| match row {
            Some(row) => value(grain, &run.grains[grain], *row),
            None => empty.to_vec(),
        };
        at.iter().flat_map(|rows| rows.iter().enumerate().flat_map(of)).collect()
    };
    let none = [f64::NAN; 3];
    let position = all(&|_, h, row| h.position[row].to_array().to_vec(), &none);
    let orientation =
        all(&|_, h, row| h.orientation[row].to_array().to_vec(), &[0.0, 0.0, 0.0, 1.0]);
    let velocity = all(&|_, h, row| h.velocity[row].to_array().to_vec(), &none);
    let spin = all(&|_, h, row| h.angular_velocity[row].to_array().to_vec(), &none);
    let has = |known: fn(&History) -> bool| run.grains.iter().any(known);
    let force = has(|h| h.force.iter().any(Option::is_some))
        .then(|| all(&|_, h, row| h.force[row].unwrap_or(DVec3::NAN).to_array().to_vec(), &none));
    let contacts = has(|h| h.contacts.iter().any(Option::is_some))
        .then(|| all(&|_, h, row| vec![f64::from(h.contacts[row].unwrap_or(0))], &[0.0]));
    let contact_force = force.as_ref().zip(contacts.as_ref()).map(|_| {
        let of = |grain: usize, h: &History, row: usize| {
            let diameter = diameters.get(grain).copied().flatten();
            vec![contact_force(run, grain, diameter, h, row).unwrap_or(f64::NAN)]
        };
        all(&of, &[f64::NAN])
    });
    let small = |counts: Vec<f64>| {
        // The conversion saturates at 255 contacts.
        Packed::bytes(&counts.into_iter().map(|n| n as u8).collect::<Vec<u8>>())
    };
    Some(Poses {
        grains: count,
        time: Packed::doubles(times),
        position: Packed::singles(position),
        orientation: Packed::quantised(&orientation),
        velocity: Packed::quantised(&velocity),
        spin: Packed::quantised(&spin),
        force: force.map(|force| Packed::quantised(&force)),
        contact_force: contact_force.map(|force| Packed::quantised(&force)),
        contacts: contacts.map(small),
        stride,
    })
}

/// Returns the magnitude of the contact force on a grain [N]: the change of its momentum that the
/// hydrodynamic force and the submerged weight do not explain. Zero without contacts.
///
/// The acceleration is the central difference between the rows of the table, so that short impacts
/// appear with their mean over two output intervals.
fn contact_force(
    run: &RunFolder,
    grain: usize,
    diameter: Option<f64>,
    history: &History,
    row: usize,
) -> Option<f64> {
    if history.contacts[row]? == 0 {
        return Some(0.0);
    }
    let density = run.facts.grains.get(grain)?.density?;
    let volume = std::f64::consts::PI / 6.0 * diameter?.powi(3);
    let displaced = run.facts.fluid_density.unwrap_or(0.0);
    let (before, after) = (row.saturating_sub(1), (row + 1).min(history.len() - 1));
    let duration = history.time[after] - history.time[before];
    if duration <= 0.0 {
        return None;
    }
    let acceleration = (history.velocity[after] - history.velocity[before]) / duration;
    let weight = (density - displaced) * volume * run.facts.gravity?;
    let force = history.force[row].filter(|f| f.is_finite()).unwrap_or(DVec3::ZERO);
    Some((density * volume * acceleration - weight - force).length())
}

#[cfg(test)]
mod tests {
    use glam::DQuat;

    use super::*;
    use crate::packed::tests::inflated;

    fn history(times: &[f64]) -> History {
        History {
            time: times.to_vec(),
            position: times.iter().map(|t| DVec3::splat(*t)).collect(),
            velocity: vec![DVec3::ONE; times.len()],
            orientation: vec![DQuat::IDENTITY; times.len()],
            angular_velocity: vec![DVec3::ZERO; times.len()],
            force: vec![None; times.len()],
            contacts: vec![None; times.len()],
        }
    }

    fn positions(limit: usize) -> (Vec<f32>, usize) {
        let grains = vec![history(&[0.0, 1.0, 2.0, 3.0]), history(&[0.0, 1.0])];
        let run = RunFolder { grains, ..RunFolder::default() };
        let poses = poses(&run, &[None, None], limit).unwrap();
        let bytes = inflated(&poses.position);
        let x = bytes.chunks_exact(12).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]));
        (x.collect(), poses.stride)
    }

    #[test]
    fn a_grain_that_has_left_has_no_position() {
        let (x, _) = positions(100);
        assert_eq!(x[..5], [0.0, 0.0, 1.0, 1.0, 2.0]);
        assert!(x[5].is_nan() && x[7].is_nan(), "{x:?}");
    }

    #[test]
    fn thinned_poses_keep_the_first_and_the_last_time() {
        let (x, stride) = positions(3);
        assert_eq!(stride, 3);
        assert_eq!((x[0], x[2], x.len()), (0.0, 3.0, 4));
    }
}

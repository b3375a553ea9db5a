//! Offsets and turns of the members of an ensemble.

use std::f64::consts::TAU;

use glam::{DQuat, DVec3};
use grainwake_run::case::Case;
use grainwake_run::number_format::number_of_grains;

use super::expand::Model;
use super::file::{Ensemble, Study};
use crate::error::StudyError;

/// Returns the overrides of an ensemble member: one grain is moved along the two axes across
/// gravity and turned about the three axes of the space frame; if asked for, all grains are moved
/// by a part of a cell. For a tilted gravity the axis nearest to it counts.
///
/// # Errors
/// If the case has no grain of that index, or grains that have no position in the case file.
pub(crate) fn member_overrides(
    study: &Study,
    model: &Model,
    ensemble: &Ensemble,
    member: usize,
    case: &Case,
) -> Result<Vec<String>, StudyError> {
    let grains = &case.setup.grains;
    let index = ensemble.grain.unwrap_or(grains.len().saturating_sub(1));
    let refuse = |message: String, help: &str| {
        Err(study.source.problem(message, help, ensemble.span.as_ref(), "this ensemble").into())
    };
    let Some(grain) = grains.get(index) else {
        let (name, count) = (&model.name, number_of_grains(grains.len()));
        let message = format!("the ensemble moves grain {index}, but \"{name}\" has {count}");
        return refuse(message, "grains are numbered from 0");
    };
    let given = placed_grains(case);
    if index >= given {
        let message = format!(
            "the ensemble moves grain {index}, but \"{}\" gives a position of their own to \
             {given} of {}",
            model.name,
            number_of_grains(grains.len())
        );
        return refuse(message, "list the grain as [[grain]], or choose such a grain by `grain`");
    }
    let gravity = case.setup.gravity.abs();
    let vertical = if gravity.max_element() == 0.0 {
        2
    } else {
        (0..3).max_by(|i, j| gravity[*i].total_cmp(&gravity[*j])).unwrap_or(2)
    };
    let horizontal: Vec<usize> = (0..3).filter(|axis| *axis != vertical).collect();
    let draw = Draw::of(ensemble.seed, member);
    let mut offset = DVec3::ZERO;
    offset[horizontal[0]] = ensemble.offset * draw.offset[0];
    offset[horizontal[1]] = ensemble.offset * draw.offset[1];
    let mut shift = DVec3::ZERO;
    if ensemble.cell_shift {
        if given != grains.len() {
            let message = format!(
                "cell_shift moves grains with a position of their own, but \"{}\" has {given} of \
                 {}",
                model.name,
                number_of_grains(grains.len())
            );
            return refuse(message, "list the grains as [[grain]], or leave out cell_shift");
        }
        shift = case.setup.mesh.spacing * draw.shift;
    }
    let moved: Vec<usize> = match ensemble.cell_shift {
        true => (0..grains.len()).collect(),
        false => vec![index],
    };
    let place = |moved: usize| {
        let own = if moved == index { offset } else { DVec3::ZERO };
        let position = grains[moved].pose.position + shift + own;
        // A grain placed with `gap_above` has two coordinates; its height follows from the gap.
        let coordinates: Vec<String> = (0..3)
            .filter(|axis| *axis != vertical || !case.gives(&format!("grain.{moved}.gap_above")))
            .map(|axis| format!("{:e}", position[axis]))
            .collect();
        format!("grain.{moved}.position=[{}]", coordinates.join(", "))
    };
    let mut overrides: Vec<String> = moved.into_iter().map(place).collect();
    if ensemble.turn > 0.0 {
        let turned = DQuat::from_scaled_axis(ensemble.turn * draw.turn) * grain.pose.orientation;
        let DQuat { x, y, z, w } = turned;
        overrides.push(format!("grain.{index}.orientation=[{w:e}, {x:e}, {y:e}, {z:e}]"));
        overrides.push(format!("grain.{index}.rotate=[]"));
    }
    Ok(overrides)
}

/// Offset and turn of a member in units of the largest ones.
struct Draw {
    /// Uniform in the unit disc.
    offset: [f64; 2],
    /// Rotation vector, each component uniform in [-1, 1].
    turn: DVec3,
    /// Shift in cells, each component uniform in [0, 1].
    shift: DVec3,
}

impl Draw {
    /// Draws from a scrambled Sobol sequence. Equal arguments give equal results, so that the
    /// members of different models are paired.
    fn of(seed: u64, member: usize) -> Draw {
        let seed = (seed ^ (seed >> 32)) as u32;
        let unit = |dimension| f64::from(sobol_burley::sample(member as u32, dimension, seed));
        let (radius, angle) = (unit(0).sqrt(), TAU * unit(1));
        Draw {
            offset: [radius * angle.cos(), radius * angle.sin()],
            turn: DVec3::from_array([2, 3, 4].map(|dimension| 2.0 * unit(dimension) - 1.0)),
            shift: DVec3::from_array([5, 6, 7].map(unit)),
        }
    }
}

/// Returns the number of grains to which the case file gives a position, or a gap above another
/// grain; they come first.
fn placed_grains(case: &Case) -> usize {
    let gives = |grain: usize, key: &str| case.gives(&format!("grain.{grain}.{key}"));
    (0..case.setup.grains.len())
        .take_while(|grain| gives(*grain, "position") || gives(*grain, "gap_above"))
        .count()
}

#[cfg(test)]
mod tests {
    use super::Draw;

    #[test]
    fn draws_fill_the_disc_and_the_cube_evenly() {
        let draws: Vec<Draw> = (0..64).map(|member| Draw::of(3, member)).collect();
        for draw in &draws {
            assert!(draw.offset[0].hypot(draw.offset[1]) <= 1.0);
            assert!(draw.turn.abs().max_element() <= 1.0);
        }
        // A Sobol sequence has as many points in each half; the mean of random draws has a
        // standard deviation of 0.06.
        for axis in 0..3 {
            let mean = draws.iter().map(|draw| draw.turn[axis]).sum::<f64>() / 64.0;
            assert!(mean.abs() < 0.02, "{axis}: {mean}");
        }
        let inner = draws.iter().filter(|d| d.offset[0].hypot(d.offset[1]) < 0.5_f64.sqrt());
        assert_eq!(inner.count(), 32);
        assert_ne!(Draw::of(4, 1).offset, draws[1].offset);
    }
}

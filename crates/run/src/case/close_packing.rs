//! Random places of grains that lie closer than their bounding spheres allow: random places in a
//! larger box, which then shrinks to the box of the case, while grains that touch move apart.

use glam::DVec3;

use super::packing::{Random, Region};
use super::placement::extent_along;
use grainwake_solver::dem::{self, Enclosure, Gap, Grain};

/// Largest solid fraction that is tried; that of the densest lattice of equal spheres is 0.74.
const LARGEST_FRACTION: f64 = 0.74;
/// Ratio of the lengths of two boxes that are tried at the start.
const GROWTH: f64 = 1.1;
/// Ratio of the lengths of a box to those of the one before: two grains that touch then overlap by
/// 5 % of the distance of their centres.
const REDUCTION: f64 = 0.95;
/// Most rounds of displacements in each box but the last.
const ROUNDS: usize = 20;
/// Most rounds of displacements in the last box.
const LAST_ROUNDS: usize = 300;
/// Distance beyond the clearance to which grains move apart [smallest equivalent diameter].
const SLACK: f64 = 0.01;
/// Part of the missing distance by which two grains move apart in a round.
const RELAXATION: f64 = 0.9;

/// Returns random centres [m] at which the surfaces of the grains keep the clearance from each
/// other, from the grains that are placed already and from the faces of the region; none if they do
/// not fit. The orientations stay.
pub(super) fn close_places(
    region: &Region,
    grains: &[Grain],
    random: &mut Random,
) -> Option<Vec<DVec3>> {
    let volume: f64 = grains.iter().map(|grain| grain.shape.volume()).sum();
    if volume > LARGEST_FRACTION * region.volume() {
        return None;
    }
    let radii: Vec<f64> = grains.iter().map(|grain| grain.shape.bounding_radius()).collect();
    let mut scale = GROWTH;
    let starts = loop {
        match enlarged(region, scale).random(&radii, random) {
            Some(centres) => break centres,
            None => scale *= GROWTH,
        }
    };
    let mut grains = grains.to_vec();
    for (grain, centre) in grains.iter_mut().zip(starts) {
        grain.pose.position = centre;
    }
    let mut apart = false;
    while scale > 1.0 {
        let reduced = (REDUCTION * scale).max(1.0);
        grains.iter_mut().for_each(|grain| grain.pose.position *= reduced / scale);
        scale = reduced;
        let rounds = if scale > 1.0 { ROUNDS } else { LAST_ROUNDS };
        apart = move_apart(&enlarged(region, scale), &mut grains, rounds);
    }
    let centres = grains.iter().map(|grain| region.enclosure.wrap(grain.pose.position));
    apart.then(|| centres.collect())
}

/// Returns the region with all lengths multiplied by `scale`, but the grains and the clearance.
fn enlarged(region: &Region, scale: f64) -> Region {
    let Enclosure { lower, upper, .. } = region.enclosure;
    let mut placed = region.placed.clone();
    placed.iter_mut().for_each(|grain| grain.pose.position *= scale);
    Region {
        lower: region.lower * scale,
        upper: region.upper * scale,
        enclosure: Enclosure { lower: lower * scale, upper: upper * scale, ..region.enclosure },
        placed,
        ..*region
    }
}

/// Moves grains apart until they keep the clearance, at most `rounds` times; returns whether they
/// do.
fn move_apart(region: &Region, grains: &mut [Grain], rounds: usize) -> bool {
    let ranges: Vec<[DVec3; 2]> = grains.iter().map(|grain| centre_range(region, grain)).collect();
    if ranges.iter().any(|[low, high]| !low.cmple(*high).all()) {
        return false;
    }
    let diameters = grains.iter().map(|grain| grain.shape.equivalent_diameter());
    let aim = region.clearance + SLACK * diameters.fold(f64::INFINITY, f64::min);
    let count = grains.len();
    for _ in 0..rounds {
        let all: Vec<Grain> = grains.iter().chain(&region.placed).cloned().collect();
        let mut gaps = dem::gaps(&all, &region.enclosure, aim);
        // Placed grains stay. A grain that touches its own image is refused later.
        gaps.retain(|gap| gap.first < count && gap.first != gap.second);
        if gaps.iter().all(|gap| gap.distance >= region.clearance) {
            return true;
        }
        let mut shifts = vec![DVec3::ZERO; all.len()];
        for Gap { first, second, distance, direction } in gaps {
            let share = if second < count { 0.5 } else { 1.0 };
            let shift = share * RELAXATION * (aim - distance) * direction;
            shifts[first] -= shift;
            shifts[second] += shift;
        }
        for ((grain, shift), [low, high]) in grains.iter_mut().zip(shifts).zip(&ranges) {
            let moved = grain.pose.position + shift;
            let clamped = moved.clamp(*low, *high);
            for axis in 0..3 {
                let free = region.spans_period(axis);
                grain.pose.position[axis] = if free { moved[axis] } else { clamped[axis] };
            }
        }
    }
    false
}

/// Range of the centre of a grain in the region [m], lower and upper corner.
fn centre_range(region: &Region, grain: &Grain) -> [DVec3; 2] {
    let centred = grain.clone().with_position(DVec3::ZERO);
    let (mut low, mut high) = (region.lower, region.upper);
    for axis in (0..3).filter(|axis| !region.spans_period(*axis)) {
        let (lowest, highest) = extent_along(&centred, axis);
        low[axis] += region.clearance - lowest;
        high[axis] -= region.clearance + highest;
    }
    [low, high]
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use grainwake_shape::{ShapeOptions, analytic};
    use grainwake_solver::dem::{Side, initial_overlaps, outside};
    use rand::SeedableRng;

    /// Ellipsoids of 2 : 1.2 : 1, long and short ones, in random orientations; unit volume.
    fn ellipsoids(count: usize) -> Vec<Grain> {
        let unit = (4.0 / 3.0 * std::f64::consts::PI * 2.4f64).cbrt().recip();
        let options = ShapeOptions { nodes: Some(300), ..ShapeOptions::default() };
        let shape = analytic::ellipsoid(2.0 * unit, 1.2 * unit, unit, &options).unwrap();
        let shape = Arc::new(shape);
        let mut random = Random::seed_from_u64(5);
        let mut turned = || {
            let orientation = crate::case::packing::orientation(&mut random);
            Grain::new(shape.clone(), 1.0).with_orientation(orientation)
        };
        (0..count).map(|_| turned()).collect()
    }

    fn region(periodic: bool, clearance: f64, placed: Vec<Grain>) -> Region {
        let (lower, upper) = (DVec3::new(-3.0, 2.0, 0.0), DVec3::new(2.0, 7.0, 8.0));
        let sides = [[Side::WALL; 2]; 3];
        let enclosure = Enclosure { lower, upper, periodic: [periodic, periodic, false], sides };
        Region { lower, upper, clearance, enclosure, placed }
    }

    fn placed_at(grains: &[Grain], centres: &[DVec3]) -> Vec<Grain> {
        let pairs = grains.iter().zip(centres);
        pairs.map(|(grain, centre)| grain.clone().with_position(*centre)).collect()
    }

    #[test]
    fn surfaces_keep_the_clearance_where_bounding_spheres_find_no_place() {
        let ball = Grain::new(analytic::sphere(1.0, &ShapeOptions::default()).unwrap(), 1.0)
            .with_position(DVec3::new(-0.5, 4.5, 4.0));
        // Solid fraction 0.35, or 0.37 with the sphere.
        let grains = ellipsoids(70);
        let radii: Vec<f64> = grains.iter().map(|grain| grain.shape.bounding_radius()).collect();
        for periodic in [false, true] {
            let region = region(periodic, 0.02, vec![ball.clone()]);
            assert_eq!(region.random(&radii, &mut Random::seed_from_u64(1)), None);
            let places = || close_places(&region, &grains, &mut Random::seed_from_u64(1)).unwrap();
            let centres = places();
            let mut all = placed_at(&grains, &centres);
            all.push(ball.clone());
            assert_eq!(initial_overlaps(&all, &region.enclosure), []);
            assert_eq!(outside(&all, &region.enclosure), []);
            let near = dem::gaps(&all, &region.enclosure, 0.1);
            assert!(near.len() > 100, "{} near pairs", near.len());
            assert!(near.iter().all(|gap| gap.distance >= 0.02));
            assert_eq!(centres, places());
            let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
            assert_eq!(centres, pool.install(places));
        }
    }

    #[test]
    fn too_many_grains_find_no_place() {
        let places = |count| {
            let region = region(true, 0.0, Vec::new());
            close_places(&region, &ellipsoids(count), &mut Random::seed_from_u64(1))
        };
        assert!(places(90).is_some());
        assert_eq!(places(140), None);
        assert_eq!(places(160), None);
    }
}

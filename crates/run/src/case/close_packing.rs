//! Random places of grains that lie closer than their bounding spheres allow: random places in a
//! larger region, which then shrinks to that of the case, while grains that touch move apart.
//!
//! Overlaps stay shallow that way. From random places in the region itself the grains hardly come
//! apart: deep inside a grain the gradient of its distance field does not lead out of the overlap.

use glam::DVec3;

use super::packing::{Random, Region};
use super::placement::extent_along;
use grainwake_solver::dem::{self, Enclosure, Gap, Grain};

/// Largest solid fraction that is tried, half of the clearance included; that of the densest
/// lattice of equal spheres is 0.74.
const LARGEST_FRACTION: f64 = 0.74;
/// Largest solid fraction of the bounding spheres in the first region.
const FIRST_FRACTION: f64 = 0.25;
/// Ratio of the lengths of two regions that are tried at the start.
const GROWTH: f64 = 1.1;
/// Ratio of the lengths of a region to those of the one before: two grains that touch then overlap
/// by 5 % of the distance of their centres.
const REDUCTION: f64 = 0.95;
/// Number of random starts: flat grains may block each other between two walls.
const ATTEMPTS: usize = 3;
/// Most rounds of displacements in each region but the last.
const ROUNDS: usize = 20;
/// Most rounds of displacements in the last region.
const LAST_ROUNDS: usize = 600;
/// Rounds in which the sum of the missing distances must fall by a tenth.
const PROGRESS_ROUNDS: usize = 60;
/// Distance beyond the clearance to which grains move apart [smallest equivalent diameter].
const SLACK: f64 = 0.01;
/// Part of the missing distance by which two grains move apart in a round.
const RELAXATION: f64 = 0.9;

/// Returns random centres [m] at which the surfaces of the grains keep the clearance from each
/// other, from the grains that are placed already and from the faces of the region; none if they do
/// not fit or the search was ended. The orientations stay.
pub(super) fn close_places(
    region: &Region,
    grains: &[Grain],
    random: &mut Random,
) -> Option<Vec<DVec3>> {
    let solid = fraction(region, grains, |grain| grain.shape.equivalent_diameter());
    if solid > LARGEST_FRACTION || !grains.iter().all(|grain| has_room(region, grain)) {
        return None;
    }
    (0..ATTEMPTS).find_map(|_| shrink(region, grains, random))
}

/// Returns places of the grains at the end of a sequence of smaller and smaller regions.
fn shrink(region: &Region, grains: &[Grain], random: &mut Random) -> Option<Vec<DVec3>> {
    let radii: Vec<f64> = grains.iter().map(|grain| grain.shape.bounding_radius()).collect();
    let spheres = fraction(region, grains, |grain| 2.0 * grain.shape.bounding_radius());
    let mut scale = (spheres / FIRST_FRACTION).cbrt().max(GROWTH);
    let starts = loop {
        match enlarged(region, scale).random(&radii, random) {
            Some(centres) => break centres,
            None if region.stopped() => return None,
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

/// Returns the fraction of the region that spheres of the given diameters [m] take, half of the
/// clearance included.
fn fraction(region: &Region, grains: &[Grain], diameter: fn(&Grain) -> f64) -> f64 {
    let cubes = grains.iter().map(|grain| (diameter(grain) + region.clearance).powi(3));
    std::f64::consts::PI / 6.0 * cubes.sum::<f64>() / region.volume()
}

/// Returns the region with all lengths multiplied by `scale`, but the grains and the clearance.
fn enlarged<'a>(region: &Region<'a>, scale: f64) -> Region<'a> {
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

/// Moves grains into the region and apart until they keep the clearance; returns whether they do.
/// It gives up after `rounds`, when they hardly come apart any more, or if the search was ended.
fn move_apart(region: &Region, grains: &mut [Grain], rounds: usize) -> bool {
    let ranges: Vec<[DVec3; 2]> = grains.iter().map(|grain| centre_range(region, grain)).collect();
    let diameters = grains.iter().map(|grain| grain.shape.equivalent_diameter());
    let aim = region.clearance + SLACK * diameters.fold(f64::INFINITY, f64::min);
    let count = grains.len();
    let mut to_beat = f64::INFINITY;
    for round in 0..rounds {
        if region.stopped() {
            return false;
        }
        for (grain, [low, high]) in grains.iter_mut().zip(&ranges) {
            let inside = grain.pose.position.clamp(*low, *high);
            for axis in (0..3).filter(|axis| !region.spans_period(*axis)) {
                grain.pose.position[axis] = inside[axis];
            }
        }
        let all: Vec<Grain> = grains.iter().chain(&region.placed).cloned().collect();
        let mut gaps = dem::gaps(&all, &region.enclosure, aim);
        // Placed grains stay. A grain that touches its own image is refused later.
        gaps.retain(|gap| gap.first < count && gap.first != gap.second);
        if gaps.iter().all(|gap| gap.distance >= region.clearance) {
            return true;
        }
        if round % PROGRESS_ROUNDS == 0 {
            let missing = gaps.iter().map(|gap| aim - gap.distance).sum::<f64>();
            if missing > to_beat {
                return false;
            }
            to_beat = 0.9 * missing;
        }
        for Gap { first, second, distance, direction } in gaps {
            let shift = RELAXATION * (aim - distance) * direction;
            // Of two grains the smaller one moves farther.
            let [one, other] = [first, second].map(|index| all[index].shape.volume());
            let share = if second < count { other / (one + other) } else { 1.0 };
            grains[first].pose.position -= share * shift;
            if second < count {
                grains[second].pose.position += (1.0 - share) * shift;
            }
        }
    }
    false
}

/// Returns whether a grain fits into the region.
fn has_room(region: &Region, grain: &Grain) -> bool {
    let [low, high] = centre_range(region, grain);
    low.cmple(high).all()
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
    use std::sync::atomic::AtomicBool;

    use super::*;
    use crate::case::NEVER;
    use grainwake_shape::{Shape, ShapeOptions, analytic};
    use grainwake_solver::dem::{Side, outside};
    use rand::SeedableRng;

    /// Ellipsoid of unit volume with axes in the given ratios.
    fn ellipsoid(axes: [f64; 3]) -> Arc<Shape> {
        let volume = std::f64::consts::PI / 6.0 * axes.iter().product::<f64>();
        let [a, b, c] = axes.map(|axis| 0.5 * axis / volume.cbrt());
        let options = ShapeOptions { nodes: Some(300), ..ShapeOptions::default() };
        Arc::new(analytic::ellipsoid(a, b, c, &options).unwrap())
    }

    /// Grains of one shape in random orientations.
    fn turned(shape: &Arc<Shape>, count: usize) -> Vec<Grain> {
        let mut random = Random::seed_from_u64(5);
        let mut turned = || {
            let orientation = crate::case::packing::orientation(&mut random);
            Grain::new(shape.clone(), 1.0).with_orientation(orientation)
        };
        (0..count).map(|_| turned()).collect()
    }

    fn ball(radius: f64, position: DVec3) -> Grain {
        let sphere = analytic::sphere(radius, &ShapeOptions::default()).unwrap();
        Grain::new(sphere, 1.0).with_position(position)
    }

    /// Box of 5 x 5 x 8 away from the origin, filled as a whole.
    fn whole_box(periodic: bool, clearance: f64) -> Region<'static> {
        let (lower, upper) = (DVec3::new(-3.0, 2.0, 0.0), DVec3::new(2.0, 7.0, 8.0));
        let sides = [[Side::WALL; 2]; 3];
        let enclosure = Enclosure { lower, upper, periodic: [periodic, periodic, false], sides };
        Region { lower, upper, clearance, enclosure, placed: Vec::new(), stop: &NEVER }
    }

    /// Places the grains and checks that they keep the clearance from each other, from the placed
    /// ones and from the faces of the region; returns the centres and the gaps below 0.1.
    fn checked(region: &Region, grains: &[Grain], seed: u64) -> Option<(Vec<DVec3>, Vec<Gap>)> {
        let centres = close_places(region, grains, &mut Random::seed_from_u64(seed))?;
        let pairs = grains.iter().zip(&centres);
        let mut all: Vec<Grain> =
            pairs.map(|(grain, centre)| grain.clone().with_position(*centre)).collect();
        let clear = Enclosure {
            lower: region.lower + region.clearance,
            upper: region.upper - region.clearance,
            periodic: [0, 1, 2].map(|axis| region.spans_period(axis)),
            sides: [[Side::WALL; 2]; 3],
        };
        let beyond = |all: &[Grain]| outside(all, &clear).iter().map(|o| o.by).fold(0.0, f64::max);
        assert!(beyond(&all) < 1e-9, "{}", beyond(&all));
        all.extend(region.placed.iter().cloned());
        let gaps = dem::gaps(&all, &region.enclosure, 0.1);
        let moved = |gap: &&Gap| gap.first < grains.len();
        assert!(gaps.iter().filter(moved).all(|gap| gap.distance >= region.clearance));
        Some((centres, gaps))
    }

    #[test]
    fn surfaces_keep_the_clearance_where_bounding_spheres_find_no_place() {
        // Solid fraction 0.35, or 0.37 with the sphere.
        let grains = turned(&ellipsoid([2.0, 1.2, 1.0]), 70);
        let radii: Vec<f64> = grains.iter().map(|grain| grain.shape.bounding_radius()).collect();
        for periodic in [false, true] {
            let mut region = whole_box(periodic, 0.02);
            region.placed.push(ball(1.0, DVec3::new(-0.5, 4.5, 4.0)));
            assert_eq!(region.random(&radii, &mut Random::seed_from_u64(1)), None);
            let (centres, gaps) = checked(&region, &grains, 1).unwrap();
            assert!(gaps.len() > 100, "{} gaps", gaps.len());
            let places = || close_places(&region, &grains, &mut Random::seed_from_u64(1)).unwrap();
            let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
            assert_eq!(centres, pool.install(places));
        }
    }

    #[test]
    fn a_part_of_the_box_is_filled_between_placed_grains() {
        let mut region = whole_box(true, 0.02);
        (region.lower, region.upper) = (DVec3::new(-3.0, 2.5, 1.0), DVec3::new(2.0, 6.0, 5.0));
        // Two placed grains overlap: they stay as they are.
        let places = [[0.0, 2.0, 3.0], [-2.5, 4.0, 5.0], [-2.4, 4.0, 6.0]];
        region.placed = places.map(|x| ball(0.6, DVec3::from_array(x))).to_vec();
        let grains = turned(&ellipsoid([2.0, 1.2, 1.0]), 22);
        assert!(checked(&region, &grains, 1).is_some());
    }

    #[test]
    fn flat_grains_stay_within_a_thin_region() {
        let shape = ellipsoid([4.0, 4.0, 1.0]);
        let mut region = whole_box(false, 0.0);
        let thickness = 1.02 * (shape.upper() - shape.lower()).min_element();
        (region.lower.z, region.upper.z) = (3.0, 3.0 + thickness);
        for count in [1, 3] {
            let grains = vec![Grain::new(shape.clone(), 1.0); count];
            for seed in 1..=10 {
                assert!(checked(&region, &grains, seed).is_some(), "{count} grains, seed {seed}");
            }
        }
    }

    #[test]
    fn small_and_large_grains_mix() {
        // Diameters of 0.4 to 3.2; solid fraction 0.42.
        let mut grains: Vec<Grain> = (0..150).map(|_| ball(0.2, DVec3::ZERO)).collect();
        grains.extend((0..30).map(|_| ball(0.5, DVec3::ZERO)));
        grains.extend((0..3).map(|_| ball(1.6, DVec3::ZERO)));
        assert!(checked(&whole_box(true, 0.0), &grains, 1).is_some());
    }

    #[test]
    fn a_search_that_was_ended_finds_no_places() {
        let grains = turned(&ellipsoid([2.0, 1.2, 1.0]), 20);
        let mut region = whole_box(true, 0.0);
        assert!(close_places(&region, &grains, &mut Random::seed_from_u64(1)).is_some());
        let stop = AtomicBool::new(true);
        region.stop = &stop;
        assert!(close_places(&region, &grains, &mut Random::seed_from_u64(1)).is_none());
    }

    #[test]
    fn too_many_grains_find_no_place() {
        let shape = ellipsoid([2.0, 1.2, 1.0]);
        let places =
            |count, clearance| checked(&whole_box(true, clearance), &turned(&shape, count), 1);
        // Solid fractions of 0.45, 0.7 and 0.8.
        assert!(places(90, 0.0).is_some());
        assert!(places(140, 0.0).is_none());
        assert!(places(160, 0.0).is_none());
        // The clearance alone fills the region, or leaves no room between the walls.
        assert!(places(60, 0.5).is_none());
        assert!(places(1, 3.5).is_none());
    }
}

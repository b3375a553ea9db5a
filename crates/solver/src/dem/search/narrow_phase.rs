//! Narrow phase: contact patch of a pair, from the surface patches of each grain in the
//! distance field of its partner (Eqs 7-8). A sphere touches at its deepest point.

use glam::DVec3;

use super::deepest_point::deepest_point_of_sphere;
use super::patch_scan::{PenetratingPoint, SurfaceMemory, scan_candidates, scan_patches};
use super::patches::PosedShape;
use super::surface::{GRADIENT_MARGIN, PartnerField, SurfacePoint, is_sphere};

/// Penetrating point of a pair, or the closest point of a pair without contact, space frame.
#[derive(Clone, Copy, Debug)]
pub(in crate::dem) struct ContactPoint {
    /// Identifier of the surface patch; ascending within a pair.
    pub id: u32,
    /// Overlap d_i [m] (Eq. 7); negative across a gap.
    pub overlap: f64,
    /// Area that the point represents, over the mean area of the grain's nodes. The nodes of a
    /// large grain thus count as much as those of a small one.
    pub area: f64,
    /// Lever arm from the centroid of the first grain [m].
    pub lever_arm: DVec3,
    /// Unit normal out of the first grain, into its partner (Eq. 8).
    pub normal: DVec3,
    /// Overlap gained per displacement along the normal.
    pub slope: f64,
}

/// Penetrating points of a pair, with the buffers of the narrow phase.
#[derive(Debug, Default)]
pub(in crate::dem) struct ContactPatch {
    /// Penetrating points, in ascending identifier.
    pub points: Vec<ContactPoint>,
    /// Lower bound of the distance between the surfaces, less the range of lubrication [m]; not
    /// positive if unknown.
    pub separation: f64,
    /// Results of the last search of each surface.
    memory: [SurfaceMemory; 2],
    found: Vec<PenetratingPoint>,
}

impl ContactPatch {
    /// Discards what earlier searches found.
    pub fn reset(&mut self) {
        self.separation = 0.0;
        self.memory.iter_mut().for_each(SurfaceMemory::reset);
    }

    /// Records that the surfaces may have approached each other by `displacement` [m].
    pub fn approach(&mut self, displacement: f64) {
        self.separation -= displacement;
        self.memory.iter_mut().for_each(|memory| memory.approach(displacement));
    }

    /// Finds the penetrating points of two grains (Eqs 7-8); returns the closest point if the
    /// surfaces are nearer than `reach` [m].
    pub fn find_grain_contact(
        &mut self,
        a: &PosedShape,
        b: &PosedShape,
        reach: f64,
    ) -> Option<ContactPoint> {
        self.points.clear();
        let branch = a.position - b.position;
        self.separation =
            branch.length() - a.shape.bounding_radius() - b.shape.bounding_radius() - reach;
        if self.separation > 0.0 {
            return None;
        }
        let to_b = b.rotation.transpose();
        let rotation = to_b * a.rotation;
        let field_of_b = PartnerField::grain(b.shape, rotation, to_b * branch);
        let (bound_a, closest_a) = self.search_surface(FIRST_GRAIN, a, &field_of_b, reach, |p| {
            (a.rotation * p.position, -(a.rotation * p.normal))
        });
        let translation = -(a.rotation.transpose() * branch);
        let field_of_a = PartnerField::grain(a.shape, rotation.transpose(), translation);
        let (bound_b, closest_b) = self.search_surface(SECOND_GRAIN, b, &field_of_a, reach, |p| {
            (b.rotation * p.position - branch, b.rotation * p.normal)
        });
        let closest = match (is_sphere(a.shape), is_sphere(b.shape)) {
            (true, false) => {
                self.keep_other_normals(closest_a, SECOND_GRAIN);
                closest_a
            }
            (false, true) => {
                self.keep_other_normals(closest_b, FIRST_GRAIN);
                closest_b
            }
            _ => {
                let both = closest_a.into_iter().chain(closest_b);
                both.min_by(|a, b| b.overlap.total_cmp(&a.overlap))
            }
        };
        self.finish(closest, bound_a.min(bound_b), reach)
    }

    /// Finds the penetrating points of a grain in a wall with the unit normal `inward`, at the
    /// distance `offset` [m] from the centroid; returns the closest point if nearer than `reach`
    /// [m].
    pub fn find_wall_contact(
        &mut self,
        a: &PosedShape,
        inward: DVec3,
        offset: f64,
        reach: f64,
    ) -> Option<ContactPoint> {
        self.points.clear();
        self.separation = offset - a.shape.bounding_radius() - reach;
        if self.separation > 0.0 {
            return None;
        }
        let wall = PartnerField::HalfSpace { normal: a.rotation.transpose() * inward, offset };
        let (bound, closest) = self
            .search_surface(FIRST_GRAIN, a, &wall, reach, |p| (a.rotation * p.position, -inward));
        self.finish(closest, bound, reach)
    }

    /// Searches the surface of `owner` and appends its penetrating points; `mark` tells whether it
    /// is the first or the second grain of the pair.
    ///
    /// `to_space` gives the lever arm from the centroid of the first grain and the normal out of
    /// it. Returns a lower bound of the distance between surface and partner [m], and the closest
    /// point if it may be nearer than `reach` [m].
    fn search_surface(
        &mut self,
        mark: u32,
        owner: &PosedShape,
        partner: &PartnerField,
        reach: f64,
        to_space: impl Fn(&SurfacePoint) -> (DVec3, DVec3),
    ) -> (f64, Option<ContactPoint>) {
        let memory = &mut self.memory[usize::from(mark == SECOND_GRAIN)];
        let (bound, closest) = scan_surface(owner, partner, reach, memory, &mut self.found);
        let area = owner.tree.spacing * owner.tree.spacing;
        let scale = 1.0 / area;
        let closest = closest.map(|point| PenetratingPoint { id: DEEPEST_POINT, area, point });
        if is_sphere(owner.shape) {
            // A sphere touches at its deepest point alone.
            self.found.clear();
            self.found.extend(closest.filter(|found| found.point.distance < 0.0));
        }
        let contact_point = |found: &PenetratingPoint| {
            let (lever_arm, normal) = to_space(&found.point);
            let (overlap, slope) = (-found.point.distance, found.point.slope);
            let (id, area) = (found.id | mark, found.area * scale);
            ContactPoint { id, overlap, area, lever_arm, normal, slope }
        };
        self.points.extend(self.found.iter().map(contact_point));
        (bound, closest.as_ref().map(contact_point))
    }

    /// Reduces the areas of the patches that touch a sphere, those of the grain `mark`, where they
    /// belong to the contact of the sphere's own point: the sphere would roll over them as over
    /// bumps. Patches with other normals, as in a groove, keep their areas.
    fn keep_other_normals(&mut self, of_sphere: Option<ContactPoint>, mark: u32) {
        let Some(of_sphere) = of_sphere else { return };
        let [same, other] = PATCH_ANGLES.map(f64::cos);
        for point in self.points.iter_mut().filter(|point| point.id & SECOND_GRAIN == mark) {
            let cosine = point.normal.dot(of_sphere.normal);
            point.area *= ((same - cosine) / (same - other)).clamp(0.0, 1.0);
        }
        self.points.retain(|point| point.area > 0.0);
    }

    /// Sets the separation from the lower bound of the distance that a search gave [m]; returns the
    /// closest point if it is nearer than `reach` [m].
    fn finish(
        &mut self,
        closest: Option<ContactPoint>,
        bound: f64,
        reach: f64,
    ) -> Option<ContactPoint> {
        self.separation = if self.points.is_empty() { bound - reach } else { 0.0 };
        closest.filter(|point| -point.overlap < reach)
    }
}

/// Bit of a point identifier that tells to which grain of the pair the point belongs.
const FIRST_GRAIN: u32 = 0;
const SECOND_GRAIN: u32 = 1 << 31;
/// Identifier of the deepest point of a sphere, which is no patch.
const DEEPEST_POINT: u32 = SECOND_GRAIN - 1;

/// Range of the search for the nearest patch over the distance up to which it matters; bounds the
/// separation of the pair.
const SEARCH_RANGE: f64 = 3.0;
/// Largest distance of a point of a sphere from the nearest node [node spacings].
const NODE_COVERAGE: f64 = 1.2;

/// Angles between the normals of two points up to which they belong to one patch of a sphere, and
/// from which to two [rad].
const PATCH_ANGLES: [f64; 2] = [0.35, 0.7];

/// Tests the surface of `owner` in the field of its partner (Eq. 7): a sphere at its deepest point,
/// other shapes at their patches. Penetrating patches go to `found` in ascending identifier.
///
/// Returns a lower bound of the distance between surface and partner [m], and the closest point of
/// the surface if it may be nearer than `reach` [m]. `memory` is that of the last search in the
/// same step.
fn scan_surface(
    owner: &PosedShape,
    partner: &PartnerField,
    reach: f64,
    memory: &mut SurfaceMemory,
    found: &mut Vec<PenetratingPoint>,
) -> (f64, Option<SurfacePoint>) {
    let (tree, is_sphere) = (owner.tree, is_sphere(owner.shape));
    if is_sphere
        && let Some(deepest) = partner.deepest_point_of_sphere(owner.shape.bounding_radius())
    {
        return (deepest.distance, Some(deepest));
    }
    let range = NODE_COVERAGE * tree.spacing + reach;
    let nearest = scan_candidates(tree, partner, memory, found)
        .unwrap_or_else(|| scan_patches(tree, partner, SEARCH_RANGE * range, memory, found));
    memory.nearest = nearest.index;
    // On a wall the nearest patch may be another one than that of the least bound.
    let others = memory.candidates.iter().filter(|_| reach > 0.0 && partner.is_wall());
    let near = nearest.index.filter(|_| nearest.distance < range).into_iter();
    let points = (near.chain(others.map(|(_, index)| *index)))
        .filter_map(|index| tree.patches[index as usize].deepest_point(partner));
    let closest = points.min_by(|a, b| a.distance.total_cmp(&b.distance));
    if !is_sphere {
        return (nearest.distance / GRADIENT_MARGIN, closest);
    }
    let deepest =
        closest.map(|start| deepest_point_of_sphere(owner, partner, start, &memory.candidates));
    // Half of the gap may close before the pair is searched again.
    let bound = nearest.distance - NODE_COVERAGE * tree.spacing;
    (deepest.map_or(bound, |point| bound.max(0.5 * point.distance)), deepest)
}

//! Contact patch of a pair: penetrating points of both surfaces in the space frame.

use glam::DVec3;

use super::closest_point::SurfacePoint;
use super::narrow_phase::{PenetratingPoint, PosedShape, SECOND_GRAIN, scan_surface};
use super::partner_field::PartnerField;

/// Penetrating point of a pair, space frame.
#[derive(Clone, Copy, Debug)]
pub(in crate::dem) struct ContactPoint {
    /// Identifier of the node or point; ascending within a pair.
    pub id: u32,
    /// Overlap d_i [m], positive (Eq. 7).
    pub overlap: f64,
    /// Area that the point represents [m^2].
    pub area: f64,
    /// Lever arm from the centroid of the first grain [m].
    pub lever_arm: DVec3,
    /// Unit normal out of the first grain, into its partner (Eq. 8).
    pub normal: DVec3,
}

/// Closest point of a pair without contact, space frame.
#[derive(Clone, Copy, Debug)]
pub(in crate::dem) struct ClosestPoint {
    /// Distance between the surfaces [m], negative if they overlap.
    pub gap: f64,
    /// Lever arm from the centroid of the first grain [m].
    pub lever_arm: DVec3,
    /// Unit normal out of the first grain.
    pub normal: DVec3,
}

impl ClosestPoint {
    fn new(point: &SurfacePoint, (lever_arm, normal): (DVec3, DVec3)) -> ClosestPoint {
        ClosestPoint { gap: point.distance, lever_arm, normal }
    }

    fn nearer(a: Option<ClosestPoint>, b: Option<ClosestPoint>) -> Option<ClosestPoint> {
        match (a, b) {
            (Some(a), Some(b)) => Some(if b.gap < a.gap { b } else { a }),
            (a, b) => a.or(b),
        }
    }
}

/// Penetrating points of a pair, with the buffers of the narrow phase.
#[derive(Debug, Default)]
pub(in crate::dem) struct ContactPatch {
    /// Penetrating points, in ascending identifier.
    pub points: Vec<ContactPoint>,
    /// Lower bound of the distance between the surfaces [m]; not positive if unknown.
    pub separation: f64,
    /// Nearest node of either grain in the last search.
    seeds: [Option<u32>; 2],
    found: Vec<PenetratingPoint>,
}

impl Clone for ContactPatch {
    fn clone(&self) -> ContactPatch {
        let mut copy = ContactPatch::default();
        copy.clone_from(self);
        copy
    }
    /// Copies a patch into the buffers of this one.
    fn clone_from(&mut self, source: &ContactPatch) {
        let (mut points, mut found) =
            (std::mem::take(&mut self.points), std::mem::take(&mut self.found));
        points.clone_from(&source.points);
        found.clone_from(&source.found);
        *self = ContactPatch { points, found, ..*source };
    }
}

impl ContactPatch {
    /// Discards the separation and the nearest nodes of earlier searches.
    pub fn reset(&mut self) {
        self.separation = 0.0;
        self.seeds = [None; 2];
    }

    /// Finds the penetrating points of two grains (Eqs 7-8); returns the closest point if the
    /// surfaces are nearer than `reach` [m].
    pub fn find_grain_contact(
        &mut self,
        a: &PosedShape,
        b: &PosedShape,
        reach: f64,
    ) -> Option<ClosestPoint> {
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
        let scan_a = scan_surface(a, &field_of_b, reach, &mut self.seeds[0], &mut self.found);
        let to_space = |p: &SurfacePoint| (a.rotation * p.position, -(a.rotation * p.normal));
        let closest_a = scan_a.closest.map(|p| ClosestPoint::new(&p, to_space(&p)));
        self.append_points(0, to_space);
        let translation = -(a.rotation.transpose() * branch);
        let field_of_a = PartnerField::grain(a.shape, rotation.transpose(), translation);
        let scan_b = scan_surface(b, &field_of_a, reach, &mut self.seeds[1], &mut self.found);
        let to_space = |p: &SurfacePoint| (b.rotation * p.position - branch, b.rotation * p.normal);
        let closest_b = scan_b.closest.map(|p| ClosestPoint::new(&p, to_space(&p)));
        self.append_points(SECOND_GRAIN, to_space);
        self.separation = if self.points.is_empty() {
            scan_a.separation.max(scan_b.separation) - reach
        } else {
            0.0
        };
        ClosestPoint::nearer(closest_a, closest_b)
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
    ) -> Option<ClosestPoint> {
        self.points.clear();
        self.separation = offset - a.shape.bounding_radius() - reach;
        if self.separation > 0.0 {
            return None;
        }
        let wall = PartnerField::HalfSpace { normal: a.rotation.transpose() * inward, offset };
        let scan = scan_surface(a, &wall, reach, &mut self.seeds[0], &mut self.found);
        let to_space = |p: &SurfacePoint| (a.rotation * p.position, -inward);
        self.append_points(0, to_space);
        self.separation = if self.points.is_empty() { scan.separation - reach } else { 0.0 };
        scan.closest.map(|p| ClosestPoint::new(&p, to_space(&p)))
    }

    /// Appends the points of the last scan, with lever arm and normal from `to_space`.
    fn append_points(
        &mut self,
        grain_bit: u32,
        to_space: impl Fn(&SurfacePoint) -> (DVec3, DVec3),
    ) {
        self.points.extend(self.found.iter().map(|found| {
            let (lever_arm, normal) = to_space(&found.point);
            ContactPoint {
                id: found.id | grain_bit,
                overlap: -found.point.distance,
                area: found.area,
                lever_arm,
                normal,
            }
        }));
    }
}

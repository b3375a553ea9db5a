//! Volume of the convex hull of points (Quickhull, Barber and others 1996).

use crate::triangles::bounds;
use glam::DVec3;

struct Facet {
    corners: [u32; 3],
    /// Neighbouring facet across the edge from corner i to corner i + 1.
    across: [u32; 3],
    normal: DVec3,
    offset: f64,
    /// Points above this facet that are assigned to it.
    outside: Vec<u32>,
    alive: bool,
}

/// Returns volume [m^3] and corners of the convex hull, or `None` if the points are coplanar or
/// rounding errors make the construction fail.
pub(crate) fn measure(points: &[DVec3]) -> Option<(f64, Vec<DVec3>)> {
    let hull = Hull::build(points)?;
    Some((hull.volume()?, hull.corners()))
}

struct Hull<'a> {
    points: &'a [DVec3],
    facets: Vec<Facet>,
    tolerance: f64,
}

impl<'a> Hull<'a> {
    fn build(points: &'a [DVec3]) -> Option<Hull<'a>> {
        let (lower, upper) = bounds(points);
        let size = (upper - lower).max_element();
        if !(size.is_finite() && size > 0.0) {
            return None;
        }
        let mut hull = Hull { points, facets: Vec::new(), tolerance: 1e-9 * size };
        hull.start()?;
        let mut pending: Vec<u32> = (0..4).collect();
        while let Some(facet) = pending.pop() {
            let f = &hull.facets[facet as usize];
            if !f.alive || f.outside.is_empty() {
                continue;
            }
            let eye = *f.outside.iter().max_by(|a, b| {
                hull.height(facet, **a).total_cmp(&hull.height(facet, **b)).then(b.cmp(a))
            })?;
            pending.extend(hull.add(facet, eye)?);
        }
        Some(hull)
    }

    fn height(&self, facet: u32, point: u32) -> f64 {
        let f = &self.facets[facet as usize];
        f.normal.dot(self.points[point as usize]) - f.offset
    }

    fn push(&mut self, corners: [u32; 3]) -> u32 {
        let [a, b, c] = corners.map(|i| self.points[i as usize]);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        self.facets.push(Facet {
            corners,
            across: [u32::MAX; 3],
            normal,
            offset: normal.dot(a),
            outside: Vec::new(),
            alive: true,
        });
        (self.facets.len() - 1) as u32
    }

    /// Builds the first tetrahedron: the farthest points along an axis, from the line, and from the
    /// plane.
    fn start(&mut self) -> Option<()> {
        let p = self.points;
        let all = 0..p.len() as u32;
        let farthest = |score: &dyn Fn(DVec3) -> f64| {
            all.clone().max_by(|a, b| {
                score(p[*a as usize]).total_cmp(&score(p[*b as usize])).then(b.cmp(a))
            })
        };
        let a = farthest(&|x| -x.x)?;
        let at = |i: u32| p[i as usize];
        let b = farthest(&|x| x.distance_squared(at(a)))?;
        let line = (at(b) - at(a)).normalize_or_zero();
        let c = farthest(&|x| (x - at(a)).cross(line).length_squared())?;
        let plane = (at(b) - at(a)).cross(at(c) - at(a)).normalize_or_zero();
        let d = farthest(&|x| (x - at(a)).dot(plane).abs())?;
        let height = (at(d) - at(a)).dot(plane);
        if height.abs() <= 1e3 * self.tolerance {
            return None;
        }
        let (b, c) = if height < 0.0 { (b, c) } else { (c, b) };
        // Point d lies below the facet a b c.
        for corners in [[a, b, c], [a, d, b], [b, d, c], [c, d, a]] {
            self.push(corners);
        }
        for f in 0..4u32 {
            for i in 0..3 {
                let (from, to) = self.edge(f, i);
                let other = (0..4u32)
                    .find(|g| *g != f && (0..3).any(|j| self.edge(*g, j) == (to, from)))?;
                self.facets[f as usize].across[i] = other;
            }
        }
        self.share_out(all.collect(), &[0, 1, 2, 3]);
        Some(())
    }

    fn edge(&self, facet: u32, i: usize) -> (u32, u32) {
        let c = self.facets[facet as usize].corners;
        (c[i], c[(i + 1) % 3])
    }

    /// Assigns every point to the facet that it lies farthest above; points above none are inside.
    fn share_out(&mut self, points: Vec<u32>, facets: &[u32]) {
        for point in points {
            let mut best = (self.tolerance, None);
            for &facet in facets {
                let height = self.height(facet, point);
                if height > best.0 {
                    best = (height, Some(facet));
                }
            }
            if let Some(facet) = best.1 {
                self.facets[facet as usize].outside.push(point);
            }
        }
    }

    /// Replaces the facets visible from `eye` by a cone over their horizon; returns the new facets.
    fn add(&mut self, first: u32, eye: u32) -> Option<Vec<u32>> {
        let mut visible = vec![first];
        let mut horizon: Vec<(u32, u32, u32)> = Vec::new();
        self.facets[first as usize].alive = false;
        let mut n = 0;
        while n < visible.len() {
            let facet = visible[n];
            n += 1;
            for i in 0..3 {
                let other = self.facets[facet as usize].across[i];
                if !self.facets[other as usize].alive {
                    continue;
                }
                if self.height(other, eye) > self.tolerance {
                    self.facets[other as usize].alive = false;
                    visible.push(other);
                }
            }
        }
        for &facet in &visible {
            for i in 0..3 {
                let other = self.facets[facet as usize].across[i];
                if self.facets[other as usize].alive {
                    let (from, to) = self.edge(facet, i);
                    horizon.push((from, to, other));
                }
            }
        }
        let mut fresh = Vec::with_capacity(horizon.len());
        let mut starting: std::collections::HashMap<u32, u32> = Default::default();
        for &(from, to, other) in &horizon {
            let new = self.push([from, to, eye]);
            self.facets[new as usize].across[0] = other;
            let back = (0..3).find(|j| self.edge(other, *j) == (to, from))?;
            self.facets[other as usize].across[back] = new;
            // A repeated vertex indicates a pinched horizon, a failure of the tolerance.
            if starting.insert(from, new).is_some() {
                return None;
            }
            fresh.push(new);
        }
        for &new in &fresh {
            let (_, to) = self.edge(new, 0);
            let next = *starting.get(&to)?;
            self.facets[new as usize].across[1] = next;
            self.facets[next as usize].across[2] = new;
        }
        let mut orphans = Vec::new();
        for facet in visible {
            orphans.append(&mut self.facets[facet as usize].outside);
        }
        orphans.retain(|p| *p != eye);
        self.share_out(orphans, &fresh);
        Some(fresh)
    }

    /// Returns the corners without duplicates.
    fn corners(&self) -> Vec<DVec3> {
        let alive = self.facets.iter().filter(|f| f.alive);
        let mut corners: Vec<u32> = alive.flat_map(|f| f.corners).collect();
        corners.sort_unstable();
        corners.dedup();
        corners.iter().map(|i| self.points[*i as usize]).collect()
    }

    /// Returns the volume. For small point sets it also verifies that no point lies above a facet
    /// by more than the rounding error.
    fn volume(&self) -> Option<f64> {
        let reference = self.points[0];
        let mut six = 0.0;
        let mut highest = 0.0f64;
        for facet in self.facets.iter().filter(|f| f.alive) {
            let [a, b, c] = facet.corners.map(|i| self.points[i as usize] - reference);
            six += a.dot(b.cross(c));
            if self.points.len() <= 200 {
                for p in self.points {
                    highest = highest.max(facet.normal.dot(*p) - facet.offset);
                }
            }
        }
        (six > 0.0 && highest <= 100.0 * self.tolerance).then_some(six / 6.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn volume(points: &[DVec3]) -> Option<f64> {
        measure(points).map(|(volume, _)| volume)
    }

    #[test]
    fn hull_of_a_cube_with_points_inside_and_on_its_faces() {
        let mut points = Vec::new();
        for k in 0..5 {
            for j in 0..5 {
                for i in 0..5 {
                    points.push(DVec3::new(f64::from(i), f64::from(j), f64::from(k)) / 4.0);
                }
            }
        }
        let (volume, corners) = measure(&points).unwrap();
        assert!((volume - 1.0).abs() < 1e-12);
        // Points on edges and faces may count as corners, interior points may not.
        for corner in
            (0..8).map(|c| DVec3::new(f64::from(c & 1), f64::from(c >> 1 & 1), f64::from(c >> 2)))
        {
            assert!(corners.contains(&corner), "{corner}");
        }
        let inner = |x: &DVec3| x.min_element() > 0.0 && x.max_element() < 1.0;
        assert!(!corners.iter().any(inner));
    }

    #[test]
    fn hull_of_a_sphere_and_of_a_cloud() {
        let sphere = crate::triangles::cube_sphere(24, |u| u);
        let hull = volume(&sphere.vertices).unwrap();
        assert!((hull / sphere.signed_volume() - 1.0).abs() < 1e-3, "{hull}");
        let cloud: Vec<DVec3> = (0..200)
            .map(|i| (DVec3::new(0.8191725134, 0.6710436067, 0.5497004779) * f64::from(i)).fract())
            .collect();
        // The internal check fails if any point lies outside the hull.
        assert!(volume(&cloud).unwrap() < 1.0);
    }

    #[test]
    fn flat_and_empty_sets_have_no_volume() {
        assert_eq!(volume(&[]), None);
        let flat: Vec<DVec3> =
            (0..50).map(|i| DVec3::new(f64::from(i % 7), f64::from(i / 7), 1.0)).collect();
        assert_eq!(volume(&flat), None);
    }
}

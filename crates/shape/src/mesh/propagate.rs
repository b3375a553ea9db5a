//! Signed distances of a mesh at all samples of a grid: exact near the mesh, propagated from there.
//!
//! Near the mesh every face is tested against the samples in its dilated bounding box: a distance
//! below the dilation is exact. Farther away, a sample starts from the nearest points of its closer
//! neighbours and descends on the mesh from the best of them. The result is exact unless the
//! nearest point of a sample is not adjacent to that of any neighbour, which is rare and far from
//! the surface; the error was below a tenth of a cell in the tests.

use super::MeshDistance;
use crate::triangles::Nearest;
use glam::{DVec3, Vec3};

/// Width of a bucket of the front [cells]; samples within one bucket are processed in any order.
const BUCKET: f64 = 0.25;
/// Face size below which a face is represented by one of its points [cells].
const FINE: f64 = 0.7;

/// Returns the signed distances [m] at the samples of a grid, x fastest, with the first at `first`.
/// Up to `band` [cells] from the mesh every face is tested. Values outside the range `needed` [m]
/// may be NaN.
pub(super) fn on_grid(
    mesh: &MeshDistance,
    first: DVec3,
    spacing: f64,
    dims: [usize; 3],
    band: f64,
    [least, most]: [f64; 2],
) -> Vec<f64> {
    let grid = Grid { first: first - DVec3::splat(spacing), spacing, dims: dims.map(|n| n + 2) };
    let mut front = Front::new(mesh, &grid);
    front.settle_band(band);
    // No required sample is reached from one that is not required.
    let needed = |value: f64| least <= value && value <= most;
    for n in grid.samples() {
        if front.open[n] == SETTLED && needed(front.values[n]) {
            front.reach(n);
        }
    }
    while let Some(n) = front.next() {
        if front.open[n] == SETTLED {
            continue;
        }
        let x = grid.position(n);
        let nearest = mesh.downhill(x, front.origins[n].face);
        let distance = nearest.point.distance(x);
        let value = distance.copysign(front.values[n]);
        front.settle(n, &nearest, value);
        if needed(value) {
            front.reach(n);
        }
    }
    let value = |n: usize| {
        if front.open[n] == SETTLED { front.values[n] } else { f64::NAN }
    };
    grid.samples().map(value).collect()
}

/// The samples with one layer of padding, which avoids border checks.
struct Grid {
    first: DVec3,
    spacing: f64,
    dims: [usize; 3],
}

impl Grid {
    fn index(&self, [i, j, k]: [usize; 3]) -> usize {
        i + self.dims[0] * (j + self.dims[1] * k)
    }

    fn position(&self, n: usize) -> DVec3 {
        self.at(crate::grid::place(self.dims, n))
    }

    fn at(&self, place: [usize; 3]) -> DVec3 {
        // Conversion via u32 takes one instruction.
        let place = place.map(|i| f64::from(i as u32));
        self.first + self.spacing * DVec3::from_array(place)
    }

    /// Iterates over the samples without the padding.
    fn samples(&self) -> impl Iterator<Item = usize> {
        let [nx, ny, nz] = self.dims;
        let row = move |j, k| self.index([1, j, k])..self.index([nx - 1, j, k]);
        (1..nz - 1).flat_map(move |k| (1..ny - 1).flat_map(move |j| row(j, k)))
    }
}

/// Nearest known mesh point of a sample, in single precision: it only selects the start of the
/// search for the nearest point.
#[derive(Clone, Copy, Default)]
struct Origin {
    point: Vec3,
    face: u32,
}

/// Marks a settled sample in [`Front::open`].
const SETTLED: f32 = -1.0;

/// Samples to be settled in order of distance, so that every sample starts from final values.
struct Front<'a> {
    mesh: &'a MeshDistance,
    grid: &'a Grid,
    /// Whether the faces are finer than the grid.
    fine: bool,
    /// Signed distance of each sample [m]; for unsettled samples only the sign is meaningful.
    values: Vec<f64>,
    /// Tentative distance of each sample [m]: infinite if unknown, or [`SETTLED`].
    open: Vec<f32>,
    origins: Vec<Origin>,
    buckets: Vec<Vec<u32>>,
    now: usize,
}

impl<'a> Front<'a> {
    /// Creates a front with all samples unknown and the padding settled.
    fn new(mesh: &'a MeshDistance, grid: &'a Grid) -> Front<'a> {
        let count = grid.dims.iter().product();
        let mut open = vec![SETTLED; count];
        grid.samples().for_each(|n| open[n] = f32::INFINITY);
        Front {
            mesh,
            grid,
            fine: mesh.face_size() < FINE * grid.spacing,
            values: vec![f64::INFINITY; count],
            open,
            origins: vec![Origin::default(); count],
            buckets: Vec::new(),
            now: 0,
        }
    }

    fn settle(&mut self, n: usize, nearest: &Nearest, value: f64) {
        self.values[n] = value;
        self.open[n] = SETTLED;
        self.origins[n] = Origin { point: nearest.point.as_vec3(), face: nearest.face };
    }

    /// Settles the samples within `band` [cells] of the mesh: every face is tested against the
    /// samples around it.
    fn settle_band(&mut self, band: f64) {
        let (mesh, grid) = (self.mesh, self.grid);
        let per_cell = 1.0 / grid.spacing;
        for face in 0..mesh.faces() {
            let [a, b, c] = *mesh.corners(face);
            let low = ((a.min(b).min(c) - grid.first) / grid.spacing - DVec3::splat(band)).ceil();
            let high = ((a.max(b).max(c) - grid.first) / grid.spacing + DVec3::splat(band)).floor();
            let middle = (a + b + c) / 3.0;
            let radius = [a, b, c].map(|corner| corner.distance(middle));
            let radius = radius.into_iter().fold(0.0, f64::max);
            let range = |axis: usize| {
                let end = ((high[axis] + 1.0).max(1.0) as usize).min(grid.dims[axis] - 1);
                (low[axis].max(1.0) as usize).min(end)..end
            };
            let normal = mesh.normal(face);
            let reach = (band * grid.spacing + radius).powi(2);
            let [along, across, up] = [0, 1, 2].map(range);
            for k in up {
                for j in across.clone() {
                    // Part of the row inside the ball.
                    let row = grid.at([0, j, k]);
                    let first = row - middle;
                    let half = reach - first.y * first.y - first.z * first.z;
                    if half < 0.0 {
                        continue;
                    }
                    let ends = [-1.0, 1.0].map(|side| (side * half.sqrt() - first.x) * per_cell);
                    let low = (ends[0] as usize).max(along.start);
                    for i in low..along.end.min(ends[1] as usize + 1) {
                        let n = grid.index([i, j, k]);
                        let x = row.with_x(row.x + grid.spacing * f64::from(i as u32));
                        let best = self.values[n].min(band * grid.spacing);
                        // No point in the ball around the face is nearer, or none in its circle in
                        // the plane.
                        let from = x - middle;
                        let squared = from.length_squared();
                        if squared >= (best + radius).powi(2) {
                            continue;
                        }
                        let height = from.dot(normal).powi(2);
                        let aside = ((squared - height).max(0.0).sqrt() - radius).max(0.0);
                        if height + aside * aside >= best * best {
                            continue;
                        }
                        let nearest = mesh.on_face(x, face);
                        let distance = nearest.point.distance(x);
                        if distance < best {
                            self.settle(n, &nearest, distance);
                        }
                    }
                }
            }
        }
        for n in grid.samples() {
            if self.open[n] == SETTLED {
                let x = grid.position(n);
                self.values[n] = mesh.signed(x, &mesh.on_face(x, self.origins[n].face));
            }
        }
    }

    /// Returns the next sample in order of distance; it may be settled already.
    fn next(&mut self) -> Option<usize> {
        while self.now < self.buckets.len() {
            if let Some(n) = self.buckets[self.now].pop() {
                return Some(n as usize);
            }
            self.now += 1;
        }
        None
    }

    /// Propagates the nearest point of the settled sample `n` to its unsettled neighbours.
    fn reach(&mut self, n: usize) {
        let (mesh, grid) = (self.mesh, self.grid);
        let (at, from, value) = (grid.position(n), self.origins[n], self.values[n]);
        let strides = [1, grid.dims[0], grid.dims[0] * grid.dims[1]];
        let neighbours = (0..3).flat_map(|axis| {
            let step = grid.spacing * DVec3::AXES[axis];
            [(n - strides[axis], at - step), (n + strides[axis], at + step)]
        });
        for (m, x) in neighbours {
            if self.open[m] == SETTLED {
                continue;
            }
            let point =
                if self.fine { from.point.as_dvec3() } else { mesh.on_face(x, from.face).point };
            let distance = point.distance(x);
            if distance as f32 >= self.open[m] {
                continue;
            }
            self.open[m] = distance as f32;
            // The surface does not pass between them.
            self.values[m] = value;
            self.origins[m] = from;
            let bucket = (distance / (BUCKET * grid.spacing)) as usize;
            let bucket = bucket.max(self.now);
            if self.buckets.len() <= bucket {
                self.buckets.resize(bucket + 1, Vec::new());
            }
            self.buckets[bucket].push(m as u32);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    use crate::distance::{Distance, EVERYWHERE};
    use crate::grid::place;
    use crate::triangles::cube_sphere;

    #[test]
    fn spread_distances_are_the_exact_ones() {
        // A lumpy flat body with a hollow.
        let lump = |u: DVec3| {
            let r = 1.0 + 0.25 * (4.0 * u.x + 1.0).sin() * (3.0 * u.y).cos() - 0.3 * u.z;
            u * r * DVec3::new(1.3, 1.0, 0.6)
        };
        for (faces, band) in [(4, 2.5), (40, 2.5), (4, 1.0), (40, 1.0)] {
            let mesh = cube_sphere(faces, lump);
            let distance = MeshDistance::new(&mesh).unwrap();
            let (spacing, dims) = (0.08, [50, 44, 30]);
            let first = DVec3::new(-2.0, -1.75, -1.2);
            let spread = distance.on_grid(first, spacing, dims, band, EVERYWHERE);
            let needed = distance.on_grid(first, spacing, dims, band, [-0.1, 0.3]);
            for (all, some) in spread.iter().zip(&needed) {
                let same = (all - some).abs() < 0.1 * spacing;
                let left_out = !(-0.1..=0.3).contains(all);
                assert!(same || left_out, "{some} for {all}");
            }
            assert!(needed.iter().filter(|v| v.is_nan()).count() > needed.len() / 4);
            // In the band and beyond it.
            let mut worst = [0.0f64; 2];
            for (n, value) in spread.iter().enumerate() {
                let x = first + spacing * DVec3::from_array(place(dims, n).map(|i| i as f64));
                let exact = distance.near(x, &mut 0);
                assert_eq!(*value < 0.0, exact < 0.0, "at {x}");
                let worst = &mut worst[usize::from(exact.abs() >= band * spacing)];
                *worst = worst.max((value - exact).abs() / spacing);
            }
            assert!(worst[0] < 1e-9 && worst[1] < 0.1, "{worst:?} cells with {faces}, band {band}");
        }
    }
}

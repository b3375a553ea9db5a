//! Bodies whose roundness is known, and rendered scans of them.

use crate::render::{Noise, blurred, greys, shares};
use glam::{DQuat, DVec2, DVec3};
use grainwake_shape::scan::{ScanOptions, Threshold, Volume, shapes_from_volume};
use grainwake_shape::{QualityBounds, Shape, ShapeOptions, SourceFile};

use std::f64::consts::PI;

type Distance = Box<dyn Fn(DVec3) -> f64 + Sync>;

/// A body of inscribed radius 1.
pub struct Body {
    /// About the signed distance, exact in its sign.
    pub distance: Distance,
    /// The body lies within this distance.
    pub reach: f64,
    /// Roundness in closed form.
    pub roundness: f64,
    /// Krumbein and Wadell sphericity and convexity in closed form; `None` for bodies without
    /// unique principal axes, such as a cube.
    pub others: Option<[f64; 3]>,
    /// Accepted range of the measured roundness.
    bounds: [f64; 2],
}

impl Body {
    /// `sphere`, `cylinder`, `rim`, `spheroid`, `octahedron`, `tetrahedron`, `prism`, `peanut`,
    /// `box`, `box.1`, or `cube` and the radius of its edges over its side.
    pub fn named(name: &str) -> Body {
        if let Some(radius) = name.strip_prefix("cube") {
            return Body::cube(2.0 * radius.parse::<f64>().unwrap());
        }
        match name {
            "sphere" => Body {
                distance: Box::new(|x| x.length() - 1.0),
                reach: 1.0,
                roundness: 1.0,
                others: None,
                bounds: [0.98, 1.0],
            },
            // Radius 1, height 2.
            "cylinder" => Body {
                distance: Box::new(|x| {
                    let q = DVec2::new(x.truncate().length(), x.z.abs()) - DVec2::ONE;
                    q.max(DVec2::ZERO).length() + q.max_element().min(0.0)
                }),
                reach: 2f64.sqrt(),
                roundness: 0.0,
                others: None,
                bounds: [0.0, 0.08],
            },
            // The cylinder with rims of half its radius.
            "rim" => Body {
                distance: Box::new(|x| {
                    let q = DVec2::new(x.truncate().length(), x.z.abs()) - DVec2::splat(0.5);
                    q.max(DVec2::ZERO).length() + q.max_element().min(0.0) - 0.5
                }),
                reach: 0.5 * 2f64.sqrt() + 0.5,
                roundness: 0.5,
                others: None,
                bounds: [0.45, 0.55],
            },
            // Two spheres with their centres 1.2 radii apart.
            "peanut" => Body {
                distance: Box::new(|x| {
                    let y = DVec3::new(x.x.abs() - 0.6, x.y, x.z);
                    y.length() - 1.0
                }),
                reach: 1.6,
                roundness: 1.0,
                others: Some(of_peanut(0.6)),
                bounds: [0.95, 1.0],
            },
            "box" => Body::brick(0.0),
            "box.1" => Body::brick(0.2),
            // Edges that turn by 71, 110, and 60 and 90 degrees.
            "octahedron" => Body::polyhedron(
                (0..8).map(|n| DVec3::new(sign(n), sign(n >> 1), sign(n >> 2))).collect(),
                3f64.sqrt(),
            ),
            "tetrahedron" => Body::polyhedron(
                [[1., 1., 1.], [1., -1., -1.], [-1., 1., -1.], [-1., -1., 1.]]
                    .map(DVec3::from_array)
                    .to_vec(),
                3.0,
            ),
            "prism" => Body::polyhedron(
                (0..6)
                    .map(|n| f64::from(n) * std::f64::consts::FRAC_PI_3)
                    .map(|angle| DVec3::new(angle.cos(), angle.sin(), 0.0))
                    .chain([DVec3::Z, DVec3::NEG_Z])
                    .collect(),
                (4.0 / 3.0 + 1.0f64).sqrt(),
            ),
            // Roundness by the closed form of `ellipsoids_have_the_mean_of_the_definition`.
            "spheroid" => Body {
                distance: Box::new(|x| {
                    let axes = DVec3::new(1.5, 1.0, 1.0);
                    let gradient = (x / (axes * axes)).length();
                    let level = (x / axes).length();
                    if gradient > 0.0 { (level - 1.0) * level / gradient } else { -1.0 }
                }),
                reach: 1.5,
                roundness: 0.874,
                others: Some(of_spheroid(1.5)),
                bounds: [0.824, 0.924],
            },
            _ => panic!("no body {name}"),
        }
    }

    /// Half side 1, edges of this radius.
    fn cube(radius: f64) -> Body {
        let bounds = if radius > 0.0 { [radius - 0.05, radius + 0.05] } else { [0.0, 0.08] };
        Body {
            distance: Box::new(move |x| {
                let q = x.abs() - DVec3::splat(1.0 - radius);
                q.max(DVec3::ZERO).length() + q.max_element().min(0.0) - radius
            }),
            reach: 3f64.sqrt() * (1.0 - radius) + radius,
            roundness: radius,
            others: None,
            bounds,
        }
    }

    /// Half sides 1.8, 1.4 and 1, edges of this radius.
    fn brick(radius: f64) -> Body {
        let half = DVec3::new(1.8, 1.4, 1.0);
        let core = half - radius;
        let edges = 2.0 * core;
        // Steiner's formulas.
        let faces = 2.0 * (edges.x * edges.y + edges.y * edges.z + edges.z * edges.x);
        let volume = edges.element_product()
            + radius * faces
            + PI * radius * radius * edges.element_sum()
            + 4.0 / 3.0 * PI * radius.powi(3);
        let area = faces + 2.0 * PI * radius * edges.element_sum() + 4.0 * PI * radius * radius;
        Body {
            distance: Box::new(move |x| {
                let q = x.abs() - core;
                q.max(DVec3::ZERO).length() + q.max_element().min(0.0) - radius
            }),
            reach: core.length() + radius,
            roundness: radius,
            others: Some([(1.4f64 / 1.8 / 1.8).cbrt(), sphericity(volume, area), 1.0]),
            bounds: [(radius - 0.05).max(0.0), (radius + 0.05).max(0.08)],
        }
    }

    /// Between planes at distance 1 with these normals.
    fn polyhedron(normals: Vec<DVec3>, reach: f64) -> Body {
        let normals: Vec<DVec3> = normals.into_iter().map(DVec3::normalize).collect();
        Body {
            distance: Box::new(move |x| {
                normals.iter().map(|n| n.dot(x) - 1.0).fold(f64::NEG_INFINITY, f64::max)
            }),
            reach,
            roundness: 0.0,
            others: None,
            bounds: [0.0, 0.08],
        }
    }

    /// Is a measured roundness as good as was asked for?
    pub fn holds(&self, roundness: f64) -> bool {
        (self.bounds[0]..=self.bounds[1]).contains(&roundness)
    }
}

/// Wadell's.
fn sphericity(volume: f64, area: f64) -> f64 {
    (36.0 * PI * volume * volume).cbrt() / area
}

/// Returns sphericities and convexity of a spheroid of semi-axes `a`, 1, 1, `a` above 1.
fn of_spheroid(a: f64) -> [f64; 3] {
    let eccentricity = (1.0 - 1.0 / (a * a)).sqrt();
    let area = 2.0 * PI * (1.0 + a / eccentricity * eccentricity.asin());
    [(a * a).recip().cbrt(), sphericity(4.0 / 3.0 * PI * a, area), 1.0]
}

/// Returns sphericities and convexity of two unit spheres with their centres `half` on either side.
fn of_peanut(half: f64) -> [f64; 3] {
    let height = 1.0 - half;
    let cap = PI * height * height * (3.0 - height) / 3.0;
    let volume = 2.0 * (4.0 / 3.0 * PI - cap);
    let area = 2.0 * (4.0 * PI - 2.0 * PI * height);
    let hull = 4.0 / 3.0 * PI + 2.0 * PI * half;
    [(1.0 + half).powi(2).recip().cbrt(), sphericity(volume, area), volume / hull]
}

fn sign(bit: u32) -> f64 {
    if bit & 1 == 0 { 1.0 } else { -1.0 }
}

/// A body as a scanner sees it, without noise.
pub struct Scan {
    dims: [usize; 3],
    shares: Vec<f32>,
}

impl Scan {
    /// The body with its inscribed sphere so many voxels across, blurred by `blur` voxels; `turn` 0
    /// lies along the grid, others are turned and placed at random.
    pub fn new(body: &Body, turn: u64, across: f64, blur: f64) -> Scan {
        let mut random = Noise::new(1000 + turn);
        let mut number = || random.normal();
        let mut rotation = DQuat::IDENTITY;
        let mut shift = DVec3::splat(0.5);
        if turn > 0 {
            rotation = DQuat::from_xyzw(number(), number(), number(), number()).normalize();
            shift = DVec3::new(number(), number(), number()).fract();
        }
        let radius = 0.5 * across;
        let n = (2.0 * body.reach * radius).ceil() as usize + 16;
        let dims = [n; 3];
        let centre = DVec3::splat(0.5 * n as f64) + shift;
        let placed = |x: DVec3| radius * (body.distance)(rotation * (x - centre) / radius);
        let exact = shares(dims, &[&placed], &[(centre, body.reach * radius)]);
        let shares = blurred(&exact, dims, blur);
        Scan { dims, shares }
    }

    /// Builds a coarse shape of the scan; `noise` is relative to the contrast.
    pub fn shape(&self, noise: f64, seed: u64, from_mask: bool) -> Shape {
        let options = ShapeOptions {
            cells: Some(24),
            nodes: Some(60),
            // The roundness comes from the finer surface of the scan.
            bounds: QualityBounds { gradient_error: 1.0, volume_error: 1.0 },
            ..Default::default()
        };
        self.shape_with(noise, seed, from_mask, options)
    }

    /// Builds the shape of the rendered scan with these options.
    pub fn shape_with(&self, noise: f64, seed: u64, from_mask: bool, shape: ShapeOptions) -> Shape {
        let image = greys(&self.shares, noise, seed);
        let volume = Volume::from_labels(self.dims, image).unwrap();
        let options = ScanOptions {
            threshold: Some(Threshold::Otsu),
            sub_voxel: !from_mask,
            largest_piece: true,
            shape,
            ..ScanOptions::new(1.0)
        };
        let mut grains = shapes_from_volume(&volume, &SourceFile::default(), &options).unwrap();
        grains.remove(0).shape.unwrap()
    }

    /// Measures the roundness from grey values.
    pub fn roundness(&self, noise: f64, seed: u64) -> f64 {
        let shape = self.shape(noise, seed, false);
        shape.morphology().wadell_roundness.unwrap()
    }
}

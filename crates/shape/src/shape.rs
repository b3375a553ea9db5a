//! The shape itself.

use glam::DVec3;

/// A point of the surface with the area it stands for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceNode {
    /// Position in the principal frame [m].
    pub position: DVec3,
    /// Share of the surface [m^2]; the shares add up to the surface area.
    pub area: f64,
}

/// How the distance is represented.
#[derive(Clone, Debug)]
pub enum Field {
    /// Exact sphere of this radius [m].
    Sphere(f64),
}

/// An immutable grain shape.
#[derive(Clone, Debug)]
pub struct Shape {
    field: Field,
    nodes: Vec<SurfaceNode>,
    volume: f64,
    inertia: DVec3,
    lower: DVec3,
    upper: DVec3,
    bounding_radius: f64,
}

impl Shape {
    /// Sphere of `radius` [m] with about `nodes` evenly spread surface nodes.
    pub fn sphere(radius: f64, nodes: usize) -> Shape {
        let volume = 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3);
        let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
        let share = 4.0 * std::f64::consts::PI * radius * radius / nodes as f64;
        let nodes = (0..nodes)
            .map(|i| {
                let z = 1.0 - (2.0 * i as f64 + 1.0) / nodes as f64;
                let rho = (1.0 - z * z).sqrt();
                let (s, c) = (golden * i as f64).sin_cos();
                SurfaceNode { position: radius * DVec3::new(rho * c, rho * s, z), area: share }
            })
            .collect();
        Shape {
            field: Field::Sphere(radius),
            nodes,
            volume,
            inertia: DVec3::splat(0.4 * volume * radius * radius),
            lower: DVec3::splat(-radius),
            upper: DVec3::splat(radius),
            bounding_radius: radius,
        }
    }

    /// Signed distance [m] at `x` (principal frame), negative inside.
    pub fn distance(&self, x: DVec3) -> f64 {
        match self.field {
            Field::Sphere(radius) => x.length() - radius,
        }
    }

    /// Signed distance [m] and its gradient (outward normal where |gradient| = 1) at `x`.
    pub fn distance_and_gradient(&self, x: DVec3) -> (f64, DVec3) {
        match self.field {
            Field::Sphere(radius) => (x.length() - radius, x.normalize_or_zero()),
        }
    }

    /// Surface nodes, evenly spread.
    pub fn nodes(&self) -> &[SurfaceNode] {
        &self.nodes
    }
    /// Volume [m^3].
    pub fn volume(&self) -> f64 {
        self.volume
    }
    /// Principal second moments per unit density [m^5], so that I = rho * inertia.
    pub fn inertia(&self) -> DVec3 {
        self.inertia
    }
    /// Lower corner of the bounding box in the principal frame [m].
    pub fn lower(&self) -> DVec3 {
        self.lower
    }
    /// Upper corner of the bounding box in the principal frame [m].
    pub fn upper(&self) -> DVec3 {
        self.upper
    }
    /// Radius of the smallest sphere about the centroid that holds the shape [m].
    pub fn bounding_radius(&self) -> f64 {
        self.bounding_radius
    }
    /// Diameter of the sphere of equal volume [m].
    pub fn equivalent_diameter(&self) -> f64 {
        (6.0 * self.volume / std::f64::consts::PI).cbrt()
    }
}

//! Exact sphere.

use crate::morphology::Morphology;
use crate::nodes::{SurfaceNode, golden_spiral};
use crate::provenance::Provenance;
use crate::shape::{Field, Shape};
use glam::DVec3;

impl Shape {
    /// Builds a sphere of `radius` [m] with about `nodes` evenly spread surface nodes and exact
    /// distances. [`analytic::sphere`](crate::analytic::sphere) checks its arguments.
    pub fn sphere(radius: f64, nodes: usize) -> Shape {
        let volume = 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3);
        let area = 4.0 * std::f64::consts::PI * radius * radius;
        let share = area / nodes as f64;
        let provenance =
            Provenance::new("analytic").with("body", "sphere").with("radius_m", radius);
        let nodes = (0..nodes)
            .map(|i| {
                let z = 1.0 - (2.0 * i as f64 + 1.0) / nodes as f64;
                SurfaceNode { position: radius * golden_spiral(i, z), area: share }
            })
            .collect();
        let mut morphology = Morphology::new(DVec3::splat(2.0 * radius), area, volume, Some(1.0));
        morphology.wadell_roundness = Some(1.0);
        morphology.inscribed_radius = Some(radius);
        morphology.feret = Some([2.0 * radius; 3]);
        Shape {
            field: Field::Sphere(radius),
            nodes,
            volume,
            inertia: DVec3::splat(0.4 * volume * radius * radius),
            lower: DVec3::splat(-radius),
            upper: DVec3::splat(radius),
            bounding_radius: radius,
            morphology,
            quality: None,
            provenance,
        }
    }
}

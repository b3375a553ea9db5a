//! Distance field of a grain or a wall in the frame of another grain, and points of its surface.

use glam::{DMat3, DVec3};
use grainwake_shape::{Field, Shape};

/// Safety factor on a distance from a sampled field, whose gradient may slightly exceed one.
pub(super) const GRADIENT_MARGIN: f64 = 1.1;

/// Signed distance field of a grain or a wall in the principal frame of another grain.
#[derive(Clone, Copy, Debug)]
pub(super) enum PartnerField<'a> {
    /// Grain; `rotation` x + `translation` are coordinates in its own principal frame.
    Shape {
        /// Shape of the partner.
        shape: &'a Shape,
        /// Rotation into the partner's principal frame.
        rotation: DMat3,
        /// Translation after the rotation [m].
        translation: DVec3,
        /// Corners of the box in which the field is a distance and not an estimate [m].
        exact: (DVec3, DVec3),
    },
    /// Wall with the distance `normal` . x + `offset`.
    HalfSpace {
        /// Unit normal out of the wall.
        normal: DVec3,
        /// Distance of the grain's centroid from the wall [m].
        offset: f64,
    },
}

impl<'a> PartnerField<'a> {
    /// Field of a grain whose principal frame has the coordinates `rotation` x + `translation`.
    pub fn grain(shape: &'a Shape, rotation: DMat3, translation: DVec3) -> PartnerField<'a> {
        let exact = match shape.field() {
            Field::Sphere(_) => (DVec3::NEG_INFINITY, DVec3::INFINITY),
            Field::Sampled(field) => (field.lower(), field.upper()),
            _ => (shape.lower(), shape.upper()),
        };
        PartnerField::Shape { shape, rotation, translation, exact }
    }
    /// Signed distance [m] and its gradient at `x`.
    pub fn distance_and_gradient(&self, x: DVec3) -> (f64, DVec3) {
        match self {
            PartnerField::Shape { shape, rotation, translation, .. } => {
                let (distance, gradient) =
                    shape.distance_and_gradient(*rotation * x + *translation);
                (distance, rotation.transpose() * gradient)
            }
            PartnerField::HalfSpace { normal, offset } => (normal.dot(x) + offset, *normal),
        }
    }
    /// Signed distance [m] at `x`, or infinity if a bound shows that it exceeds `reach` [m].
    pub fn distance_within(&self, x: DVec3, reach: f64) -> f64 {
        match self {
            PartnerField::Shape { shape, rotation, translation, .. } => {
                let y = *rotation * x + *translation;
                let outside = (shape.lower() - y).max(y - shape.upper()).max(DVec3::ZERO);
                if outside.length_squared() > reach * reach {
                    return f64::INFINITY;
                }
                shape.distance(y)
            }
            PartnerField::HalfSpace { normal, offset } => normal.dot(x) + offset,
        }
    }
    /// Signed distance [m] at `x`.
    pub fn distance(&self, x: DVec3) -> f64 {
        self.distance_within(x, f64::INFINITY)
    }
    /// Returns true if the whole sphere is farther away than `reach` [m], false if that is
    /// uncertain.
    pub fn is_beyond(&self, centre: DVec3, radius: f64, reach: f64) -> bool {
        match self {
            PartnerField::Shape { shape, rotation, translation, exact } => {
                let y = *rotation * centre + *translation;
                let far = radius + reach;
                if y.length_squared() > (shape.bounding_radius() + far).powi(2) {
                    return true;
                }
                if y.cmpge(exact.0).all() && y.cmple(exact.1).all() {
                    return shape.distance(y) > GRADIENT_MARGIN * far;
                }
                let outside = (shape.lower() - y).max(y - shape.upper()).max(DVec3::ZERO);
                outside.length_squared() > far * far
            }
            PartnerField::HalfSpace { normal, offset } => {
                normal.dot(centre) + offset > radius + reach
            }
        }
    }
    /// Whether the partner is a wall.
    pub fn is_wall(&self) -> bool {
        matches!(self, PartnerField::HalfSpace { .. })
    }
}

/// Point of a grain's surface with the partner's distance there, principal frame of the grain.
#[derive(Clone, Copy, Debug)]
pub(super) struct SurfacePoint {
    /// Position [m].
    pub position: DVec3,
    /// Distance in the partner's field [m], negative inside.
    pub distance: f64,
    /// Unit gradient of that distance.
    pub normal: DVec3,
    /// Length of the gradient; differs from one between the samples of a field.
    pub slope: f64,
}

impl SurfacePoint {
    /// Evaluates the partner's field; `None` where its gradient vanishes.
    pub fn at(partner: &PartnerField, position: DVec3) -> Option<SurfacePoint> {
        let (distance, gradient) = partner.distance_and_gradient(position);
        let normal = gradient.try_normalize()?;
        Some(SurfacePoint { position, distance, normal, slope: gradient.dot(normal) })
    }
}

/// Whether the shape is an exact sphere.
pub(crate) fn is_sphere(shape: &Shape) -> bool {
    matches!(shape.field(), Field::Sphere(_))
}

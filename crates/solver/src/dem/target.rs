//! What the nodes of a grain are tested against, seen from the grain's own principal frame.

use glam::{DMat3, DVec3};
use grainwake_shape::{Field, Shape};

/// Blobs are skipped by the field only when they are this much further away than needed, because
/// the gradient of a sampled field may exceed one a little.
const SLACK: f64 = 1.1;

/// A distance field in the principal frame of the grain whose nodes are tested.
#[derive(Clone, Copy, Debug)]
pub(super) enum Target<'a> {
    /// Another grain: its own principal frame is `turn` x + `shift`.
    Shape {
        /// The other grain's shape.
        shape: &'a Shape,
        /// Rotation into the other grain's frame.
        turn: DMat3,
        /// Translation after the rotation [m].
        shift: DVec3,
        /// Corners of the box inside which its field is a distance and no estimate [m].
        sampled: (DVec3, DVec3),
    },
    /// A wall: distance `normal` . x + `offset`.
    HalfSpace {
        /// Unit normal out of the wall.
        normal: DVec3,
        /// Distance of the grain's centroid from the wall [m].
        offset: f64,
    },
}

impl<'a> Target<'a> {
    /// A grain as another sees it, whose principal frame `turn` x + `shift` takes to its own.
    pub fn grain(shape: &'a Shape, turn: DMat3, shift: DVec3) -> Target<'a> {
        let sampled = match shape.field() {
            Field::Sphere(_) => (DVec3::NEG_INFINITY, DVec3::INFINITY),
            Field::Sampled(field) => (field.lower(), field.upper()),
            _ => (shape.lower(), shape.upper()),
        };
        Target::Shape {
            shape,
            turn,
            shift,
            sampled,
        }
    }
    /// Signed distance [m] and its gradient at `x`.
    pub fn distance_and_gradient(&self, x: DVec3) -> (f64, DVec3) {
        match self {
            Target::Shape {
                shape, turn, shift, ..
            } => {
                let (distance, gradient) = shape.distance_and_gradient(*turn * x + *shift);
                (distance, turn.transpose() * gradient)
            }
            Target::HalfSpace { normal, offset } => (normal.dot(x) + offset, *normal),
        }
    }
    /// Signed distance [m] at `x`, or none where it is surely more than `reach` [m].
    pub fn distance_within(&self, x: DVec3, reach: f64) -> Option<f64> {
        match self {
            Target::Shape {
                shape, turn, shift, ..
            } => {
                let y = *turn * x + *shift;
                let outside = (shape.lower() - y).max(y - shape.upper()).max(DVec3::ZERO);
                (outside.length_squared() <= reach * reach).then(|| shape.distance(y))
            }
            Target::HalfSpace { normal, offset } => Some(normal.dot(x) + offset),
        }
    }
    /// Signed distance [m] at `x`.
    pub fn distance(&self, x: DVec3) -> f64 {
        match self {
            Target::Shape {
                shape, turn, shift, ..
            } => shape.distance(*turn * x + *shift),
            Target::HalfSpace { normal, offset } => normal.dot(x) + offset,
        }
    }
    /// Whether every point of the ball is surely further away than `reach` [m].
    pub fn is_beyond(&self, center: DVec3, radius: f64, reach: f64) -> bool {
        match self {
            Target::Shape {
                shape,
                turn,
                shift,
                sampled,
            } => {
                let y = *turn * center + *shift;
                let far = radius + reach;
                if y.length_squared() > (shape.bounding_radius() + far).powi(2) {
                    return true;
                }
                if y.cmpge(sampled.0).all() && y.cmple(sampled.1).all() {
                    return shape.distance(y) > SLACK * far;
                }
                let outside = (shape.lower() - y).max(y - shape.upper()).max(DVec3::ZERO);
                outside.length_squared() > far * far
            }
            Target::HalfSpace { normal, offset } => normal.dot(center) + offset > radius + reach,
        }
    }
    /// Radius of curvature that a first guess may assume [m].
    pub fn radius(&self) -> f64 {
        match self {
            Target::Shape { shape, .. } => shape.bounding_radius(),
            Target::HalfSpace { .. } => f64::INFINITY,
        }
    }
}

//! Tests of the `.grain` format.

use super::*;
use crate::shape::Field;
use crate::{ShapeOptions, analytic};
use glam::DVec3;

/// Length of signature, version and body length.
const HEAD: usize = 8 + 4 + 8;

fn egg() -> Shape {
    let options = ShapeOptions { cells: Some(16), nodes: Some(100), ..Default::default() };
    analytic::ellipsoid(2e-3, 1.5e-3, 1e-3, &options).unwrap()
}

#[test]
fn files_round_trip_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    for shape in [egg(), Shape::sphere(1e-3, 50), egg().scaled(1.7).unwrap()] {
        let path = folder.path().join("egg.grain");
        shape.save(&path).unwrap();
        let back = Shape::load(&path).unwrap();
        assert_eq!(back, shape);
        assert_eq!(back.to_bytes(), shape.to_bytes());
        assert_eq!(back.digest(), shape.digest());
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn every_flipped_byte_is_noticed() {
    let path = Path::new("egg.grain");
    let good = egg().to_bytes();
    for at in (0..good.len()).step_by(97).chain(0..40).chain(good.len() - 40..good.len()) {
        let mut bad = good.clone();
        bad[at] ^= 0x10;
        assert!(Shape::from_bytes(&bad, path).is_err(), "byte {at}");
    }
    for length in (0..good.len()).step_by(101).chain([good.len() - 1]) {
        assert!(Shape::from_bytes(&good[..length], path).is_err(), "length {length}");
    }
}

#[test]
fn errors_tell_damage_from_age() {
    let path = Path::new("egg.grain");
    let good = egg().to_bytes();
    let mut newer = good.clone();
    newer[8] = 200;
    let error = Shape::from_bytes(&newer, path).unwrap_err();
    assert!(error.to_string().contains("version 200"), "{error}");
    let mut damaged = good.clone();
    let middle = damaged.len() / 2;
    damaged[middle] ^= 1;
    let error = Shape::from_bytes(&damaged, path).unwrap_err();
    assert!(error.to_string().contains("checksum"), "{error}");
    let error = Shape::from_bytes(b"solid cube", path).unwrap_err();
    assert!(error.to_string().contains("signature"), "{error}");
    let missing = Shape::load(Path::new("/nonexistent/egg.grain")).unwrap_err();
    assert!(matches!(missing, ShapeError::Io { .. }), "{missing}");
}

/// Invalid content with a valid checksum must not panic.
#[test]
fn forged_content_is_refused() {
    let good = egg().to_bytes();
    let mut refused = 0;
    for at in (HEAD..good.len() - CHECKSUM).step_by(61) {
        for value in [0u8, 0xff, 0x7f] {
            let mut forged = good[..good.len() - CHECKSUM].to_vec();
            forged[at] = value;
            let checksum = Sha256::digest(&forged);
            forged.extend_from_slice(&checksum);
            refused += usize::from(Shape::from_bytes(&forged, Path::new("x")).is_err());
        }
    }
    assert!(refused > 0);
}

/// Found by fuzzing: sizes that are no numbers, or that contradict each other.
#[test]
fn contradictory_sizes_are_refused() {
    let forged = |change: &dyn Fn(&mut Shape)| {
        let mut shape = egg();
        change(&mut shape);
        Shape::from_bytes(&shape.to_bytes(), Path::new("x")).unwrap_err().to_string()
    };
    let egg_radius = egg().bounding_radius;
    for (change, words) in [
        (&(|s: &mut Shape| s.bounding_radius = 1e9) as &dyn Fn(&mut Shape), "bounding radius"),
        (&|s: &mut Shape| s.volume *= 20.0, "volume"),
        (&|s: &mut Shape| s.inertia.z = f64::NAN, "moments of inertia"),
        (&|s: &mut Shape| s.upper.x = 3.0 * egg_radius, "bounding box"),
        (&|s: &mut Shape| s.lower.y = s.upper.y, "bounding box"),
        (&|s: &mut Shape| s.nodes[7].position.x = f64::INFINITY, "surface nodes"),
        (&|s: &mut Shape| s.nodes[7].area = -1.0, "surface nodes"),
        (&|s: &mut Shape| s.morphology.b = f64::NAN, "principal axes"),
        (&|s: &mut Shape| s.provenance.scale = f64::NAN, "pose in the source"),
        (&|s: &mut Shape| s.field = Field::Sphere(f64::NAN), "distance field"),
        (&|s: &mut Shape| s.field = Field::Sphere(2.0 * egg_radius), "distance field"),
        (
            &|s: &mut Shape| {
                if let Field::Sampled(field) = &s.field {
                    s.field = Field::Sampled(field.clone().shifted(DVec3::splat(egg_radius)));
                }
            },
            "distance field",
        ),
    ] {
        let message = forged(change);
        assert!(message.contains(words), "{words}: {message}");
    }
}

#[test]
fn the_digest_is_of_the_geometry() {
    let shape = egg();
    let mut renamed = shape.clone();
    renamed.provenance.source = "elsewhere".into();
    assert_eq!(shape.digest(), renamed.digest());
    assert_ne!(shape.digest(), shape.scaled(1.0 + 1e-12).unwrap().digest());
    assert_eq!(shape.digest().len(), 64);
}

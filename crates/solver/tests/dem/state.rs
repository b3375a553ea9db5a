//! Same bits for any number of threads, and after saving and restoring the contact history.

use crate::clouds::{Random, cloud, step};
use crate::support::bits;
use glam::DVec3;
use grainwake_solver::dem::{
    ContactDynamics, ContactLawKind, ContactParams, Enclosure, Grain, Material, Side,
};

fn params() -> ContactParams {
    ContactParams { normal_stiffness: 500.0, restitution: 0.8, ..Default::default() }
}

fn tank() -> Enclosure {
    Enclosure {
        lower: DVec3::new(-0.05, -0.05, -0.06),
        upper: DVec3::new(0.05, 0.05, 0.2),
        periodic: [true, false, false],
        sides: [[Side::Open; 2], [Side::WALL; 2], [Side::WALL, Side::Open]],
    }
}

fn settle(dynamics: &mut ContactDynamics, grains: &mut [Grain], steps: usize) {
    for _ in 0..steps {
        step(dynamics, grains, DVec3::new(0.3, 0.0, -9.81), 1e-3);
    }
}

#[test]
fn one_two_and_three_threads_give_the_same_bits() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut grains = cloud(80, 0.045, 0.007, 0.3, 3);
            let mut dynamics = ContactDynamics::new(params(), tank());
            settle(&mut dynamics, &mut grains, 150);
            assert!(dynamics.contacts().len() > 30, "{}", dynamics.contacts().len());
            let mut history = Vec::new();
            dynamics.save(&mut history).unwrap();
            (bits(&grains), history)
        })
    };
    let one = run(1);
    assert!(one == run(2));
    assert!(one == run(3));
}

#[test]
fn saved_and_restored_history_continues_with_the_same_bits() {
    continues_with_the_same_bits(params(), Material::default());
    let hertz = ContactParams { law: ContactLawKind::HertzMindlin, ..params() };
    let soft = Material { youngs_modulus: 1e5, poisson_ratio: 0.3, restitution: 0.8 };
    continues_with_the_same_bits(hertz, soft);
}

fn continues_with_the_same_bits(params: ContactParams, material: Material) {
    let mut grains = cloud(60, 0.045, 0.007, 0.3, 5);
    grains.iter_mut().for_each(|grain| grain.material = material);
    let mut dynamics = ContactDynamics::new(params, tank());
    settle(&mut dynamics, &mut grains, 120);
    for _ in 0..10 {
        let mut file = Vec::new();
        dynamics.save(&mut file).unwrap();
        let mut other = ContactDynamics::new(params, tank());
        other.restore(&mut file.as_slice()).unwrap();
        assert_eq!(other.contacts(), dynamics.contacts());
        assert_eq!(other.elastic_energy().to_bits(), dynamics.elastic_energy().to_bits());
        let mut copy = grains.clone();
        settle(&mut dynamics, &mut grains, 3);
        settle(&mut other, &mut copy, 3);
        assert!(bits(&grains) == bits(&copy));
        assert_eq!(other.contacts(), dynamics.contacts());
    }
    // Without the history the tangential springs start from zero, and the bits differ.
    let mut copy = grains.clone();
    let mut fresh = ContactDynamics::new(params, tank());
    settle(&mut dynamics, &mut grains, 3);
    settle(&mut fresh, &mut copy, 3);
    assert!(bits(&grains) != bits(&copy));
}

#[test]
fn damaged_history_is_an_error_and_leaves_the_state_alone() {
    let mut grains = cloud(40, 0.045, 0.007, 0.3, 5);
    let mut dynamics = ContactDynamics::new(params(), tank());
    settle(&mut dynamics, &mut grains, 120);
    let mut file = Vec::new();
    dynamics.save(&mut file).unwrap();
    let restore = |bytes: &[u8]| {
        let mut other = dynamics.clone();
        let result = other.restore(&mut &bytes[..]);
        let mut after = Vec::new();
        other.save(&mut after).unwrap();
        assert!(result.is_ok() || after == file);
        result
    };
    assert!(restore(&file).is_ok());
    for length in (0..file.len()).step_by(97) {
        assert!(restore(&file[..length]).is_err(), "cut at {length}");
    }
    assert!(restore(b"not a history at all, but long enough to look like one").is_err());
    // A flipped bit gives an error or a readable state; neither reading nor the step panics.
    let mut random = Random(1);
    for _ in 0..300 {
        let mut damaged = file.clone();
        let at = (random.next() * file.len() as f64) as usize;
        damaged[at] ^= 1 << (random.next() * 8.0) as u8;
        let mut other = dynamics.clone();
        if other.restore(&mut damaged.as_slice()).is_ok() {
            settle(&mut other, &mut grains.clone(), 1);
        }
    }
    // A damaged count must not exhaust the memory.
    let mut greedy = file.clone();
    greedy[8..16].copy_from_slice(&u64::MAX.to_le_bytes());
    assert!(restore(&greedy).is_err());
    greedy[8..16].copy_from_slice(&u64::from(u32::MAX).to_le_bytes());
    assert!(restore(&greedy).is_err());
}

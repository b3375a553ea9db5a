//! Every vector against plain numbers.

use super::plain::Plain;
use super::*;

/// Lane-wise arithmetic and the transpose of one kind of vector.
struct Check;

impl Kernel for Check {
    #[inline(always)]
    fn run<V: Vector>(self) {
        check::<V>();
        check::<V::Four>();
        check::<Single>();
    }
}

#[inline(always)]
fn check<V: Vector>() {
    let a: [f64; 8] = std::array::from_fn(|i| (i as f64 + 0.3).sin());
    let b: [f64; 8] = std::array::from_fn(|i| (i as f64 + 0.7).cos());
    let (x, y) = (V::load(&a), V::load(&b));
    let c = V::splat(0.1);
    let mut found = [[0.0; 8]; 6];
    for (found, v) in
        found
            .iter_mut()
            .zip([x + y, x - y, x * c, x.over(y), x.larger(y), y.magnitude()])
    {
        v.store(found);
    }
    for i in 0..V::WIDTH {
        let expected = [
            a[i] + b[i],
            a[i] - b[i],
            a[i] * 0.1,
            a[i] / b[i],
            a[i].max(b[i]),
            b[i].abs(),
        ];
        for (found, expected) in found.iter().zip(expected) {
            assert_eq!(found[i].to_bits(), expected.to_bits());
        }
    }
    let rows: [[f64; 8]; 8] =
        std::array::from_fn(|row| std::array::from_fn(|i| (10 * row + i) as f64));
    let mut block = [V::splat(0.0); 8];
    for (v, row) in block.iter_mut().zip(&rows) {
        *v = V::load(row);
    }
    V::transpose(&mut block);
    for i in 0..V::WIDTH {
        let mut column = [0.0; 8];
        block[i].store(&mut column);
        for row in 0..V::WIDTH {
            assert_eq!(column[row], rows[row][i]);
        }
    }
}

#[test]
fn all_vectors_compute_alike() {
    check::<Plain>();
    Check.run::<Common>();
    dispatch(Check);
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") {
        // SAFETY: just detected.
        unsafe { with_four(Check) };
    }
}

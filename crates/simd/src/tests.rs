//! Every vector against plain numbers.

use std::ops::Range;

use super::plain::Plain;
use super::*;

/// Lane-wise arithmetic and the transpose of the vectors of one number.
struct Check<R>(std::marker::PhantomData<R>);

impl<R: Real> Check<R> {
    fn new() -> Self {
        Check(std::marker::PhantomData)
    }
}

impl<R: Real> Kernel for Check<R> {
    type Number = R;
    #[inline(always)]
    fn run<V: Vector<Number = R>>(self) {
        check::<V>();
        check::<V::Half>();
        check::<V::Tail>();
        check::<Scalar<R>>();
    }
}

#[inline(always)]
fn check<V: Vector>() {
    let number = V::Number::of;
    let a: [V::Number; MAX_LANES] = std::array::from_fn(|i| number((i as f64 + 0.3).sin()));
    let b: [V::Number; MAX_LANES] = std::array::from_fn(|i| number((i as f64 + 0.7).cos()));
    let (x, y) = (V::load(&a), V::load(&b));
    let c = V::constant(0.1);
    let mut found = [[V::Number::default(); MAX_LANES]; 10];
    for (found, v) in found.iter_mut().zip([
        x + y,
        x - y,
        x * c,
        x.div(y),
        x.max(y),
        y.abs(),
        x.min(y),
        x.is_below(y),
        x.select_below(y, c, x),
        x.mul_add(y, c),
    ]) {
        v.store(found);
    }
    assert_eq!(x.mask_below(y).checked_shr(V::WIDTH as u32).unwrap_or(0), 0);
    let mut sums = [1.0; MAX_LANES];
    x.add_into(&mut sums);
    assert_eq!(sums[V::WIDTH..], [1.0; MAX_LANES][V::WIDTH..]);
    for i in 0..V::WIDTH {
        // One operation in double precision rounds to the same single.
        let (a, b) = (a[i].wide(), b[i].wide());
        let expected = [
            a + b,
            a - b,
            a * number(0.1).wide(),
            a / b,
            a.max(b),
            b.abs(),
            a.min(b),
            f64::from(u8::from(a < b)),
            if a < b { number(0.1).wide() } else { a },
            number(a).mul_add(number(b), number(0.1)).wide(),
        ];
        for (found, expected) in found.iter().zip(expected) {
            let expected = number(expected).wide();
            assert_eq!(found[i].wide().to_bits(), expected.to_bits());
        }
        assert_eq!(sums[i], 1.0 + a);
        assert_eq!(x.mask_below(y) >> i & 1 == 1, a < b);
    }
    let signed: [V::Number; MAX_LANES] = std::array::from_fn(|i| number(1.7 * i as f64 - 5.0));
    let (mut floors, mut roots) =
        ([V::Number::default(); MAX_LANES], [V::Number::default(); MAX_LANES]);
    V::load(&signed).floor().store(&mut floors);
    V::load(&signed).abs().sqrt().store(&mut roots);
    let entry = |n: usize| 100.5 * (n * n) as f32 - 32768.0;
    let table: Vec<f32> = (0..40).map(entry).collect();
    let places: [V::Number; MAX_LANES] = std::array::from_fn(|i| number((7 * i % 39) as f64));
    let mut pairs = [[V::Number::default(); MAX_LANES]; 2];
    for (lanes, found) in pairs.iter_mut().zip(V::gather_pairs(&table, V::load(&places))) {
        found.store(lanes);
    }
    let mut inverses = [V::Number::default(); MAX_LANES];
    (x * x).rsqrt().store(&mut inverses);
    for i in 0..V::WIDTH {
        assert_eq!(floors[i].wide(), signed[i].wide().floor());
        assert_eq!(roots[i], number(signed[i].wide().abs().sqrt()));
        let at = 7 * i % 39;
        assert_eq!(pairs.map(|p| p[i].wide()), [at, at + 1].map(|n| f64::from(entry(n))));
        let square = a[i].wide() * a[i].wide();
        let within = if V::Number::BYTES == 4 { 1e-6 } else { 2e-10 };
        assert!((square * inverses[i].wide().powi(2) - 1.0).abs() < within);
    }
    let mut behind = [V::Number::default(); MAX_LANES];
    x.shift(y).store(&mut behind);
    assert_eq!(behind[0], b[V::WIDTH - 1]);
    assert_eq!(behind[1..V::WIDTH], a[..V::WIDTH - 1]);
    let doubles: [f64; MAX_LANES] = std::array::from_fn(|i| (i as f64 + 0.1).sin());
    let (mut back, mut exact) = ([0.0; MAX_LANES], [0.0_f32; MAX_LANES]);
    V::load_from(&doubles).store_to(&mut back);
    V::load_from(&doubles).store_to(&mut exact);
    for i in 0..V::WIDTH {
        assert_eq!(back[i], number(doubles[i]).wide());
        assert_eq!(exact[i], doubles[i] as f32);
    }
    let rows: [[V::Number; MAX_LANES]; MAX_LANES] =
        std::array::from_fn(|row| std::array::from_fn(|i| number((20 * row + i) as f64)));
    let mut block = [V::constant(0.0); MAX_LANES];
    for (v, row) in block.iter_mut().zip(&rows) {
        *v = V::load(row);
    }
    V::transpose(&mut block);
    for i in 0..V::WIDTH {
        let mut column = [V::Number::default(); MAX_LANES];
        block[i].store(&mut column);
        for row in 0..V::WIDTH {
            assert_eq!(column[row], rows[row][i]);
        }
    }
}

#[test]
fn all_vectors_compute_alike() {
    check::<Plain<f64, 4>>();
    check::<Plain<f32, 8>>();
    each_level::<f64>();
    each_level::<f32>();
}

fn each_level<R: Real>() {
    Check::<R>::new().run::<R::Baseline>();
    dispatch(Check::<R>::new());
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
        // SAFETY: just detected.
        unsafe { R::with_avx2(Check::<R>::new()) };
    }
}

/// Sums a row and notes the entries.
struct Sum<'a, R> {
    row: &'a [R],
    sum: &'a mut Partial,
    maximum: &'a mut Maximum<R>,
    seen: &'a mut Vec<usize>,
}
impl<R: Real> RowWork for Sum<'_, R> {
    type Number = R;
    #[inline(always)]
    fn at<V: Vector<Number = R>>(&mut self, i: usize) {
        self.sum.add(i, V::load(&self.row[i..]));
        self.maximum.include(i, V::load(&self.row[i..]));
        self.seen.extend(i..i + V::WIDTH);
    }
}
impl<R: Real> Kernel for Sum<'_, R> {
    type Number = R;
    #[inline(always)]
    fn run<V: Vector<Number = R>>(mut self) {
        along_row::<V>(self.row.len() - 1, &mut self);
    }
}

#[test]
fn every_entry_of_a_row_is_treated_once_and_summed_alike() {
    fn sums<R: Real>(n: usize) {
        let row: Vec<R> = (0..=n).map(|i| R::of((i as f64).sin())).collect();
        let sum = |run: fn(Sum<R>)| {
            let (mut sum, mut maximum) = (Partial::default(), Maximum::default());
            let mut seen = Vec::new();
            run(Sum { row: &row, sum: &mut sum, maximum: &mut maximum, seen: &mut seen });
            assert_eq!(seen, (1..=n).collect::<Vec<_>>());
            let largest = row[1..].iter().fold(0.0, |top, x| x.wide().max(top));
            assert_eq!(maximum.get(), largest);
            sum.sum()
        };
        let one = sum(|work| work.run::<Scalar<R>>());
        assert_eq!(one, sum(|work| work.run::<R::Baseline>()));
        assert_eq!(one, sum(|work| dispatch(work)));
        #[cfg(target_arch = "x86_64")]
        if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
            // SAFETY: just detected.
            assert_eq!(one, sum(|work| unsafe { R::with_avx2(work) }));
        }
        let plain: f64 = row[1..].iter().map(|x| x.wide()).sum();
        assert!((one - plain).abs() < 1e-12, "{one} {plain}");
    }
    for n in 1..70 {
        sums::<f64>(n);
        sums::<f32>(n);
    }
}

/// Marks the entries of a row of `n` that are written with non-temporal stores.
struct Streamed<'a, R> {
    n: usize,
    lines: Range<usize>,
    row: &'a mut [R],
}

impl<R: Real> RowWork for Streamed<'_, R> {
    type Number = R;
    fn at<V: Vector<Number = R>>(&mut self, i: usize) {
        if self.lines.contains(&i) {
            assert!(self.row[i..].as_ptr().addr().is_multiple_of(V::WIDTH * R::BYTES));
            self.row[i..i + V::WIDTH].fill(R::of(1.0));
        }
    }
}

impl<R: Real> Kernel for Streamed<'_, R> {
    type Number = R;
    #[inline(always)]
    fn run<V: Vector<Number = R>>(mut self) {
        self.lines = inner_lines::<V>(self.row, self.n);
        along_row::<V>(self.n, &mut self);
    }
}

#[test]
fn lines_of_non_temporal_stores_are_whole_and_inside_a_row() {
    fn count<R: Real>(n: usize, head: usize, run: impl Fn(Streamed<R>)) -> usize {
        let mut list = Aligned::<R>::zeros((head + n + 2).next_multiple_of(R::LANES));
        run(Streamed { n, lines: 0..0, row: &mut list[head..head + n + 2] });
        assert!(list[head + 1].wide() + list[head + n].wide() == 0.0);
        let lines = list.chunks_exact(R::LANES);
        assert!(lines.clone().all(|line| line.iter().all(|x| x.wide() == line[0].wide())));
        lines.filter(|line| line[0].wide() > 0.0).count()
    }
    fn check<R: Real>() {
        for (n, head) in (1..70).flat_map(|n| (0..R::LANES).map(move |head| (n, head))) {
            count::<R>(n, head, |work| work.run::<R::Baseline>());
            count::<R>(n, head, |work| dispatch(work));
        }
        // Entry 1 starts a line: all lines but those of the ends.
        assert_eq!(count::<R>(5 * R::LANES, R::LANES - 1, |work| dispatch(work)), 3);
        assert_eq!(count::<R>(5 * R::LANES + 2, R::LANES - 1, |work| dispatch(work)), 4);
    }
    check::<f64>();
    check::<f32>();
}

/// Reads and writes at the end of a list.
struct Ends<R>(R);

impl<R: Real> Kernel for Ends<R> {
    type Number = f64;
    #[inline(always)]
    fn run<V: Vector<Number = f64>>(self) {
        let list: Vec<R> = (1..40).map(|n| R::of(f64::from(n))).collect();
        for at in [0, 3, 30, 31, 36, 38, 39] {
            let mut lanes = [9.0; MAX_LANES];
            V::load_partial(&list[at..]).store(&mut lanes);
            for n in 0..V::WIDTH {
                let entry = list.get(at + n).map_or(0.0, |entry| entry.wide());
                assert_eq!(lanes[n], entry, "{at} {n}");
            }
            for end in at..=list.len() {
                let mut copy = list.clone();
                V::constant(0.5).store_partial(&mut copy[at..end]);
                for (n, (new, old)) in copy.iter().zip(&list).enumerate() {
                    let written = (at..end.min(at + V::WIDTH)).contains(&n);
                    let expected = if written { 0.5 } else { old.wide() };
                    assert_eq!(new.wide(), expected, "{at}..{end} {n}");
                }
                for skip in 0..V::WIDTH {
                    let mut numbers: Vec<f64> = list.iter().map(|entry| entry.wide()).collect();
                    V::ramp().store_from(skip, &mut numbers[at..end]);
                    for (n, (new, old)) in numbers.iter().zip(&list).enumerate() {
                        let written = (at..end.min(at + V::WIDTH - skip)).contains(&n);
                        let lane = || (n - at + skip) as f64;
                        let expected = if written { lane() } else { old.wide() };
                        assert_eq!(*new, expected, "{at}..{end} from {skip} {n}");
                    }
                }
            }
        }
    }
}

#[test]
fn lists_may_end_within_a_vector() {
    fn ends<R: Real>() {
        let ends = || Ends(R::default());
        dispatch(ends());
        #[cfg(target_arch = "x86_64")]
        if instructions() >= InstructionSet::Avx2 {
            // SAFETY: `instructions` never exceeds the sets detected on this machine.
            unsafe { f64::with_avx2(ends()) };
        }
        ends().run::<<f64 as Registers>::Baseline>();
        ends().run::<Scalar<f64>>();
    }
    ends::<f64>();
    ends::<f32>();
}

/// Reads about places of a list, at its ends too.
struct Around;

impl Kernel for Around {
    type Number = f64;
    #[inline(always)]
    fn run<V: Vector<Number = f64>>(self) {
        let list: Vec<f32> = (1..60).map(|n| n as f32).collect();
        let offsets = [0, 3, -2, 20];
        let stencil = Stencil::new(offsets);
        for at in [0, 1, 2, 10, 20, 38, 50, 58, 70, usize::MAX] {
            let found = stencil.load_within::<V, f32>(&list, at);
            for (offset, found) in offsets.into_iter().zip(found) {
                let mut lanes = [0.0; MAX_LANES];
                found.store(&mut lanes);
                for n in 0..V::WIDTH {
                    let place = at.wrapping_add_signed(offset).wrapping_add(n);
                    // All or nothing before the list begins.
                    let first = at.wrapping_add_signed(offset);
                    let entry = list.get(place).filter(|_| first < list.len());
                    assert_eq!(lanes[n], f64::from(entry.copied().unwrap_or(0.0)), "{at}");
                }
            }
        }
        let all = stencil.load::<V, f32>(&list, 2);
        let mut lanes = [0.0; MAX_LANES];
        all[2].store(&mut lanes);
        assert_eq!(lanes[0], 1.0);
    }
}

#[test]
fn stencils_read_what_is_there() {
    dispatch(Around);
    Around.run::<<f64 as Registers>::Baseline>();
    Around.run::<Scalar<f64>>();
    let list = [1.0; 40];
    for (offsets, at) in [([0, 39], 1), ([-3, 0], 2), ([isize::MIN, isize::MAX], 20)] {
        let stencil = Stencil::new(offsets);
        let read = || stencil.load::<Scalar<f64>, f64>(&list, at);
        assert!(std::panic::catch_unwind(read).is_err(), "{offsets:?}");
    }
}

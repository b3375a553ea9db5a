//! Loads and stores of blocks of lines before and after the transforms.

use super::axis::{self, AxisTransform};
use crate::math::{Aligned, Real};
use grainwake_simd::{Complex, MAX_LANES, Vector, as_complex, dispatch};

/// Both buffers of the transforms, one set per thread.
pub struct Buffers<R>(Aligned<R>);

impl<R: Real> Buffers<R> {
    /// Buffers for the transforms along x and y.
    pub fn new(axes: [&AxisTransform<R>; 2]) -> Buffers<R> {
        let longest = axes[0].buffer_len().max(axes[1].buffer_len());
        Buffers(Aligned::zeros(4 * R::LANES * longest))
    }
    /// Memory held [bytes].
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.0)
    }
    /// Input lines of a transform along `axis`.
    #[inline(always)]
    pub fn lines<V: Vector<Number = R>>(&mut self, axis: &AxisTransform<R>) -> &mut [Complex<V>] {
        &mut as_complex::<V>(&mut self.0)[..axis.n]
    }
    /// Transforms the input lines and returns the result.
    #[inline(always)]
    pub fn transform<V: Vector<Number = R>>(
        &mut self,
        axis: &AxisTransform<R>,
        inverse: bool,
    ) -> &[Complex<V>] {
        let len = axis.buffer_len();
        let buffers = &mut self.0[..4 * V::WIDTH * len];
        let mut second = false;
        dispatch(axis::Lines {
            axis,
            buffers,
            inverse,
            half: 2 * V::WIDTH == R::LANES,
            second: &mut second,
        });
        &as_complex::<V>(buffers)[if second { len } else { 0 }..][..axis.n]
    }
}

/// Pairs of adjacent lines: entry i of the first lines at `at + i step`, of the second lines
/// `second` further.
#[derive(Clone, Copy)]
pub struct Lines {
    /// Position of entry 0 of the first lines.
    pub at: usize,
    /// Distance of successive entries of a line.
    pub step: usize,
    /// Distance of the second lines from the first.
    pub second: usize,
}

impl Lines {
    /// Loads entry i of the lines.
    #[inline(always)]
    fn entry<V: Vector>(&self, values: &[V::Number], i: usize) -> Complex<V> {
        let both = &values[self.at + i * self.step..][..self.second + V::WIDTH];
        Complex { re: V::load(both), im: V::load(&both[self.second..]) }
    }
    /// Mutable entry i of the first lines, and of the second lines.
    #[inline(always)]
    fn entry_mut<'a, V: Vector>(
        &self,
        values: &'a mut [V::Number],
        i: usize,
    ) -> (&'a mut [V::Number], &'a mut [V::Number]) {
        values[self.at + i * self.step..][..self.second + V::WIDTH].split_at_mut(self.second)
    }
    /// Loads all entries of the lines.
    #[inline(always)]
    pub fn load<V: Vector>(&self, values: &[V::Number], a: &mut [Complex<V>]) {
        for (i, x) in a.iter_mut().enumerate() {
            *x = self.entry(values, i);
        }
    }
    /// Stores all entries of the lines.
    #[inline(always)]
    pub fn store<V: Vector>(&self, a: &[Complex<V>], values: &mut [V::Number]) {
        for (i, x) in a.iter().enumerate() {
            let (first, second) = self.entry_mut::<V>(values, i);
            x.re.store(first);
            x.im.store(second);
        }
    }
    /// Stores all entries of the lines with non-temporal stores.
    #[inline(always)]
    pub fn store_non_temporal<V: Vector>(&self, a: &[Complex<V>], values: &mut [V::Number]) {
        for (i, x) in a.iter().enumerate() {
            let (first, second) = self.entry_mut::<V>(values, i);
            x.re.store_non_temporal(first);
            x.im.store_non_temporal(second);
        }
    }
    /// Replaces the lines by their modes along `axis`.
    #[inline(always)]
    pub fn forward<V: Vector>(
        &self,
        axis: &AxisTransform<V::Number>,
        values: &mut [V::Number],
        buffers: &mut Buffers<V::Number>,
    ) {
        let lines = buffers.lines::<V>(axis);
        for (i, &to) in axis.order.iter().enumerate() {
            lines[to] = self.entry(values, i);
        }
        self.store(buffers.transform::<V>(axis, false), values);
    }
    /// Replaces modes along `axis` by the lines, unnormalised.
    #[inline(always)]
    pub fn inverse<V: Vector>(
        &self,
        axis: &AxisTransform<V::Number>,
        values: &mut [V::Number],
        buffers: &mut Buffers<V::Number>,
    ) {
        self.load(values, buffers.lines::<V>(axis));
        let lines = buffers.transform::<V>(axis, true);
        for (i, &from) in axis.order.iter().enumerate() {
            let (first, second) = self.entry_mut::<V>(values, i);
            let line = &lines[from];
            line.im.store(first);
            line.re.store(second);
        }
    }
}

/// Pairs of rows of a plane: the first rows start at `at`, the second rows `second` rows further.
#[derive(Clone, Copy)]
pub struct Rows {
    /// Position of entry 0 of the first row.
    pub at: usize,
    /// Distance of successive rows.
    pub pitch: usize,
    /// Number of rows from the first rows to the second rows.
    pub second: usize,
}

impl Rows {
    /// Loads the rows transposed, entry i at `order[i]`.
    #[inline(always)]
    pub fn load<V: Vector>(&self, order: &[usize], values: &[V::Number], a: &mut [Complex<V>]) {
        for (group, order) in order.chunks(V::WIDTH).enumerate() {
            let at = self.at + group * V::WIDTH;
            let (mut re, mut im) = ([V::constant(0.0); MAX_LANES], [V::constant(0.0); MAX_LANES]);
            for row in 0..V::WIDTH {
                re[row] = V::load(&values[at + row * self.pitch..]);
                im[row] = V::load(&values[at + (row + self.second) * self.pitch..]);
            }
            V::transpose(&mut re);
            V::transpose(&mut im);
            for ((re, im), &to) in re.into_iter().zip(im).zip(order) {
                a[to] = Complex { re, im };
            }
        }
    }
    /// Stores the rows from their transpose, entry i from `order[i]`; real and imaginary parts are
    /// swapped.
    #[inline(always)]
    pub fn store<V: Vector>(&self, order: &[usize], a: &[Complex<V>], values: &mut [V::Number]) {
        let groups = order.chunks_exact(V::WIDTH);
        let rest = groups.remainder();
        let mut at = self.at;
        for order in groups {
            let mut block = [[V::constant(0.0); MAX_LANES]; 2];
            for n in 0..V::WIDTH {
                let line = &a[order[n]];
                (block[0][n], block[1][n]) = (line.im, line.re);
            }
            self.store_block(block, at, values);
            at += V::WIDTH;
        }
        if !rest.is_empty() {
            let mut block = [[V::constant(0.0); MAX_LANES]; 2];
            for (n, &from) in rest.iter().enumerate() {
                (block[0][n], block[1][n]) = (a[from].im, a[from].re);
            }
            self.store_block(block, at, values);
        }
    }
    /// Transposes two blocks into the entries from `at` on of `V::WIDTH` first and second rows.
    #[inline(always)]
    fn store_block<V: Vector>(
        &self,
        [mut first, mut second]: [[V; MAX_LANES]; 2],
        at: usize,
        values: &mut [V::Number],
    ) {
        V::transpose(&mut first);
        V::transpose(&mut second);
        for row in 0..V::WIDTH {
            first[row].store(&mut values[at + row * self.pitch..]);
            second[row].store(&mut values[at + (row + self.second) * self.pitch..]);
        }
    }
}

//! Parallel loops over the planes of a field and reductions in a fixed order.
//!
//! Work is split by z plane, and every plane's result depends on nothing but its inputs, so the
//! bits do not depend on the number of threads.

use rayon::prelude::*;

use super::Layout;

/// Calls `f(k, plane)` for the interior planes k = 1..=nz of `values` in parallel.
pub fn for_planes(layout: Layout, values: &mut [f64], f: impl Fn(usize, &mut [f64]) + Sync) {
    let plane = layout.plane();
    values[plane..plane * (layout.cells[2] + 1)]
        .par_chunks_exact_mut(plane)
        .enumerate()
        .for_each(|(k, slab)| f(k + 1, slab));
}

/// Like [`for_planes`] for several fields at once, with one partial result a plane.
pub fn for_planes_of<const N: usize, T: Send>(
    layout: Layout,
    fields: [&mut [f64]; N],
    partial: &mut [T],
    f: impl Fn(usize, [&mut [f64]; N], &mut T) + Sync,
) {
    let (plane, planes) = (layout.plane(), layout.cells[2]);
    debug_assert_eq!(partial.len(), planes);
    let interior = plane..plane * (planes + 1);
    let fields = fields.map(|field| Planes::new(&mut field[interior.clone()], plane));
    partial.par_iter_mut().enumerate().for_each(|(k, partial)| {
        // Each k is visited once, so no two threads hold the same plane.
        let slabs = fields.each_ref().map(|field| unsafe { field.get(k) });
        f(k + 1, slabs, partial);
    });
}

/// A field cut into planes that threads may hold one at a time.
struct Planes {
    start: *mut f64,
    plane: usize,
    planes: usize,
}

unsafe impl Send for Planes {}
unsafe impl Sync for Planes {}

impl Planes {
    fn new(values: &mut [f64], plane: usize) -> Planes {
        Planes {
            start: values.as_mut_ptr(),
            plane,
            planes: values.len() / plane,
        }
    }
    /// Plane `k`.
    ///
    /// # Safety
    /// No two live borrows may have the same `k`, and the field must outlive them.
    #[allow(clippy::mut_from_ref)]
    unsafe fn get(&self, k: usize) -> &mut [f64] {
        assert!(k < self.planes);
        unsafe { std::slice::from_raw_parts_mut(self.start.add(k * self.plane), self.plane) }
    }
}

/// Sum of partial results in the order of the planes.
pub fn ordered_sum(partial: &[f64]) -> f64 {
    partial.iter().sum()
}

/// The rows (j fixed, k = 1..=nz) of a field that one thread holds during [`for_row_columns`].
pub struct RowColumn<'a> {
    start: *mut f64,
    layout: Layout,
    borrow: std::marker::PhantomData<&'a mut [f64]>,
}

impl RowColumn<'_> {
    /// The interior of row `k`, entries i = 1..=nx.
    #[inline]
    pub fn row(&mut self, k: usize) -> &mut [f64] {
        assert!((1..=self.layout.cells[2]).contains(&k));
        // Disjoint from all other columns, and borrowed from `self` as a whole.
        unsafe {
            let first = self.start.add(k * self.layout.plane());
            std::slice::from_raw_parts_mut(first, self.layout.cells[0])
        }
    }
}

/// Calls `f(j, column, scratch)` for j = 1..=ny in parallel; each scratch slot serves a run of j.
pub fn for_row_columns<S: Send>(
    layout: Layout,
    values: &mut [f64],
    scratch: &mut [S],
    f: impl Fn(usize, &mut RowColumn, &mut S) + Sync,
) {
    assert_eq!(values.len(), layout.len());
    let whole = Planes {
        start: values.as_mut_ptr(),
        plane: layout.plane(),
        planes: 1,
    };
    let (rows, slots) = (layout.cells[1], scratch.len());
    scratch
        .par_iter_mut()
        .enumerate()
        .for_each(|(slot, scratch)| {
            let whole = &whole;
            for j in rows * slot / slots..rows * (slot + 1) / slots {
                // Every j belongs to one slot, so the rows of two columns never overlap.
                let start = unsafe { whole.start.add(layout.index(1, j + 1, 0)) };
                let mut column = RowColumn {
                    start,
                    layout,
                    borrow: std::marker::PhantomData,
                };
                f(j + 1, &mut column, scratch);
            }
        });
}

/// Calls `f(k, plane, scratch)` for k = 1..=nz in parallel; each scratch slot serves a run of k.
pub fn for_planes_with<S: Send>(
    layout: Layout,
    values: &mut [f64],
    scratch: &mut [S],
    f: impl Fn(usize, &mut [f64], &mut S) + Sync,
) {
    let (plane, planes, slots) = (layout.plane(), layout.cells[2], scratch.len());
    let slabs = Planes::new(&mut values[plane..plane * (planes + 1)], plane);
    scratch
        .par_iter_mut()
        .enumerate()
        .for_each(|(slot, scratch)| {
            let slabs = &slabs;
            for k in planes * slot / slots..planes * (slot + 1) / slots {
                // Every k belongs to one slot.
                f(k + 1, unsafe { slabs.get(k) }, scratch);
            }
        });
}

//! The faces that a grain's rigidity acts on, in runs along x.

use glam::DVec3;

/// Neighbouring faces of one component in a row of the grid, with no gap in memory.
#[derive(Clone, Copy, Debug)]
pub struct Run {
    /// Position in memory of the first face, also that of the cell above it.
    pub at: usize,
    /// Position of the cell below it, across a periodic edge if need be.
    pub below: usize,
    /// From the grain's centroid to the first face [m].
    pub arm: DVec3,
    /// Place of the first face in the lists of [`Forced`].
    pub first: usize,
    /// Number of faces.
    pub count: usize,
}

/// Forced faces of all components; faces between them that are not forced have zeros. In each list some
/// entries more follow the last.
#[derive(Clone, Debug, Default)]
pub struct Forced {
    /// Of each component.
    pub runs: [Vec<Run>; 3],
    /// Share by which a face takes the rigid velocity, 0 to 1.
    pub share: Vec<f32>,
    /// Part of a face that the grain closes to the pressure gradient, 0 to 1.
    pub closed: Vec<f32>,
    /// Part that all grains together close; empty where no other grain is near.
    pub closed_by_all: Vec<f32>,
    /// What a face takes from a grain at rest that goes on resting [m/s]: the pressure of the step given back
    /// to its closed part, less its share of the velocity that it would have without drag. Known once the
    /// impulse is.
    pub taken: Vec<f64>,
}

impl Forced {
    /// Memory held [bytes].
    pub fn bytes(&self) -> usize {
        let lists = [&self.share, &self.closed, &self.closed_by_all];
        let runs: usize = self.runs.iter().map(Vec::capacity).sum();
        let values: usize = lists.iter().map(|list| list.capacity()).sum();
        size_of::<Run>() * runs
            + size_of::<f32>() * values
            + size_of::<f64>() * self.taken.capacity()
    }
}

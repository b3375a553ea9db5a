//! Memory that the lists of the grains hold.

use super::ImmersedGrains;
use super::forcing::ForcedFaces;
use super::geometry::LocatedBody;
use super::update::ImmersedGrain;

/// Memory of lists [bytes].
fn bytes_of<'a, T: 'a>(lists: impl IntoIterator<Item = &'a Vec<T>>) -> usize {
    lists.into_iter().map(|list| size_of::<T>() * list.capacity()).sum()
}

impl<R> ImmersedGrains<R> {
    /// Memory held without the buffers of threads [bytes].
    pub fn bytes(&self) -> usize {
        self.grains.iter().map(ImmersedGrain::bytes).sum::<usize>() + self.locator.bytes()
    }
}

impl ImmersedGrain {
    /// Memory held [bytes].
    fn bytes(&self) -> usize {
        size_of::<ImmersedGrain>()
            + self.body.bytes()
            + self.forced.bytes()
            + bytes_of(&self.correction)
            + bytes_of([&self.located_beside])
    }
}

impl LocatedBody {
    /// Memory held [bytes].
    fn bytes(&self) -> usize {
        let lists = bytes_of(&self.distance) + bytes_of(&self.spans) + bytes_of(&self.rows);
        lists + bytes_of(self.index_map.tables())
    }
}

impl ForcedFaces {
    /// Memory held [bytes].
    fn bytes(&self) -> usize {
        let fractions = [&self.closed_fraction, &self.total_closed_fraction, &self.solid_fraction];
        bytes_of(&self.runs)
            + bytes_of(fractions.into_iter().chain([&self.weight]))
            + bytes_of([&self.rest_gain])
    }
}

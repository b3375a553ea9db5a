//! Data of the figures of a run, and the elements that several figures share.

use glam::DVec3;
use grainwake_formats::events::Event;
use grainwake_formats::vti::Image;
use grainwake_plot::Figure;
use grainwake_plot::axis::{Axis, AxisRange, extent};
use grainwake_plot::equal_aspect::length_unit;
use grainwake_plot::stacked::{Panel, Series, VerticalMark, stacked_panels};
use grainwake_plot::style::series_colour;

use super::grain_surface::{self, Outline, Surfaces};
use super::section::{Section, SliceView};
use crate::features::{LEAST, RunFeatures};
use crate::phases::Instant;
use crate::run_folder::{History, RunFolder};

/// Names of the coordinate axes.
pub const AXES: [&str; 3] = ["x", "y", "z"];

/// Points of a curve.
pub type Points = Vec<(f64, f64)>;

/// Data of the figures.
pub struct Scene<'a> {
    /// Run folder.
    pub run: &'a RunFolder,
    /// Features derived from the tables.
    pub features: &'a RunFeatures,
    /// Known surfaces of the grains, in the body frame.
    pub surfaces: Surfaces,
    /// Key instants, moved to the nearest times with pictures.
    pub instants: Vec<Instant>,
}

impl Scene<'_> {
    /// Returns the time axis of all curves.
    fn time(&self) -> Axis {
        let (label, factor) = self.features.time_axis();
        Axis::linear(label, 0.0, self.features.end * factor, 6, AxisRange::Tight)
    }

    /// Returns the events as marks on the time axis.
    fn marks(&self) -> Vec<VerticalMark> {
        let (_, factor) = self.features.time_axis();
        // Contacts with walls are too many to mark.
        let marked = self.run.events.iter().filter(|event| event.wall.is_none());
        let mark = marked
            .map(|event| VerticalMark { at: event.time * factor, name: self.event_name(event) });
        mark.collect()
    }

    /// Returns the name of an event with the indices of its grains, "landing 3" or "kiss 0, 2"; an
    /// event of all grains of the run is named without them.
    pub fn event_name(&self, event: &Event) -> String {
        let label = event.kind.label();
        if event.grains.len() == self.run.grains.len() {
            return label.to_owned();
        }
        let grains: Vec<String> = event.grains.iter().map(usize::to_string).collect();
        format!("{label} {}", grains.join(", "))
    }

    /// Draws panels against time with the events marked.
    pub fn with_events(
        &self,
        name: &str,
        title: &str,
        caption: String,
        panels: &[Panel],
    ) -> Figure {
        let some = |event: &Event| event.grains.len() < self.run.grains.len();
        let named = self.run.events.iter().any(|event| event.wall.is_none() && some(event));
        let of_grains =
            if named { " Events are named with the indices of their grains." } else { "" };
        let drawing = stacked_panels(&self.time(), panels, &self.marks());
        Figure::new(name, title, caption + of_grains, drawing)
    }

    /// Draws panels against time.
    pub fn without_events(
        &self,
        name: &str,
        title: &str,
        caption: String,
        panels: &[Panel],
    ) -> Figure {
        Figure::new(name, title, caption, stacked_panels(&self.time(), panels, &[]))
    }

    /// Returns a curve of a grain against time.
    pub fn curve(&self, grain: usize, value: impl Fn(&History, usize) -> f64) -> Series {
        let (_, factor) = self.features.time_axis();
        let history = &self.run.grains[grain];
        let point = |row: usize| (history.time[row] * factor, value(history, row));
        let colour = series_colour(self.features.grain_rank(grain));
        let points = (0..history.len()).map(point).collect();
        Series::new(points, colour).named(self.features.grain_name(grain))
    }

    /// Returns two columns of the diagnostics as points against time: the first column found.
    pub fn diagnostic(&self, names: &[&str]) -> Option<Points> {
        let table = self.run.diagnostics.as_ref()?;
        let (_, factor) = self.features.time_axis();
        let column = names.iter().find_map(|name| table.column(name))?;
        let rows = table.column("time")?.iter().zip(column);
        Some(rows.map(|(time, value)| (time * factor, *value)).collect())
    }

    /// Returns the unit of the heights of the grains, and the number of units per metre.
    pub fn height_unit(&self) -> (&'static str, f64) {
        let up = self.vertical();
        let heights = self.run.grains.iter().flat_map(|h| &h.position).map(|p| p[up].abs());
        let box_height = self.run.facts.size.map_or(0.0, |size| size[up]);
        length_unit(heights.filter(|z| z.is_finite()).fold(box_height, f64::max))
    }

    /// Returns the ends of the least range of an axis of positions around the values, which have
    /// `factor` units per metre: a resting grain has no ticks of round-off.
    pub fn least_range(&self, values: impl Iterator<Item = f64>, factor: f64) -> Vec<f64> {
        let half = 0.5 * LEAST * factor * self.run.facts.diameter().unwrap_or(0.0);
        let ends = |(low, high): (f64, f64)| {
            let middle = 0.5 * (low + high);
            vec![middle - half, middle + half]
        };
        extent(values).map(ends).unwrap_or_default()
    }

    /// Returns the grains with a history; of a pair, the trailing one first.
    pub fn moving(&self) -> Vec<usize> {
        let pair = self.features.pair;
        pair.map_or_else(|| self.run.moving(), |pair| pair.to_vec())
    }

    /// Returns a function of the line of centres of the pair against time.
    pub fn pair_curve(&self, value: impl Fn(DVec3) -> f64) -> Option<Points> {
        let [a, b] = self.features.pair?.map(|grain| &self.run.grains[grain]);
        let (_, factor) = self.features.time_axis();
        let rows = (0..a.len().min(b.len())).filter(|row| a.time[*row] == b.time[*row]);
        let line = |row: usize| self.run.nearest(a.position[row] - b.position[row]);
        let points = rows.map(|row| (a.time[row] * factor, value(line(row))));
        Some(points.collect())
    }

    /// Returns the outlines of a grain at a row of its history, projected to two axes: from its
    /// surface if known, with those of its holes; else a circle of equal volume.
    pub fn outlines(&self, grain: usize, row: usize, across: usize, up: usize) -> Vec<Outline> {
        let history = &self.run.grains[grain];
        let position = self.run.wrapped(history.position[row]);
        if let Some(diameter) = self.sphere_diameter(grain) {
            return vec![grain_surface::circle((position[across], position[up]), 0.5 * diameter)];
        }
        let body = self.surfaces.get(&grain);
        let traced = body.map(|body| body.outlines(position, history.orientation[row], across, up));
        traced.filter(|outlines| !outlines.is_empty()).unwrap_or_else(|| {
            let own = self.run.facts.grains.get(grain).and_then(|facts| facts.diameter);
            let diameter = own.or(self.run.facts.diameter()).unwrap_or(0.0);
            vec![grain_surface::circle((position[across], position[up]), 0.5 * diameter)]
        })
    }

    /// Returns a radius around the position of a grain that holds its outlines [m].
    pub fn reach(&self, grain: usize) -> f64 {
        let facts = &self.run.facts;
        let own = facts.grains.get(grain).and_then(|facts| facts.diameter);
        let sphere = 0.5 * own.or(facts.diameter()).unwrap_or(0.0);
        let surface = self.surfaces.get(&grain).filter(|_| self.sphere_diameter(grain).is_none());
        let farthest = surface.map(|body| body.points().iter().map(|p| p.length()));
        farthest.map_or(sphere, |lengths| lengths.fold(sphere, f64::max))
    }

    /// Returns the shifts of an outline to itself and to its images through periodic faces, along
    /// two axes [m].
    pub fn image_shifts(&self, across: usize, up: usize) -> Vec<(f64, f64)> {
        let shifts = |axis: usize| match self.run.period(axis) {
            Some(period) => vec![0.0, -period, period],
            None => vec![0.0],
        };
        let upward = shifts(up);
        let pairs = |dx: f64| upward.iter().map(move |dy| (dx, *dy));
        shifts(across).into_iter().flat_map(pairs).collect()
    }

    /// Returns the diameter of a grain that is a sphere [m].
    pub fn sphere_diameter(&self, grain: usize) -> Option<f64> {
        let facts = &self.run.facts;
        facts.grains.get(grain)?.diameter.filter(|_| facts.is_sphere(grain))
    }

    /// Returns the representation of the grains in words.
    pub fn drawn_as(&self, grains: &[usize]) -> &'static str {
        let known =
            |g: &&usize| self.surfaces.contains_key(g) || self.sphere_diameter(**g).is_some();
        match grains.iter().filter(known).count() {
            n if n == grains.len() => "true outlines",
            0 => "circles of equal volume",
            _ => "true outlines where their surfaces are known, else circles of equal volume",
        }
    }

    /// Returns a sentence about grains whose centres are outside the box at the end; empty if there
    /// are none.
    pub fn left_out(&self, grains: &[usize]) -> String {
        let Some(size) = self.run.facts.size else {
            return String::new();
        };
        let (low, high) = (self.run.facts.lower, self.run.facts.lower + size);
        let outside = |grain: &&usize| {
            let last = self.run.grains[**grain].position.last();
            let last = last.map(|x| self.run.wrapped(*x));
            last.is_some_and(|x| x.cmplt(low).any() || x.cmpgt(high).any())
        };
        let names: Vec<String> = grains.iter().filter(outside).map(usize::to_string).collect();
        match names.as_slice() {
            [] => String::new(),
            [one] => format!(" Grain {one} has left the box and is not shown there."),
            few if few.len() <= 6 => {
                let names = few.join(", ");
                format!(" Grains {names} have left the box and are not shown there.")
            }
            many => {
                let count = many.len();
                format!(" {count} grains have left the box and are not shown there.")
            }
        }
    }

    /// Returns the axis nearest to the vertical.
    pub fn vertical(&self) -> usize {
        let up = self.features.up.abs();
        match () {
            () if up.z >= up.x && up.z >= up.y => 2,
            () if up.y >= up.x => 1,
            () => 0,
        }
    }

    /// Returns whether the vertical axis points down: views show it downwards, so that grains fall
    /// down in all pictures.
    pub fn flipped(&self) -> bool {
        self.features.up[self.vertical()] < 0.0
    }

    /// Returns a sentence about a vertical axis that points down; empty if it points up.
    pub fn downwards(&self) -> String {
        match self.flipped() {
            true => format!(" Gravity acts along +{}, shown downwards.", AXES[self.vertical()]),
            false => String::new(),
        }
    }

    /// Extracts a slice, seen with gravity downwards if it lies in the plane.
    ///
    /// # Errors
    /// As [`Section::of`].
    pub fn section(&self, image: &Image) -> Result<Section, String> {
        let mut section = Section::of(image, self.vertical())?;
        section.view.flipped = self.flipped() && section.view.up == self.vertical();
        Ok(section)
    }

    /// Returns the height of a point above the lower side of the box, if gravity acts along a
    /// positive axis; else its coordinate against gravity [m].
    pub fn height(&self, point: DVec3) -> f64 {
        let (up, axis) = (self.features.up, self.vertical());
        let floor = match self.run.facts.size.filter(|_| self.flipped()) {
            Some(size) => (self.run.facts.lower[axis] + size[axis]) * up[axis],
            None => 0.0,
        };
        point.dot(up) - floor
    }

    /// Returns the two other axes.
    pub fn horizontal(&self) -> [usize; 2] {
        [[1, 2], [0, 2], [0, 1]][self.vertical()]
    }

    /// Returns the centres of all grains at a time, projected to the plane of a view.
    pub fn centres(&self, time: f64, view: SliceView) -> Vec<(usize, (f64, f64))> {
        let histories = self.run.grains.iter().enumerate();
        let centre = histories.filter_map(|(grain, history)| {
            let (position, _) = history.pose(time)?;
            Some((grain, view.seen(self.run.wrapped(position))))
        });
        centre.collect()
    }

    /// Returns whether the grains of a pair lie more than a quarter of a diameter apart along the
    /// normal of a view.
    pub fn out_of_plane(&self, time: f64, view: SliceView) -> bool {
        let distance = || {
            let [a, b] = self.features.pair?.map(|grain| self.run.grains[grain].pose(time));
            Some(self.run.nearest(a?.0 - b?.0)[view.normal].abs())
        };
        let diameter = self.run.facts.diameter().unwrap_or(0.0);
        distance().is_some_and(|distance| distance > 0.25 * diameter)
    }
}

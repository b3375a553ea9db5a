//! A slice of the fields: interpolation between cells, outlines of the solid, raster image.

use glam::DVec3;
use grainwake_formats::vti::{Frame, Image};
use grainwake_plot::contour;
use grainwake_plot::equal_aspect::Window;
use grainwake_plot::raster::Raster;

/// Representation of the values of cells in a raster.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shading {
    /// Interpolated between cell centres.
    Smooth,
    /// One colour per cell.
    Flat,
}

/// Direction of view onto a plane; axes 0, 1, 2 are x, y, z.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SliceView {
    /// Axis across the plane.
    pub normal: usize,
    /// Axis to the right.
    pub across: usize,
    /// Axis upwards.
    pub up: usize,
    /// Whether that axis points downwards instead: gravity acts along it.
    pub flipped: bool,
}

impl SliceView {
    /// Returns the view along a normal, with the axis `vertical` upwards if it lies in the plane.
    pub fn along(normal: usize, vertical: usize) -> SliceView {
        let up = match (vertical == normal, normal) {
            (false, _) => vertical,
            (true, 2) => 1,
            (true, _) => 2,
        };
        SliceView { normal, across: 3 - normal - up, up, flipped: false }
    }

    /// Projects a point to the plane.
    pub fn seen(&self, x: DVec3) -> (f64, f64) {
        (x[self.across], x[self.up])
    }

    /// Returns whether a positive rotation about the normal appears clockwise.
    pub fn clockwise(&self) -> bool {
        let turn = DVec3::AXES[self.across].cross(DVec3::AXES[self.up])[self.normal];
        (turn < 0.0) != self.flipped
    }
}

/// A slice one cell thick.
#[derive(Clone, Debug)]
pub struct Section {
    /// Direction of view.
    pub view: SliceView,
    nx: usize,
    nz: usize,
    lower: (f64, f64),
    step: (f64, f64),
    /// Position of the plane along its normal [m].
    pub place: f64,
    /// Velocity to the right, upwards, and its magnitude in space [m/s], by cell.
    pub velocity: Option<Vec<[f64; 3]>>,
    /// Vorticity along the normal [1/s], by cell.
    pub vorticity: Option<Vec<f64>>,
    solid: Option<Vec<f64>>,
}

impl Section {
    /// Extracts the slice from an image that is one cell thick in y, else in x, else in z.
    ///
    /// # Errors
    /// If the image is thicker, or its spacing or origin is unusable.
    pub fn of(image: &Image, vertical: usize) -> Result<Section, String> {
        let Frame { cells, spacing, origin, .. } = image.frame;
        let [nx, ny, nz] = cells;
        let thin = [1, 0, 2].into_iter().find(|axis| cells[*axis] == 1);
        let normal = thin.ok_or_else(|| {
            format!("{nx} x {ny} x {nz} cells are no slice, which is one cell thick")
        })?;
        let view = SliceView::along(normal, vertical);
        let strides = [1, nx, nx * ny];
        let (across, up) = (view.across, view.up);
        let order = || {
            let rows = (0..cells[up]).map(move |k| k * strides[up]);
            rows.flat_map(move |row| (0..cells[across]).map(move |i| row + i * strides[across]))
        };
        if !(spacing.min_element() > 0.0 && spacing.is_finite() && origin.is_finite()) {
            return Err("its spacing or origin cannot be used".to_owned());
        }
        let array = |name: &str, components: usize| {
            let found =
                image.arrays.iter().find(|a| a.name == name && a.components == components)?;
            Some(&found.data)
        };
        let velocity = array("velocity", 3).map(|data| {
            let value = |cell: usize| {
                let v = [0, 1, 2].map(|axis| f64::from(data[3 * cell + axis]));
                [v[across], v[up], DVec3::from_array(v).length()]
            };
            order().map(value).collect()
        });
        let vorticity = array("vorticity", 3)
            .map(|data| order().map(|cell| f64::from(data[3 * cell + normal])).collect());
        let solid = array("solid_fraction", 1)
            .map(|data| order().map(|cell| f64::from(data[cell])).collect());
        Ok(Section {
            view,
            nx: cells[across],
            nz: cells[up],
            lower: view.seen(origin),
            step: view.seen(spacing),
            place: origin[normal] + 0.5 * spacing[normal],
            velocity,
            vorticity,
            solid,
        })
    }

    /// Returns the extent of the slice.
    pub fn whole(&self) -> Window {
        let (x, z) = self.lower;
        Window {
            low: (x, z),
            high: (x + self.step.0 * self.nx as f64, z + self.step.1 * self.nz as f64),
        }
    }

    /// Interpolates at a point with cubics, limited to the range of the four nearest cells.
    pub fn sample(&self, value: impl Fn(usize) -> f64, (x, z): (f64, f64)) -> f64 {
        let place = |at: f64, low: f64, step: f64, n: usize| {
            ((at - low) / step - 0.5).clamp(0.0, (n - 1) as f64)
        };
        let px = place(x, self.lower.0, self.step.0, self.nx);
        let pz = place(z, self.lower.1, self.step.1, self.nz);
        let (i, k) = (px.floor() as isize, pz.floor() as isize);
        let inside = |i: isize, n: usize| i.clamp(0, n as isize - 1) as usize;
        let at = |i: isize, k: isize| value(inside(i, self.nx) + self.nx * inside(k, self.nz));
        let (u, w) = (px - i as f64, pz - k as f64);
        let row = |k: isize| cubic([at(i - 1, k), at(i, k), at(i + 1, k), at(i + 2, k)], u);
        let out = cubic([row(k - 1), row(k), row(k + 1), row(k + 2)], w);
        let near = [at(i, k), at(i + 1, k), at(i, k + 1), at(i + 1, k + 1)];
        out.clamp(
            near.iter().copied().fold(f64::INFINITY, f64::min),
            near.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        )
    }

    /// Returns the cell that contains a point, or the nearest cell.
    pub fn cell(&self, (x, z): (f64, f64)) -> usize {
        let place = |at: f64, low: f64, step: f64, n: usize| {
            (((at - low) / step).floor() as isize).clamp(0, n as isize - 1) as usize
        };
        place(x, self.lower.0, self.step.0, self.nx)
            + self.nx * place(z, self.lower.1, self.step.1, self.nz)
    }

    /// Returns the solid fraction of a cell; zero if the file has none.
    pub fn solid(&self, cell: usize) -> f64 {
        self.solid.as_ref().map_or(0.0, |solid| solid[cell])
    }

    /// Returns the solid fractions by cell, if the file has them.
    pub fn solid_fraction(&self) -> Option<&[f64]> {
        self.solid.as_deref()
    }

    /// Returns the cells whose centres lie in the window.
    pub fn cells_in(&self, window: Window) -> impl Iterator<Item = usize> + '_ {
        let inside = move |cell: usize| {
            let x = self.lower.0 + (0.5 + (cell % self.nx) as f64) * self.step.0;
            let z = self.lower.1 + (0.5 + (cell / self.nx) as f64) * self.step.1;
            x >= window.low.0 && x <= window.high.0 && z >= window.low.1 && z <= window.high.1
        };
        (0..self.nx * self.nz).filter(move |cell| inside(*cell))
    }

    /// Returns the contours of solid fraction 0.5 [m].
    pub fn outlines(&self) -> Vec<Vec<(f64, f64)>> {
        let Some(solid) = &self.solid else {
            return Vec::new();
        };
        let loops = contour::closed_contours(self.nx, self.nz, |i, k| solid[i + self.nx * k], 0.5);
        let place = |(i, k): (f64, f64)| {
            (self.lower.0 + (i + 0.5) * self.step.0, self.lower.1 + (k + 0.5) * self.step.1)
        };
        loops.into_iter().map(|ring| ring.into_iter().map(place).collect()).collect()
    }

    /// Returns the window as a raster of `width` x `height` pixels; `position` maps a value to a
    /// position in the palette, 0 to 1.
    pub fn raster(
        &self,
        window: Window,
        [width, height]: [usize; 2],
        palette: Vec<[u8; 3]>,
        values: &[f64],
        position: impl Fn(f64) -> f64,
        shading: Shading,
    ) -> Raster {
        let mut pixels = Vec::with_capacity(width * height);
        for row in 0..height {
            let depth = window.height() * (row as f64 + 0.5) / height as f64;
            let z = match self.view.flipped {
                true => window.low.1 + depth,
                false => window.high.1 - depth,
            };
            for column in 0..width {
                let x = window.low.0 + window.width() * (column as f64 + 0.5) / width as f64;
                let place = position(match shading {
                    Shading::Smooth => self.sample(|cell| values[cell], (x, z)),
                    Shading::Flat => values[self.cell((x, z))],
                });
                pixels.push((255.0 * place.clamp(0.0, 1.0)).round() as u8);
            }
        }
        Raster { width, height, pixels, palette }
    }
}

/// Catmull-Rom interpolation between the middle two of four values.
fn cubic([a, b, c, d]: [f64; 4], t: f64) -> f64 {
    b + 0.5 * t * (c - a + t * (2.0 * a - 5.0 * b + 4.0 * c - d + t * (3.0 * (b - c) + d - a)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use grainwake_formats::vti::Array;

    fn image(ny: usize) -> Image {
        let centre = |i: usize| (i % 8) as f32 + 0.5;
        let height = |i: usize| (i / 8) as f32 + 0.5;
        let inside = |i: usize| (centre(i) - 4.0).hypot(height(i) - 3.0) < 1.6;
        let array =
            |name: &str, components, data| Array { name: name.to_owned(), components, data };
        Image {
            frame: Frame { cells: [8, ny, 6], spacing: DVec3::ONE, origin: DVec3::ZERO, time: 0.0 },
            arrays: vec![
                array(
                    "solid_fraction",
                    1,
                    (0..48).map(|i| f32::from(u8::from(inside(i)))).collect(),
                ),
                array(
                    "velocity",
                    3,
                    (0..48).flat_map(|i| [height(i), 0.0, 2.0 * centre(i)]).collect(),
                ),
            ],
        }
    }

    #[test]
    fn values_between_cells() {
        let section = Section::of(&image(1), 2).unwrap();
        let velocity = section.velocity.clone().unwrap();
        assert!(
            (section.sample(|i| velocity[i][0], (3.3, 2.9)) - 2.9).abs() < 1e-12,
            "linear fields are exact"
        );
        assert_eq!(section.sample(|i| velocity[i][1], (-9.0, 3.0)), 1.0, "held at the edge");
        assert_eq!(section.place, 0.5);
        assert!(section.vorticity.is_none());
        let step = section.sample(|i| if i % 8 < 4 { 0.0 } else { 1.0 }, (4.9, 2.0));
        assert!((0.0..=1.0).contains(&step));
    }

    #[test]
    fn the_solid_is_outlined() {
        let section = Section::of(&image(1), 2).unwrap();
        let rings = section.outlines();
        assert_eq!(rings.len(), 1);
        let middle = rings[0].iter().fold((0.0, 0.0), |s, p| (s.0 + p.0, s.1 + p.1));
        let n = rings[0].len() as f64;
        assert!((middle.0 / n - 4.0).abs() < 0.1 && (middle.1 / n - 3.0).abs() < 0.1);
        let window = Window { low: (0.0, 0.0), high: (4.0, 6.0) };
        assert_eq!(section.cells_in(window).count(), 24);
        let raster = |size: [usize; 2], shading: Shading| {
            let values = section.solid_fraction().unwrap();
            section.raster(window, size, vec![[0; 3]; 256], values, |v| v, shading)
        };
        let (flat, raster) = (raster([8, 12], Shading::Flat), raster([4, 6], Shading::Smooth));
        assert!(flat.pixels.iter().all(|v| [0, 255].contains(v)), "cells are not blended");
        assert_eq!((raster.pixels.len(), raster.pixels[3 + 4 * 3]), (24, 255));
    }

    #[test]
    fn every_normal_has_its_view() {
        assert_eq!(
            SliceView::along(1, 2),
            SliceView { normal: 1, across: 0, up: 2, flipped: false }
        );
        assert_eq!(
            SliceView::along(0, 1),
            SliceView { normal: 0, across: 2, up: 1, flipped: false }
        );
        assert_eq!(
            SliceView::along(2, 2),
            SliceView { normal: 2, across: 0, up: 1, flipped: false }
        );
        assert!(SliceView::along(1, 2).clockwise() && !SliceView::along(0, 2).clockwise());
        let mut turned = image(1);
        turned.frame.cells = [1, 8, 6];
        let section = Section::of(&turned, 1).unwrap();
        assert_eq!((section.view.across, section.view.up), (2, 1));
        assert_eq!(section.whole().high, (6.0, 8.0));
        let inside = section.sample(|cell| section.solid(cell), (3.0, 4.0));
        assert_eq!(inside, 1.0, "the solid follows the axes");
    }

    #[test]
    fn a_flipped_view_shows_the_lowest_cells_on_top() {
        let mut section = Section::of(&image(1), 2).unwrap();
        let clockwise = section.view.clockwise();
        let raster = |section: &Section| {
            let heights: Vec<f64> = (0..48).map(|cell| (cell / 8) as f64 / 5.0).collect();
            let palette = vec![[0; 3]; 256];
            let window = section.whole();
            section.raster(window, [8, 6], palette, &heights, |v| v, Shading::Flat).pixels
        };
        assert_eq!([raster(&section)[0], raster(&section)[47]], [255, 0]);
        section.view.flipped = true;
        assert_eq!([raster(&section)[0], raster(&section)[47]], [0, 255]);
        assert_ne!(section.view.clockwise(), clockwise, "rotation appears mirrored");
    }

    #[test]
    fn thick_images_are_no_slices() {
        let mut thick = image(1);
        thick.frame.cells[1] = 2;
        assert!(Section::of(&thick, 2).unwrap_err().contains("8 x 2 x 6 cells are no slice"));
    }
}

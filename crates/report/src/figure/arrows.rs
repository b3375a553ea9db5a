//! Arrows of the velocity in a plane, and the key of their length.

use grainwake_plot::drawing::{Anchor, Drawing, path_data};
use grainwake_plot::equal_aspect::EqualAspectFrame;
use grainwake_plot::scale_bar::RoundValue;
use grainwake_plot::style::{HAIR, INK, SMALL};
use grainwake_plot::text;

use super::section::Section;

/// Distance of the arrows [pt].
const ARROWS: f64 = 8.5;
/// Space between the arrow of the key and its speed [pt].
const SPACE: f64 = 4.0;

/// Arrow of a round speed, which explains the length of the others.
pub struct ArrowKey {
    length: f64,
    label: String,
}

impl ArrowKey {
    /// Creates the key of arrows whose length is relative to the largest speed.
    pub fn new(largest: f64, unit: &str) -> ArrowKey {
        let speed = RoundValue::at_most(largest);
        let label = format!("{} {unit}", speed.text());
        let label = label.trim_end().to_owned();
        ArrowKey { length: arrow_length(speed.value() / largest), label }
    }

    /// Width [pt].
    pub fn width(&self) -> f64 {
        self.length + SPACE + text::width(&self.label, SMALL)
    }

    /// Draws the key to the right of a point [pt].
    pub fn draw(&self, drawing: &mut Drawing, (x, y): (f64, f64)) {
        let arrow = arrow((x + 0.5 * self.length, y), (1.0, 0.0), self.length);
        drawing.path(&arrow, &arrow_style());
        drawing.note((x + self.length + SPACE, y), Anchor::Start, &self.label);
    }
}

/// Draws arrows of the velocity in the plane, their length relative to the largest speed.
pub fn draw(
    drawing: &mut Drawing,
    section: &Section,
    velocity: &[[f64; 3]],
    frame: &EqualAspectFrame,
    largest: f64,
) {
    let (width, height) = (frame.width(), frame.height());
    let (columns, rows) = ((width / ARROWS) as usize, (height / ARROWS) as usize);
    let mut data = String::new();
    for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
        let x = frame.corner.0 + width * (column as f64 + 0.5) / columns as f64;
        let y = frame.corner.1 + height * (row as f64 + 0.5) / rows as f64;
        let at = frame.point((x, y));
        if section.sample(|cell| section.solid(cell), at) > 0.1 {
            continue;
        }
        let [u, w] = [0, 1].map(|i| section.sample(|cell| velocity[cell][i], at) / largest);
        let size = u.hypot(w);
        if size.is_nan() || size < 0.06 {
            continue;
        }
        let w = if frame.flipped { -w } else { w };
        data += &arrow((x, y), (u / size, -w / size), arrow_length(size));
    }
    if !data.is_empty() {
        drawing.path(&data, &arrow_style());
    }
}

/// Length on paper [pt] of an arrow for a part of the largest speed.
fn arrow_length(part: f64) -> f64 {
    1.7 * ARROWS * part.min(1.0)
}

/// SVG path of an arrow around its middle, along a unit vector.
fn arrow((x, y): (f64, f64), (dx, dy): (f64, f64), length: f64) -> String {
    let end = |part: f64| (x + part * length * dx, y + part * length * dy);
    let (tail, tip) = (end(-0.5), end(0.5));
    let head = 0.35 * length.min(5.0);
    let barb =
        |side: f64| (tip.0 - head * (dx - 0.5 * side * dy), tip.1 - head * (dy + 0.5 * side * dx));
    path_data(&[tail, tip], false) + &path_data(&[barb(1.0), tip, barb(-1.0)], false)
}

fn arrow_style() -> String {
    let width = HAIR - 0.1;
    format!("fill=\"none\" stroke=\"{INK}\" stroke-opacity=\"0.75\" stroke-width=\"{width}\"")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_key_is_as_long_as_an_arrow_of_its_speed() {
        let key = ArrowKey::new(0.17, "m/s");
        assert_eq!(key.label, "0.1 m/s");
        assert!((key.length - arrow_length(0.1 / 0.17)).abs() < 1e-12);
        assert_eq!(ArrowKey::new(1.3, "").label, "1");
    }
}

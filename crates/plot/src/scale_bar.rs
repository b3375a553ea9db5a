//! Round values, and bars of a round length that show the scale of a picture.

use crate::axis::minus;
use crate::drawing::{Anchor, Drawing};
use crate::style::{HAIR, INK, SMALL};
use crate::text;

/// 1, 2 or 5 times a power of ten.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RoundValue {
    lead: u8,
    power: i32,
}

impl RoundValue {
    /// Returns the largest round value that is at most `value`; 1 unless `value` is positive.
    pub fn at_most(value: f64) -> RoundValue {
        if !(value > 0.0 && value.is_finite()) {
            return RoundValue { lead: 1, power: 0 };
        }
        let power = value.log10().floor() as i32;
        // One power more than needed, in case the logarithm is rounded down.
        let round = (power - 1..=power + 1)
            .rev()
            .flat_map(|power| [5, 2, 1].map(|lead| RoundValue { lead, power }));
        let fitting = round.into_iter().find(|round| round.value() <= value * (1.0 + 1e-9));
        fitting.unwrap_or(RoundValue { lead: 1, power })
    }

    /// Returns the value.
    pub fn value(self) -> f64 {
        // Exact, unlike a product with a power.
        format!("{}e{}", self.lead, self.power).parse().unwrap_or(f64::NAN)
    }

    /// Returns the value in label markup: "0.05", "200", "2×10^{−5}".
    pub fn text(self) -> String {
        let RoundValue { lead, power } = self;
        match power {
            -3..=4 => format!("{:.*}", power.min(0).unsigned_abs() as usize, self.value()),
            _ => format!("{lead}×10^{{{}}}", minus(&power.to_string())),
        }
    }
}

/// Bar of a round length.
#[derive(Clone, Debug, PartialEq)]
pub struct ScaleBar {
    /// Length [m].
    pub length: f64,
    /// Length with its unit, in label markup.
    pub label: String,
}

/// Units of scale bars and their size [m], from the smallest.
const UNITS: [(&str, f64); 4] = [("nm", 1e-9), ("µm", 1e-6), ("mm", 1e-3), ("m", 1.0)];
/// Size of the space between bar and label, of the half height of the ends, and of the width of the
/// line, relative to the text.
const SPACE: f64 = 0.7;
const END: f64 = 0.36;
const LINE: f64 = 0.2;

impl ScaleBar {
    /// Returns the longest bar of at most `room` [m].
    pub fn within(room: f64) -> ScaleBar {
        let in_metres = RoundValue::at_most(room).value() * (1.0 + 1e-9);
        let fitting = UNITS.into_iter().rfind(|(_, size)| *size <= in_metres);
        let (unit, size) = fitting.unwrap_or(UNITS[0]);
        let round = RoundValue::at_most(room / size);
        ScaleBar { length: round.value() * size, label: format!("{} {unit}", round.text()) }
    }

    /// Returns the width on paper of the bar and its label [pt], at a scale [pt/m] and text size
    /// [pt].
    pub fn width(&self, scale: f64, size: f64) -> f64 {
        scale * self.length + SPACE * size + text::width(&self.label, size)
    }

    /// Draws the bar to the right of a point [pt], at a scale [pt/m] and text size [pt].
    pub fn draw(&self, drawing: &mut Drawing, (x, y): (f64, f64), scale: f64, size: f64) {
        let end = x + scale * self.length;
        drawing.line(&[(x, y), (end, y)], INK, LINE * size, None);
        for at in [x, end] {
            let ends = [(at, y - END * size), (at, y + END * size)];
            drawing.line(&ends, INK, HAIR * size / SMALL, None);
        }
        let base = (end + SPACE * size, y + 0.36 * size);
        drawing.label(base, Anchor::Start, size, INK, &self.label);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_rounded_down_to_1_2_or_5() {
        for (value, text) in [
            (1.0, "1"),
            (0.999, "0.5"),
            (4.99, "2"),
            (0.05, "0.05"),
            (0.3, "0.2"),
            (70000.0, "50000"),
            (2e-5, "2×10^{−5}"),
            (1e9, "1×10^{9}"),
            (0.0, "1"),
            (f64::NAN, "1"),
        ] {
            assert_eq!(RoundValue::at_most(value).text(), text, "{value}");
        }
        for power in -12..9 {
            let value = 10f64.powi(power);
            let round = RoundValue::at_most(value).value();
            assert!((round / value - 1.0).abs() < 1e-9, "{value}: {round}");
        }
    }

    #[test]
    fn bars_have_a_unit_of_their_size() {
        for (room, label) in [
            (3.1e-7, "200 nm"),
            (9e-6, "5 µm"),
            (1e-3, "1 mm"),
            (0.99e-3, "500 µm"),
            (0.06, "50 mm"),
            (3.0, "2 m"),
        ] {
            let bar = ScaleBar::within(room);
            assert_eq!(bar.label, label, "{room}");
            assert!(bar.length <= room * (1.0 + 1e-9) && bar.length > 0.39 * room, "{room}");
        }
    }
}

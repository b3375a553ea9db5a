//! Axes: range, ticks and their labels.

/// How values are spread along an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Evenly.
    Linear,
    /// By decades.
    Log,
}

/// One axis of a plot.
#[derive(Clone, Debug)]
pub struct Axis {
    /// Quantity and unit, in label markup.
    pub label: String,
    scale: Scale,
    low: f64,
    high: f64,
    /// Values with a tick and the text beside it (empty: a minor tick).
    pub ticks: Vec<(f64, String)>,
}

impl Axis {
    /// An axis that covers `low` to `high` with about `count` round steps; the range grows to whole
    /// steps unless `tight`.
    pub fn linear(label: &str, low: f64, high: f64, count: usize, tight: bool) -> Axis {
        let (mut low, mut high) = sane(low, high);
        let mut step = round_step((high - low) / count.max(1) as f64);
        // Round steps may miss a tight range but once, which gives no scale.
        let within = |step: f64| (high / step + 1e-6).floor() - (low / step - 1e-6).ceil();
        while tight && within(step) < 1.0 {
            step = round_step(0.4 * step);
        }
        if !tight {
            // A value just beyond a round one does not cost a whole step.
            let grow = |value: f64, out: f64| {
                let inner = (value / step * out + 1e-6).floor() * out * step;
                let beyond = (value - inner).abs() / step;
                if beyond < 2e-6 {
                    inner
                } else if beyond < 0.15 {
                    inner + 0.2 * out * step
                } else {
                    inner + out * step
                }
            };
            low = grow(low, -1.0);
            high = grow(high, 1.0);
        }
        let power = common_power(low.abs().max(high.abs()));
        let unit = 10f64.powi(power);
        let decimals = decimals(step / unit);
        let first = (low / step - 1e-6).ceil() as i64;
        let last = (high / step + 1e-6).floor() as i64;
        let ticks = (first..=last)
            .map(|i| {
                let value = i as f64 * step;
                (
                    value,
                    minus(&format!(
                        "{:.decimals$}",
                        if i == 0 { 0.0 } else { value / unit }
                    )),
                )
            })
            .collect();
        let label = if power == 0 {
            label.to_owned()
        } else {
            scaled_label(label, power)
        };
        Axis {
            label,
            scale: Scale::Linear,
            low,
            high,
            ticks,
        }
    }

    /// An axis for angles in degrees, with ticks at multiples of 30 up to a right angle and of 45 beyond.
    pub fn degrees(label: &str, low: f64, high: f64) -> Axis {
        let (low, high) = sane(low, high);
        let step = match high.abs().max(low.abs()) {
            size if size <= 90.0 + 1e-6 => 30.0,
            size if size <= 360.0 + 1e-6 => 45.0,
            _ => 90.0,
        };
        let first = (low / step + 1e-6).floor() as i64;
        let last = (high / step - 1e-6).ceil() as i64;
        let value = |i: i64| i as f64 * step;
        Axis {
            label: label.to_owned(),
            scale: Scale::Linear,
            low: value(first),
            high: value(last),
            ticks: (first..=last)
                .map(|i| (value(i), minus(&value(i).to_string())))
                .collect(),
        }
    }

    /// A logarithmic axis that covers the positive values `low` to `high` in whole decades.
    pub fn log(label: &str, low: f64, high: f64) -> Axis {
        let positive = |v: f64| if v.is_finite() && v > 0.0 { v } else { 1.0 };
        let (low, high) = (
            positive(low).min(positive(high)),
            positive(low).max(positive(high)),
        );
        let first = (low.log10() + 1e-9).floor() as i32;
        let last = ((high.log10() - 1e-9).ceil() as i32).max(first + 1);
        let every = ((last - first) / 5 + 1).max(1);
        let ticks = (first..=last)
            .map(|power| {
                let shown = (power - first) % every == 0;
                let text = if shown {
                    format!("10^{{{}}}", minus(&power.to_string()))
                } else {
                    String::new()
                };
                (10f64.powi(power), text)
            })
            .collect();
        Axis {
            label: label.to_owned(),
            scale: Scale::Log,
            low: 10f64.powi(first),
            high: 10f64.powi(last),
            ticks,
        }
    }

    /// A logarithmic axis that covers the positive values `low` to `high` out to the next of 1, 2, 5
    /// times a power of ten, or no further if `tight`; these are labelled where there are few.
    pub fn log_close(label: &str, low: f64, high: f64, tight: bool) -> Axis {
        let whole = Axis::log(label, low, high);
        let leads = [1.0, 2.0, 5.0];
        let marks = |leads: &[f64]| -> Vec<f64> {
            let (first, last) = (whole.low.log10().round(), whole.high.log10().round());
            let powers = (first as i32 - 1)..=(last as i32 + 1);
            powers
                .flat_map(|power| leads.iter().map(move |lead| lead * 10f64.powi(power)))
                .collect()
        };
        let (low, high) = match (low.is_finite(), high.is_finite()) {
            (true, true) if low > 0.0 && high > low * (1.0 + 1e-9) => (low, high),
            _ => (whole.low, whole.high),
        };
        let ends = marks(&leads);
        let below = ends.iter().copied().rfind(|v| *v <= low * (1.0 + 1e-9));
        let above = ends.iter().copied().find(|v| *v >= high * (1.0 - 1e-9));
        let (low, high) = match (tight, below, above) {
            (false, Some(below), Some(above)) => (below, above),
            _ => (low, high),
        };
        let inside = |v: &f64| *v >= low * (1.0 - 1e-9) && *v <= high * (1.0 + 1e-9);
        let few = (high / low).log10() < 2.2 && low >= 9e-5 && high <= 2e5;
        if !few {
            let ticks = whole.ticks.into_iter().filter(|(v, _)| inside(v)).collect();
            return Axis {
                low,
                high,
                ticks,
                ..whole
            };
        }
        let all: Vec<f64> = (1..10).map(f64::from).collect();
        let text = |value: f64| {
            let lead = value / 10f64.powf((value.log10() + 1e-9).floor());
            let shown = leads.iter().any(|l| (lead - l).abs() < 1e-6);
            let digits = decimals(value);
            if shown {
                format!("{value:.digits$}")
            } else {
                String::new()
            }
        };
        let inner = marks(&all).into_iter().filter(inside);
        Axis {
            label: label.to_owned(),
            scale: Scale::Log,
            low,
            high,
            ticks: inner.map(|value| (value, text(value))).collect(),
        }
    }

    /// Puts ticks at `values` and nowhere else.
    #[must_use]
    pub fn with_ticks(mut self, values: &[f64]) -> Axis {
        self.ticks = values.iter().map(|v| (*v, minus(&v.to_string()))).collect();
        self
    }

    /// Lower end.
    pub fn low(&self) -> f64 {
        self.low
    }

    /// Upper end.
    pub fn high(&self) -> f64 {
        self.high
    }

    /// Place of `value` along the axis: 0 at the lower end, 1 at the upper; none where it has no place.
    pub fn place(&self, value: f64) -> Option<f64> {
        let place = match self.scale {
            Scale::Linear => (value - self.low) / (self.high - self.low),
            Scale::Log if value > 0.0 => {
                (value / self.low).log10() / (self.high / self.low).log10()
            }
            Scale::Log => return None,
        };
        place.is_finite().then_some(place)
    }
}

/// Smallest and largest finite value.
pub fn extent(values: impl IntoIterator<Item = f64>) -> Option<(f64, f64)> {
    values
        .into_iter()
        .filter(|v| v.is_finite())
        .fold(None, |range, v| match range {
            None => Some((v, v)),
            Some((low, high)) => Some((low.min(v), high.max(v))),
        })
}

/// A range that can be drawn: finite, ordered and not empty.
fn sane(low: f64, high: f64) -> (f64, f64) {
    if !low.is_finite() || !high.is_finite() {
        return (0.0, 1.0);
    }
    let (low, high) = (low.min(high), low.max(high));
    let size = low.abs().max(high.abs());
    if high - low > 1e-9 * size {
        (low, high)
    } else if size == 0.0 {
        (-1.0, 1.0)
    } else {
        (low - 0.1 * size, high + 0.1 * size)
    }
}

/// The next of 1, 2, 5 times a power of ten that is at least about `step`.
fn round_step(step: f64) -> f64 {
    let power = 10f64.powf(step.log10().floor());
    let lead = step / power;
    let round = if lead <= 1.02 {
        1.0
    } else if lead <= 2.04 {
        2.0
    } else if lead <= 5.1 {
        5.0
    } else {
        10.0
    };
    round * power
}

/// Power of ten to take out of very large or small values.
fn common_power(size: f64) -> i32 {
    if size > 0.0 && !(9e-3..2e4).contains(&size) {
        3 * (size.log10() / 3.0).floor() as i32
    } else {
        0
    }
}

fn decimals(step: f64) -> usize {
    (-(step.log10() + 1e-9).floor()).clamp(0.0, 9.0) as usize
}

/// A label with a power of ten before its unit: "p [Pa]" becomes "p [10³ Pa]".
fn scaled_label(label: &str, power: i32) -> String {
    let factor = format!("10^{{{}}}", minus(&power.to_string()));
    match label.split_once('[') {
        Some((name, unit)) => format!("{name}[{factor} {unit}"),
        None => format!("{label} [{factor}]"),
    }
}

/// The typographic minus.
pub fn minus(text: &str) -> String {
    text.replace('-', "−")
}

#[cfg(test)]
mod tests;

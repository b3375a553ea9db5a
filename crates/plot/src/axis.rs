//! Axes: range, ticks and tick labels.

/// Mapping of values to positions along an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Linear.
    Linear,
    /// Logarithmic, base 10.
    Log,
    /// Linear, with names of categories at the ticks.
    Categories,
}

/// End values of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AxisRange {
    /// The given values.
    Tight,
    /// Values extended outwards to round ones.
    Rounded,
}

/// One axis of a plot.
#[derive(Clone, Debug)]
pub struct Axis {
    /// Quantity and unit, in label markup.
    pub label: String,
    scale: Scale,
    low: f64,
    high: f64,
    /// Whether values decrease along the axis.
    reversed: bool,
    /// Value and label of each tick; minor ticks have an empty label.
    pub ticks: Vec<(f64, String)>,
}

impl Axis {
    fn new(label: &str, scale: Scale, low: f64, high: f64, ticks: Vec<(f64, String)>) -> Axis {
        Axis { label: label.to_owned(), scale, low, high, reversed: false, ticks }
    }

    /// Creates a linear axis from `low` to `high` with about `count` round steps; a
    /// rounded range is extended towards whole steps.
    pub fn linear(label: &str, low: f64, high: f64, count: usize, range: AxisRange) -> Axis {
        let (mut low, mut high) = drawable_range(low, high);
        let mut step = round_step((high - low) / count.max(1) as f64);
        // A tight range needs at least two ticks to show its scale.
        let within = |step: f64| (high / step + 1e-6).floor() - (low / step - 1e-6).ceil();
        while range == AxisRange::Tight && within(step) < 1.0 {
            step = round_step(0.4 * step);
        }
        if range == AxisRange::Rounded {
            // A value slightly beyond a tick extends the range by 0.2 steps only.
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
                (value, minus(&format!("{:.decimals$}", if i == 0 { 0.0 } else { value / unit })))
            })
            .collect();
        let label = if power == 0 { label.to_owned() } else { scaled_label(label, power) };
        Axis::new(&label, Scale::Linear, low, high, ticks)
    }

    /// Creates an axis for angles [deg], with ticks every 30 up to 90, every 45 up to 360 and every
    /// 90 beyond.
    pub fn degrees(label: &str, low: f64, high: f64) -> Axis {
        let (low, high) = drawable_range(low, high);
        let step = match high.abs().max(low.abs()) {
            size if size <= 90.0 + 1e-6 => 30.0,
            size if size <= 360.0 + 1e-6 => 45.0,
            _ => 90.0,
        };
        let first = (low / step + 1e-6).floor() as i64;
        let last = (high / step - 1e-6).ceil() as i64;
        let value = |i: i64| i as f64 * step;
        let ticks = (first..=last).map(|i| (value(i), minus(&value(i).to_string()))).collect();
        Axis::new(label, Scale::Linear, value(first), value(last), ticks)
    }

    /// Creates a logarithmic axis that covers `low` to `high` (positive) in whole decades.
    pub fn log(label: &str, low: f64, high: f64) -> Axis {
        let positive = |v: f64| if v.is_finite() && v > 0.0 { v } else { 1.0 };
        let (low, high) = (positive(low).min(positive(high)), positive(low).max(positive(high)));
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
        Axis::new(label, Scale::Log, 10f64.powi(first), 10f64.powi(last), ticks)
    }

    /// Creates a logarithmic axis that covers `low` to `high` (positive), extended to the next 1, 2
    /// or 5 times a power of ten if rounded. Ranges up to about two decades have labels at
    /// these values, longer ones at the decades.
    pub fn log_rounded(label: &str, low: f64, high: f64, range: AxisRange) -> Axis {
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
        let (low, high) = match (range == AxisRange::Tight, below, above) {
            (false, Some(below), Some(above)) => (below, above),
            _ => (low, high),
        };
        let inside = |v: &f64| *v >= low * (1.0 - 1e-9) && *v <= high * (1.0 + 1e-9);
        let few = (high / low).log10() < 2.2 && low >= 9e-5 && high <= 2e5;
        if !few {
            let ticks = whole.ticks.into_iter().filter(|(v, _)| inside(v)).collect();
            return Axis { low, high, ticks, ..whole };
        }
        let all: Vec<f64> = (1..10).map(f64::from).collect();
        let text = |value: f64| {
            let lead = value / 10f64.powf((value.log10() + 1e-9).floor());
            let shown = leads.iter().any(|l| (lead - l).abs() < 1e-6);
            let digits = decimals(value);
            if shown { format!("{value:.digits$}") } else { String::new() }
        };
        let inner = marks(&all).into_iter().filter(inside);
        let ticks = inner.map(|value| (value, text(value))).collect();
        Axis::new(label, Scale::Log, low, high, ticks)
    }

    /// Creates an axis of categories at 0.5, 1.5 ..., with their names in label markup.
    pub fn categories(label: &str, names: Vec<String>) -> Axis {
        let high = names.len().max(1) as f64;
        let ticks = names.into_iter().enumerate().map(|(i, name)| (i as f64 + 0.5, name)).collect();
        Axis::new(label, Scale::Categories, 0.0, high, ticks)
    }

    /// Returns whether the ticks are categories.
    pub fn has_categories(&self) -> bool {
        self.scale == Scale::Categories
    }

    /// Makes the values decrease along the axis: the larger end is on the left, or below.
    #[must_use]
    pub fn reversed(mut self) -> Axis {
        self.reversed = !self.reversed;
        self
    }

    /// Replaces the ticks by ticks at `values`.
    #[must_use]
    pub fn with_ticks(mut self, values: &[f64]) -> Axis {
        self.ticks = values.iter().map(|v| (*v, minus(&v.to_string()))).collect();
        self
    }

    /// Lower end of the range.
    pub fn low(&self) -> f64 {
        self.low
    }

    /// Upper end of the range.
    pub fn high(&self) -> f64 {
        self.high
    }

    /// Returns the position of `value` along the axis, from 0 at the lower to 1 at the upper end,
    /// or from 1 to 0 if the axis is reversed; `None` if the axis cannot represent it.
    pub fn fraction(&self, value: f64) -> Option<f64> {
        let fraction = match self.scale {
            Scale::Linear | Scale::Categories => (value - self.low) / (self.high - self.low),
            Scale::Log if value > 0.0 => {
                (value / self.low).log10() / (self.high / self.low).log10()
            }
            Scale::Log => return None,
        };
        let fraction = if self.reversed { 1.0 - fraction } else { fraction };
        fraction.is_finite().then_some(fraction)
    }
}

/// Returns the smallest and largest finite value.
pub fn extent(values: impl IntoIterator<Item = f64>) -> Option<(f64, f64)> {
    values.into_iter().filter(|v| v.is_finite()).fold(None, |range, v| match range {
        None => Some((v, v)),
        Some((low, high)) => Some((low.min(v), high.max(v))),
    })
}

/// Returns a finite, ordered, non-empty range.
fn drawable_range(low: f64, high: f64) -> (f64, f64) {
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

/// Returns the next 1, 2 or 5 times a power of ten at or above about `step`.
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

/// Returns the power of ten to factor out of very large or small values, a multiple of 3.
fn common_power(size: f64) -> i32 {
    if size > 0.0 && !(9e-3..2e4).contains(&size) {
        3 * (size.log10() / 3.0).floor() as i32
    } else {
        0
    }
}

/// Returns the number of decimals that resolves `step`.
fn decimals(step: f64) -> usize {
    (-(step.log10() + 1e-9).floor()).clamp(0.0, 9.0) as usize
}

/// Inserts a power of ten before the unit: "p [Pa]" becomes "p [10³ Pa]".
fn scaled_label(label: &str, power: i32) -> String {
    let factor = format!("10^{{{}}}", minus(&power.to_string()));
    match label.split_once('[') {
        Some((name, unit)) => format!("{name}[{factor} {unit}"),
        None => format!("{label} [{factor}]"),
    }
}

/// Replaces hyphens by the typographic minus sign.
pub fn minus(text: &str) -> String {
    text.replace('-', "−")
}

#[cfg(test)]
mod tests;

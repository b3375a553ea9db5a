//! What a run tells: its scales, its pair, phases and instants, the numbers of a report.

use glam::DVec3;
use serde_json::Value;

use crate::phases::{self, Instant, Moment, Phase};
use grainwake_formats::events::Event;

use crate::run_folder::{History, RunFolder};

/// What was run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Subject {
    /// Fluid alone.
    Flow,
    /// One grain.
    Single,
    /// Two grains.
    Pair,
    /// More than two.
    Many,
}

/// Lengths and times by which the paper makes numbers dimensionless.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scales {
    /// Mean equal-volume diameter d [m].
    pub diameter: f64,
    /// Magnitude of gravity g [m/s^2].
    pub gravity: f64,
}

impl Scales {
    /// sqrt(d/g) [s].
    pub fn time(&self) -> f64 {
        (self.diameter / self.gravity).sqrt()
    }
    /// sqrt(d g) [m/s].
    pub fn velocity(&self) -> f64 {
        (self.diameter * self.gravity).sqrt()
    }
}

/// The run, understood.
#[derive(Clone, Debug)]
pub struct Story {
    /// What was run.
    pub subject: Subject,
    /// Scales, where diameter and gravity are known.
    pub scales: Option<Scales>,
    /// Direction against gravity; +z where gravity is not known or zero.
    pub up: DVec3,
    /// Of a pair: the grain behind (above) and the one ahead at the start.
    pub pair: Option<[usize; 2]>,
    /// Phases of a pair.
    pub phases: Vec<Phase>,
    /// First contact of a pair.
    pub kiss: Option<Moment>,
    /// When a pair that had touched parted.
    pub parting: Option<Moment>,
    /// Instants that the pictures show.
    pub instants: Vec<Instant>,
    /// Whether any grain travels by a tenth of its diameter or more.
    pub travels: bool,
    /// Last time [s].
    pub end: f64,
}

impl Story {
    /// Makes out what the run folder tells.
    pub fn of(run: &RunFolder) -> Story {
        let moving: Vec<usize> = (0..run.grains.len())
            .filter(|i| !run.grains[*i].is_empty())
            .collect();
        let subject = match moving.len() {
            0 => Subject::Flow,
            1 => Subject::Single,
            2 => Subject::Pair,
            _ => Subject::Many,
        };
        let gravity = run.facts.gravity.unwrap_or(DVec3::ZERO);
        let up = if gravity.length() > 0.0 {
            -gravity.normalize()
        } else {
            DVec3::Z
        };
        let scales = run.facts.diameter().filter(|_| gravity.length() > 0.0);
        let scales = scales.map(|diameter| Scales {
            diameter,
            gravity: gravity.length(),
        });
        let end = run.end();
        let pair = (subject == Subject::Pair).then(|| {
            let height = |i: usize| run.grains[i].position[0].dot(up);
            let [a, b] = [moving[0], moving[1]];
            if height(a) >= height(b) {
                [a, b]
            } else {
                [b, a]
            }
        });
        let tumble = run
            .summary
            .as_ref()
            .and_then(|summary| summary.get("tumble_time_s"))
            .and_then(Value::as_f64);
        let phases = if pair.is_some() {
            phases::phases(&run.events, tumble, end)
        } else {
            Vec::new()
        };
        let of_pair = |moment: fn(&[Event]) -> Option<Moment>| {
            pair.is_some().then(|| moment(&run.events)).flatten()
        };
        let step = 0.1 * run.facts.diameter().unwrap_or(0.0);
        let far = |history: &History| {
            history
                .position
                .iter()
                .any(|p| p.distance(history.position[0]) > step)
        };
        let travels = run.grains.iter().any(far);
        let instants = match subject {
            Subject::Single if !travels => vec![Instant {
                time: end,
                name: "",
            }],
            Subject::Pair => phases::pair_instants(&phases, &run.events, closest(run, pair), end),
            Subject::Flow => vec![Instant {
                time: end,
                name: "",
            }],
            _ => phases::even_instants(end),
        };
        Story {
            subject,
            scales,
            up,
            pair,
            phases,
            kiss: of_pair(phases::kiss),
            parting: of_pair(phases::parting),
            instants,
            travels,
            end,
        }
    }

    /// Name of a grain in legends.
    pub fn grain_name(&self, grain: usize) -> String {
        match self.pair {
            Some([behind, _]) if grain == behind => {
                format!("grain {grain} (trailing at the start)")
            }
            Some([_, ahead]) if grain == ahead => format!("grain {grain} (leading at the start)"),
            _ => format!("grain {grain}"),
        }
    }

    /// Colour index of a grain: the one behind first.
    pub fn grain_rank(&self, grain: usize) -> usize {
        match self.pair {
            Some([behind, _]) => usize::from(grain != behind),
            None => grain,
        }
    }

    /// Label of the time axis and the factor that turns seconds into its numbers.
    pub fn time_axis(&self) -> (&'static str, f64) {
        match self.scales {
            Some(scales) if self.subject == Subject::Pair => {
                ("*t* √(*g*/*d*)  [–]", 1.0 / scales.time())
            }
            _ => ("*t*  [s]", 1.0),
        }
    }

    /// A time in words: dimensionless where the figures are.
    pub fn time_text(&self, time: f64) -> String {
        match self.scales {
            Some(scales) if self.subject == Subject::Pair => {
                format!("*t* √(*g*/*d*) = {}", short(time / scales.time()))
            }
            _ => format!("*t* = {} s", short(time)),
        }
    }

    /// When a pair met or parted, in words.
    pub fn moment_text(&self, moment: Moment) -> String {
        let landed = if moment.landed {
            ", after the first has landed"
        } else {
            ""
        };
        format!("{}{landed}", self.time_text(moment.time))
    }
}

/// When the two grains were closest [s]: their surfaces, or their centres if nothing is known of
/// the surfaces.
fn closest(run: &RunFolder, pair: Option<[usize; 2]>) -> f64 {
    let least = |points: &mut dyn Iterator<Item = (f64, f64)>| {
        points
            .filter(|(time, gap)| time.is_finite() && gap.is_finite())
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .map(|(time, _)| time)
    };
    let surfaces = run.diagnostics.as_ref().and_then(|table| {
        let (time, gap) = (table.column("time")?, table.column("gap")?);
        least(&mut time.iter().copied().zip(gap.iter().copied()))
    });
    let centres = || {
        let [a, b] = pair.map(|pair| pair.map(|grain| &run.grains[grain]))?;
        let line = a
            .position
            .iter()
            .zip(&b.position)
            .map(|(a, b)| run.nearest(*a - *b).length());
        least(&mut a.time.iter().copied().zip(line))
    };
    surfaces.or_else(centres).unwrap_or(0.0)
}

/// The Galileo number sqrt(|s - 1| g d^3) / nu of density ratio s.
pub fn galileo(scales: Scales, ratio: f64, viscosity: f64) -> f64 {
    ((ratio - 1.0).abs() * scales.gravity * scales.diameter.powi(3)).sqrt() / viscosity
}

/// A number in three significant digits.
pub fn short(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    if !value.is_finite() {
        return "not known".to_owned();
    }
    // The power of the rounded number: 0.9999 reads 1.00.
    let rounded = format!("{value:.2e}");
    let power: i32 = rounded
        .split_once('e')
        .and_then(|(_, power)| power.parse().ok())
        .unwrap_or(0);
    if !(-3..=5).contains(&power) {
        let mantissa = value / 10f64.powi(power);
        return format!(
            "{mantissa:.2}×10^{{{}}}",
            grainwake_plot::minus(&power.to_string())
        )
        .replacen('-', "−", 1);
    }
    let decimals = (2 - power).clamp(0, 6) as usize;
    grainwake_plot::minus(&format!("{value:.decimals$}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_digits() {
        let texts = [
            0.0,
            18.234,
            0.99999,
            -0.002_346,
            123_456.0,
            1.0e-9,
            -4.2e7,
            f64::NAN,
        ]
        .map(short);
        assert_eq!(
            texts,
            [
                "0",
                "18.2",
                "1.00",
                "−0.00235",
                "123456",
                "1.00×10^{−9}",
                "−4.20×10^{7}",
                "not known"
            ]
        );
    }

    #[test]
    fn the_grain_above_trails() {
        let mut run = RunFolder::default();
        for z in [0.02, 0.05] {
            run.grains.push(History {
                time: vec![0.0],
                position: vec![DVec3::Z * z],
                ..History::default()
            });
        }
        assert_eq!(Story::of(&run).pair, Some([1, 0]));
        run.facts.gravity = Some(DVec3::new(0.0, 0.0, 9.81));
        assert_eq!(
            Story::of(&run).pair,
            Some([0, 1]),
            "down is where gravity points"
        );
    }

    #[test]
    fn galileo_number_of_the_paper() {
        let scales = Scales {
            diameter: 2e-3,
            gravity: 9.81,
        };
        assert!((galileo(scales, 1.5, 1e-6) - 198.1).abs() < 0.1);
        assert!(
            (scales.time() - 0.014_28).abs() < 1e-5 && (scales.velocity() - 0.140_07).abs() < 1e-5
        );
    }
}

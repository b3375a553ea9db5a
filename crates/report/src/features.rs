//! Features of a run derived from its tables: kind, scales, pair, phases and key instants.

use glam::DVec3;
use grainwake_formats::events::{Event, EventKind};
use grainwake_plot::equal_aspect::length_unit;
use grainwake_plot::minus;

use crate::phases::{self, Instant, PairEvent, Phase};
use crate::run_folder::{History, RunFolder};

/// Part of the diameter below which a distance is round-off, and of the largest component below
/// which another one is.
pub const ROUND_OFF: f64 = 1e-6;
/// Part of the diameter that is the least range of an axis of positions, and below which a drift is
/// not stated.
pub const LEAST: f64 = 1e-3;

/// Largest angle between gravity and an axis along which it acts [rad].
const ALIGNED: f64 = 1e-6;
/// Directions against gravity, and the symbols of the velocity along them.
const AXIS_SYMBOLS: [(DVec3, &str); 6] = [
    (DVec3::Z, "*v*_{z}"),
    (DVec3::Y, "*v*_{y}"),
    (DVec3::X, "*v*_{x}"),
    (DVec3::NEG_Z, "−*v*_{z}"),
    (DVec3::NEG_Y, "−*v*_{y}"),
    (DVec3::NEG_X, "−*v*_{x}"),
];

/// Kind of a run by its number of grains.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RunKind {
    /// Fluid only.
    Flow,
    /// One grain.
    Single,
    /// Two grains.
    Pair,
    /// Three or more grains.
    Many,
}

/// Scales of dimensionless quantities, as in the paper.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scales {
    /// Mean equivalent diameter d [m].
    pub diameter: f64,
    /// Magnitude of gravity g [m/s^2].
    pub gravity: f64,
}

impl Scales {
    /// Time scale sqrt(d/g) [s].
    pub fn time(&self) -> f64 {
        (self.diameter / self.gravity).sqrt()
    }
    /// Velocity scale sqrt(d g) [m/s].
    pub fn velocity(&self) -> f64 {
        (self.diameter * self.gravity).sqrt()
    }
}

/// Features of a run.
#[derive(Clone, Debug)]
pub struct RunFeatures {
    /// Kind of the run.
    pub kind: RunKind,
    /// Scales; `None` without diameter or gravity.
    pub scales: Option<Scales>,
    /// True if gravity is known and not zero.
    pub has_gravity: bool,
    /// Unit vector against gravity; +z if gravity is unknown or zero.
    pub up: DVec3,
    /// Unit vector from the leading to the trailing grain of a pair that moves in line: up or, if
    /// the grains rise, down. Without gravity against their mean displacement.
    pub back: DVec3,
    /// Trailing and leading grain of a pair at the start, by their positions along `back`.
    pub pair: Option<[usize; 2]>,
    /// Phases of a pair.
    pub phases: Vec<Phase>,
    /// First contact of a pair.
    pub kiss: Option<PairEvent>,
    /// Separation of a pair after its contact.
    pub separation: Option<PairEvent>,
    /// Key instants, shown in the figures.
    pub instants: Vec<Instant>,
    /// Whether any grain moves by a tenth of the mean diameter or more.
    pub travels: bool,
    /// Last time [s].
    pub end: f64,
}

impl RunFeatures {
    /// Derives the features from the tables of a run folder.
    pub fn of(run: &RunFolder) -> RunFeatures {
        let moving = run.moving();
        let kind = match moving.len() {
            0 => RunKind::Flow,
            1 => RunKind::Single,
            2 => RunKind::Pair,
            _ => RunKind::Many,
        };
        let gravity = run.facts.gravity.unwrap_or(DVec3::ZERO);
        let has_gravity = gravity.length() > 0.0;
        let up = (-gravity).try_normalize().unwrap_or(DVec3::Z);
        let diameter = run.facts.diameter().filter(|_| has_gravity);
        let scales = diameter.map(|diameter| Scales { diameter, gravity: gravity.length() });
        let end = run.end();
        let back = match has_gravity {
            true if rises(run, &moving) => -up,
            true => up,
            false => (-displacement(run)).try_normalize().unwrap_or(up),
        };
        let height = |i: usize| run.grains[i].position[0].dot(back);
        let pair = match moving[..] {
            [a, b] if height(a) >= height(b) => Some([a, b]),
            [a, b] => Some([b, a]),
            _ => None,
        };
        // A pair is observed until a grain leaves the box.
        let together = phases::first(&run.events, EventKind::Left).map_or(end, |t| t.min(end));
        let phases = pair.map_or(Vec::new(), |_| {
            phases::phases(&run.events, run.summary_number("tumble_time_s"), together)
        });
        let of_pair =
            |moment: fn(&[Event]) -> Option<PairEvent>| pair.and_then(|_| moment(&run.events));
        let least = 0.1 * run.facts.diameter().unwrap_or(0.0);
        let moves = |history: &History| {
            let mut positions = history.position.iter();
            positions.any(|p| p.distance(history.position[0]) > least)
        };
        let travels = run.grains.iter().any(moves);
        let last = || vec![Instant { time: end, name: "" }];
        let instants = match kind {
            RunKind::Flow => last(),
            RunKind::Single if !travels => last(),
            RunKind::Pair => {
                phases::pair_instants(&phases, &run.events, closest(run, pair), together)
            }
            _ => phases::even_instants(run.last_row()),
        };
        RunFeatures {
            kind,
            scales,
            has_gravity,
            up,
            back,
            pair,
            phases,
            kiss: of_pair(phases::kiss),
            separation: of_pair(phases::separation),
            instants,
            travels,
            end,
        }
    }

    /// Returns the name of the velocity along `up` in captions.
    pub fn vertical_velocity(&self) -> String {
        match self.has_gravity {
            true if self.up == DVec3::Z => "Vertical velocity (down is negative)".to_owned(),
            true => format!("Vertical velocity (down, {}, is negative)", self.down_text()),
            false => "Velocity along z".to_owned(),
        }
    }

    /// Returns the symbol of the velocity along `up` in label markup: a component of the velocity,
    /// with a minus sign if gravity acts along a positive axis.
    pub fn vertical_symbol(&self) -> &'static str {
        match AXIS_SYMBOLS.iter().find(|(axis, _)| self.up.angle_between(*axis) < ALIGNED) {
            Some((_, symbol)) => symbol,
            None => "*v*_{up}",
        }
    }

    /// Returns the direction of gravity in words: an axis or a unit vector.
    fn down_text(&self) -> String {
        let down = -self.up;
        let axis = ["x", "y", "z"].into_iter().zip(DVec3::AXES).find_map(|(name, axis)| {
            let along = |axis: DVec3| down.angle_between(axis) < ALIGNED;
            let sign = if along(axis) { Some('+') } else { along(-axis).then_some('−') };
            sign.map(|sign| format!("along {sign}{name}"))
        });
        axis.unwrap_or_else(|| format!("in the direction {}", vector_text(down)))
    }

    /// Returns the name of the speed normal to `up` in captions.
    pub fn horizontal_speed(&self) -> &'static str {
        if self.has_gravity { "Horizontal speed" } else { "Speed normal to z" }
    }

    /// Returns whether a speed [m/s] moves a grain by more than round-off during the run.
    pub fn is_motion(&self, run: &RunFolder, speed: f64) -> bool {
        speed * self.end > ROUND_OFF * run.facts.diameter().unwrap_or(0.0)
    }

    /// Returns the direction of a velocity in words or, without gravity, as a unit vector.
    pub fn direction_text(&self, velocity: DVec3) -> String {
        let direction = velocity.normalize_or_zero();
        if !self.has_gravity {
            return format!("in the direction {}", vector_text(direction));
        }
        let text = match direction.dot(self.up) {
            part if part > 0.95 => "upwards",
            part if part < -0.95 => "downwards",
            part if part > 0.1 => "obliquely upwards",
            part if part < -0.1 => "obliquely downwards",
            _ => "horizontally",
        };
        text.to_owned()
    }

    /// Returns the name of a grain in legends.
    pub fn grain_name(&self, grain: usize) -> String {
        let role = match self.pair {
            Some([trailing, _]) if grain == trailing => " (trailing at the start)",
            Some([_, leading]) if grain == leading => " (leading at the start)",
            _ => "",
        };
        format!("grain {grain}{role}")
    }

    /// Returns the number of a grain in the cycle of colours; the trailing grain of a pair is 0.
    pub fn grain_rank(&self, grain: usize) -> usize {
        let pair = self.pair;
        pair.map_or(grain, |[trailing, _]| usize::from(grain != trailing))
    }

    /// Returns the time scale of a pair; `None` for runs whose figures show seconds.
    fn time_scale(&self) -> Option<f64> {
        let scales = self.scales.filter(|_| self.kind == RunKind::Pair);
        scales.map(|scales| scales.time())
    }

    /// Returns the label of the time axis, and its value for one second.
    pub fn time_axis(&self) -> (&'static str, f64) {
        match self.time_scale() {
            Some(scale) => ("*t* √(*g*/*d*)  [–]", 1.0 / scale),
            None => ("*t*  [s]", 1.0),
        }
    }

    /// Returns a time in label markup, in the unit of the figures.
    pub fn time_text(&self, time: f64) -> String {
        match self.time_scale() {
            Some(scale) => format!("*t* √(*g*/*d*) = {}", short(time / scale)),
            None => format!("*t* = {} s", short(time)),
        }
    }

    /// Returns the time of a first contact or separation in label markup.
    pub fn pair_event_text(&self, moment: PairEvent) -> String {
        let landed = match moment.landed {
            true => ", after the first has landed",
            false => "",
        };
        format!("{}{landed}", self.time_text(moment.time))
    }
}

/// Returns a unit vector with two decimals.
fn vector_text(direction: DVec3) -> String {
    // The sum with zero turns -0 into 0.
    let parts = direction.to_array().map(|x| (100.0 * x).round() / 100.0 + 0.0);
    format!("({})", parts.map(|x| minus(&format!("{x:.2}"))).join(", "))
}

/// Returns whether all of these grains are known to be lighter than the fluid.
fn rises(run: &RunFolder, grains: &[usize]) -> bool {
    let ratio =
        |grain: &usize| Some(run.facts.grains.get(*grain)?.density? / run.facts.fluid_density?);
    !grains.is_empty() && grains.iter().all(|grain| ratio(grain).is_some_and(|ratio| ratio < 1.0))
}

/// Returns the sum of the displacements of all grains [m].
fn displacement(run: &RunFolder) -> DVec3 {
    let ends = run.grains.iter().filter_map(|h| Some((h.position.first()?, h.position.last()?)));
    ends.map(|(first, last)| *last - *first).sum()
}

/// Returns the time of the smallest gap between the surfaces or, if the gap is unknown, of the
/// smallest distance of the centres [s].
fn closest(run: &RunFolder, pair: Option<[usize; 2]>) -> f64 {
    let least = |points: &mut dyn Iterator<Item = (f64, f64)>| {
        let known = points.filter(|(time, gap)| time.is_finite() && gap.is_finite());
        known.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(time, _)| time)
    };
    let surfaces = run.diagnostics.as_ref().and_then(|table| {
        let (time, gap) = (table.column("time")?, table.column("gap")?);
        least(&mut time.iter().copied().zip(gap.iter().copied()))
    });
    let centres = || {
        let [a, b] = pair?.map(|grain| &run.grains[grain]);
        let lines = a.position.iter().zip(&b.position).map(|(a, b)| *a - *b);
        let distances = lines.map(|line| run.nearest(line).length());
        least(&mut a.time.iter().copied().zip(distances))
    };
    surfaces.or_else(centres).unwrap_or(0.0)
}

/// Returns the Galileo number sqrt(|s - 1| g d^3) / nu for the density ratio s.
pub fn galileo(scales: Scales, ratio: f64, viscosity: f64) -> f64 {
    ((ratio - 1.0).abs() * scales.gravity * scales.diameter.powi(3)).sqrt() / viscosity
}

/// Returns a length [m] with three significant digits and the unit that suits it.
pub fn length(value: f64) -> String {
    let (unit, factor) = length_unit(value.abs());
    format!("{} {unit}", short(value * factor))
}

/// Returns a value with three significant digits, in label markup.
pub fn short(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    if !value.is_finite() {
        return "not known".to_owned();
    }
    // The exponent of the rounded value: 0.9999 becomes 1.00.
    let rounded = format!("{value:.2e}");
    let (mantissa, exponent) = rounded.split_once('e').unwrap_or((&rounded, "0"));
    match exponent.parse::<i32>().unwrap_or(0) {
        power @ -3..=5 => {
            let decimals = (2 - power).clamp(0, 6) as usize;
            minus(&format!("{value:.decimals$}"))
        }
        _ => minus(&format!("{mantissa}×10^{{{exponent}}}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_digits() {
        let texts =
            [0.0, 18.234, 0.99999, -0.002_346, 123_456.0, 1.0e-9, -4.2e7, f64::NAN].map(short);
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
    fn lengths_have_the_unit_of_their_size() {
        let texts = [15.0, 0.016, 0.125e-3, 2e-6].map(length);
        assert_eq!(texts, ["15.0 m", "16.0 mm", "125 µm", "2.00 µm"]);
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
        assert_eq!(RunFeatures::of(&run).pair, Some([1, 0]));
        run.facts.gravity = Some(DVec3::new(0.0, 0.0, 9.81));
        assert_eq!(RunFeatures::of(&run).pair, Some([0, 1]), "down is where gravity points");
    }

    #[test]
    fn the_grain_ahead_leads_without_gravity() {
        let mut run = RunFolder::default();
        for (x, path) in [(0.01, 0.02), (0.03, 0.0)] {
            run.grains.push(History {
                time: vec![0.0, 1.0],
                position: vec![DVec3::X * x, DVec3::X * (x + path)],
                ..History::default()
            });
        }
        assert_eq!(RunFeatures::of(&run).pair, Some([0, 1]));
        run.grains.swap(0, 1);
        assert_eq!(RunFeatures::of(&run).pair, Some([1, 0]));
    }

    #[test]
    fn directions_are_named() {
        let mut run = RunFolder::default();
        let text = |run: &RunFolder, v| RunFeatures::of(run).direction_text(DVec3::from_array(v));
        assert_eq!(text(&run, [0.0, -1e-9, 0.03]), "in the direction (0.00, 0.00, 1.00)");
        assert_eq!(text(&run, [-0.3, 0.0, 0.3]), "in the direction (−0.71, 0.00, 0.71)");
        run.facts.gravity = Some(DVec3::new(0.0, 0.0, -9.81));
        for (velocity, words) in [
            ([0.0, 0.0, 0.08], "upwards"),
            ([0.1, 0.0, -0.9], "downwards"),
            ([0.5, 0.0, 0.0], "horizontally"),
            ([0.5, 0.0, -0.2], "obliquely downwards"),
            ([0.5, 0.0, 0.5], "obliquely upwards"),
        ] {
            assert_eq!(text(&run, velocity), words);
        }
    }

    #[test]
    fn the_vertical_velocity_is_named_by_its_axis() {
        let mut run = RunFolder::default();
        let mut names = |gravity: [f64; 3]| {
            run.facts.gravity = Some(DVec3::from_array(gravity));
            let features = RunFeatures::of(&run);
            (features.vertical_symbol(), features.vertical_velocity())
        };
        for (gravity, symbol, words) in [
            ([0.0, 0.0, -9.81], "*v*_{z}", "down is negative"),
            ([0.0, -9.81, 0.0], "*v*_{y}", "down, along −y, is negative"),
            ([9.81, 0.0, 0.0], "−*v*_{x}", "down, along +x, is negative"),
            ([0.6, 0.0, -0.8], "*v*_{up}", "in the direction (0.60, 0.00, −0.80), is negative"),
            ([0.0; 3], "*v*_{z}", "Velocity along z"),
        ] {
            let (found, said) = names(gravity);
            assert_eq!(found, symbol);
            assert!(said.contains(words), "{said}");
        }
    }

    #[test]
    fn galileo_number_of_the_paper() {
        let scales = Scales { diameter: 2e-3, gravity: 9.81 };
        assert!((galileo(scales, 1.5, 1e-6) - 198.1).abs() < 0.1);
        assert!(
            (scales.time() - 0.014_28).abs() < 1e-5 && (scales.velocity() - 0.140_07).abs() < 1e-5
        );
    }
}

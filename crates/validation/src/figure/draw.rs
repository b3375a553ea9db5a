//! From the description of a figure to its drawing.

use std::path::{Path, PathBuf};

use grainwake_report::figure::field::{self, Panel};
use grainwake_report::figure::style::FAINT;
use grainwake_report::figure::svg::Drawing;
use grainwake_report::figure::{minus, plain};

use grainwake_solver::output::SUMMARY;
use grainwake_solver::output::vti::Image;

use super::plot::{self, Shown};
use super::{Content, Data, Figure, Picture, Point, Series};
use crate::measure;
use crate::signal;
use crate::table::{Columns, last_slice};

/// Part of the finest error at which a guide line passes, so that the data do not hide it.
const BESIDE: f64 = 0.7;

/// What came of a figure.
#[derive(Debug)]
pub struct Drawn {
    /// The drawing; none if no run has data for it.
    pub drawing: Option<Drawing>,
    /// What was left out, and why.
    pub notes: Vec<String>,
}

/// Why something is left out.
enum Gap {
    /// The run is not there or has not come to its end.
    Run(String),
    /// Anything else, in words.
    Other(String),
}

impl From<String> for Gap {
    fn from(what: String) -> Gap {
        Gap::Other(what)
    }
}

/// The gaps in words, all runs together.
fn notes(gaps: Vec<Gap>) -> Vec<String> {
    let (mut runs, mut notes): (Vec<String>, Vec<String>) = Default::default();
    for gap in gaps {
        match gap {
            Gap::Run(name) if runs.contains(&name) => {}
            Gap::Run(name) => runs.push(name),
            Gap::Other(what) => notes.push(what),
        }
    }
    if !runs.is_empty() {
        notes.push(format!("no finished run {}", runs.join(", ")));
    }
    notes
}

impl Figure {
    /// Draws what there are data for; `runs` holds the run folders of the suite. The numbers (run,
    /// quantity) of runs that are not there may have been `saved`.
    pub fn draw(&self, runs: &Path, saved: impl Fn(&str, &str) -> Option<f64>) -> Drawn {
        let mut gaps = Vec::new();
        let drawing = match &self.content {
            Content::Plot { across, up, series } => {
                let mut shown = Vec::new();
                let mut measured = false;
                for one in series {
                    match one.shown(runs, &saved, &mut gaps) {
                        Ok(found) => {
                            let reference = matches!(one.data, Data::Reference { .. });
                            measured |= !reference && !found.is_empty();
                            shown.extend(found);
                        }
                        Err(gap) => gaps.push(one.named(gap)),
                    }
                }
                measured.then(|| plot::draw(across, up, &shown))
            }
            Content::Pictures {
                quantity,
                style,
                pictures,
            } => {
                let mut images = Vec::new();
                for picture in pictures {
                    match picture.image(runs) {
                        Ok((folder, image)) => images.push((picture, folder, image)),
                        Err(gap) => gaps.push(gap),
                    }
                }
                let panels: Vec<Panel> = images
                    .iter()
                    .map(|(picture, folder, image)| Panel {
                        title: picture.title.clone(),
                        image,
                        window: picture.window,
                        run: Some(folder.as_path()),
                    })
                    .collect();
                if panels.is_empty() {
                    None
                } else {
                    field::draw(&panels, *quantity, style)
                        .map_err(|why| gaps.push(Gap::Other(why)))
                        .ok()
                }
            }
        };
        Drawn {
            drawing,
            notes: notes(gaps),
        }
    }

    /// Title, caption and sources of the reference data, in label markup.
    pub fn description(&self) -> String {
        let mut text = self.caption.clone();
        if !self.sources.is_empty() {
            text += &format!(" Reference data: {}.", self.sources.join("; "));
        }
        text.trim().to_owned()
    }
}

/// The folder of a run that came to its end.
fn finished(runs: &Path, name: &str) -> Result<PathBuf, Gap> {
    let folder = runs.join(name);
    if folder.join(SUMMARY).is_file() {
        Ok(folder)
    } else {
        Err(Gap::Run(name.to_owned()))
    }
}

impl Picture {
    fn image(&self, runs: &Path) -> Result<(PathBuf, Image), Gap> {
        let folder = finished(runs, &self.run)?;
        let image = last_slice(&folder, &self.plane);
        let image = image.map_err(|why| Gap::Other(format!("{}: {why}", self.run)))?;
        Ok((folder, image))
    }
}

impl Series {
    /// What happened to this series.
    fn named(&self, gap: Gap) -> Gap {
        match gap {
            Gap::Other(what) if !self.label.is_empty() => {
                Gap::Other(format!("\"{}\": {what}", plain(&self.label)))
            }
            gap => gap,
        }
    }

    /// The points, and what else is drawn with them.
    fn shown(
        &self,
        runs: &Path,
        saved: impl Fn(&str, &str) -> Option<f64>,
        gaps: &mut Vec<Gap>,
    ) -> Result<Vec<Shown>, Gap> {
        let mut shown = Shown {
            label: self.label.clone(),
            colour: self.colour,
            sign: Some(self.sign),
            hollow: false,
            line: self.line,
            points: Vec::new(),
        };
        match &self.data {
            Data::Reference {
                file,
                x,
                y,
                constants,
            } => {
                let columns = Columns::of_data(file)?;
                let x = measure::evaluate(x, &columns, constants)?;
                let y = measure::evaluate(y, &columns, constants)?;
                shown.points = x.into_iter().zip(y).collect();
                shown.sign = self.line.is_none().then_some(self.sign);
                shown.hollow = true;
            }
            Data::History {
                run,
                window,
                constants,
                derivative,
            } => {
                let (x, mut y) = window.samples(&finished(runs, run)?, constants)?;
                if *derivative {
                    y = signal::derivative(&x, &y)
                        .ok_or_else(|| "one row has no derivative".to_owned())?;
                }
                shown.points = x.into_iter().zip(y).collect();
                shown.sign = None;
            }
            Data::Results {
                points,
                error,
                slope,
            } => {
                for point in points {
                    match point.value(runs, &saved, *error) {
                        Ok(y) => shown.points.push((point.x, y)),
                        Err(gap) => gaps.push(self.named(gap)),
                    }
                }
                shown.points.sort_by(|a, b| a.0.total_cmp(&b.0));
                if shown.points.is_empty() {
                    return Ok(Vec::new());
                }
                if let Some(slope) = slope {
                    let guide = guide(&shown.points, *slope);
                    if let Some(order) = observed_order(&shown.points, *slope) {
                        // Not "-0.00".
                        let order = (100.0 * order).round() / 100.0 + 0.0;
                        shown.label += &minus(&format!(" (order {order:.2})"));
                    }
                    return Ok(guide.into_iter().chain([shown]).collect());
                }
            }
        }
        Ok(vec![shown])
    }
}

impl Point {
    fn value(
        &self,
        runs: &Path,
        saved: impl Fn(&str, &str) -> Option<f64>,
        error: bool,
    ) -> Result<f64, Gap> {
        let value = match finished(runs, &self.run) {
            Ok(folder) => self.check.measure(&folder)?,
            Err(gap) => saved(&self.run, &self.check.quantity).ok_or(gap)?,
        };
        Ok(match self.reference {
            Some(reference) if error => ((value - reference) / reference).abs(),
            _ => value,
        })
    }
}

/// The two points of the finest runs, the finest last: largest x where the error falls with x.
fn finest(points: &[(f64, f64)], slope: f64) -> Option<[(f64, f64); 2]> {
    let n = points.len();
    match (n >= 2, slope < 0.0) {
        (false, _) => None,
        (true, true) => Some([points[n - 2], points[n - 1]]),
        (true, false) => Some([points[1], points[0]]),
    }
}

/// Power with which the error falls between the two finest of `points`, which are sorted by x;
/// positive where it falls as `slope` does.
fn observed_order(points: &[(f64, f64)], slope: f64) -> Option<f64> {
    let [coarse, fine] = finest(points, slope)?;
    let order = (fine.1 / coarse.1).ln() / (fine.0 / coarse.0).ln() * slope.signum();
    order.is_finite().then_some(order)
}

/// A line of the given power, a little below the point of the finest run.
fn guide(points: &[(f64, f64)], slope: f64) -> Option<Shown> {
    let [_, (x0, y0)] = finest(points, slope)?;
    let along = |x: f64| (x, BESIDE * y0 * (x / x0).powf(slope));
    Some(Shown {
        label: minus(&format!("slope {slope}")),
        colour: FAINT,
        sign: None,
        hollow: false,
        line: Some("4.5 2"),
        points: points.iter().map(|(x, _)| along(*x)).collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_order_is_that_of_the_two_finest() {
        // Error 0.3 h^2 with h = 1/n, spoiled on the coarsest.
        let error = |n: f64| 0.3 / (n * n);
        let points = [(8.0, 0.5), (16.0, error(16.0)), (24.0, error(24.0))];
        assert!((observed_order(&points, -2.0).unwrap() - 2.0).abs() < 1e-12);
        let by_h = [
            (1.0 / 24.0, error(24.0)),
            (1.0 / 16.0, error(16.0)),
            (0.125, 0.5),
        ];
        assert!((observed_order(&by_h, 2.0).unwrap() - 2.0).abs() < 1e-12);
        let growing = [(8.0, 0.1), (16.0, 0.2)];
        assert!((observed_order(&growing, -2.0).unwrap() + 1.0).abs() < 1e-12);
        assert_eq!(observed_order(&points[..1], -2.0), None);
        let line = guide(&points, -2.0).unwrap();
        for (point, n) in line.points.iter().zip([8.0, 16.0, 24.0]) {
            assert!((point.1 - BESIDE * error(n)).abs() < 1e-12);
        }
        assert_eq!(line.label, "slope −2");
    }
}

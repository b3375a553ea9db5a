//! Drawing of figures from run folders and reference data.

use std::path::{Path, PathBuf};

use grainwake_plot::drawing::Drawing;
use grainwake_plot::frame::Fill;
use grainwake_plot::style::FAINT;
use grainwake_plot::{minus, plain};
use grainwake_report::figure::field::{self, Panel};

use grainwake_formats::summary;
use grainwake_formats::vti::Image;

use super::plot::{self, DataSet};
use super::raw::SliceSpec;
use super::spec::{Content, Data, FigureSpec, ResultPoint, SeriesSpec};
use crate::columns::{Columns, last_slice};
use crate::{expression, signal};

/// Ratio of the guide line to the finest error, so that the data do not hide the line.
const GUIDE_RATIO: f64 = 0.7;

/// Drawing of a figure, and its omissions.
#[derive(Debug)]
pub struct DrawnFigure {
    /// Drawing; none if no run has data for it.
    pub drawing: Option<Drawing>,
    /// Omitted parts, with the reason.
    pub notes: Vec<String>,
}

/// Reason of an omission.
enum Omission {
    /// The run is missing or unfinished.
    Run(String),
    /// Another reason.
    Other(String),
}

impl From<String> for Omission {
    fn from(what: String) -> Omission {
        Omission::Other(what)
    }
}

/// Words the omissions; all missing runs are combined in one note.
fn notes(omissions: Vec<Omission>) -> Vec<String> {
    let (mut runs, mut notes): (Vec<String>, Vec<String>) = Default::default();
    for omission in omissions {
        match omission {
            Omission::Run(name) if runs.contains(&name) => {}
            Omission::Run(name) => runs.push(name),
            Omission::Other(what) => notes.push(what),
        }
    }
    if !runs.is_empty() {
        notes.push(format!("no finished run {}", runs.join(", ")));
    }
    notes
}

impl FigureSpec {
    /// Draws the data sets that exist in the run folders below `runs`.
    ///
    /// `saved` returns stored values, by run and quantity, of runs whose folders do not exist.
    pub fn draw(&self, runs: &Path, saved: impl Fn(&str, &str) -> Option<f64>) -> DrawnFigure {
        let mut omissions = Vec::new();
        let drawing = match &self.content {
            Content::Plot { across, up, series } => {
                let mut shown = Vec::new();
                let mut measured = false;
                for one in series {
                    match one.data_sets(runs, &saved, &mut omissions) {
                        Ok(found) => {
                            let reference = matches!(one.data, Data::Reference { .. });
                            measured |= !reference && !found.is_empty();
                            shown.extend(found);
                        }
                        Err(omission) => omissions.push(one.named(omission)),
                    }
                }
                measured.then(|| plot::draw(across, up, &shown))
            }
            Content::Pictures { style, pictures } => {
                let mut images = Vec::new();
                for picture in pictures {
                    match picture.image(runs) {
                        Ok((folder, image)) => images.push((picture, folder, image)),
                        Err(omission) => omissions.push(omission),
                    }
                }
                let panels: Vec<Panel> = images
                    .iter()
                    .map(|(picture, folder, image)| Panel {
                        title: picture.title.clone(),
                        image,
                        window: Some(picture.window()),
                        run: Some(folder.as_path()),
                    })
                    .collect();
                if panels.is_empty() {
                    None
                } else {
                    field::draw(&panels, style)
                        .map_err(|why| omissions.push(Omission::Other(why)))
                        .ok()
                }
            }
        };
        DrawnFigure { drawing, notes: notes(omissions) }
    }

    /// Returns the caption and the sources of the reference data, in label markup.
    pub fn description(&self) -> String {
        let mut text = self.caption.clone();
        if !self.sources.is_empty() {
            text += &format!(" Reference data: {}.", self.sources.join("; "));
        }
        text.trim().to_owned()
    }
}

/// Returns the folder of a finished run.
fn finished(runs: &Path, name: &str) -> Result<PathBuf, Omission> {
    let folder = runs.join(name);
    if folder.join(summary::FILE).is_file() {
        Ok(folder)
    } else {
        Err(Omission::Run(name.to_owned()))
    }
}

impl SliceSpec {
    fn image(&self, runs: &Path) -> Result<(PathBuf, Image), Omission> {
        let folder = finished(runs, &self.run)?;
        let image = last_slice(&folder, &self.plane);
        let image = image.map_err(|why| Omission::Other(format!("{}: {why}", self.run.value)))?;
        Ok((folder, image))
    }
}

impl SeriesSpec {
    /// Adds the label of the series to the reason of an omission.
    fn named(&self, omission: Omission) -> Omission {
        match omission {
            Omission::Other(what) if !self.label.is_empty() => {
                Omission::Other(format!("\"{}\": {what}", plain(&self.label)))
            }
            omission => omission,
        }
    }

    /// Returns the data set of the series, and its guide line.
    fn data_sets(
        &self,
        runs: &Path,
        saved: impl Fn(&str, &str) -> Option<f64>,
        omissions: &mut Vec<Omission>,
    ) -> Result<Vec<DataSet>, Omission> {
        let mut shown = DataSet {
            label: self.label.clone(),
            colour: self.colour,
            sign: Some(self.sign),
            fill: Fill::Solid,
            line: self.line,
            points: Vec::new(),
        };
        match &self.data {
            Data::Reference { file, x, y, constants } => {
                let columns = Columns::read_reference(file)?;
                let x = expression::evaluate(x, &columns, constants)?;
                let y = expression::evaluate(y, &columns, constants)?;
                shown.points = x.into_iter().zip(y).collect();
                shown.sign = self.line.is_none().then_some(self.sign);
                shown.fill = Fill::Hollow;
            }
            Data::History { run, sampling, constants, derivative } => {
                let (x, mut y) = sampling.samples(&finished(runs, run)?, constants)?;
                if *derivative {
                    y = signal::derivative(&x, &y)
                        .ok_or_else(|| "a single row has no derivative".to_owned())?;
                }
                shown.points = x.into_iter().zip(y).collect();
                shown.sign = None;
            }
            Data::Results { points, error, slope } => {
                for point in points {
                    match point.value(runs, &saved, *error) {
                        Ok(y) => shown.points.push((point.x, y)),
                        Err(omission) => omissions.push(self.named(omission)),
                    }
                }
                shown.points.sort_by(|a, b| a.0.total_cmp(&b.0));
                if shown.points.is_empty() {
                    return Ok(Vec::new());
                }
                if let Some(slope) = slope {
                    let guide = guide(&shown.points, *slope);
                    if let Some(order) = observed_order(&shown.points, *slope) {
                        // Avoids "-0.00".
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

impl ResultPoint {
    fn value(
        &self,
        runs: &Path,
        saved: impl Fn(&str, &str) -> Option<f64>,
        error: bool,
    ) -> Result<f64, Omission> {
        let value = match finished(runs, &self.run) {
            Ok(folder) => self.check.measure(&folder)?,
            Err(omission) => saved(&self.run, &self.check.quantity).ok_or(omission)?,
        };
        Ok(match self.reference {
            Some(reference) if error => ((value - reference) / reference).abs(),
            _ => value,
        })
    }
}

/// Returns the points of the two finest runs, the finest last: largest x for a negative slope.
fn finest(points: &[(f64, f64)], slope: f64) -> Option<[(f64, f64); 2]> {
    let n = points.len();
    match (n >= 2, slope < 0.0) {
        (false, _) => None,
        (true, true) => Some([points[n - 2], points[n - 1]]),
        (true, false) => Some([points[1], points[0]]),
    }
}

/// Returns the observed order between the two finest of `points`, which are sorted by x.
///
/// Positive if the error falls in the direction of `slope`.
fn observed_order(points: &[(f64, f64)], slope: f64) -> Option<f64> {
    let [coarse, fine] = finest(points, slope)?;
    let order = (fine.1 / coarse.1).ln() / (fine.0 / coarse.0).ln() * slope.signum();
    order.is_finite().then_some(order)
}

/// Returns a line of the given exponent, slightly below the point of the finest run.
fn guide(points: &[(f64, f64)], slope: f64) -> Option<DataSet> {
    let [_, (x0, y0)] = finest(points, slope)?;
    let along = |x: f64| (x, GUIDE_RATIO * y0 * (x / x0).powf(slope));
    Some(DataSet {
        label: minus(&format!("slope {slope}")),
        colour: FAINT,
        sign: None,
        fill: Fill::Solid,
        line: Some("4.5 2"),
        points: points.iter().map(|(x, _)| along(*x)).collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn order_follows_from_the_two_finest_runs() {
        // Error 0.3 h^2 with h = 1/n, except on the coarsest mesh.
        let error = |n: f64| 0.3 / (n * n);
        let points = [(8.0, 0.5), (16.0, error(16.0)), (24.0, error(24.0))];
        assert!((observed_order(&points, -2.0).unwrap() - 2.0).abs() < 1e-12);
        let by_h = [(1.0 / 24.0, error(24.0)), (1.0 / 16.0, error(16.0)), (0.125, 0.5)];
        assert!((observed_order(&by_h, 2.0).unwrap() - 2.0).abs() < 1e-12);
        let growing = [(8.0, 0.1), (16.0, 0.2)];
        assert!((observed_order(&growing, -2.0).unwrap() + 1.0).abs() < 1e-12);
        assert_eq!(observed_order(&points[..1], -2.0), None);
        let line = guide(&points, -2.0).unwrap();
        for (point, n) in line.points.iter().zip([8.0, 16.0, 24.0]) {
            assert!((point.1 - GUIDE_RATIO * error(n)).abs() < 1e-12);
        }
        assert_eq!(line.label, "slope −2");
    }
}

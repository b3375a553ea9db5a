//! Curves over a shared horizontal axis, one panel above the other, with marked instants.

use crate::axis::Axis;
use crate::style::{self, COLUMN, HAIR, INK, LINE, SMALL, TEXT, TICK};
use crate::svg::{Anchor, Drawing};
use crate::text;

/// A curve.
#[derive(Clone, Debug)]
pub struct Series {
    /// Name in the legend; none keeps it out.
    pub name: Option<String>,
    /// Points in data units; breaks at values that are not finite.
    pub points: Vec<(f64, f64)>,
    /// Colour.
    pub colour: &'static str,
    /// SVG dash pattern.
    pub dash: Option<&'static str>,
}

/// One frame with its curves.
#[derive(Clone, Debug)]
pub struct Panel {
    /// Vertical axis.
    pub y: Axis,
    /// Curves.
    pub series: Vec<Series>,
    /// Horizontal reference lines with a note at their right end.
    pub levels: Vec<(f64, String)>,
    /// Height of the frame [pt].
    pub height: f64,
}

/// An instant marked across all panels.
#[derive(Clone, Debug)]
pub struct Mark {
    /// Place on the horizontal axis.
    pub at: f64,
    /// Name written above the first panel; empty for a mark without one.
    pub name: String,
}

const LEFT: f64 = 38.0;
const RIGHT: f64 = 8.0;
const ROW: f64 = 9.5;
const LABEL_ROWS: usize = 5;

/// Draws the panels over one horizontal axis in a column-wide drawing.
pub fn stack(x: &Axis, panels: &[Panel], marks: &[Mark]) -> Drawing {
    let width = COLUMN - LEFT - RIGHT;
    let names = place_names(x, marks, width);
    let rows = names.iter().map(|(row, _, _)| row + 1).max().unwrap_or(0);
    let mut legends: Vec<Vec<Vec<&Series>>> = Vec::new();
    let mut before: Vec<&str> = Vec::new();
    for panel in panels {
        let named: Vec<&Series> = panel.series.iter().filter(|s| s.name.is_some()).collect();
        let these: Vec<&str> = named.iter().filter_map(|s| s.name.as_deref()).collect();
        legends.push(if these == before {
            Vec::new()
        } else {
            legend_rows(&named, width)
        });
        before = these;
    }
    let top = |i: usize| {
        let marks = if i == 0 { ROW * rows as f64 } else { 0.0 };
        let letter = if panels.len() > 1 { 5.0 } else { 0.0 };
        7.0 + letter + ROW * legends[i].len() as f64 + marks
    };
    // A long label makes its panel taller.
    let height = |panel: &Panel| panel.height.max(text::width(&panel.y.label, TEXT) + 4.0);
    let heights: f64 = panels
        .iter()
        .enumerate()
        .map(|(i, panel)| top(i) + height(panel))
        .sum();
    let mut drawing = Drawing::new(COLUMN, heights + 26.0);
    let mut y = 0.0;
    for (i, panel) in panels.iter().enumerate() {
        draw_legend(&mut drawing, &legends[i], y + 7.0);
        y += top(i);
        let frame = Frame {
            x: LEFT,
            y,
            width,
            height: height(panel),
        };
        draw_marks(
            &mut drawing,
            &frame,
            x,
            marks,
            if i == 0 { &names } else { &[] },
        );
        draw_panel(&mut drawing, &frame, x, panel, i);
        y += frame.height;
        let last = i + 1 == panels.len();
        draw_x_axis(&mut drawing, &frame, x, last);
        if panels.len() > 1 {
            let letter = format!("({})", char::from(b'a' + (i % 26) as u8));
            drawing.label(2.0, frame.y - 4.0, Anchor::Start, TEXT, INK, &letter, false);
        }
    }
    drawing
}

/// The rectangle inside the axes [pt].
struct Frame {
    x: f64,
    y: f64,
    width: f64,
    height: f64,
}

impl Frame {
    fn at(&self, x: &Axis, y: &Axis, (px, py): (f64, f64)) -> Option<(f64, f64)> {
        Some((
            self.x + self.width * x.place(px)?,
            self.y + self.height * (1.0 - y.place(py)?),
        ))
    }
}

fn draw_panel(drawing: &mut Drawing, frame: &Frame, x: &Axis, panel: &Panel, index: usize) {
    for (value, name) in panel.y.ticks.iter() {
        let Some(place) = panel.y.place(*value) else {
            continue;
        };
        let y = frame.y + frame.height * (1.0 - place);
        let inner = place > 0.01 && place < 0.99 && !name.is_empty();
        if inner {
            drawing.line(
                &[(frame.x, y), (frame.x + frame.width, y)],
                style::GRID,
                0.5,
                None,
            );
        }
        drawing.line(&[(frame.x - TICK, y), (frame.x, y)], INK, HAIR, None);
        drawing.label(
            frame.x - TICK - 2.0,
            y + 0.36 * SMALL,
            Anchor::End,
            SMALL,
            INK,
            name,
            false,
        );
    }
    let clip = format!("clip-{index}");
    drawing.begin_clip(
        &clip,
        frame.x,
        frame.y - 1.0,
        frame.width,
        frame.height + 2.0,
    );
    for (value, _) in &panel.levels {
        if let Some((_, y)) = frame.at(x, &panel.y, (x.low(), *value)) {
            drawing.line(
                &[(frame.x, y), (frame.x + frame.width, y)],
                style::FAINT,
                0.8,
                Some("5 2.5"),
            );
        }
    }
    for series in &panel.series {
        for run in runs(&series.points, |p| frame.at(x, &panel.y, p)) {
            drawing.line(&thin(&run), series.colour, LINE, series.dash);
        }
    }
    drawing.end_clip();
    for (value, note) in &panel.levels {
        if let Some((_, y)) = frame.at(x, &panel.y, (x.low(), *value)) {
            let (left, base) = place_note(frame, x, panel, y, text::width(note, SMALL));
            drawing.rimmed_label(left, base, Anchor::Start, SMALL, style::FAINT, note);
        }
    }
    let outline = format!("fill=\"none\" stroke=\"{INK}\" stroke-width=\"{HAIR}\"");
    drawing.rectangle(frame.x, frame.y, frame.width, frame.height, &outline);
    drawing.label(
        9.0,
        frame.y + 0.5 * frame.height,
        Anchor::Middle,
        TEXT,
        INK,
        &panel.y.label,
        true,
    );
}

/// Where the note of a level line covers the least of the curves: left end and baseline [pt].
fn place_note(frame: &Frame, x: &Axis, panel: &Panel, y: f64, width: f64) -> (f64, f64) {
    let points = panel.series.iter().flat_map(|series| &series.points);
    let points: Vec<_> = points.filter_map(|p| frame.at(x, &panel.y, *p)).collect();
    let covered = |left: f64, base: f64| {
        let inside = |p: &&(f64, f64)| {
            (left - 2.0..left + width + 2.0).contains(&p.0)
                && (base - SMALL - 1.0..base + 3.0).contains(&p.1)
        };
        points.iter().filter(inside).count()
    };
    let room = frame.width - width - 6.0;
    let ends = [1.0, 0.0, 0.75, 0.25, 0.5].map(|part| frame.x + 3.0 + part * room);
    let bases = [y - 2.5, y + SMALL + 1.5];
    let places = ends.iter().flat_map(|left| bases.map(|base| (*left, base)));
    let inside =
        |(_, base): &(f64, f64)| *base > frame.y + SMALL && *base < frame.y + frame.height - 1.0;
    let best = places
        .filter(inside)
        .min_by_key(|(left, base)| covered(*left, *base));
    best.unwrap_or((ends[0], bases[0]))
}

fn draw_x_axis(drawing: &mut Drawing, frame: &Frame, x: &Axis, labelled: bool) {
    let bottom = frame.y + frame.height;
    for (value, name) in &x.ticks {
        let Some(place) = x.place(*value) else {
            continue;
        };
        let at = frame.x + frame.width * place;
        drawing.line(&[(at, bottom), (at, bottom + TICK)], INK, HAIR, None);
        if labelled {
            drawing.label(
                at,
                bottom + TICK + SMALL + 0.5,
                Anchor::Middle,
                SMALL,
                INK,
                name,
                false,
            );
        }
    }
    if labelled {
        let middle = frame.x + 0.5 * frame.width;
        drawing.label(
            middle,
            bottom + TICK + SMALL + 11.0,
            Anchor::Middle,
            TEXT,
            INK,
            &x.label,
            false,
        );
    }
}

fn draw_marks(
    drawing: &mut Drawing,
    frame: &Frame,
    x: &Axis,
    marks: &[Mark],
    names: &[(usize, f64, &str)],
) {
    for mark in marks {
        if let Some(place) = x.place(mark.at).filter(|place| (0.0..=1.0).contains(place)) {
            let at = frame.x + frame.width * place;
            drawing.line(
                &[(at, frame.y), (at, frame.y + frame.height)],
                style::FAINT,
                HAIR,
                Some("1.5 1.5"),
            );
        }
    }
    for (row, at, _) in names {
        let y = frame.y - 3.0 - ROW * *row as f64;
        if *row > 0 {
            drawing.line(
                &[(frame.x + at, y + 1.5), (frame.x + at, frame.y)],
                style::GRID,
                HAIR,
                None,
            );
        }
    }
    for (row, at, name) in names {
        let y = frame.y - 3.0 - ROW * *row as f64;
        let half = 0.5 * text::width(name, SMALL);
        let centre = at.clamp(half - LEFT + 12.0, (frame.width + RIGHT - half).max(half));
        drawing.rimmed_label(frame.x + centre, y, Anchor::Middle, SMALL, INK, name);
    }
}

/// Rows for the names of marks such that none overlap: (row, place [pt], name). Of marks of one
/// name in a row only the first is named. Names that find no room are left out; their lines stay.
fn place_names<'a>(x: &Axis, marks: &'a [Mark], width: f64) -> Vec<(usize, f64, &'a str)> {
    let mut ends = [f64::NEG_INFINITY; LABEL_ROWS];
    let mut out = Vec::new();
    let mut before = "";
    for mark in marks.iter().filter(|mark| !mark.name.is_empty()) {
        let repeated = std::mem::replace(&mut before, mark.name.as_str()) == mark.name;
        if repeated {
            continue;
        }
        let Some(place) = x.place(mark.at).filter(|place| (0.0..=1.0).contains(place)) else {
            continue;
        };
        let at = place * width;
        let half = 0.5 * text::width(&mark.name, SMALL);
        let centre = at.clamp(half - LEFT + 12.0, (width + RIGHT - half).max(half));
        if let Some(row) = ends.iter().position(|end| centre - half > end + 4.0) {
            ends[row] = centre + half;
            out.push((row, at, mark.name.as_str()));
        }
    }
    out
}

fn legend_rows<'a>(series: &[&'a Series], width: f64) -> Vec<Vec<&'a Series>> {
    let mut rows: Vec<Vec<&Series>> = Vec::new();
    let mut used = f64::INFINITY;
    for one in series {
        let size = entry_width(one);
        if used + size > width {
            rows.push(Vec::new());
            used = 0.0;
        }
        used += size;
        if let Some(row) = rows.last_mut() {
            row.push(one);
        }
    }
    rows
}

fn entry_width(series: &Series) -> f64 {
    14.0 + 3.0 + text::width(series.name.as_deref().unwrap_or(""), SMALL) + 10.0
}

fn draw_legend(drawing: &mut Drawing, rows: &[Vec<&Series>], top: f64) {
    for (i, row) in rows.iter().enumerate() {
        let y = top + ROW * i as f64;
        let mut x = LEFT;
        for series in row {
            drawing.line(&[(x, y), (x + 14.0, y)], series.colour, LINE, series.dash);
            let name = series.name.as_deref().unwrap_or("");
            drawing.label(
                x + 17.0,
                y + 0.36 * SMALL,
                Anchor::Start,
                SMALL,
                INK,
                name,
                false,
            );
            x += entry_width(series);
        }
    }
}

/// Splits at points that have no place.
fn runs(
    points: &[(f64, f64)],
    place: impl Fn((f64, f64)) -> Option<(f64, f64)>,
) -> Vec<Vec<(f64, f64)>> {
    let mut out = vec![Vec::new()];
    for point in points {
        match place(*point) {
            Some(at) => out
                .last_mut()
                .into_iter()
                .for_each(|run: &mut Vec<_>| run.push(at)),
            None => out.push(Vec::new()),
        }
    }
    out.retain(|run| run.len() > 1);
    out
}

/// Keeps what can be seen of a long curve: the first, lowest, highest and last point of every
/// half point of width.
fn thin(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    if points.len() < 1200 {
        return points.to_vec();
    }
    let mut out: Vec<(f64, f64)> = Vec::new();
    let mut start = 0;
    while start < points.len() {
        let column = (2.0 * points[start].0).floor();
        let length = points[start..]
            .iter()
            .take_while(|p| (2.0 * p.0).floor() == column)
            .count()
            .max(1);
        let bucket = &points[start..start + length];
        let by_height = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
        let mut keep = [
            bucket.first(),
            bucket.iter().min_by(by_height),
            bucket.iter().max_by(by_height),
            bucket.last(),
        ]
        .into_iter()
        .flatten()
        .copied()
        .collect::<Vec<_>>();
        keep.sort_by(|a, b| a.0.total_cmp(&b.0));
        keep.dedup();
        out.extend(keep);
        start += length;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_curves_keep_their_peaks() {
        let mut points: Vec<(f64, f64)> = (0..20_000).map(|i| (f64::from(i) * 0.01, 0.0)).collect();
        points[7777].1 = 9.0;
        points[7778].1 = -9.0;
        let kept = thin(&points);
        assert!(kept.len() < 2000, "{}", kept.len());
        assert!(kept.contains(&points[7777]) && kept.contains(&points[7778]));
        assert_eq!((kept[0], kept[kept.len() - 1]), (points[0], points[19_999]));
    }

    #[test]
    fn names_of_marks_do_not_overlap() {
        let x = Axis::linear("t", 0.0, 10.0, 5, true);
        let mark = |at, name: &str| Mark {
            at,
            name: name.to_owned(),
        };
        let marks = [
            mark(5.0, "kiss"),
            mark(5.1, "role change"),
            mark(5.2, "separation"),
            mark(5.21, "separation"),
            mark(5.3, "landing"),
            mark(5.4, "rest"),
            mark(5.5, "one too many"),
            mark(99.0, "outside"),
        ];
        let placed = place_names(&x, &marks, 200.0);
        assert_eq!(
            placed
                .iter()
                .map(|(row, _, name)| (*row, *name))
                .collect::<Vec<_>>(),
            [
                (0, "kiss"),
                (1, "role change"),
                (2, "separation"),
                (3, "landing"),
                (4, "rest")
            ]
        );
    }

    #[test]
    fn notes_keep_off_the_curves() {
        let x = Axis::linear("t", 0.0, 10.0, 5, true);
        let points = (0..=100)
            .map(|i| (0.1 * f64::from(i), if i < 60 { 1.0 } else { 5.5 }))
            .collect();
        let series = Series {
            name: None,
            points,
            colour: INK,
            dash: None,
        };
        let y = Axis::linear("y", 0.0, 10.0, 5, true);
        let panel = Panel {
            y,
            series: vec![series],
            levels: Vec::new(),
            height: 100.0,
        };
        let frame = Frame {
            x: 40.0,
            y: 10.0,
            width: 200.0,
            height: 100.0,
        };
        let (left, base) = place_note(&frame, &x, &panel, 60.0, 30.0);
        assert!(
            left > 200.0 && base > 60.0,
            "to the right, below the line: {left} {base}"
        );
    }

    #[test]
    fn curves_break_where_nothing_was_measured() {
        let points = [
            (0.0, 1.0),
            (1.0, 2.0),
            (2.0, f64::NAN),
            (3.0, 1.0),
            (4.0, 2.0),
        ];
        let split = runs(&points, |(x, y)| y.is_finite().then_some((x, y)));
        assert_eq!(
            split,
            [vec![(0.0, 1.0), (1.0, 2.0)], vec![(3.0, 1.0), (4.0, 2.0)]]
        );
    }
}

//! Legend of line samples and names, in rows.

use super::{LEFT, ROW, Series};
use crate::drawing::{Anchor, Drawing};
use crate::style::{LINE, SMALL};
use crate::text;

/// Distributes the entries over rows of at most `width` [pt].
pub fn rows<'a>(series: &[&'a Series], width: f64) -> Vec<Vec<&'a Series>> {
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

/// Returns the width of an entry [pt].
fn entry_width(series: &Series) -> f64 {
    14.0 + 3.0 + text::width(series.name.as_deref().unwrap_or(""), SMALL) + 10.0
}

/// Draws the rows, the first at height `top` [pt].
pub fn draw(drawing: &mut Drawing, rows: &[Vec<&Series>], top: f64) {
    for (i, row) in rows.iter().enumerate() {
        let y = top + ROW * i as f64;
        let mut x = LEFT;
        for series in row {
            drawing.line(&[(x, y), (x + 14.0, y)], series.colour, LINE, series.dash);
            let name = series.name.as_deref().unwrap_or("");
            drawing.note((x + 17.0, y), Anchor::Start, name);
            x += entry_width(series);
        }
    }
}

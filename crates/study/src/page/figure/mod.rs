//! Figures of a study, each a drawing with its caption.

mod claims;
mod data;
mod factor_means;
mod factor_unit;
mod grains;
mod histories;
mod kissing_share;
mod kissing_time;
mod legend;
mod line_style;
mod misses;
mod overview;
mod panels;
mod setup;
mod snapshots;
mod trends;

use grainwake_plot::Figure;

pub use data::FigureData;

/// Draws all figures that the study has data for; omitted ones are added to `notes`.
pub fn all(data: &FigureData, notes: &mut Vec<String>) -> Vec<Figure> {
    let mut out = Vec::new();
    out.extend(grains::family(data, notes));
    out.extend(grains::orientations(data, notes));
    out.extend(setup::figure(data, notes));
    out.extend(snapshots::figures(data, notes));
    out.extend(kissing_time::by_model(data));
    out.extend(kissing_time::box_plot(data));
    out.extend(kissing_share::figure(data));
    out.extend(histories::figures(data, notes));
    out.extend(overview::figures(data));
    out.extend(trends::figure(data));
    out.extend(factor_means::figure(data));
    out.extend(claims::figure(data));
    if !numbered_as_in_paper(data) {
        renumber(&mut out);
    }
    out
}

/// Returns whether the study shows grains, orientations and set-up as the paper's first figures.
fn numbered_as_in_paper(data: &FigureData) -> bool {
    let request = &data.plan.analysis.figures;
    request.grains.is_some() && request.orientations.is_some() && request.setup.is_some()
}

/// Numbers the figures from 1, also in their file names.
fn renumber(figures: &mut [Figure]) {
    for (i, figure) in figures.iter_mut().enumerate() {
        figure.number = (i + 1).to_string();
        let numbered = figure.name.strip_prefix("fig").and_then(|rest| rest.split_once('-'));
        let numbered = numbered.filter(|(n, _)| n.starts_with(|c: char| c.is_ascii_digit()));
        let name = numbered.map_or(figure.name.as_str(), |(_, name)| name);
        figure.name = format!("fig{:02}-{name}", i + 1);
    }
}

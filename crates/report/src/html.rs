//! Elements of the HTML pages of runs and studies: skeleton, sections, notices, figures, tables.

use grainwake_plot::COLUMN;
use grainwake_plot::text::pieces;
use maud::{DOCTYPE, Markup, PreEscaped, html};

use crate::files::WrittenFigure;

/// Style sheet of all pages.
const STYLE: &str = include_str!("style.css");

/// Returns a page: one HTML file without scripts and external resources.
pub fn page(title: &str, lead: &Markup, content: &Markup, footer: &Markup) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (title) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                main {
                    header { h1 { (title) } p.lead { (lead) } }
                    (content)
                    footer { (footer) }
                }
            }
        }
    };
    page.into_string() + "\n"
}

/// Converts label markup to HTML.
pub fn label(text: &str) -> Markup {
    html! {
        @for piece in pieces(text) {
            @let text = html! { @if piece.italic { i { (piece.text) } } @else { (piece.text) } };
            @match piece.level {
                -1 => { sub { (text) } }
                1 => { sup { (text) } }
                _ => (text)
            }
        }
    }
}

/// Returns a section with its heading.
pub fn section(title: &str, body: &Markup) -> Markup {
    html! { section { h2 { (title) } (body) } }
}

/// Returns a highlighted notice.
pub fn notice(body: &Markup) -> Markup {
    html! { div.notice role="note" { (body) } }
}

/// Returns the notice about missing or omitted parts; empty if there are none.
pub fn omissions(notes: &[String]) -> Markup {
    html! {
        @if !notes.is_empty() {
            (notice(&html! {
                b { "Missing or left out" }
                ul { @for note in notes { li { (note) } } }
            }))
        }
    }
}

/// Returns all figures, with number, title, caption and links to the files.
pub fn figures(figures: &[WrittenFigure]) -> Markup {
    html! {
        div.figures {
            @for WrittenFigure { figure, svg, .. } in figures {
                @let class = (figure.drawing.width() <= COLUMN + 30.0).then_some("column");
                figure class=[class] id=(figure.name) {
                    div.paper { (PreEscaped(svg)) }
                    figcaption {
                        b {
                            @if !figure.number.is_empty() { "Figure " (figure.number) ". " }
                            (label(&figure.title)) "."
                        }
                        " " (label(&figure.caption)) " "
                        span {
                            "(" a href={ "figures/" (figure.name) ".png" } { "PNG" } ", "
                            a href={ "figures/" (figure.name) ".svg" } { "SVG" } ")"
                        }
                    }
                }
            }
        }
    }
}

/// Column of a table: heading and CSS class.
pub type Column = (Markup, Option<&'static str>);

/// Returns a column of text.
pub fn text_column(heading: &str) -> Column {
    (html! { (heading) }, None)
}

/// Returns a column of names, which are not wrapped.
pub fn name_column(heading: &str) -> Column {
    (html! { (heading) }, Some("name"))
}

/// Returns a column of numbers, aligned to the right; the heading is label markup.
pub fn number_column(heading: &str) -> Column {
    (label(heading), Some("number"))
}

/// Returns a table that scrolls if it is wider than the page.
pub fn table(columns: &[Column], rows: impl IntoIterator<Item = Vec<Markup>>) -> Markup {
    html! {
        div.scroll {
            table {
                thead { tr { @for (heading, class) in columns { th class=[class] { (heading) } } } }
                tbody {
                    @for row in rows {
                        tr {
                            @for ((_, class), cell) in columns.iter().zip(row) {
                                td class=[class] { (cell) }
                            }
                        }
                    }
                }
            }
        }
    }
}

/// Returns a table of names and values.
pub fn properties(rows: &[(Markup, Markup)]) -> Markup {
    html! {
        table {
            tbody { @for (name, value) in rows { tr { th scope="row" { (name) } td { (value) } } } }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_become_html() {
        assert_eq!(
            label("*v*_{z} < 10^{3}").into_string(),
            "<i>v</i><sub>z</sub> &lt; 10<sup>3</sup>"
        );
    }
}

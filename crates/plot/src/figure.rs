//! A figure: a drawing with its file name, title and caption.

use crate::drawing::Drawing;
use crate::text::plain;

/// A figure of a report.
#[derive(Clone, Debug)]
pub struct Figure {
    /// File name without extension.
    pub name: String,
    /// Number in the report, as in "4" or "14a"; empty for none.
    pub number: String,
    /// Title, in label markup.
    pub title: String,
    /// Caption, in label markup.
    pub caption: String,
    /// Drawing.
    pub drawing: Drawing,
}

impl Figure {
    /// Creates a figure without a number.
    pub fn new(
        name: impl Into<String>,
        title: impl Into<String>,
        caption: impl Into<String>,
        drawing: Drawing,
    ) -> Figure {
        Figure {
            name: name.into(),
            number: String::new(),
            title: title.into(),
            caption: caption.into(),
            drawing,
        }
    }

    /// Sets the number.
    #[must_use]
    pub fn numbered(mut self, number: impl ToString) -> Figure {
        self.number = number.to_string();
        self
    }

    /// Returns the SVG document, which can also be embedded in a page.
    pub fn svg(&self) -> String {
        let (title, caption) = (plain(&self.title), plain(&self.caption));
        self.drawing.to_svg(&self.name, &title, &caption)
    }
}

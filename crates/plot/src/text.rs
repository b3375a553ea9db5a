//! Labels in a small markup (`*italic*`, `_{sub}`, `^{sup}`), measured in the embedded font.

use std::sync::OnceLock;

use skrifa::instance::{LocationRef, Size};
use skrifa::metrics::GlyphMetrics;
use skrifa::{FontRef, MetadataProvider};

use crate::font;

/// Size of a sub- or superscript relative to the text.
const SMALL: f64 = 0.72;

/// A part of a label with one style.
#[derive(Clone, Debug, PartialEq)]
pub struct Piece {
    /// Characters.
    pub text: String,
    /// Whether the characters are italic.
    pub italic: bool,
    /// Subscript (-1), baseline (0) or superscript (+1).
    pub level: i8,
}

/// Splits a label by style; `\` escapes the next character.
pub fn pieces(label: &str) -> Vec<Piece> {
    let mut out: Vec<Piece> = Vec::new();
    let mut italic = false;
    let mut level = 0;
    let mut chars = label.chars().peekable();
    let mut push = |c: char, italic: bool, level: i8| match out.last_mut() {
        Some(last) if last.italic == italic && last.level == level => last.text.push(c),
        _ => out.push(Piece { text: c.to_string(), italic, level }),
    };
    while let Some(c) = chars.next() {
        match c {
            '\\' => {
                if let Some(next) = chars.next() {
                    push(next, italic, level);
                }
            }
            '*' => italic = !italic,
            '_' | '^' if level == 0 && chars.peek() == Some(&'{') => {
                chars.next();
                level = if c == '_' { -1 } else { 1 };
            }
            '}' if level != 0 => level = 0,
            _ => push(c, italic, level),
        }
    }
    out
}

/// Returns the label without markup, for titles and alternative texts.
pub fn plain(label: &str) -> String {
    pieces(label).into_iter().map(|piece| piece.text).collect()
}

/// Escapes the markup characters of arbitrary text, for use as a label.
pub fn literal(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        if matches!(c, '\\' | '*' | '_' | '^' | '}') {
            out.push('\\');
        }
        out.push(c);
    }
    out
}

/// Returns a name as a label of at most `most` [pt] at a text size [pt]. A long name lacks its
/// middle.
pub fn fitting(name: &str, size: f64, most: f64) -> String {
    let all: Vec<char> = name.chars().collect();
    let shortened = |kept: usize| {
        let head: String = all[..kept.div_ceil(2)].iter().collect();
        let tail: String = all[all.len() - kept / 2..].iter().collect();
        if kept == all.len() { literal(name) } else { literal(&format!("{head}…{tail}")) }
    };
    let mut labels = (0..=all.len()).rev().map(shortened);
    labels.find(|label| width(label, size) <= most).unwrap_or_default()
}

/// Returns the letter of the i-th panel of a figure: "(a)", "(b)" ...
pub fn letter(i: usize) -> String {
    format!("({})", char::from(b'a' + (i % 26) as u8))
}

/// Joins sentences on the panels of a figure, each after the letter of its panel. A single panel
/// has no letter.
pub fn lettered(sentences: &[String]) -> String {
    if let [one] = sentences {
        return one.clone();
    }
    let each = sentences.iter().enumerate().map(|(i, text)| format!("{} {text}", letter(i)));
    each.collect::<Vec<_>>().join(" ")
}

/// Escapes the five reserved characters of XML; removes control characters.
pub(crate) fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            c if c.is_control() && c != '\n' && c != '\t' => {}
            c => out.push(c),
        }
    }
    out
}

/// Converts a label to SVG `tspan` elements for text of `size` [pt].
pub fn spans(label: &str, size: f64) -> String {
    let mut out = String::new();
    let mut shift = 0.0;
    for piece in pieces(label) {
        let wanted = match piece.level {
            -1 => 0.22 * size,
            1 => -0.36 * size,
            _ => 0.0,
        };
        let mut attributes = String::new();
        if wanted != shift {
            attributes.push_str(&format!(" dy=\"{:.2}\"", wanted - shift));
            shift = wanted;
        }
        if piece.level != 0 {
            attributes.push_str(&format!(" font-size=\"{:.2}\"", SMALL * size));
        }
        if piece.italic {
            attributes.push_str(" font-style=\"italic\"");
        }
        let text = escape(&piece.text);
        if attributes.is_empty() {
            out.push_str(&text);
        } else {
            out.push_str(&format!("<tspan{attributes}>{text}</tspan>"));
        }
    }
    out
}

/// Returns the width of a label at font size `size` [pt].
pub fn width(label: &str, size: f64) -> f64 {
    static FONT: OnceLock<Option<FontRef<'static>>> = OnceLock::new();
    let font = FONT.get_or_init(|| FontRef::new(&font::REGULAR).ok());
    let Some(font) = font else {
        let count = |piece: &Piece| piece.text.chars().count() as f64;
        return 0.6 * size * pieces(label).iter().map(count).sum::<f64>();
    };
    let map = font.charmap();
    let metrics = GlyphMetrics::new(font, Size::new(1000.0), LocationRef::default());
    pieces(label)
        .iter()
        .map(|piece| {
            let scale = size / 1000.0 * if piece.level == 0 { 1.0 } else { SMALL };
            let advance =
                |c| map.map(c).and_then(|glyph| metrics.advance_width(glyph)).unwrap_or(600.0);
            let advances = piece.text.chars().map(|c| f64::from(advance(c)));
            scale * advances.sum::<f64>()
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markup_gives_scripts_and_italics() {
        let svg = spans("*v*_{z} / √(*d* *g*)", 10.0);
        assert!(svg.starts_with(
            "<tspan font-style=\"italic\">v</tspan><tspan dy=\"2.20\" font-size=\"7.20\">z</tspan>"
        ));
        assert!(svg.contains("dy=\"-2.20\""), "the line comes back up after a subscript: {svg}");
        assert_eq!(plain("*v*_{z} / √(*d* *g*)"), "vz / √(d g)");
    }

    #[test]
    fn names_from_files_stay_as_they_are() {
        assert_eq!(plain(&literal("max_{x}^{2} *a* \\")), "max_{x}^{2} *a* \\");
        assert_eq!(escape("<a & 'b'>\u{1}"), "&lt;a &amp; &#39;b&#39;&gt;");
    }

    #[test]
    fn long_names_lack_their_middle() {
        assert_eq!(fitting("g_01", 6.5, 60.0), "g\\_01");
        let label = fitting("sphere-number-12-of-a-long-name", 6.5, 60.0);
        assert!(label.starts_with("sphere-") && label.ends_with("-name"), "{label}");
        assert!(label.contains('…') && width(&label, 6.5) <= 60.0);
        assert_eq!(fitting("g", 6.5, 0.0), "");
    }

    #[test]
    fn widths_follow_the_font() {
        let narrow = width("iiii", 10.0);
        let wide = width("MMMM", 10.0);
        assert!(narrow < 0.4 * wide, "{narrow} against {wide}");
        assert!((width("MM", 20.0) - wide).abs() < 1e-9);
        assert!(width("a_{bcd}", 10.0) < width("abcd", 10.0));
    }
}

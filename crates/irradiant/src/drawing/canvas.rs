//! Marks on a sheet, and the sheet as SVG: one file that carries its pictures and needs no other.

use irradiant_image::{FileFormat, Image, ImageError};
use std::fmt::Write;

/// Left, top, width, height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Area {
    /// Left edge.
    pub x: f32,
    /// Upper edge.
    pub y: f32,
    /// Width.
    pub width: f32,
    /// Height.
    pub height: f32,
}

/// How a line looks.
#[derive(Clone, Copy, Debug)]
pub struct Stroke<'a> {
    /// As `#rrggbb`.
    pub color: &'a str,
    /// Pixels.
    pub width: f32,
    /// In [0, 1].
    pub opacity: f32,
    /// Lengths of strokes and gaps; empty for a whole line.
    pub dash: &'a str,
}

/// How a text looks.
#[derive(Clone, Copy, Debug)]
pub struct Type<'a> {
    /// Height of a line's letters, pixels.
    pub size: f32,
    /// As `#rrggbb`.
    pub color: &'a str,
    /// Digits below each other.
    pub monospaced: bool,
    /// For headings.
    pub bold: bool,
}

/// A sheet under way. Later marks cover earlier ones.
#[derive(Debug, Default)]
pub struct Canvas {
    body: String,
    clips: usize,
}

impl Canvas {
    /// A box with round corners.
    pub fn panel(&mut self, at: Area, fill: &str, edge: &str, radius: f32) {
        let Area { x, y, width, height } = at;
        let _ = writeln!(
            self.body,
            "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" rx=\"{radius}\" fill=\"{fill}\" stroke=\"{edge}\"/>"
        );
    }

    /// A picture, scaled to fill the area.
    pub fn picture(&mut self, at: Area, image: &Image) -> Result<(), ImageError> {
        let png = irradiant_image::write(image, FileFormat::Png)?;
        let Area { x, y, width, height } = at;
        let _ = writeln!(
            self.body,
            "<image x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" preserveAspectRatio=\"none\" href=\"data:image/png;base64,{}\"/>",
            base64(&png)
        );
        Ok(())
    }

    /// What `draw` draws, as far as it lies in the area.
    pub fn clipped(&mut self, at: Area, draw: impl FnOnce(&mut Self)) {
        let id = self.clips;
        self.clips += 1;
        let Area { x, y, width, height } = at;
        let _ = writeln!(
            self.body,
            "<clipPath id=\"clip{id}\"><rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" rx=\"6\"/></clipPath>\n<g clip-path=\"url(#clip{id})\">"
        );
        draw(self);
        self.body += "</g>\n";
    }

    /// A line through points.
    pub fn line(&mut self, points: &[[f32; 2]], stroke: Stroke) {
        if points.len() < 2 {
            return;
        }
        self.body += "<polyline points=\"";
        for [x, y] in points {
            let _ = write!(self.body, "{x:.1},{y:.1} ");
        }
        let Stroke { color, width, opacity, dash } = stroke;
        let _ = write!(self.body, "\" fill=\"none\" stroke=\"{color}\" stroke-width=\"{width}\"");
        let _ =
            write!(self.body, " stroke-opacity=\"{opacity:.2}\" stroke-linecap=\"round\" stroke-linejoin=\"round\"");
        if !dash.is_empty() {
            let _ = write!(self.body, " stroke-dasharray=\"{dash}\"");
        }
        self.body += "/>\n";
    }

    /// A disc with a rim.
    pub fn disc(&mut self, center: [f32; 2], radius: f32, fill: &str, rim: Stroke) {
        let [x, y] = center;
        let Stroke { color, width, opacity, .. } = rim;
        let _ = writeln!(
            self.body,
            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius}\" fill=\"{fill}\" stroke=\"{color}\" stroke-width=\"{width}\" stroke-opacity=\"{opacity:.2}\"/>"
        );
    }

    /// A text whose first letter stands at a place; with a dark rim, readable on anything.
    pub fn text(&mut self, at: [f32; 2], text: &str, look: Type) {
        let [x, y] = at;
        let family = if look.monospaced {
            "ui-monospace, 'DejaVu Sans Mono', Menlo, Consolas, monospace"
        } else {
            "system-ui, 'DejaVu Sans', Helvetica, Arial, sans-serif"
        };
        let weight = if look.bold { 600 } else { 400 };
        let Type { size, color, .. } = look;
        let _ = write!(
            self.body,
            "<text x=\"{x:.1}\" y=\"{y:.1}\" font-family=\"{family}\" font-size=\"{size}\" font-weight=\"{weight}\" fill=\"{color}\" stroke=\"#0f1115\" stroke-width=\"2.5\" stroke-opacity=\"0.7\" paint-order=\"stroke\" xml:space=\"preserve\">"
        );
        for c in text.chars() {
            match c {
                '<' => self.body += "&lt;",
                '>' => self.body += "&gt;",
                '&' => self.body += "&amp;",
                c if c.is_control() => self.body.push(' '),
                c => self.body.push(c),
            }
        }
        self.body += "</text>\n";
    }

    /// The sheet as a file.
    pub fn svg(&self, width: f32, height: f32, background: &str) -> String {
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.0}\" height=\"{height:.0}\" viewBox=\"0 0 {width:.0} {height:.0}\">\n<rect width=\"100%\" height=\"100%\" fill=\"{background}\"/>\n{}</svg>\n",
            self.body
        )
    }
}

/// RFC 4648, with padding.
pub fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let word = chunk.iter().fold(0u32, |word, &b| word << 8 | u32::from(b)) << (8 * (3 - chunk.len()));
        for i in 0..4 {
            let letter = LETTERS[(word >> (18 - 6 * i) & 63) as usize];
            text.push(if i <= chunk.len() { letter as char } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_is_that_of_the_rfc() {
        for (bytes, text) in
            [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foob", "Zm9vYg=="), ("foobar", "Zm9vYmFy")]
        {
            assert_eq!(base64(bytes.as_bytes()), text);
        }
    }

    #[test]
    fn names_with_angle_brackets_are_text() {
        let mut canvas = Canvas::default();
        canvas.text([0.0, 0.0], "<b>&", Type { size: 10.0, color: "#fff", monospaced: false, bold: false });
        assert!(canvas.svg(1.0, 1.0, "#000").contains("&lt;b&gt;&amp;</text>"));
    }
}

//! A canvas as the text of an SVG file.

use std::fmt::Write as _;

use super::canvas::{Anchor, Canvas, CanvasPoint, CanvasShape, TextStyle, VerticalAlignment, fine};
use super::color::Color;
use super::symbols::runs;

impl Canvas {
    /// Returns the figure as an SVG file. Texts are `<text>` elements with subscripts as `<tspan>`.
    /// Without `xml:space`, librsvg and Inkscape drop the spaces beside `<tspan>`.
    #[must_use]
    pub fn svg(&self) -> String {
        let (width, height) = self.size();
        let on_page = |pixels: i32| match self.format().pixel_mm() {
            Some(pixel_mm) => format!("{}mm", (f64::from(pixels) * pixel_mm * 1e3).round() / 1e3),
            None => pixels.to_string(),
        };
        // The view box has the coordinates; the size is that on a page.
        let mut svg = format!(
            "<svg width=\"{}\" height=\"{}\" viewBox=\"0 0 {} {}\" xmlns=\"http://www.w3.org/2000/svg\" xml:space=\"preserve\">\n",
            on_page(width),
            on_page(height),
            fine(width),
            fine(height)
        );
        let families = self.format().families();
        for shape in self.shapes() {
            write_shape(&mut svg, shape, &families).expect("memory takes what is written to it");
        }
        svg + "</svg>\n\n"
    }
}

impl std::fmt::Display for Color {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "#{:02X}{:02X}{:02X}", self.0, self.1, self.2)
    }
}

fn write_shape(svg: &mut String, shape: &CanvasShape, families: &str) -> std::fmt::Result {
    match shape {
        CanvasShape::Rectangle {
            corners: [(x, y), (right, bottom)],
            fill,
        } => {
            let (width, height) = (right - x, bottom - y);
            writeln!(
                svg,
                "<rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" opacity=\"1\" fill=\"{fill}\" \
                 stroke=\"none\"/>"
            )
        }
        CanvasShape::Polygon {
            points,
            fill,
            opacity,
        } => {
            write!(svg, "<polygon opacity=\"{opacity}\" fill=\"{fill}\"")?;
            write_points(svg, points)
        }
        CanvasShape::Line { points, stroke } => {
            let (color, width) = (stroke.color, stroke.width);
            write!(
                svg,
                "<polyline fill=\"none\" opacity=\"1\" stroke=\"{color}\" stroke-width=\"{width}\""
            )?;
            write_points(svg, points)
        }
        CanvasShape::Text { text, style, at } => write_text(svg, text, *style, *at, families),
    }
}

fn write_points(svg: &mut String, points: &[CanvasPoint]) -> std::fmt::Result {
    svg.push_str(" points=\"");
    for (x, y) in points {
        write!(svg, "{x},{y} ")?;
    }
    svg.push_str("\"/>\n");
    Ok(())
}

fn write_text(
    svg: &mut String,
    text: &str,
    style: TextStyle,
    (x, y): CanvasPoint,
    families: &str,
) -> std::fmt::Result {
    let TextStyle {
        size,
        color,
        anchor,
        level,
        upwards,
    } = style;
    let dy = match level {
        VerticalAlignment::Top => "0.76em",
        VerticalAlignment::Middle => "0.5ex",
    };
    let anchor = match anchor {
        Anchor::Start => "start",
        Anchor::Middle => "middle",
        Anchor::End => "end",
    };
    write!(
        svg,
        "<text x=\"{x}\" y=\"{y}\" dy=\"{dy}\" text-anchor=\"{anchor}\" font-family=\"{families}\" \
         font-size=\"{}\" opacity=\"1\" fill=\"{color}\"",
        written_size(size)
    )?;
    if upwards {
        write!(svg, " transform=\"rotate(270, {x}, {y})\"")?;
    }
    svg.push('>');
    // Distance of the last run below the baseline of the text.
    let mut below = 0;
    for run in runs(text) {
        let (drop, escaped) = (run.drop(size), escaped(run.text));
        if run.is_subscript {
            write!(
                svg,
                "<tspan dy=\"{}\" font-size=\"{}\">{escaped}</tspan>",
                drop - below,
                run.size(size)
            )?;
        } else if drop != below {
            write!(svg, "<tspan dy=\"{}\">{escaped}</tspan>", drop - below)?;
        } else {
            svg.push_str(&escaped);
        }
        below = drop;
    }
    svg.push_str("</text>\n");
    Ok(())
}

/// Returns a font size as files state it. Earlier versions rounded 120 to 120.00000000000001. This
/// detour keeps the bytes of a figure with unchanged text.
fn written_size(size: i32) -> f64 {
    f64::from(size) * 1.24 / 1.24
}

/// Escapes text for XML.
fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '&' => escaped.push_str("&amp;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&apos;"),
            other => escaped.push(other),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::super::canvas::text;
    use super::super::color::INK;
    use super::super::format::Format;
    use super::*;

    /// Returns the element of a text in an SVG file.
    fn written(words: &str) -> String {
        let mut canvas = Canvas::on(&Format::default(), (10, 10));
        canvas.text(words, text(11, INK).left().upwards(), (3, 4));
        canvas.svg().lines().nth(2).unwrap_or_default().to_owned()
    }

    #[test]
    fn text_stays_text_with_subscripts_below_the_baseline() {
        let start = "<text x=\"3\" y=\"4\" dy=\"0.5ex\" text-anchor=\"end\" font-family=\"Helvetica, Arial, sans-serif\" \
                     font-size=\"110\" opacity=\"1\" fill=\"#282C34\" transform=\"rotate(270, 3, 4)\">";
        let subscript = |text: &str| format!("<tspan dy=\"22\" font-size=\"77\">{text}</tspan>");
        let cases = [
            ("plain", "plain".to_owned()),
            ("a < b & 'c'", "a &lt; b &amp; &apos;c&apos;".to_owned()),
            ("F_n,w", format!("F{}", subscript("n,w"))),
            (
                "ε_tc of a_e",
                format!(
                    "ε{}<tspan dy=\"-22\"> of a</tspan>{}",
                    subscript("tc"),
                    subscript("e")
                ),
            ),
        ];
        for (words, expected) in cases {
            assert_eq!(written(words), format!("{start}{expected}</text>"));
        }
    }
}

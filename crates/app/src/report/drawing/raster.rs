//! A canvas as a PNG file.

use png::{BitDepth, ColorType, Compression, Encoder, Filter, Info, PixelDimensions, Unit};
use tiny_skia::{FillRule, LineCap, Paint, Path, PathBuilder, Pixmap, Rect, Transform};

use super::canvas::{Anchor, Canvas, CanvasPoint, CanvasShape, FINE, TextStyle, VerticalAlignment};
use super::color::Color;
use super::font;

/// Pixels of the bitmap per pixel of the figure: about 200 dpi.
const SCALE: f32 = 2.0;

impl Canvas {
    /// Returns the figure as a PNG file: with twice the width and the height of the SVG file in
    /// pixels, or 600 pixels per inch on paper. The font is Liberation Sans for every format.
    ///
    /// # Panics
    /// If the figure has no pixels, or more than fit into memory.
    #[must_use]
    pub fn png(&self) -> Vec<u8> {
        let (width, height) = self.size();
        let on_paper = self.format().resolution();
        let scale = on_paper.map_or(SCALE, |(scale, _)| scale as f32);
        let [width, height] = [width, height].map(|pixels| (pixels as f32 * scale).round() as u32);
        let mut pixels =
            Pixmap::new(width, height).expect("a figure has pixels, and they fit into memory");
        let to_pixels = Transform::from_scale(scale / FINE as f32, scale / FINE as f32);
        for shape in self.shapes() {
            draw(&mut pixels, shape, to_pixels);
        }
        let mut info = Info::with_size(width, height);
        info.color_type = ColorType::Rgb;
        info.bit_depth = BitDepth::Eight;
        info.pixel_dims = on_paper.map(|(_, per_metre)| PixelDimensions {
            xppu: per_metre,
            yppu: per_metre,
            unit: Unit::Meter,
        });
        // Pixels are opaque. A plain loop: tests run it unoptimised, where `flat_map` is slow.
        let (pixels, _) = pixels.data().as_chunks();
        let mut colors = vec![[0; 3]; pixels.len()];
        for (color, [red, green, blue, _]) in colors.iter_mut().zip(pixels) {
            *color = [*red, *green, *blue];
        }
        let mut file = Vec::new();
        let written = Encoder::with_info(&mut file, info).and_then(|mut encoder| {
            encoder.set_compression(Compression::Fast);
            // Trying all filters on each line takes longer and saves 2 % of the file.
            encoder.set_filter(Filter::Paeth);
            encoder
                .write_header()?
                .write_image_data(colors.as_flattened())
        });
        written.expect("the pixels are those of the size, and memory takes them");
        file
    }
}

fn paint(Color(red, green, blue): Color, opacity: f64) -> Paint<'static> {
    let mut color = tiny_skia::Color::from_rgba8(red, green, blue, u8::MAX);
    color.set_alpha(opacity as f32);
    let mut paint = Paint::default();
    paint.set_color(color);
    paint
}

/// Draws a shape; `scale` converts its coordinates to pixels of the bitmap.
fn draw(pixels: &mut Pixmap, shape: &CanvasShape, scale: Transform) {
    let mut fill = |path: Option<Path>, paint: &Paint<'_>, transform| {
        // For example, a text of spaces has no path.
        if let Some(path) = path {
            pixels.fill_path(&path, paint, FillRule::Winding, transform, None);
        }
    };
    match shape {
        CanvasShape::Rectangle {
            corners: [(left, top), (right, bottom)],
            fill: color,
        } => {
            let [left, top, right, bottom] =
                [left, top, right, bottom].map(|&coordinate| coordinate as f32);
            // In pixels of the bitmap. As paths, rectangles take eight times as long.
            if let Some(area) =
                Rect::from_ltrb(left, top, right, bottom).and_then(|area| area.transform(scale))
            {
                pixels.fill_rect(area, &paint(*color, 1.0), Transform::identity(), None);
            }
        }
        CanvasShape::Polygon {
            points,
            fill: color,
            opacity,
        } => fill(polyline(points, true), &paint(*color, *opacity), scale),
        CanvasShape::Line { points, stroke } => {
            let look = tiny_skia::Stroke {
                width: stroke.width as f32,
                line_cap: LineCap::Butt,
                ..Default::default()
            };
            if let Some(path) = polyline(points, false) {
                pixels.stroke_path(&path, &paint(stroke.color, 1.0), &look, scale, None);
            }
        }
        CanvasShape::Text { text, style, at } => {
            let (path, turn) = outline(text, style, *at);
            fill(path, &paint(style.color, 1.0), scale.pre_concat(turn));
        }
    }
}

/// Returns a path of straight lines through points.
fn polyline(points: &[CanvasPoint], closed: bool) -> Option<Path> {
    let mut path = PathBuilder::new();
    for (index, &(x, y)) in points.iter().enumerate() {
        let (x, y) = (x as f32, y as f32);
        if index == 0 {
            path.move_to(x, y)
        } else {
            path.line_to(x, y)
        }
    }
    if closed {
        path.close();
    }
    path.finish()
}

/// Returns the start of the baseline of a text before rotation.
pub(super) fn start(text: &str, style: &TextStyle, (x, y): CanvasPoint) -> (f32, f32) {
    let (x, y) = (x as f32, y as f32);
    let size = style.size as f32;
    let start = match style.anchor {
        Anchor::Start => x,
        Anchor::Middle => x - font::length(text, style.size) / 2.0,
        Anchor::End => x - font::length(text, style.size),
    };
    // Equals `dy` in the SVG file, with an x-height of half the font size.
    let baseline = match style.level {
        VerticalAlignment::Top => y + 0.76 * size,
        VerticalAlignment::Middle => y + 0.25 * size,
    };
    (start, baseline)
}

/// Returns the outlines of a text before rotation, and the rotation.
fn outline(text: &str, style: &TextStyle, at: CanvasPoint) -> (Option<Path>, Transform) {
    let mut path = PathBuilder::new();
    font::outline(&mut path, text, style.size, start(text, style, at));
    let (x, y) = (at.0 as f32, at.1 as f32);
    let turn = if style.upwards {
        Transform::from_rotate_at(270.0, x, y)
    } else {
        Transform::identity()
    };
    (path.finish(), turn)
}

#[cfg(test)]
mod tests {
    use super::super::canvas::text;
    use super::super::color::INK;
    use super::super::format::Format;
    use super::*;

    /// Returns a figure of one word.
    fn figure(word: &str) -> Vec<u8> {
        let mut canvas = Canvas::on(&Format::default(), (60, 20));
        canvas.text(word, text(12, INK), (0, 0));
        canvas.png()
    }

    #[test]
    fn bitmaps_have_twice_the_pixels_and_the_same_bytes() {
        let bytes = figure("F_n");
        assert_eq!(bytes[..8], *b"\x89PNG\r\n\x1a\n");
        assert_eq!(
            [&bytes[16..20], &bytes[20..24]],
            [&120_u32.to_be_bytes()[..], &40_u32.to_be_bytes()[..]]
        );
        assert_eq!(bytes, figure("F_n"));
    }

    #[test]
    fn a_subscript_is_not_on_the_baseline() {
        assert_ne!(figure("F_n"), figure("Fn"));
    }
}

//! What the examples that draw share: text and strokes of one look, axes, and the file.

use std::error::Error;
use std::fs;
use std::ops::Range;

use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{FontTransform, ShapeStyle};

/// Coordinates in the file are whole numbers: this many of them make a pixel, so that curves are smooth.
const FINE: i32 = 10;

pub const INK: RGBColor = RGBColor(40, 44, 52);
pub const GREY: RGBColor = RGBColor(100, 104, 110);
pub const FAINT: RGBColor = RGBColor(150, 154, 160);
/// Blue and vermilion of Okabe and Ito, told apart by all readers.
pub const BLUE: RGBColor = RGBColor(0, 114, 178);
pub const VERMILION: RGBColor = RGBColor(213, 94, 0);

pub type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
pub type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;
pub type Result<T> = std::result::Result<T, Box<dyn Error>>;

/// Writes what `draw` draws, `width` by `height` pixels, to the file `path`.
pub fn write_svg(path: &str, (width, height): (i32, i32), draw: impl FnOnce(&Area<'_>) -> Result<()>) -> Result<()> {
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, (fine(width) as u32, fine(height) as u32)).into_drawing_area();
        root.fill(&WHITE)?;
        draw(&root)?;
        root.present()?;
    }
    // The size on a page; the view box keeps the fine coordinates.
    let [fine_size, size] =
        [FINE, 1].map(|factor| format!("<svg width=\"{}\" height=\"{}\"", width * factor, height * factor));
    fs::write(path, svg.replacen(&fine_size, &size, 1) + "\n")?;
    eprintln!("wrote {path}");
    Ok(())
}

/// Pixels in coordinates of the file.
pub fn fine(pixels: i32) -> i32 {
    pixels * FINE
}

pub fn text(size: i32, color: RGBColor) -> TextStyle<'static> {
    // The backend writes a font size of 1/1.24 of what it is given.
    let size = f64::from(fine(size)) * 1.24;
    let color = color.to_backend_color();
    TextStyle { color, ..TextStyle::from(("Helvetica, Arial, sans-serif", size).into_font()) }
}

pub fn centred(style: TextStyle<'static>) -> TextStyle<'static> {
    style.pos(Pos::new(HPos::Center, VPos::Center))
}

/// Text that starts at its place.
pub fn right_of(style: TextStyle<'static>) -> TextStyle<'static> {
    style.pos(Pos::new(HPos::Left, VPos::Center))
}

/// A line of a width in tenths of a pixel.
pub fn stroke(color: RGBColor, tenths: i32) -> ShapeStyle {
    color.stroke_width((fine(tenths) / 10) as u32)
}

/// An empty chart in the part of `area` (pixels) that the margins leave.
pub fn chart<'a, 'b>(
    area: &'a Area<'b>,
    title: &str,
    [left, right, top, bottom]: [i32; 4],
    x: Range<f64>,
    y: Range<f64>,
) -> Result<Chart<'a, 'b>> {
    area.draw_text(title, &text(14, INK), (fine(left), fine(14)))?;
    let chart = ChartBuilder::on(area)
        .margin_top(fine(top))
        .margin_right(fine(right))
        .set_label_area_size(LabelAreaPosition::Left, fine(left))
        .set_label_area_size(LabelAreaPosition::Bottom, fine(bottom))
        .build_cartesian_2d(x, y)?;
    Ok(chart)
}

/// Where a point of a chart lies in its area.
pub fn pixels(area: &Area<'_>, chart: &Chart<'_, '_>) -> impl Fn((f64, f64)) -> (i32, i32) {
    let (across, down) = area.get_pixel_range();
    move |at| {
        let (x, y) = chart.backend_coord(&at);
        (x - across.start, y - down.start)
    }
}

/// Marks `values` on an axis with the labels that `label` makes, at the pixels that `at` gives, and writes its name.
pub fn axis(
    area: &Area<'_>,
    name: (&str, (i32, i32)),
    values: &[f64],
    label: impl Fn(f64) -> String,
    vertical: bool,
    at: impl Fn(f64) -> (i32, i32),
) -> Result<()> {
    for &value in values {
        let (x, y) = at(value);
        let mark = if vertical { (x - fine(4), y) } else { (x, y + fine(4)) };
        area.draw(&PathElement::new([(x, y), mark], stroke(INK, 10)))?;
        let (style, at) = if vertical {
            (text(11, INK).pos(Pos::new(HPos::Right, VPos::Center)), (x - fine(7), y))
        } else {
            (text(11, INK).pos(Pos::new(HPos::Center, VPos::Top)), (x, y + fine(7)))
        };
        area.draw_text(&label(value), &style, at)?;
    }
    let (name, at) = name;
    let style = centred(text(12, INK));
    let style = if vertical { style.transform(FontTransform::Rotate270) } else { style };
    area.draw_text(name, &style, (fine(at.0), fine(at.1)))?;
    Ok(())
}

/// A whole number, as a label.
pub fn whole(value: f64) -> String {
    format!("{value:.0}").replace('-', "−")
}

//! Pictures of one look: text, strokes, markers and axes in, SVG as text out.
//!
//! Drawings are made with [`plotters`]; what is here places its elements to the tenth of a pixel.

pub mod diagram;
pub mod map;
pub mod pens;
pub mod raster;
pub mod scale;

use std::error::Error;
use std::f64::consts::TAU;
use std::ops::Range;

use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{FontTransform, ShapeStyle};

/// Coordinates in the file are whole numbers: this many of them make a pixel, so that curves are smooth.
const FINE: i32 = 10;

/// Text, and what is as strong as text.
pub const INK: RGBColor = RGBColor(40, 44, 52);
/// Text and lines that stand behind others.
pub const GREY: RGBColor = RGBColor(100, 104, 110);
/// Lines that only help.
pub const FAINT: RGBColor = RGBColor(150, 154, 160);
/// Lines of a grid.
pub const GRID: RGBColor = RGBColor(228, 230, 233);
/// Blue of Okabe and Ito, whose colours all readers tell apart.
pub const BLUE: RGBColor = RGBColor(0, 114, 178);
/// Vermilion of Okabe and Ito.
pub const VERMILION: RGBColor = RGBColor(213, 94, 0);

/// A picture or a part of it, in coordinates of the file ([`fine`]).
pub type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
/// A part of a picture with coordinates of its own.
pub type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;
/// What drawing gives, or why it could not.
pub type Result<T> = std::result::Result<T, Box<dyn Error>>;

/// What `draw` draws, `width` by `height` pixels on white, as the text of an SVG file.
pub fn svg((width, height): (i32, i32), draw: impl FnOnce(&Area<'_>) -> Result<()>) -> Result<String> {
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
    Ok(svg.replacen(&fine_size, &size, 1) + "\n")
}

/// Pixels in coordinates of the file.
pub fn fine(pixels: i32) -> i32 {
    pixels * FINE
}

/// The look of text of a size in pixels.
pub fn text(size: i32, color: RGBColor) -> TextStyle<'static> {
    // The backend writes a font size of 1/1.24 of what it is given.
    let size = f64::from(fine(size)) * 1.24;
    let color = color.to_backend_color();
    TextStyle { color, ..TextStyle::from(("Helvetica, Arial, sans-serif", size).into_font()) }
}

/// Text about its place.
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

/// Values of an axis with the labels that `label` makes.
pub fn labelled(values: impl IntoIterator<Item = f64>, label: impl Fn(f64) -> String) -> Vec<(f64, String)> {
    values.into_iter().map(|value| (value, label(value))).collect()
}

/// Marks `ticks`, values and their labels, at the pixels that `at` gives, and writes the axis' name at its place (pixels).
pub fn axis(
    area: &Area<'_>,
    name: (&str, (i32, i32)),
    ticks: &[(f64, String)],
    vertical: bool,
    at: impl Fn(f64) -> (i32, i32),
) -> Result<()> {
    for (value, label) in ticks {
        let (x, y) = at(*value);
        let mark = if vertical { (x - fine(4), y) } else { (x, y + fine(4)) };
        area.draw(&PathElement::new([(x, y), mark], stroke(INK, 10)))?;
        let (style, at) = if vertical {
            (text(11, INK).pos(Pos::new(HPos::Right, VPos::Center)), (x - fine(7), y))
        } else {
            (text(11, INK).pos(Pos::new(HPos::Center, VPos::Top)), (x, y + fine(7)))
        };
        area.draw_text(label, &style, at)?;
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

/// `10ⁿ`, as a label.
pub fn power_of_ten(exponent: f64) -> String {
    const RAISED: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let raised = |character: char| character.to_digit(10).map_or('⁻', |digit| RAISED[digit as usize]);
    format!("10{}", format!("{exponent:.0}").chars().map(raised).collect::<String>())
}

/// How the points of a curve are marked: by regular polygons.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Marker {
    /// Number of corners; many make a circle.
    pub corners: u32,
    /// Angle in rad from one to the right to a corner.
    pub turn: f64,
    /// Distance of the corners from the centre in pixels.
    pub radius: i32,
}

/// How a curve is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pen {
    /// Of line and markers.
    pub color: RGBColor,
    /// Width of line and outlines in tenths of a pixel.
    pub tenths: i32,
    /// Lengths of dashes and gaps in pixels; with a gap of zero the line is whole.
    pub dash: (i32, i32),
    /// Of its points.
    pub marker: Marker,
}

impl Pen {
    /// Joins points of the area.
    pub fn line(&self, area: &Area<'_>, points: &[(i32, i32)]) -> Result<()> {
        let (dash, gap) = self.dash;
        let style = stroke(self.color, self.tenths);
        if gap == 0 {
            area.draw(&PathElement::new(points, style))?;
        } else {
            area.draw(&DashedPathElement::new(points.to_vec(), fine(dash), fine(gap), style))?;
        }
        Ok(())
    }

    /// Marks points of the area; the markers are filled with white, so that they hide the line.
    pub fn markers(&self, area: &Area<'_>, points: &[(i32, i32)]) -> Result<()> {
        let Marker { corners, turn, radius } = self.marker;
        for &(x, y) in points {
            let corner = |k: u32| {
                let (sine, cosine) = (turn + TAU * f64::from(k) / f64::from(corners)).sin_cos();
                let radius = f64::from(fine(radius));
                (x + (radius * cosine).round() as i32, y + (radius * sine).round() as i32)
            };
            // Once more over the first corner, so that the outline is closed there.
            let outline: Vec<_> = (0..=corners + 1).map(corner).collect();
            area.draw(&Polygon::new(&outline[..=corners as usize], WHITE.filled()))?;
            area.draw(&PathElement::new(outline, stroke(self.color, self.tenths)))?;
        }
        Ok(())
    }
}

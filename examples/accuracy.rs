//! Draws how accurate the metrics are: their errors over the solver's tolerance, against CVODES.
//!
//! ```text
//! cargo run --release --example accuracy                # docs/accuracy.svg
//! cargo run --release --example accuracy -- other.svg
//! ```
//!
//! It prints the errors too, as a table.

#[allow(dead_code, reason = "the tests use more of it")]
#[path = "../tests/common/accuracy.rs"]
mod accuracy;
#[allow(dead_code, reason = "each example uses a part")]
mod common;

use std::f64::consts::TAU;

use accuracy::{ReferenceContact, SYMBOLS, worse};
use bristle::document::Document;
use bristle::simulation::simulate;
use common::{
    Area, BLUE, FAINT, GREY, INK, Result, VERMILION, axis, chart, fine, pixels, right_of, stroke, text, write_svg,
};
use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// Size of the picture in pixels.
const SIZE: (i32, i32) = (680, 430);
/// Tolerances are powers of ten between these, and errors are shown between those.
const EXPONENTS: (i32, i32) = (-8, -3);
const ERROR_EXPONENTS: (i32, i32) = (-11, -2);

/// Errors below this power of ten are no longer known.
const REFERENCE_EXPONENT: f64 = -9.0;

const UNKNOWN: RGBColor = RGBColor(238, 239, 241);
const GRID: RGBColor = RGBColor(228, 230, 233);
const GREEN: RGBColor = RGBColor(0, 120, 90);

/// A curve: the worst of a few metrics of [`SYMBOLS`], and how it looks.
struct Curve {
    metrics: &'static [&'static str],
    name: &'static str,
    color: RGBColor,
    /// Lengths of dashes and gaps in pixels; a gap of zero is a line.
    dash: (i32, i32),
    /// The marker is a regular polygon, with a corner to the right if turned by zero.
    corners: u32,
    turn: f64,
}

impl Curve {
    /// The largest error of the curve's metrics.
    fn value(&self, errors: &[f64; 6]) -> f64 {
        let index = |symbol| SYMBOLS.iter().position(|other| other == symbol).expect("the metric is measured");
        self.metrics.iter().map(|symbol| errors[index(symbol)]).fold(0.0, f64::max)
    }
}

/// The curves, and in the legend, from top to bottom.
const CURVES: [Curve; 4] = [
    Curve {
        metrics: &["t_c", "ε_tc"],
        name: "contact time t_c, its ratio ε_tc",
        color: VERMILION,
        dash: (1, 0),
        corners: 4,
        turn: 0.0,
    },
    Curve {
        metrics: &["s_n,max"],
        name: "tip deflection s_n,max",
        color: GREEN,
        dash: (6, 3),
        corners: 4,
        turn: TAU / 8.0,
    },
    Curve {
        metrics: &["p_n", "F_n,w"],
        name: "impulse p_n, tool force F_n,w",
        color: BLUE,
        dash: (1, 0),
        corners: 32,
        turn: 0.0,
    },
    Curve { metrics: &["max F_n"], name: "peak force", color: INK, dash: (2, 3), corners: 3, turn: TAU / 4.0 },
];

fn main() -> Result<()> {
    let path = std::env::args().nth(1).unwrap_or_else(|| "docs/accuracy.svg".into());
    let errors = (EXPONENTS.0..=EXPONENTS.1)
        .map(|exponent| Ok((exponent, worst_errors(10_f64.powi(exponent))?)))
        .collect::<Result<Vec<_>>>()?;
    println!("tolerance {}", SYMBOLS.map(|symbol| format!("{symbol:>9}")).join(""));
    for (exponent, errors) in errors.iter().rev() {
        println!("1e{exponent:<7} {}", errors.map(|error| format!("{error:>9.1e}")).join(""));
    }
    write_svg(&path, SIZE, |area| draw(area, &errors))
}

/// The largest relative errors of the reference's contacts at a relative tolerance of the solver.
fn worst_errors(tolerance: f64) -> Result<[f64; 6]> {
    let mut settings = Document::parse(include_str!("zirconia.toml"), "examples/zirconia.toml")?.settings()?;
    settings.solver.relative_tolerance = tolerance;
    let mut worst = [0.0; 6];
    for contact in ReferenceContact::read(include_str!("../tests/data/reference_contacts_cvodes.csv")) {
        let process = &mut settings.process;
        (process.brushing_velocity_m_s, process.penetration_depth_m) = contact.case();
        worst = worse(worst, contact.errors(&simulate(&settings)?.metrics));
    }
    Ok(worst)
}

fn draw(area: &Area<'_>, errors: &[(i32, [f64; 6])]) -> Result<()> {
    let margins @ [left, right, top, bottom] = [70, 24, 40, 50];
    let (width, height) = (SIZE.0 - left - right, SIZE.1 - top - bottom);
    let [tolerances, values] = [EXPONENTS, ERROR_EXPONENTS].map(|(low, high)| f64::from(low)..f64::from(high));
    let (x, y) = (tolerances.start - 0.25..tolerances.end + 0.25, values);
    let mut chart =
        chart(area, "Largest errors of the metrics in six contacts, against CVODES", margins, x.clone(), y.clone())?;

    for exponent in ERROR_EXPONENTS.0..=ERROR_EXPONENTS.1 {
        let level = f64::from(exponent);
        chart.draw_series([PathElement::new([(x.start, level), (x.end, level)], stroke(GRID, 8))])?;
    }
    let unknown = Rectangle::new([(x.start, y.start), (x.end, REFERENCE_EXPONENT)], UNKNOWN.filled());
    chart.draw_series([unknown])?;
    let label = "errors of the reference itself";
    let at = (x.end - 0.1, (y.start + REFERENCE_EXPONENT) / 2.0);
    let style = text(12, GREY).pos(Pos::new(HPos::Right, VPos::Center));
    chart.draw_series([Text::new(label, at, style)])?;
    let equal = [(x.start, x.start), (x.end, x.end)];
    chart.draw_series([PathElement::new(equal, stroke(FAINT, 30))])?;

    let pixel = pixels(area, &chart);
    for curve in &CURVES {
        let points = errors.iter().map(|(exponent, errors)| (f64::from(*exponent), curve.value(errors).log10()));
        let points: Vec<_> = points.map(&pixel).collect();
        curve.draw_line(area, &points)?;
        curve.draw_markers(area, &points)?;
    }
    // The legend, above all curves.
    let row = |row: usize| {
        let level = fine(top + 16 + 20 * row as i32);
        ([12, 33, 54].map(|across| (fine(left + across), level)), (fine(left + 62), level))
    };
    let box_corners = [(fine(left + 4), fine(top + 4)), (fine(left + 232), fine(top + 108))];
    area.draw(&Rectangle::new(box_corners, WHITE.filled()))?;
    for (curve, (line, at)) in CURVES.iter().zip((0..).map(row)) {
        curve.draw_line(area, &line)?;
        curve.draw_markers(area, &line[1..2])?;
        area.draw_text(curve.name, &right_of(text(12, INK)), at)?;
    }
    let (line, at) = row(CURVES.len());
    area.draw(&PathElement::new(line, stroke(FAINT, 30)))?;
    area.draw_text("error = tolerance", &right_of(text(12, INK)), at)?;

    let ticks = |(low, high): (i32, i32)| (low..=high).map(f64::from).collect::<Vec<_>>();
    let name = "relative tolerance of the solver";
    axis(area, (name, (left + width / 2, SIZE.1 - 12)), &ticks(EXPONENTS), power_of_ten, false, |at| {
        pixel((at, y.start))
    })?;
    axis(area, ("relative error", (16, top + height / 2)), &ticks(ERROR_EXPONENTS), power_of_ten, true, |at| {
        pixel((x.start, at))
    })?;
    Ok(())
}

impl Curve {
    fn draw_line(&self, area: &Area<'_>, points: &[(i32, i32)]) -> Result<()> {
        let (dash, gap) = self.dash;
        let style = stroke(self.color, 16);
        if gap == 0 {
            area.draw(&PathElement::new(points, style))?;
        } else {
            area.draw(&DashedPathElement::new(points.to_vec(), fine(dash), fine(gap), style))?;
        }
        Ok(())
    }

    fn draw_markers(&self, area: &Area<'_>, points: &[(i32, i32)]) -> Result<()> {
        for &(x, y) in points {
            let corner = |k: u32| {
                let (sine, cosine) = (self.turn + TAU * f64::from(k) / f64::from(self.corners)).sin_cos();
                let radius = f64::from(fine(5));
                (x + (radius * cosine).round() as i32, y + (radius * sine).round() as i32)
            };
            let mut outline: Vec<_> = (0..=self.corners).map(corner).collect();
            area.draw(&Polygon::new(outline.clone(), WHITE.filled()))?;
            // Once more over the first corner, so that the outline is closed there.
            outline.push(outline[1]);
            area.draw(&PathElement::new(outline, stroke(self.color, 16)))?;
        }
        Ok(())
    }
}

/// `10ⁿ`, as a label.
fn power_of_ten(exponent: f64) -> String {
    let raised = |character| match character {
        '-' => '⁻',
        digit => ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'][digit.to_digit(10).expect("a digit") as usize],
    };
    format!("10{}", format!("{exponent:.0}").chars().map(raised).collect::<String>())
}

//! The diagrams of the cases as SVG: points become pixels, on axes whose ticks are round numbers.
//!
//! Curves are told apart by colour, dashes and markers at once. A legend covers no point: it stands in a corner that is free, or
//! beside the diagram.

use std::f64::consts::TAU;

use bristle::drawing::{
    self, Area, BLUE, FAINT, GREY, GRID, INK, Marker, Pen, VERMILION, axis, fine, labelled, power_of_ten, right_of,
    stroke, text, whole,
};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::case::{Axis, Curve, Figure, Look};

/// Size of a picture in pixels; one with a legend beside the diagram may be wider.
const SIZE: (i32, i32) = (680, 430);
/// Pixels above, below and to the right of the diagram.
const TOP: i32 = 40;
const BOTTOM: i32 = 50;
const RIGHT: i32 = 24;
/// Least width of a diagram.
const MIN_WIDTH: i32 = 400;
/// More curves have their legend beside the diagram.
const MAX_IN_CORNER: usize = 5;
/// Height of a row of the legend, where its text begins, and what is free around it.
const ROW: i32 = 18;
const TEXT: i32 = 58;
const MARGIN: i32 = 8;
/// Points nearer to the one before, in coordinates of the file, are left out: half a pixel.
const RESOLUTION: i32 = 5;

/// Of Okabe and Ito, without their yellow, which white swallows.
const COLORS: [RGBColor; 7] = [
    BLUE,
    VERMILION,
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    INK,
];
/// Corners and turns of the markers. Their number, that of the colours and that of the dashes have no common factor, so that no
/// two curves look the same.
const MARKERS: [(u32, f64); 5] = [(32, 0.0), (4, TAU / 8.0), (3, -TAU / 4.0), (4, 0.0), (3, TAU / 4.0)];
const DASHES: [(i32, i32); 6] = [(1, 0), (7, 3), (2, 3), (14, 4), (7, 8), (4, 6)];

/// An axis with its range and its ticks, in coordinates in which equal distances are equal.
struct Scale {
    axis: Axis,
    low: f64,
    high: f64,
    ticks: Vec<(f64, String)>,
    /// What the labels are to be multiplied by; empty if that is one.
    factor: String,
}

impl Scale {
    /// The scale of an axis that shows `values`, in its coordinates.
    fn new(axis: Axis, values: impl Iterator<Item = f64>) -> Self {
        let (mut low, mut high) =
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
        if low > high {
            (low, high) = (0.0, 1.0);
        }
        let largest = low.abs().max(high.abs());
        if high - low <= 1e-9 * largest || largest < 1e-290 {
            // All in one place, as far as labels can show.
            let half = match axis.logarithmic {
                true => 0.5,
                false if largest < 1e-290 => 1.0,
                false => 0.1 * largest,
            };
            (low, high) = (low - half, high + half);
        }
        let margin = 0.04 * (high - low);
        (low, high) = (low - margin, high + margin);
        let (ticks, factor) = if axis.logarithmic { logarithmic_ticks(low, high) } else { linear_ticks(low, high) };
        Self { axis, low, high, ticks, factor }
    }

    /// Where a coordinate lies between `low` and `high` (pixels), in coordinates of the file.
    fn place(&self, at: f64, low: i32, high: i32) -> i32 {
        let part = (at - self.low) / (self.high - self.low);
        fine(low) + (part * f64::from(fine(high - low))).round() as i32
    }
}

/// The coordinate of a value on an axis; none if it cannot be shown.
fn coordinate(axis: Axis, value: f64) -> Option<f64> {
    let shown = value.abs() < 1e300 && (value > 0.0 || !axis.logarithmic);
    shown.then(|| if axis.logarithmic { value.log10() } else { value })
}

/// Multiples of 1, 2 or 5 times a power of ten, with their labels and the factor that these leave out.
fn linear_ticks(low: f64, high: f64) -> (Vec<(f64, String)>, String) {
    let least = (high - low) / 7.0;
    let power = 10_f64.powf(least.log10().floor());
    let step = [1.0, 2.0, 5.0].map(|digit| digit * power).into_iter().find(|step| *step >= least);
    let step = step.unwrap_or(10.0 * power);
    let largest = low.abs().max(high.abs());
    let exponent = if (1e-2..1e5).contains(&largest) { 0.0 } else { 3.0 * (largest.log10() / 3.0).floor() };
    let unit = 10_f64.powf(exponent);
    // A little more than a step, so that a logarithm rounded down costs no decimal too many.
    let decimals = (-(1.1 * step / unit).log10().floor()).clamp(0.0, 15.0) as usize;
    let values = ((low / step).ceil() as i64..=(high / step).floor() as i64).map(|count| count as f64 * step);
    let ticks = labelled(values, |value| format!("{:.decimals$}", value / unit).replace('-', "−"));
    let factor = if exponent == 0.0 { String::new() } else { format!("× {}", power_of_ten(exponent)) };
    (ticks, factor)
}

/// Ticks between two powers of ten given by their exponents: powers of ten, in a narrow range 1, 2 and 5 times them, in a
/// still narrower one those of a linear axis.
fn logarithmic_ticks(low: f64, high: f64) -> (Vec<(f64, String)>, String) {
    let powers: Vec<f64> = (low.ceil() as i32..=high.floor() as i32).map(f64::from).collect();
    if powers.len() > 2 {
        let every = powers.len().div_ceil(9) as f64;
        let plain = powers.iter().all(|power| (0.0..5.0).contains(power));
        let powers = powers.into_iter().filter(|power| power % every == 0.0);
        let label = |power: f64| if plain { whole(10_f64.powf(power)) } else { power_of_ten(power) };
        return (labelled(powers, label), String::new());
    }
    let digits = (low.floor() as i32..=high.floor() as i32).flat_map(|power| [1, 2, 5].map(|digit| (digit, power)));
    let digits = digits.map(|(digit, power)| (f64::from(digit).log10() + f64::from(power), digit_label(digit, power)));
    let digits: Vec<_> = digits.filter(|(at, _)| (low..=high).contains(at)).collect();
    if digits.len() > 2 {
        return (digits, String::new());
    }
    let (ticks, factor) = linear_ticks(10_f64.powf(low), 10_f64.powf(high));
    (ticks.into_iter().filter(|(value, _)| *value > 0.0).map(|(value, label)| (value.log10(), label)).collect(), factor)
}

/// A digit times a power of ten, as a label.
fn digit_label(digit: i32, power: i32) -> String {
    match (digit, power) {
        (_, -3..=4) => format!("{:.*}", (-power).max(0) as usize, f64::from(digit) * 10_f64.powi(power)),
        (1, _) => power_of_ten(f64::from(power)),
        _ => format!("{digit}·{}", power_of_ten(f64::from(power))),
    }
}

/// The pen of a curve that is the `index`-th of those with a colour.
fn pen(index: usize) -> Pen {
    let (corners, turn) = MARKERS[index % MARKERS.len()];
    let (color, dash) = (COLORS[index % COLORS.len()], DASHES[index % DASHES.len()]);
    Pen { color, tenths: 16, dash, marker: Marker { corners, turn, radius: 4 } }
}

/// The pen of a reference.
fn reference_pen(index: usize) -> Pen {
    Pen { color: GREY, tenths: 10, dash: DASHES[index % DASHES.len()], ..pen(0) }
}

/// A curve and its pen.
struct Styled<'a> {
    curve: &'a Curve,
    pen: Pen,
}

impl Styled<'_> {
    fn draw(&self, area: &Area<'_>, points: &[(i32, i32)], marked: &[(i32, i32)]) -> drawing::Result<()> {
        if self.curve.look != Look::Markers {
            self.pen.line(area, points)?;
        }
        if matches!(self.curve.look, Look::Markers | Look::Joined) {
            self.pen.markers(area, marked)?;
        }
        Ok(())
    }
}

/// References first, so that they lie below the rest. Those of one name look the same.
fn styled(curves: &[Curve]) -> Vec<Styled<'_>> {
    let (references, others): (Vec<_>, Vec<_>) = curves.iter().partition(|curve| curve.look == Look::Reference);
    let mut names: Vec<&str> = Vec::new();
    let mut styled = Vec::new();
    for curve in references {
        let index = names.iter().position(|name| *name == curve.name).unwrap_or_else(|| {
            names.push(&curve.name);
            names.len() - 1
        });
        styled.push(Styled { curve, pen: reference_pen(index) });
    }
    styled.extend(others.into_iter().enumerate().map(|(index, curve)| Styled { curve, pen: pen(index) }));
    styled
}

/// A rectangle: left, top, right and bottom, in pixels.
type Frame = [i32; 4];

/// The points of a curve in coordinates of the file, in parts that end where a point cannot be shown.
fn places(curve: &Curve, [x, y]: [&Scale; 2], [left, top, right, bottom]: Frame) -> Vec<Vec<(i32, i32)>> {
    let mut parts = vec![Vec::new()];
    for (index, &(across, up)) in curve.points.iter().enumerate() {
        let (Some(across), Some(up)) = (coordinate(x.axis, across), coordinate(y.axis, up)) else {
            parts.push(Vec::new());
            continue;
        };
        let at = (x.place(across, left, right), y.place(up, bottom, top));
        let part = parts.last_mut().expect("there is always a part");
        let near = |&(x, y): &(i32, i32)| (at.0 - x).abs() < RESOLUTION && (at.1 - y).abs() < RESOLUTION;
        if index + 1 == curve.points.len() || part.last().is_none_or(|last| !near(last)) {
            part.push(at);
        }
    }
    parts.retain(|part| !part.is_empty());
    parts
}

/// Distance of a rectangle (pixels) from what a curve covers, in coordinates of the file.
fn distance([left, top, right, bottom]: Frame, look: Look, parts: &[Vec<(i32, i32)>]) -> i32 {
    let beside = |at: i32, low: i32, high: i32| (fine(low) - at).max(at - fine(high)).max(0);
    let from = |(x, y): (i32, i32)| beside(x, left, right).max(beside(y, top, bottom));
    let points = parts.iter().flatten().map(|&at| from(at));
    let lines = parts.iter().filter(|_| look != Look::Markers).flat_map(|part| part.windows(2)).flat_map(|ends| {
        let [(x, y), (to_x, to_y)] = [ends[0], ends[1]];
        let steps = (to_x - x).abs().max((to_y - y).abs()) / fine(3) + 1;
        (0..steps).map(move |step| (x + (to_x - x) * step / steps, y + (to_y - y) * step / steps))
    });
    points.chain(lines.map(from)).min().unwrap_or(i32::MAX)
}

/// Width of a text in pixels, about: the font is the reader's.
fn width(text: &str, size: i32) -> i32 {
    text.chars().count() as i32 * size * 55 / 100
}

/// A figure as the text of an SVG file.
pub fn svg(figure: &Figure) -> drawing::Result<String> {
    let shown = || {
        let points = figure.curves.iter().flat_map(|curve| &curve.points);
        points.filter_map(|&(x, y)| Some((coordinate(figure.x, x)?, coordinate(figure.y, y)?)))
    };
    let x = Scale::new(figure.x, shown().map(|(x, _)| x));
    let y = Scale::new(figure.y, shown().map(|(_, y)| y));
    let curves = styled(&figure.curves);
    let mut entries: Vec<&Styled> = Vec::new();
    for styled in curves.iter().filter(|styled| !styled.curve.name.is_empty()) {
        let same = |entry: &&Styled| entry.curve.name == styled.curve.name && entry.pen == styled.pen;
        if !entries.iter().any(same) {
            entries.push(styled);
        }
    }

    let labels = y.ticks.iter().map(|(_, label)| width(label, 11)).max().unwrap_or(0);
    let left = 36 + labels.max(24);
    let bottom = SIZE.1 - BOTTOM;
    let names = entries.iter().map(|entry| width(&entry.curve.name, 12)).max().unwrap_or(0);
    let (wide, high) = (TEXT + names + MARGIN, ROW * entries.len() as i32 + MARGIN);
    let within = [left, TOP, SIZE.0 - RIGHT, bottom];
    let corner = free_corner(&curves, [&x, &y], within, (wide, high)).filter(|_| entries.len() <= MAX_IN_CORNER);
    let (frame, legend) = corner.map_or_else(
        || {
            let right = (SIZE.0 - wide - MARGIN).max(left + MIN_WIDTH);
            ([left, TOP, right, bottom], (right + MARGIN, TOP))
        },
        |corner| (within, corner),
    );
    let size = if corner.is_some() { SIZE } else { (frame[2] + MARGIN + wide, SIZE.1.max(TOP + high)) };

    drawing::svg(size, |area| {
        area.draw_text(&figure.title, &text(14, INK), (fine(left), fine(14)))?;
        draw_axes(area, [&x, &y], frame)?;
        for styled in &curves {
            for points in places(styled.curve, [&x, &y], frame) {
                styled.draw(area, &points, &points)?;
            }
        }
        let (across, down) = legend;
        let cover = [(fine(across), fine(down)), (fine(across + wide), fine(down + high))];
        area.draw(&Rectangle::new(cover, WHITE.filled()))?;
        for (row, entry) in (0..).zip(&entries) {
            let level = fine(down + MARGIN / 2 + ROW / 2 + ROW * row);
            let line = [MARGIN, 29, 50].map(|x| (fine(across + x), level));
            entry.draw(area, &line, &line[1..2])?;
            area.draw_text(&entry.curve.name, &right_of(text(12, INK)), (fine(across + TEXT), level))?;
        }
        Ok(())
    })
}

/// Where a legend of a size can stand in the frame, as far as possible from the curves; nowhere if it would cover one.
fn free_corner(
    curves: &[Styled<'_>],
    scales: [&Scale; 2],
    frame: Frame,
    (wide, high): (i32, i32),
) -> Option<(i32, i32)> {
    let covered: Vec<_> =
        curves.iter().map(|styled| (styled.curve.look, places(styled.curve, scales, frame))).collect();
    let [left, top, right, bottom] = frame;
    let (far, low) = (right - wide - 2, bottom - high - 2);
    let corners = [(far, top + 2), (left + 2, top + 2), (far, low), (left + 2, low)];
    let distance = |(x, y): (i32, i32)| {
        let legend = [x, y, x + wide, y + high];
        covered.iter().map(|(look, parts)| distance(legend, *look, parts)).min().unwrap_or(i32::MAX)
    };
    // Of equal ones the first.
    let best = corners.into_iter().rev().max_by_key(|&corner| distance(corner))?;
    (wide <= right - left && distance(best) > fine(6)).then_some(best)
}

/// Grid, frame, ticks and names.
fn draw_axes(area: &Area<'_>, [x, y]: [&Scale; 2], frame: Frame) -> drawing::Result<()> {
    let [left, top, right, bottom] = frame;
    for (at, _) in &x.ticks {
        let at = x.place(*at, left, right);
        area.draw(&PathElement::new([(at, fine(top)), (at, fine(bottom))], stroke(GRID, 8)))?;
    }
    for (at, _) in &y.ticks {
        let at = y.place(*at, bottom, top);
        area.draw(&PathElement::new([(fine(left), at), (fine(right), at)], stroke(GRID, 8)))?;
    }
    let corners = [(left, top), (right, top), (right, bottom), (left, bottom), (left, top)];
    area.draw(&PathElement::new(corners.map(|(x, y)| (fine(x), fine(y))), stroke(FAINT, 8)))?;
    let name = (x.axis.label, ((left + right) / 2, SIZE.1 - 12));
    axis(area, name, &x.ticks, false, |at| (x.place(at, left, right), fine(bottom)))?;
    let name = (y.axis.label, (14, (top + bottom) / 2));
    axis(area, name, &y.ticks, true, |at| (fine(left), y.place(at, bottom, top)))?;
    let to_the_left = text(11, INK).pos(Pos::new(HPos::Right, VPos::Center));
    area.draw_text(&y.factor, &to_the_left, (fine(left - 7), fine(top - 12)))?;
    area.draw_text(&x.factor, &to_the_left, (fine(right), fine(SIZE.1 - 12)))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figure(logarithmic: bool, curves: Vec<Curve>) -> Figure {
        let axis = |label| Axis { label, logarithmic };
        let (title, description) = ("Title".to_owned(), String::new());
        Figure { name: "test", title, description, x: axis("abscissa"), y: axis("ordinate"), curves }
    }

    fn points(points: &[(f64, f64)]) -> Vec<Curve> {
        let looks = [Look::Reference, Look::Markers, Look::Joined, Look::Line];
        looks.map(|look| Curve::new(format!("{look:?}"), look, points.to_vec())).into()
    }

    fn labels((ticks, factor): (Vec<(f64, String)>, String)) -> (String, String) {
        (ticks.into_iter().map(|(_, label)| label).collect::<Vec<_>>().join(" "), factor)
    }

    #[test]
    fn odd_points_are_drawn_or_left_out() {
        let far = f64::MAX;
        let odd: [&[(f64, f64)]; 9] = [
            &[],
            &[(1.0, 2.0)],
            &[(0.0, 0.0)],
            &[(3.0, 4.0), (3.0, 4.0), (3.0, 4.0)],
            &[(1.0, 1.0), (f64::NAN, 1.0), (2.0, f64::INFINITY), (3.0, -1.0), (4.0, 0.0), (5.0, 2.0)],
            &[(far, -far), (-far, far), (1.0, 1.0)],
            &[(1e299, -1e299), (-1e299, 1e299), (1e299, 1e-299)],
            &[(f64::MIN_POSITIVE / 8.0, 5e-324), (5e-324, f64::MIN_POSITIVE)],
            &[(1.0, 1e9), (1.0 + f64::EPSILON, 1e9 + 1e-6)],
        ];
        for logarithmic in [false, true] {
            for odd in odd {
                let text = svg(&figure(logarithmic, points(odd))).expect("a picture");
                assert!(text.starts_with("<svg") && text.trim_end().ends_with("</svg>"), "{odd:?}");
                assert!(!text.contains("NaN") && !text.contains("inf"), "{odd:?}\n{text}");
            }
            svg(&figure(logarithmic, vec![])).expect("a picture");
        }
    }

    #[test]
    fn a_line_stops_where_a_point_cannot_be_shown() {
        let curve = Curve::new("", Look::Line, vec![(1.0, 1.0), (2.0, 2.0), (3.0, f64::NAN), (4.0, 4.0)]);
        let axis = Axis::linear("");
        let scale = Scale::new(axis, [1.0, 4.0].into_iter());
        let parts = places(&curve, [&scale, &scale], [0, 0, 300, 300]);
        assert_eq!(parts.iter().map(Vec::len).collect::<Vec<_>>(), [2, 1]);
        let zero = Curve::new("", Look::Line, vec![(1.0, 1.0), (2.0, 0.0), (4.0, 4.0)]);
        let scale = Scale::new(Axis::logarithmic(""), [0.0, 0.6].into_iter());
        assert_eq!(places(&zero, [&scale, &scale], [0, 0, 300, 300]).len(), 2);
    }

    #[test]
    fn ticks_are_round_numbers() {
        let linear = |low, high| labels(linear_ticks(low, high));
        assert_eq!(linear(-0.04, 1.04), ("0.0 0.2 0.4 0.6 0.8 1.0".into(), String::new()));
        assert_eq!(linear(-30.0, 30.0).0, "−30 −20 −10 0 10 20 30");
        assert_eq!(linear(0.0, 7.0).0, "0 1 2 3 4 5 6 7");
        assert_eq!(linear(0.0, 7.1e-4), ("0 200 400 600".into(), "× 10⁻⁶".into()));
        assert_eq!(linear(0.0, 2.5e7), ("0 5 10 15 20 25".into(), "× 10⁶".into()));
        assert_eq!(linear(1.000001, 1.000006).0, "1.000001 1.000002 1.000003 1.000004 1.000005 1.000006");
        let logarithmic = |low: f64, high: f64| labels(logarithmic_ticks(low.log10(), high.log10()));
        assert_eq!(logarithmic(4.3, 230.0).0, "5 10 20 50 100 200");
        assert_eq!(logarithmic(0.5, 2e4).0, "1 10 100 1000 10000");
        assert_eq!(logarithmic(2e-9, 5e-5).0, "10⁻⁸ 10⁻⁷ 10⁻⁶ 10⁻⁵");
        assert_eq!(logarithmic(2e-17, 5e2).0, "10⁻¹⁵ 10⁻¹² 10⁻⁹ 10⁻⁶ 10⁻³ 10⁰");
        assert_eq!(logarithmic(1.5e-7, 1.2e-6).0, "2·10⁻⁷ 5·10⁻⁷ 10⁻⁶");
        assert_eq!(logarithmic(1.1, 1.5).0, "1.1 1.2 1.3 1.4 1.5");
    }

    #[test]
    fn a_legend_covers_no_point() {
        let rising = vec![Curve::new("a name", Look::Line, vec![(0.0, 0.0), (0.6, 0.1), (1.0, 1.0)])];
        let scale = Scale::new(Axis::linear(""), [0.0, 1.0].into_iter());
        let frame = [0, 0, 600, 300];
        let corner = free_corner(&styled(&rising), [&scale, &scale], frame, (100, 50));
        assert_eq!(corner, Some((2, 2)), "top left");
        let crossing = vec![(0.0, 0.0), (1.0, 1.0), (f64::NAN, 0.0), (0.0, 1.0), (1.0, 0.0)];
        let crossing = vec![Curve::new("a name", Look::Line, crossing)];
        assert_eq!(free_corner(&styled(&crossing), [&scale, &scale], frame, (100, 50)), None);
        let beside = svg(&figure(false, crossing)).expect("a picture");
        assert!(beside.contains("a name"));
    }

    #[test]
    fn curves_differ_in_more_than_colour() {
        for index in 0..210 {
            for other in 0..index {
                assert_ne!(pen(index), pen(other));
            }
        }
        let [first, second] = [pen(0), pen(1)];
        assert!(first.dash != second.dash && first.marker != second.marker);
    }

    #[test]
    fn long_histories_keep_what_can_be_seen() {
        let history = (0..100_000).map(|i| (f64::from(i), (f64::from(i) * 1e-3).sin())).collect();
        let text = svg(&figure(false, vec![Curve::new("history", Look::Line, history)])).expect("a picture");
        assert!(text.len() < 300_000, "{}", text.len());
    }
}

//! Diagrams: curves on two axes.

use super::format::Format;
use super::heading::Heading;
use super::legend::Legend;
use super::pens::{pen, reference_pen};
use super::scale::{Axis, AxisScale, Zero, coordinate};
use super::{Canvas, CanvasPoint, FAINT, GRID, INK, Pen, axis, fine, stroke, text, width};
use bristle_study::text::number::significant;

/// Width of a figure and height of its diagram in pixels. A figure with its legend to the right of
/// the diagram may be wider.
const SIZE: (i32, i32) = (680, 340);
/// Minimum height of the diagram on paper, in pixels.
const MIN_HEIGHT: i32 = 170;
/// Pixels below and to the right of the diagram.
const BOTTOM: i32 = 50;
const RIGHT: i32 = 24;
/// Maximum number of markers on a line.
const MAX_MARKERS: usize = 25;
/// Opacity of bands and stripes, and half the width of an error bar's cap in pixels.
const BAND_OPACITY: f64 = 0.15;
const HALF_CAP: i32 = 4;
/// Maximum length of an error bar that sets the axis, over the median length. The mark of a cut
/// bar, in pixels, and the room of its number.
const MAX_BAR_RATIO: f64 = 4.0;
const CUT: i32 = 9;
const CUT_ROOM: i32 = 50;
/// Minimum distance from the previous point in coordinates of the canvas: half a pixel.
const MIN_POINT_DISTANCE: i32 = 5;

/// A diagram.
#[derive(Clone, Debug)]
pub struct Diagram {
    /// Heading.
    title: String,
    /// Smaller text below the heading; may be empty.
    subtitle: String,
    /// Horizontal axis.
    x: Axis,
    /// Vertical axis.
    y: Axis,
    /// The curves, in drawing order. Bands and references are drawn before the others.
    curves: Vec<Curve>,
}

/// Points of a diagram.
#[derive(Clone, Debug)]
pub struct Curve {
    /// Name in the legend.
    pub name: String,
    /// The points.
    pub points: Vec<(f64, f64)>,
    /// Drawing style of the points.
    pub look: Look,
    /// Number of the pen; by default the position among the curves of this kind.
    pub pen: Option<usize>,
    /// Shift of the curve to the right, in pixels. It keeps several error bars at one place
    /// visible.
    pub shift: i32,
}

/// Drawing styles of points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Look {
    /// A thin grey line, for an exact solution or another code.
    Reference,
    /// Markers.
    Markers,
    /// Filled markers for measured values, which come first in the legend.
    Filled,
    /// Markers joined by a line.
    Joined,
    /// A coloured line.
    Line,
    /// A light coloured area with the points as its outline.
    Band,
    /// Error bars, two points each. A bar much longer than the others is cut at the end of the
    /// axis, with a mark and the number at its end.
    Bars,
    /// A light coloured stripe over the whole height, between the first and the last point.
    Stripe,
}

impl Curve {
    /// Creates a curve.
    pub fn new(
        name: impl Into<String>,
        look: Look,
        points: impl IntoIterator<Item = (f64, f64)>,
    ) -> Self {
        Self {
            name: name.into(),
            points: points.into_iter().collect(),
            look,
            pen: None,
            shift: 0,
        }
    }

    /// Gives the curve a pen that others may share.
    pub fn with_pen(self, index: usize) -> Self {
        Self {
            pen: Some(index),
            ..self
        }
    }

    /// Draws the curve some pixels to the right of its points.
    pub fn shifted(self, shift: i32) -> Self {
        Self { shift, ..self }
    }

    /// Returns `true` for an area, which lies below lines.
    fn is_area(&self) -> bool {
        [Look::Band, Look::Stripe].contains(&self.look)
    }
}

/// A curve and its pen.
pub(super) struct Styled<'a> {
    pub curve: &'a Curve,
    pub pen: Pen,
}

impl Styled<'_> {
    pub fn draw(&self, canvas: &mut Canvas, points: &[CanvasPoint], marked: &[CanvasPoint]) {
        match self.curve.look {
            Look::Reference | Look::Line => self.pen.line(canvas, points),
            Look::Markers | Look::Filled => {
                self.pen
                    .markers(canvas, marked, self.curve.look == Look::Filled)
            }
            Look::Joined => {
                self.pen.line(canvas, points);
                // Markers thinned out, so that dashes stay visible between them.
                let every = marked.len().div_ceil(MAX_MARKERS).max(1);
                let marked: Vec<CanvasPoint> = marked.iter().copied().step_by(every).collect();
                self.pen.markers(canvas, &marked, false);
            }
            Look::Band | Look::Stripe => canvas.area(points, self.pen.color, BAND_OPACITY),
            Look::Bars => {
                let whole = Pen {
                    dash: (1, 0),
                    tenths: 12,
                    ..self.pen
                };
                whole.line(canvas, points);
                for &(x, y) in marked {
                    whole.line(canvas, &[(x - fine(HALF_CAP), y), (x + fine(HALF_CAP), y)]);
                }
            }
        }
    }
}

/// Assigns pens. Bands and references come first, so that they lie below the rest. References with
/// the same name look alike.
pub(super) fn styled(curves: &[Curve]) -> Vec<Styled<'_>> {
    let (bands, others): (Vec<_>, Vec<_>) = curves.iter().partition(|curve| curve.is_area());
    let (references, others): (Vec<_>, Vec<_>) = others
        .into_iter()
        .partition(|curve| curve.look == Look::Reference);
    let own = |index: usize, curve: &Curve| pen(curve.pen.unwrap_or(index));
    let mut names: Vec<&str> = Vec::new();
    let mut styled: Vec<_> = bands
        .into_iter()
        .enumerate()
        .map(|(index, curve)| Styled {
            curve,
            pen: own(index, curve),
        })
        .collect();
    for curve in references {
        let index = names
            .iter()
            .position(|name| *name == curve.name)
            .unwrap_or_else(|| {
                names.push(&curve.name);
                names.len() - 1
            });
        styled.push(Styled {
            curve,
            pen: reference_pen(index),
        });
    }
    styled.extend(others.into_iter().enumerate().map(|(index, curve)| Styled {
        curve,
        pen: own(index, curve),
    }));
    styled
}

/// A rectangle: left, top, right and bottom, in pixels.
pub type PixelRectangle = [i32; 4];

/// Returns the points of a curve in coordinates of the canvas, split at points that cannot be
/// shown.
pub(super) fn places(
    curve: &Curve,
    [x, y]: [&AxisScale; 2],
    [left, top, right, bottom]: PixelRectangle,
) -> Vec<Vec<(i32, i32)>> {
    let place = |&(across, up): &(f64, f64)| {
        let (across, up) = (coordinate(&x.axis, across)?, coordinate(&y.axis, up)?);
        Some((
            x.place(across, left, right) + fine(curve.shift),
            y.place(up, bottom, top),
        ))
    };
    if let (Look::Stripe, [(first, _), .., (last, _)]) = (curve.look, &curve.points[..]) {
        let ends = [*first, *last].map(|across| coordinate(&x.axis, across));
        let [Some(from), Some(to)] = ends.map(|at| Some(x.place(at?, left, right))) else {
            return Vec::new();
        };
        let [top, bottom] = [top, bottom].map(fine);
        return vec![vec![(from, bottom), (from, top), (to, top), (to, bottom)]];
    }
    if curve.look == Look::Bars {
        let bars = curve.points.chunks_exact(2);
        let within = |(x, y): (i32, i32)| (x, y.clamp(fine(top), fine(bottom)));
        return bars
            .filter_map(|ends| ends.iter().map(|end| place(end).map(within)).collect())
            .collect();
    }
    let mut parts = vec![Vec::new()];
    for (index, point) in curve.points.iter().enumerate() {
        let Some(at) = place(point) else {
            parts.push(Vec::new());
            continue;
        };
        let part = parts.last_mut().expect("there is always a part");
        let near = |&(x, y): &(i32, i32)| {
            (at.0 - x).abs() < MIN_POINT_DISTANCE && (at.1 - y).abs() < MIN_POINT_DISTANCE
        };
        if index + 1 == curve.points.len() || part.last().is_none_or(|last| !near(last)) {
            part.push(at);
        }
    }
    parts.retain(|part| !part.is_empty());
    parts
}

impl Diagram {
    /// Creates a diagram with a title, a subtitle that may be empty, and its axes.
    pub fn new(
        title: impl Into<String>,
        subtitle: impl Into<String>,
        [x, y]: [Axis; 2],
        curves: Vec<Curve>,
    ) -> Self {
        Self {
            title: title.into(),
            subtitle: subtitle.into(),
            x,
            y,
            curves,
        }
    }

    /// Returns the coordinates that the vertical axis shows: those of all points, without the bars
    /// that are much longer than the others. Ends of bars below zero count as zero if the axis
    /// shows an amount without negative values.
    fn heights(&self) -> Vec<f64> {
        let shown =
            |&(x, y): &(f64, f64)| coordinate(&self.x, x).and_then(|_| coordinate(&self.y, y));
        let others = self
            .curves
            .iter()
            .filter(|curve| ![Look::Stripe, Look::Bars].contains(&curve.look));
        let mut heights: Vec<f64> = others
            .flat_map(|curve| &curve.points)
            .filter_map(shown)
            .collect();
        let bars = self
            .curves
            .iter()
            .filter(|curve| curve.look == Look::Bars)
            .flat_map(|curve| curve.points.chunks_exact(2));
        let bars: Vec<[f64; 2]> = bars
            .filter_map(|ends| Some([shown(&ends[0])?, shown(&ends[1])?]))
            .collect();
        let length = |[from, to]: &[f64; 2]| (to - from).abs();
        let mut lengths: Vec<f64> = bars
            .iter()
            .map(length)
            .filter(|length| *length > 0.0)
            .collect();
        lengths.sort_by(f64::total_cmp);
        let usual = lengths
            .get(lengths.len() / 2)
            .map_or(f64::INFINITY, |middle| MAX_BAR_RATIO * middle);
        let is_amount = self.y.zero != Zero::Between
            && !self.y.logarithmic
            && heights.iter().all(|height| *height >= 0.0);
        let least = if is_amount && !heights.is_empty() {
            0.0
        } else {
            f64::NEG_INFINITY
        };
        let has_others = !heights.is_empty();
        let kept = bars
            .iter()
            .filter(|bar| !has_others || length(bar) <= usual);
        heights.extend(kept.flatten().map(|end| end.max(least)));
        heights
    }

    /// Draws the diagram.
    pub fn draw_in(&self, format: &Format) -> Canvas {
        let shown = self.curves.iter().flat_map(|curve| &curve.points);
        let shown =
            shown.filter_map(|&(x, y)| coordinate(&self.y, y).and_then(|_| coordinate(&self.x, x)));
        let x = AxisScale::new(self.x.clone(), shown);
        let y = AxisScale::new(self.y.clone(), self.heights().into_iter());
        let curves = styled(&self.curves);
        let mut entries: Vec<&Styled> = Vec::new();
        for styled in curves.iter().filter(|styled| !styled.curve.name.is_empty()) {
            let same =
                |entry: &&Styled| entry.curve.name == styled.curve.name && entry.pen == styled.pen;
            if !entries.iter().any(same) {
                entries.push(styled);
            }
        }
        entries.sort_by_key(|entry| entry.curve.look != Look::Filled);

        let left = left_of(format, &y);
        let page = format.width(SIZE.0);
        let heading = Heading::new(format, &self.title, &self.subtitle, [left, page]);
        let top = heading.height();
        let bottom = top + format.height(SIZE.1, SIZE.0, MIN_HEIGHT);
        let height = bottom + BOTTOM;
        let within = [left, top, page - RIGHT, bottom];
        let legend = Legend::new(format, &entries, &curves, [&x, &y], within, (page, height));
        let frame = legend.frame;

        let mut canvas = Canvas::on(format, legend.size);
        heading.draw(&mut canvas);
        draw_axes(&mut canvas, [&x, &y], frame);
        for styled in &curves {
            let is_bars = styled.curve.look == Look::Bars;
            // Bars that are cut have no caps.
            let is_marked =
                |(_, y): &CanvasPoint| !is_bars || (fine(frame[1]) < *y && *y < fine(frame[3]));
            for points in places(styled.curve, [&x, &y], frame) {
                let marked: Vec<CanvasPoint> = points.iter().copied().filter(is_marked).collect();
                styled.draw(&mut canvas, &points, &marked);
            }
            if is_bars {
                draw_cuts(&mut canvas, styled, [&x, &y], frame);
            }
        }
        legend.draw(&mut canvas, &entries);
        canvas
    }
}

/// Marks the ends of error bars that lie beyond the axis: an arrowhead at the frame, and the number
/// next to it.
fn draw_cuts(
    canvas: &mut Canvas,
    Styled { curve, pen }: &Styled<'_>,
    [x, y]: [&AxisScale; 2],
    [left, top, right, bottom]: PixelRectangle,
) {
    for &(across, up) in &curve.points {
        let (Some(at), Some(height)) = (coordinate(&x.axis, across), coordinate(&y.axis, up))
        else {
            continue;
        };
        let (end, inwards) = match y.part(height) {
            part if part < 0.0 => (fine(bottom), -fine(CUT)),
            part if part > 1.0 => (fine(top), fine(CUT)),
            _ => continue,
        };
        let at = x.place(at, left, right) + fine(curve.shift);
        let half = fine(CUT) / 2;
        canvas.polygon(
            [
                (at, end),
                (at - half, end + inwards),
                (at + half, end + inwards),
            ],
            pen.color,
        );
        let (style, aside) = if at > fine(right - CUT_ROOM) {
            (text(11, INK).left(), -half)
        } else {
            (text(11, INK).right(), half)
        };
        canvas.text(
            &significant(up),
            style,
            (at + aside + aside.signum() * fine(2), end + inwards / 2),
        );
    }
}

/// Returns the room for the labels of the vertical axis, in pixels.
pub fn left_of(format: &Format, y: &AxisScale) -> i32 {
    let labels = y
        .ticks
        .iter()
        .map(|(_, label)| width(label, format.font_size(11)))
        .max()
        .unwrap_or(0);
    36 + labels.max(24)
}

/// Draws grid, frame, ticks and names.
pub fn draw_axes(
    canvas: &mut Canvas,
    [x, y]: [&AxisScale; 2],
    [left, top, right, bottom]: PixelRectangle,
) {
    for (at, _) in &x.ticks {
        let at = x.place(*at, left, right);
        canvas.line([(at, fine(top)), (at, fine(bottom))], stroke(GRID, 8));
    }
    for (at, _) in &y.ticks {
        let at = y.place(*at, bottom, top);
        canvas.line([(fine(left), at), (fine(right), at)], stroke(GRID, 8));
    }
    canvas.frame(
        [(fine(left), fine(top)), (fine(right), fine(bottom))],
        stroke(FAINT, 8),
    );
    let name = (&*x.axis.label, ((left + right) / 2, bottom + 38));
    axis(canvas, name, &x.ticks, false, |at| {
        (x.place(at, left, right), fine(bottom))
    });
    let name = (&*y.axis.label, (14, (top + bottom) / 2));
    axis(canvas, name, &y.ticks, true, |at| {
        (fine(left), y.place(at, bottom, top))
    });
    let to_the_left = text(11, INK).left();
    canvas.text(&y.factor, to_the_left, (fine(left - 7), fine(top - 12)));
    canvas.text(&x.factor, to_the_left, (fine(right), fine(bottom + 38)));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn diagram(logarithmic: bool, curves: Vec<Curve>) -> Diagram {
        let axis = |label| {
            if logarithmic {
                Axis::logarithmic(label)
            } else {
                Axis::linear(label)
            }
        };
        Diagram::new(
            "Title",
            "Subtitle",
            [axis("abscissa"), axis("ordinate")],
            curves,
        )
    }

    fn svg(diagram: &Diagram) -> String {
        diagram.draw_in(&Format::default()).svg()
    }

    fn points(points: &[(f64, f64)]) -> Vec<Curve> {
        let looks = [
            Look::Reference,
            Look::Markers,
            Look::Filled,
            Look::Joined,
            Look::Line,
            Look::Band,
            Look::Bars,
            Look::Stripe,
        ];
        looks
            .map(|look| Curve::new(format!("{look:?}"), look, points.to_vec()))
            .into()
    }

    #[test]
    fn odd_points_are_drawn_or_left_out() {
        let far = f64::MAX;
        let odd: [&[(f64, f64)]; 9] = [
            &[],
            &[(1.0, 2.0)],
            &[(0.0, 0.0)],
            &[(3.0, 4.0), (3.0, 4.0), (3.0, 4.0)],
            &[
                (1.0, 1.0),
                (f64::NAN, 1.0),
                (2.0, f64::INFINITY),
                (3.0, -1.0),
                (4.0, 0.0),
                (5.0, 2.0),
            ],
            &[(far, -far), (-far, far), (1.0, 1.0)],
            &[(1e299, -1e299), (-1e299, 1e299), (1e299, 1e-299)],
            &[
                (f64::MIN_POSITIVE / 8.0, 5e-324),
                (5e-324, f64::MIN_POSITIVE),
            ],
            &[(1.0, 1e9), (1.0 + f64::EPSILON, 1e9 + 1e-6)],
        ];
        for logarithmic in [false, true] {
            for odd in odd {
                let text = svg(&diagram(logarithmic, points(odd)));
                assert!(
                    text.starts_with("<svg") && text.trim_end().ends_with("</svg>"),
                    "{odd:?}"
                );
                assert!(
                    !text.contains("NaN") && !text.contains("inf"),
                    "{odd:?}\n{text}"
                );
            }
            assert!(svg(&diagram(logarithmic, vec![])).starts_with("<svg"));
        }
    }

    #[test]
    fn a_line_stops_where_a_point_cannot_be_shown() {
        let curve = Curve::new(
            "",
            Look::Line,
            vec![(1.0, 1.0), (2.0, 2.0), (3.0, f64::NAN), (4.0, 4.0)],
        );
        let axis = Axis::linear("");
        let scale = AxisScale::new(axis, [1.0, 4.0].into_iter());
        let parts = places(&curve, [&scale, &scale], [0, 0, 300, 300]);
        assert_eq!(parts.iter().map(Vec::len).collect::<Vec<_>>(), [2, 1]);
        let zero = Curve::new("", Look::Line, vec![(1.0, 1.0), (2.0, 0.0), (4.0, 4.0)]);
        let scale = AxisScale::new(Axis::logarithmic(""), [0.0, 0.6].into_iter());
        assert_eq!(places(&zero, [&scale, &scale], [0, 0, 300, 300]).len(), 2);
    }

    #[test]
    fn a_bar_much_longer_than_the_others_is_cut() {
        let bars = |last: f64| {
            let ends = [10.0, 12.0, 20.0, 22.0, 30.0 - last, 30.0 + last];
            let ends = (0..)
                .zip(ends)
                .map(|(index, end)| (f64::from(index / 2), end));
            let points = vec![(0.0, 11.0), (1.0, 21.0), (2.0, 30.0)];
            let curves = vec![
                Curve::new("", Look::Bars, ends),
                Curve::new("measured", Look::Filled, points),
            ];
            Diagram {
                y: Axis::amount("force in N"),
                ..diagram(false, curves)
            }
        };
        let top = |diagram: &Diagram| diagram.heights().into_iter().fold(0.0, f64::max);
        assert_eq!([top(&bars(3.0)), top(&bars(300.0))], [33.0, 30.0]);
        let cut = svg(&bars(300.0));
        assert!(
            cut.contains(">330</text>") && cut.contains(">−270</text>"),
            "{cut}"
        );
        assert!(!svg(&bars(3.0)).contains(">33.0</text>"));
        // A bar alone does not take an axis of forces below zero.
        let least = bars(30.5)
            .heights()
            .into_iter()
            .fold(f64::INFINITY, f64::min);
        assert!(least >= 0.0, "{least}");
    }

    #[test]
    fn long_histories_keep_what_can_be_seen() {
        let history = (0..100_000).map(|i| (f64::from(i), (f64::from(i) * 1e-3).sin()));
        let text = svg(&diagram(
            false,
            vec![Curve::new("history", Look::Line, history)],
        ));
        assert!(text.len() < 300_000, "{}", text.len());
    }
}

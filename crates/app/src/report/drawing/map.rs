//! Maps: a quantity over two others as coloured cells, with numbers where they fit.
//!
//! The colours are those of viridis. Their brightness rises evenly, so a map can be read in grey.

use super::cell_number::{CellNumber, NUMBER, NUMBER_MARGIN, number};
use super::contour::{contour, joined, on_to_the_frame, sampled};
use super::diagram::PixelRectangle;
use super::format::Format;
use super::heading::Heading;
use super::scale::{Axis, AxisScale, coordinate};
use super::{
    Canvas, CanvasPoint, Color, FAINT, INK, VERMILION, WHITE, axis, fine, stroke, text, viridis,
    width,
};

/// Width of a figure and height of its cells in pixels, and the minimum height on paper.
const SIZE: (i32, i32) = (680, 340);
const MIN_HEIGHT: i32 = 170;
/// Pixels below and to the right of the cells.
const BOTTOM: i32 = 50;
const RIGHT: i32 = 100;
/// Distance between the colour bar and the cells, and width of the bar.
const BAR: (i32, i32) = (20, 14);
/// Number of colours in the bar.
const SHADES: u32 = 100;
/// Fill of a cell without a value, and distance between its hatching lines.
const EMPTY: Color = Color(240, 241, 243);
const HATCH: i32 = 6;

/// A side of a map.
#[derive(Clone, Debug)]
pub struct CellAxis {
    /// Quantity and unit.
    pub label: String,
    /// The values of the cells, in ascending order; at least one.
    pub values: Vec<f64>,
    /// The label of each value.
    pub labels: Vec<String>,
}

/// A quantity over two others.
#[derive(Clone, Debug)]
pub struct Map {
    /// Heading.
    pub title: String,
    /// Smaller text below the heading; may be empty.
    pub subtitle: String,
    /// Horizontal side.
    pub x: CellAxis,
    /// Vertical side.
    pub y: CellAxis,
    /// Scale of the colours, with name and unit of the quantity.
    pub colours: Axis,
    /// The values of the quantity, row by row from the bottom; none where unknown.
    pub values: Vec<Option<f64>>,
    /// Marks of cells: `true` if a cell has a mark in its corner.
    pub marked: Vec<bool>,
    /// Range of the colours; by default that of the values.
    pub range: Option<[f64; 2]>,
    /// The contour line, if there is one.
    pub line: Option<Contour>,
}

/// A contour line of the quantity, or of another quantity over the same sides.
#[derive(Clone, Debug, PartialEq)]
pub struct Contour {
    /// Value along the line.
    pub level: f64,
    /// The values of the other quantity, row by row from the bottom.
    pub other: Option<Vec<Option<f64>>>,
}

impl CellAxis {
    /// Returns the borders of the cells: midway between values, and equally far beyond the ends.
    fn borders(&self) -> Vec<f64> {
        let values = &self.values;
        let (first, last) = (values[0], values[values.len() - 1]);
        let ends = match values.len() {
            1 => [first.abs().max(1e-300) / 2.0; 2],
            count => [(values[1] - first) / 2.0, (last - values[count - 2]) / 2.0],
        };
        let middles = values
            .windows(2)
            .map(|pair| pair[0] + (pair[1] - pair[0]) / 2.0);
        std::iter::once(first - ends[0])
            .chain(middles)
            .chain([last + ends[1]])
            .collect()
    }
}

/// Returns a function from the values of a side to coordinates between two pixels.
fn placing(borders: &[f64], low: i32, high: i32) -> impl Fn(f64) -> i32 {
    let (first, last) = (borders[0], borders[borders.len() - 1]);
    move |value| {
        fine(low) + ((value - first) / (last - first) * f64::from(fine(high - low))).round() as i32
    }
}

/// Returns values and labels, thinned out until the labels do not touch: every value, every second
/// one, and so on.
fn ticks(
    side: &CellAxis,
    at: impl Fn(f64) -> i32,
    room: impl Fn(&str) -> i32,
) -> Vec<(f64, String)> {
    let all: Vec<(f64, String)> = side
        .values
        .iter()
        .copied()
        .zip(side.labels.iter().cloned())
        .collect();
    let apart = |every: usize| {
        let kept: Vec<_> = all.iter().step_by(every).collect();
        kept.windows(2).all(|pair| {
            let distance = (at(pair[1].0) - at(pair[0].0)).abs();
            distance >= fine(room(&pair[0].1).max(room(&pair[1].1)))
        })
    };
    let every = (1..all.len())
        .find(|&every| apart(every))
        .unwrap_or(all.len().max(1));
    all.into_iter().step_by(every).collect()
}

/// Side of the mark in the corner of a cell, in pixels.
const MARK: i32 = 9;

/// Returns the part of the colours that lies below a value. A value that the axis cannot show is at
/// an end.
fn part(scale: &AxisScale, value: f64) -> f64 {
    coordinate(&scale.axis, value).map_or(if value > 0.0 { 1.0 } else { 0.0 }, |at| scale.part(at))
}

/// Value of a cell, and its upper left and lower right corner on the canvas.
type MapCell = (Option<f64>, [CanvasPoint; 2]);

impl Map {
    /// Draws the map.
    pub fn draw_in(&self, format: &Format) -> Canvas {
        let known = self.values.iter().flatten().copied();
        let limits = self.range.into_iter().flatten();
        let shown: Vec<f64> = limits
            .chain(known)
            .filter_map(|value| coordinate(&self.colours, value))
            .collect();
        let scale = AxisScale::exact(self.colours.clone(), shown.iter().copied());
        let size = format.font_size(11);
        let labels = self
            .y
            .labels
            .iter()
            .map(|label| width(label, size))
            .max()
            .unwrap_or(0);
        let left = 36 + labels.max(24);
        let page = format.width(SIZE.0);
        let heading = Heading::new(format, &self.title, &self.subtitle, [left, page]);
        let top = heading.height();
        let frame @ [_, _, right, bottom] = [
            left,
            top,
            page - RIGHT,
            top + format.height(SIZE.1, SIZE.0, MIN_HEIGHT),
        ];
        let mut canvas = Canvas::on(format, (page, bottom + BOTTOM));
        heading.draw(&mut canvas);
        let (xs, ys) = (self.x.borders(), self.y.borders());
        let (across, up) = (placing(&xs, left, right), placing(&ys, bottom, top));
        let places = ys
            .windows(2)
            .flat_map(|y| xs.windows(2).map(move |x| [x, y]));
        let corners = places.map(|[x, y]| [(across(x[0]), up(y[1])), (across(x[1]), up(y[0]))]);
        let cells: Vec<MapCell> = self.values.iter().copied().zip(corners).collect();
        self.draw_cells(&mut canvas, &cells, frame, &scale);
        let mut numbers = self.numbers(format, &scale, &cells);
        let lines = self.lines(frame, &across, &up);
        let points: Vec<CanvasPoint> = lines.iter().flat_map(|line| sampled(line)).collect();
        numbers.iter_mut().for_each(|number| number.avoid(&points));
        // In ink on white, so that it shows on every colour.
        for (color, tenths) in LINE {
            lines
                .iter()
                .for_each(|line| canvas.line(line.as_slice(), stroke(color, tenths)));
        }
        for number in numbers {
            let shade = if number.part < 0.6 { WHITE } else { INK };
            canvas.text(&number.text, text(NUMBER, shade).centred(), number.middle);
        }
        canvas.frame(
            [(fine(left), fine(top)), (fine(right), fine(bottom))],
            stroke(FAINT, 8),
        );
        let below = ticks(&self.x, &across, |label| width(label, size) + 8);
        let name = (&*self.x.label, ((left + right) / 2, bottom + 38));
        axis(&mut canvas, name, &below, false, |x| {
            (across(x), fine(bottom))
        });
        let beside = ticks(&self.y, &up, |_| 15);
        axis(
            &mut canvas,
            (&self.y.label, (14, (top + bottom) / 2)),
            &beside,
            true,
            |y| (fine(left), up(y)),
        );
        // Without a value the colours have no range.
        if !shown.is_empty() {
            self.draw_bar(&mut canvas, frame, &scale);
        }
        canvas
    }

    fn draw_cells(
        &self,
        canvas: &mut Canvas,
        cells: &[MapCell],
        [_, top, right, _]: PixelRectangle,
        scale: &AxisScale,
    ) {
        for &(value, corners) in cells {
            let [(low_x, high_y), (high_x, low_y)] = corners;
            match value {
                // A cell extends slightly below the cell drawn after it, so that no seam shows.
                Some(value) => {
                    let reach = [
                        (low_x, (high_y - 5).max(fine(top))),
                        ((high_x + 5).min(fine(right)), low_y),
                    ];
                    canvas.rectangle(reach, viridis(part(scale, value)));
                }
                None => hatch(canvas, corners),
            }
        }
        // Drawn again, over the extensions of their neighbours.
        for (_, corners) in cells.iter().filter(|(value, _)| value.is_none()) {
            hatch(canvas, *corners);
        }
        for ((_, corners), _) in cells
            .iter()
            .zip(&self.marked)
            .filter(|(_, marked)| **marked)
        {
            let [(low_x, high_y), (high_x, low_y)] = *corners;
            let side = fine(MARK)
                .min((high_x - low_x) / 2)
                .min((low_y - high_y) / 2);
            let corner = [
                (high_x - side, high_y),
                (high_x, high_y),
                (high_x, high_y + side),
            ];
            canvas.area(corner, WHITE, 1.0);
            let inner = side - (2 * fine(1)).min(side / 2);
            canvas.area(
                [
                    (high_x - inner, high_y),
                    corner[1],
                    (high_x, high_y + inner),
                ],
                VERMILION,
                1.0,
            );
        }
    }

    /// Returns the numbers of all cells if all of them fit, otherwise none.
    fn numbers(&self, format: &Format, scale: &AxisScale, cells: &[MapCell]) -> Vec<CellNumber> {
        let size = format.font_size(NUMBER);
        let (mut numbers, mut largest) = (Vec::new(), 0.0_f64);
        for &(value, [(left, top), (right, bottom)]) in cells {
            let Some(value) = value else { continue };
            let text = number(value, &self.colours);
            let half = (fine(width(&text, size)) / 2, fine(size) / 2);
            if right - left < 2 * (half.0 + fine(NUMBER_MARGIN.0))
                || bottom - top < 2 * (half.1 + fine(NUMBER_MARGIN.1))
            {
                return Vec::new();
            }
            let middle = ((left + right) / 2, (top + bottom) / 2);
            let cell = ((right - left) / 2, (bottom - top) / 2);
            numbers.push(CellNumber {
                text,
                part: part(scale, value),
                middle,
                half,
                cell,
            });
            largest = largest.max(value.abs());
        }
        if scale.factor.is_empty() && largest >= 0.1 {
            numbers
        } else {
            Vec::new()
        }
    }

    /// Returns the pieces of the contour line in coordinates of the canvas; none without a line.
    fn pieces(
        &self,
        across: &impl Fn(f64) -> i32,
        up: &impl Fn(f64) -> i32,
    ) -> Vec<[(i32, i32); 2]> {
        let Some(Contour { level, other }) = &self.line else {
            return Vec::new();
        };
        let at = |value: f64| coordinate(&self.colours, value);
        let (values, level) = match other {
            Some(values) => (values.clone(), Some(*level)),
            None => (
                self.values.iter().map(|value| value.and_then(at)).collect(),
                at(*level),
            ),
        };
        let pieces = level.map_or_else(Vec::new, |level| {
            contour([&self.x.values, &self.y.values], &values, level)
        });
        pieces
            .into_iter()
            .map(|piece| piece.map(|(x, y)| (across(x), up(y))))
            .collect()
    }

    /// Returns the lines that the pieces make. A line that ends in the middle of the outermost
    /// cells continues straight to the `frame`.
    fn lines(
        &self,
        frame: PixelRectangle,
        across: &impl Fn(f64) -> i32,
        up: &impl Fn(f64) -> i32,
    ) -> Vec<Vec<CanvasPoint>> {
        let middles =
            [&self.x.values, &self.y.values].map(|values| [values[0], values[values.len() - 1]]);
        let [(left, right), (bottom, top)] =
            [middles[0].map(across).into(), middles[1].map(up).into()];
        let mut lines = joined(&self.pieces(across, up));
        for line in lines.iter_mut().filter(|line| line.first() != line.last()) {
            for _ in 0..2 {
                if let [.., before, end] = line[..] {
                    line.extend(on_to_the_frame(
                        [before, end],
                        [left, top, right, bottom],
                        frame,
                    ));
                }
                line.reverse();
            }
        }
        lines
    }

    fn draw_bar(
        &self,
        canvas: &mut Canvas,
        [_, top, right, bottom]: PixelRectangle,
        scale: &AxisScale,
    ) {
        let (start, end) = (right + BAR.0, right + BAR.0 + BAR.1);
        let at = |part: f64| fine(bottom) - (part * f64::from(fine(bottom - top))).round() as i32;
        for shade in 0..SHADES {
            let [low, middle] =
                [0.0, 0.5].map(|half| (f64::from(shade) + half) / f64::from(SHADES));
            let corners = [(fine(start), fine(top)), (fine(end), at(low))];
            canvas.rectangle(corners, viridis(middle));
        }
        canvas.frame(
            [(fine(start), fine(top)), (fine(end), fine(bottom))],
            stroke(FAINT, 8),
        );
        let mut labels = 0;
        for (value, label) in &scale.ticks {
            let level = scale.place(*value, bottom, top);
            canvas.line(
                [(fine(end), level), (fine(end + 4), level)],
                stroke(INK, 10),
            );
            canvas.text(label, text(11, INK).right(), (fine(end + 7), level));
            labels = labels.max(width(label, 11));
        }
        let own = self.line.as_ref().filter(|line| line.other.is_none());
        let level = own.and_then(|line| coordinate(&self.colours, line.level));
        if let Some(level) = level.filter(|level| (0.0..=1.0).contains(&scale.part(*level))) {
            let level = scale.place(level, bottom, top);
            for (color, tenths) in LINE {
                canvas.line(
                    [(fine(start), level), (fine(end), level)],
                    stroke(color, tenths),
                );
            }
        }
        canvas.text(
            &scale.factor,
            text(11, INK).right(),
            (fine(start), fine(top - 12)),
        );
        let name = (end + 7 + labels + 16, (top + bottom) / 2);
        canvas.text(
            &self.colours.label,
            text(12, INK).centred().upwards(),
            (fine(name.0), fine(name.1)),
        );
    }
}

/// Colours and widths (tenths of a pixel) of the contour line, from the lowest to the highest
/// layer.
const LINE: [(Color, i32); 2] = [(WHITE, 40), (INK, 18)];

/// Hatches a rectangle.
fn hatch(canvas: &mut Canvas, corners: [(i32, i32); 2]) {
    let [(left, top), (right, bottom)] = corners;
    canvas.rectangle(corners, EMPTY);
    let (wide, high) = (right - left, bottom - top);
    let mut offset = fine(HATCH) / 2;
    while offset < wide + high {
        // From the left or lower border to the upper or right one.
        let from = (left + (offset - high).max(0), top + offset.min(high));
        let to = (left + offset.min(wide), top + (offset - wide).max(0));
        canvas.line([from, to], stroke(FAINT, 8));
        offset += fine(HATCH);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn side(values: &[f64]) -> CellAxis {
        let labels = values.iter().map(f64::to_string).collect();
        CellAxis {
            label: "side in mm".to_owned(),
            values: values.to_vec(),
            labels,
        }
    }

    fn map(xs: &[f64], ys: &[f64], values: Vec<Option<f64>>) -> Map {
        let (title, subtitle, colours) = (
            "Title".to_owned(),
            "Below".to_owned(),
            Axis::linear("quantity"),
        );
        let marked = values.iter().map(Option::is_some).collect();
        Map {
            title,
            subtitle,
            x: side(xs),
            y: side(ys),
            colours,
            values,
            marked,
            range: None,
            line: Some(Contour {
                level: 0.5,
                other: None,
            }),
        }
    }

    fn svg(map: &Map) -> String {
        map.draw_in(&Format::default()).svg()
    }

    #[test]
    fn borders_lie_between_values() {
        assert_eq!(side(&[1.0, 2.0, 4.0]).borders(), [0.5, 1.5, 3.0, 5.0]);
        assert_eq!(side(&[3.0]).borders(), [1.5, 4.5]);
    }

    #[test]
    fn the_line_goes_from_border_to_border_in_one_piece() {
        let sides = [1.0, 2.0, 3.0];
        let plane = sides
            .iter()
            .flat_map(|y| sides.map(|x| Some(x + 0.1 * y)))
            .collect();
        let map = Map {
            line: Some(Contour {
                level: 2.4,
                other: None,
            }),
            ..map(&sides, &sides, plane)
        };
        let at = |value: f64| (1e3 * value).round() as i32;
        // The middles of cells lie from 1000 to 3000, their borders from 500 to 3500.
        let lines = map.lines([50, 50, 350, 350], &at, &|value: f64| 4000 - at(value));
        assert_eq!(lines.len(), 1, "{lines:?}");
        let ends = [lines[0].first(), lines[0].last()].map(|end| *end.expect("a point"));
        assert!(
            ends.contains(&(2350, 3500)) && ends.contains(&(2050, 500)),
            "{ends:?}"
        );
        // Beyond a corner too, but not far along a side.
        let beyond = |before: CanvasPoint, end: CanvasPoint| {
            on_to_the_frame([before, end], [100, 100, 300, 300], [0, 0, 40, 40])
        };
        assert_eq!(beyond((150, 200), (100, 280)), Some((25, 400)));
        assert_eq!(beyond((150, 200), (100, 200)), Some((0, 200)));
        assert_eq!(
            [
                beyond((101, 150), (100, 100)),
                beyond((110, 350), (100, 250))
            ],
            [Some((98, 0)), None]
        );
        assert_eq!(
            [
                beyond((150, 200), (200, 200)),
                beyond((50, 200), (100, 200))
            ],
            [None; 2]
        );
        // The line of another quantity has no place on the colours.
        let lines = [None, Some(vec![Some(0.0), Some(2.0), Some(0.0), Some(2.0)])].map(|other| {
            let [sides, values] = [[1.0, 2.0], [5.0, 6.0]];
            let mut map = super::tests::map(
                &sides,
                &sides,
                values.into_iter().chain(values).map(Some).collect(),
            );
            map.line = Some(Contour { level: 1.0, other });
            svg(&map)
                .matches("stroke=\"#282C34\" stroke-width=\"18\"")
                .count()
        });
        assert_eq!(lines, [0, 1]);
    }

    #[test]
    fn odd_maps_are_drawn() {
        let maps = [
            map(&[1.0], &[1.0], vec![Some(0.3)]),
            map(&[0.0], &[1.0], vec![None]),
            map(
                &[1.0, 1.0 + 1e-12],
                &[-3.0, 1e9],
                vec![Some(0.0), None, Some(1e300), Some(-1e-300)],
            ),
            map(&[1.0, 2.0], &[1.0], vec![Some(0.25), Some(0.75)]),
            map(
                &(0..300).map(f64::from).collect::<Vec<_>>(),
                &[1.0],
                vec![Some(0.5); 300],
            ),
        ];
        let logarithmic = maps.clone().map(|map| Map {
            colours: Axis::logarithmic("quantity"),
            ..map
        });
        for map in maps.into_iter().chain(logarithmic) {
            let text = svg(&map);
            assert!(
                text.trim_end().ends_with("</svg>")
                    && !text.contains("NaN")
                    && !text.contains("inf"),
                "{text}"
            );
        }
    }

    #[test]
    fn logarithmic_colours_have_round_labels_and_short_numbers() {
        let values = [3.3, 95.38, 1961.2, 624_390.9].map(Some).to_vec();
        let mut map = map(&[1.0, 2.0, 3.0, 4.0], &[1.0], values);
        map.colours = Axis::logarithmic("quantity");
        let text = svg(&map);
        for label in ["3.30", "95.4", "1960", "6·10⁵", "10⁵"] {
            assert!(text.contains(label), "{label}\n{text}");
        }
    }

    #[test]
    fn labels_do_not_touch() {
        let side = side(&[1.0, 2.0, 3.0, 4.0, 5.0]);
        let labels = |distance: i32| {
            let ticks = ticks(&side, |value| fine(distance) * value as i32, |_| 10);
            ticks
                .into_iter()
                .map(|(_, label)| label)
                .collect::<Vec<_>>()
                .concat()
        };
        assert_eq!([labels(10), labels(6), labels(1)], ["12345", "135", "1"]);
    }
}

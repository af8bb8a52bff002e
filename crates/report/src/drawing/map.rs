//! Maps: a quantity over two others as coloured cells, with numbers where they fit.
//!
//! The colours are those of viridis, whose brightness rises evenly: a map can be read in grey.

use super::diagram::Frame;
use super::format::Format;
use super::heading::Heading;
use super::scale::{Axis, Scale, coordinate};
use super::{Canvas, Color, FAINT, INK, VERMILION, WHITE, axis, fine, stroke, text, viridis, width};
use bristle_text::number::{significant, spanning};

/// Width of a figure and height of its cells in pixels, and the least height on paper.
const SIZE: (i32, i32) = (680, 340);
const MIN_HEIGHT: i32 = 170;
/// Pixels below and to the right of the cells.
const BOTTOM: i32 = 50;
const RIGHT: i32 = 100;
/// Distance between the colour bar and the cells, and width of the bar.
const BAR: (i32, i32) = (20, 14);
/// Number of colours in the bar.
const SHADES: u32 = 100;
/// Font size of the numbers in cells, and the margin around them.
const NUMBER: i32 = 10;
const FREE: (i32, i32) = (4, 5);
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
    /// The scale of the colours, with name and unit of the quantity.
    pub colours: Axis,
    /// The values of the quantity, row by row from the bottom; none where unknown.
    pub values: Vec<Option<f64>>,
    /// Whether each cell has a mark in its corner.
    pub marked: Vec<bool>,
    /// Range of the colours; by default that of the values.
    pub range: Option<[f64; 2]>,
    /// The line that is drawn, if there is one.
    pub line: Option<Contour>,
}

/// A contour line of the quantity, or of another one over the same sides.
#[derive(Clone, Debug, PartialEq)]
pub struct Contour {
    /// The value along it.
    pub level: f64,
    /// The values of the other quantity, row by row from the bottom.
    pub other: Option<Vec<Option<f64>>>,
}

impl CellAxis {
    /// Borders of the cells: midway between values, and equally far beyond the first and the last.
    fn borders(&self) -> Vec<f64> {
        let values = &self.values;
        let (first, last) = (values[0], values[values.len() - 1]);
        let ends = match values.len() {
            1 => [first.abs().max(1e-300) / 2.0; 2],
            count => [(values[1] - first) / 2.0, (last - values[count - 2]) / 2.0],
        };
        let middles = values.windows(2).map(|pair| pair[0] + (pair[1] - pair[0]) / 2.0);
        std::iter::once(first - ends[0]).chain(middles).chain([last + ends[1]]).collect()
    }
}

/// Maps the values of a side to coordinates between two pixels.
fn placing(borders: &[f64], low: i32, high: i32) -> impl Fn(f64) -> i32 {
    let (first, last) = (borders[0], borders[borders.len() - 1]);
    move |value| fine(low) + ((value - first) / (last - first) * f64::from(fine(high - low))).round() as i32
}

/// Values and labels, thinned out until the labels do not touch: every value, or every second, and so on.
fn ticks(side: &CellAxis, at: impl Fn(f64) -> i32, room: impl Fn(&str) -> i32) -> Vec<(f64, String)> {
    let all: Vec<(f64, String)> = side.values.iter().copied().zip(side.labels.iter().cloned()).collect();
    let apart = |every: usize| {
        let kept: Vec<_> = all.iter().step_by(every).collect();
        kept.windows(2).all(|pair| {
            let distance = (at(pair[1].0) - at(pair[0].0)).abs();
            distance >= fine(room(&pair[0].1).max(room(&pair[1].1)))
        })
    };
    let every = (1..all.len()).find(|&every| apart(every)).unwrap_or(all.len().max(1));
    all.into_iter().step_by(every).collect()
}

/// Side of the mark in the corner of a cell, in pixels.
const MARK: i32 = 9;

/// The number in a cell.
fn number(value: f64, colours: &Axis) -> String {
    let number = if colours.logarithmic { spanning(value) } else { significant(value) };
    number.replace('-', "−")
}

/// The part of the colours that lies below a value. A value that the axis cannot show is at an end.
fn part(scale: &Scale, value: f64) -> f64 {
    coordinate(&scale.axis, value).map_or(if value > 0.0 { 1.0 } else { 0.0 }, |at| scale.part(at))
}

/// The number in a cell on the canvas.
struct Number {
    text: String,
    /// The part of the colours that lies below its value.
    part: f64,
    middle: (i32, i32),
    /// Half its width and height.
    half: (i32, i32),
}

impl Number {
    /// Whether a point is on the number, or next to it.
    fn covers(&self, (x, y): (i32, i32)) -> bool {
        (x - self.middle.0).abs() <= self.half.0 + fine(FREE.0) / 2
            && (y - self.middle.1).abs() <= self.half.1 + fine(FREE.1) / 4
    }
}

/// The parts of a straight line beside the numbers, told apart at points one pixel apart.
fn beside([from, to]: [(i32, i32); 2], numbers: &[Number]) -> Vec<[(i32, i32); 2]> {
    let (wide, high) = (to.0 - from.0, to.1 - from.1);
    let steps = (wide.abs().max(high.abs()) / fine(1)).max(1);
    let at = |step: i32| (from.0 + wide * step / steps, from.1 + high * step / steps);
    let mut parts: Vec<[i32; 2]> = Vec::new();
    let is_free = |step: &i32| !numbers.iter().any(|number| number.covers(at(*step)) || number.covers(at(step + 1)));
    for step in (0..steps).filter(is_free) {
        match parts.last_mut() {
            Some([_, end]) if *end == step => *end += 1,
            _ => parts.push([step, step + 1]),
        }
    }
    parts.into_iter().map(|ends| ends.map(at)).collect()
}

impl Map {
    /// Draws the map for a screen.
    #[must_use]
    pub fn draw(&self) -> Canvas {
        self.draw_in(&Format::default())
    }

    /// Draws the map.
    #[must_use]
    pub fn draw_in(&self, format: &Format) -> Canvas {
        let known = self.values.iter().flatten().copied();
        let limits = self.range.into_iter().flatten();
        let shown: Vec<f64> = limits.chain(known).filter_map(|value| coordinate(&self.colours, value)).collect();
        let scale = Scale::exact(self.colours.clone(), shown.iter().copied());
        let size = format.font_size(11);
        let labels = self.y.labels.iter().map(|label| width(label, size)).max().unwrap_or(0);
        let left = 36 + labels.max(24);
        let page = format.width(SIZE.0);
        let heading = Heading::new(format, &self.title, &self.subtitle, [left, page]);
        let top = heading.height();
        let frame @ [_, _, right, bottom] = [left, top, page - RIGHT, top + format.height(SIZE.1, SIZE.0, MIN_HEIGHT)];
        let mut canvas = Canvas::on(format, (page, bottom + BOTTOM));
        heading.draw(&mut canvas);
        self.draw_cells(&mut canvas, frame, &scale);
        let (xs, ys) = (self.x.borders(), self.y.borders());
        let (across, up) = (placing(&xs, left, right), placing(&ys, bottom, top));
        let numbers = self.numbers(format, &scale, &across, &up);
        self.draw_line(&mut canvas, &numbers, &across, &up);
        for number in numbers {
            let shade = if number.part < 0.6 { WHITE } else { INK };
            canvas.text(&number.text, text(NUMBER, shade).centred(), number.middle);
        }
        canvas.frame([(fine(left), fine(top)), (fine(right), fine(bottom))], stroke(FAINT, 8));
        let below = ticks(&self.x, &across, |label| width(label, size) + 8);
        let name = (&*self.x.label, ((left + right) / 2, bottom + 38));
        axis(&mut canvas, name, &below, false, |x| (across(x), fine(bottom)));
        let beside = ticks(&self.y, &up, |_| 15);
        axis(&mut canvas, (&self.y.label, (14, (top + bottom) / 2)), &beside, true, |y| (fine(left), up(y)));
        // Without a value the colours have no range.
        if !shown.is_empty() {
            self.draw_bar(&mut canvas, frame, &scale);
        }
        canvas
    }

    fn draw_cells(&self, canvas: &mut Canvas, [left, top, right, bottom]: Frame, scale: &Scale) {
        let (xs, ys) = (self.x.borders(), self.y.borders());
        let (across, up) = (placing(&xs, left, right), placing(&ys, bottom, top));
        let cells = || {
            let rows = self.values.chunks(self.x.values.len()).zip(ys.windows(2));
            rows.flat_map(|(row, y)| row.iter().zip(xs.windows(2)).map(move |(value, x)| (value, [x, y])))
        };
        let corners = |[x, y]: [&[f64]; 2]| [(across(x[0]), up(y[1])), (across(x[1]), up(y[0]))];
        for (value, borders) in cells() {
            let [(low_x, high_y), (high_x, low_y)] = corners(borders);
            match value {
                // A cell extends slightly below the one that is drawn after it, so that no seam shows.
                Some(value) => {
                    let reach = [(low_x, high_y - 5), (high_x + 5, low_y)];
                    let reach = [(reach[0].0, reach[0].1.max(fine(top))), (reach[1].0.min(fine(right)), reach[1].1)];
                    canvas.rectangle(reach, viridis(part(scale, *value)));
                }
                None => hatch(canvas, [(low_x, high_y), (high_x, low_y)]),
            }
        }
        // Again, over what their neighbours have drawn into them.
        for (_, borders) in cells().filter(|(value, _)| value.is_none()) {
            hatch(canvas, corners(borders));
        }
        for ((_, borders), _) in cells().zip(&self.marked).filter(|(_, marked)| **marked) {
            let [(low_x, high_y), (high_x, low_y)] = corners(borders);
            let side = fine(MARK).min((high_x - low_x) / 2).min((low_y - high_y) / 2);
            let corner = [(high_x - side, high_y), (high_x, high_y), (high_x, high_y + side)];
            canvas.area(corner, WHITE, 1.0);
            let inner = side - (2 * fine(1)).min(side / 2);
            canvas.area([(high_x - inner, high_y), corner[1], (high_x, high_y + inner)], VERMILION, 1.0);
        }
    }

    /// The numbers of all cells if all of them fit, otherwise none.
    fn numbers(
        &self,
        format: &Format,
        scale: &Scale,
        across: &impl Fn(f64) -> i32,
        up: &impl Fn(f64) -> i32,
    ) -> Vec<Number> {
        let size = format.font_size(NUMBER);
        let (xs, ys) = (self.x.borders(), self.y.borders());
        let (mut numbers, mut largest) = (Vec::new(), 0.0_f64);
        for (row, y) in self.values.chunks(self.x.values.len()).zip(ys.windows(2)) {
            for (value, x) in row.iter().zip(xs.windows(2)) {
                let Some(value) = *value else { continue };
                let text = number(value, &self.colours);
                let half = (fine(width(&text, size)) / 2, fine(size) / 2);
                let [left, right] = [x[0], x[1]].map(across);
                let [bottom, top] = [y[0], y[1]].map(up);
                if right - left < 2 * (half.0 + fine(FREE.0)) || bottom - top < 2 * (half.1 + fine(FREE.1)) {
                    return Vec::new();
                }
                let middle = ((left + right) / 2, (top + bottom) / 2);
                numbers.push(Number { text, part: part(scale, value), middle, half });
                largest = largest.max(value.abs());
            }
        }
        if scale.factor.is_empty() && largest >= 0.1 { numbers } else { Vec::new() }
    }

    /// The pieces of the contour line in coordinates of the canvas; none without a line.
    fn pieces(&self, across: &impl Fn(f64) -> i32, up: &impl Fn(f64) -> i32) -> Vec<[(i32, i32); 2]> {
        let Some(Contour { level, other }) = &self.line else { return Vec::new() };
        let sides = [&self.x.values[..], &self.y.values];
        let pieces = match other {
            Some(values) => contour(sides, values, *level),
            None => {
                let at = |value: f64| coordinate(&self.colours, value);
                let coordinates: Vec<Option<f64>> = self.values.iter().map(|value| value.and_then(at)).collect();
                at(*level).map_or_else(Vec::new, |level| contour(sides, &coordinates, level))
            }
        };
        pieces.into_iter().map(|piece| piece.map(|(x, y)| (across(x), up(y)))).collect()
    }

    /// Draws the contour line in ink on white, so that it shows on every colour, with gaps at the numbers.
    fn draw_line(
        &self,
        canvas: &mut Canvas,
        numbers: &[Number],
        across: &impl Fn(f64) -> i32,
        up: &impl Fn(f64) -> i32,
    ) {
        let pieces: Vec<_> = self.pieces(across, up).into_iter().flat_map(|piece| beside(piece, numbers)).collect();
        for (color, tenths) in LINE {
            for piece in &pieces {
                canvas.line(*piece, stroke(color, tenths));
            }
        }
    }

    fn draw_bar(&self, canvas: &mut Canvas, [_, top, right, bottom]: Frame, scale: &Scale) {
        let (start, end) = (right + BAR.0, right + BAR.0 + BAR.1);
        let at = |part: f64| fine(bottom) - (part * f64::from(fine(bottom - top))).round() as i32;
        for shade in 0..SHADES {
            let [low, middle] = [0.0, 0.5].map(|half| (f64::from(shade) + half) / f64::from(SHADES));
            let corners = [(fine(start), fine(top)), (fine(end), at(low))];
            canvas.rectangle(corners, viridis(middle));
        }
        canvas.frame([(fine(start), fine(top)), (fine(end), fine(bottom))], stroke(FAINT, 8));
        let mut labels = 0;
        for (value, label) in &scale.ticks {
            let level = scale.place(*value, bottom, top);
            canvas.line([(fine(end), level), (fine(end + 4), level)], stroke(INK, 10));
            canvas.text(label, text(11, INK).right(), (fine(end + 7), level));
            labels = labels.max(width(label, 11));
        }
        let own = self.line.as_ref().filter(|line| line.other.is_none());
        let level = own.and_then(|line| coordinate(&self.colours, line.level));
        if let Some(level) = level.filter(|level| (0.0..=1.0).contains(&scale.part(*level))) {
            let level = scale.place(level, bottom, top);
            for (color, tenths) in LINE {
                canvas.line([(fine(start), level), (fine(end), level)], stroke(color, tenths));
            }
        }
        canvas.text(&scale.factor, text(11, INK).right(), (fine(start), fine(top - 12)));
        let name = (end + 7 + labels + 16, (top + bottom) / 2);
        canvas.text(&self.colours.label, text(12, INK).centred().upwards(), (fine(name.0), fine(name.1)));
    }
}

/// Colours and widths (tenths of a pixel) of the contour line, from the lowest to the highest layer.
const LINE: [(Color, i32); 2] = [(WHITE, 44), (INK, 20)];

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

/// The pieces of the contour line at this level of a quantity given row by row, linear between neighbours.
///
/// Four neighbours of which one is unknown have no piece between them.
pub fn contour([xs, ys]: [&[f64]; 2], values: &[Option<f64>], level: f64) -> Vec<[(f64, f64); 2]> {
    let mut pieces = Vec::new();
    for (row, y) in ys.windows(2).enumerate() {
        for (column, x) in xs.windows(2).enumerate() {
            let at = |column: usize, row: usize| values.get(row * xs.len() + column).copied().flatten();
            let around = [at(column, row), at(column + 1, row), at(column + 1, row + 1), at(column, row + 1)];
            let [Some(a), Some(b), Some(c), Some(d)] = around else { continue };
            let corners = [(x[0], y[0], a), (x[1], y[0], b), (x[1], y[1], c), (x[0], y[1], d)];
            let crossing = |from: usize| {
                let ((x0, y0, v0), (x1, y1, v1)) = (corners[from], corners[(from + 1) % 4]);
                let part = (level - v0) / (v1 - v0);
                ((v0 < level) != (v1 < level)).then_some((x0 + part * (x1 - x0), y0 + part * (y1 - y0)))
            };
            let crossings: Vec<(f64, f64)> = (0..4).filter_map(crossing).collect();
            match crossings[..] {
                [from, to] => pieces.push([from, to]),
                [below, right, above, left] => {
                    // A saddle: the value in the middle tells which corners belong together.
                    let joined = ((a + b + c + d) / 4.0 < level) == (a < level);
                    let pairs = if joined { [[below, right], [above, left]] } else { [[below, left], [right, above]] };
                    pieces.extend(pairs);
                }
                _ => {}
            }
        }
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;

    fn side(values: &[f64]) -> CellAxis {
        let labels = values.iter().map(f64::to_string).collect();
        CellAxis { label: "side in mm".to_owned(), values: values.to_vec(), labels }
    }

    fn map(xs: &[f64], ys: &[f64], values: Vec<Option<f64>>) -> Map {
        let (title, subtitle, colours) = ("Title".to_owned(), "Below".to_owned(), Axis::linear("quantity"));
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
            line: Some(Contour { level: 0.5, other: None }),
        }
    }

    #[test]
    fn borders_lie_between_values() {
        assert_eq!(side(&[1.0, 2.0, 4.0]).borders(), [0.5, 1.5, 3.0, 5.0]);
        assert_eq!(side(&[3.0]).borders(), [1.5, 4.5]);
    }

    #[test]
    fn the_line_of_a_level_is_interpolated() {
        let [xs, ys] = [[0.0, 1.0, 3.0], [0.0, 2.0, 3.0]];
        let plane: Vec<_> = ys.iter().flat_map(|y| xs.map(|x| Some(x + y))).collect();
        let pieces = contour([&xs, &ys], &plane, 1.5);
        assert!(!pieces.is_empty());
        for (x, y) in pieces.into_iter().flatten() {
            assert!((x + y - 1.5_f64).abs() < 1e-12, "{x} {y}");
        }
        let saddle = [1.0, 0.0, 0.0, 1.0].map(Some);
        assert_eq!(contour([&xs[..2], &ys[..2]], &saddle, 0.5).len(), 2);
        let gap = [Some(1.0), None, Some(0.0), Some(1.0)];
        assert!(contour([&xs[..2], &ys[..2]], &gap, 0.5).is_empty());
    }

    #[test]
    fn the_line_leaves_numbers_free() {
        let number = |x: i32| Number { text: "1".to_owned(), part: 0.5, middle: (x, 0), half: (fine(5), fine(5)) };
        let line = [(0, 0), (fine(100), 0)];
        assert_eq!(beside(line, &[]), [line]);
        let parts = beside(line, &[number(fine(50)), number(fine(100))]);
        let free = 5 + FREE.0 / 2;
        let ends = [[0, 50 - free - 1], [50 + free + 1, 100 - free - 1]];
        assert_eq!(parts, ends.map(|ends| ends.map(|x| (fine(x), 0))));
        assert!(beside([(0, 0), (0, 0)], &[number(0)]).is_empty());
        // The line of another quantity has no place on the colours.
        let lines = [None, Some(vec![Some(0.0), Some(2.0), Some(0.0), Some(2.0)])].map(|other| {
            let [sides, values] = [[1.0, 2.0], [5.0, 6.0]];
            let mut map = map(&sides, &sides, values.into_iter().chain(values).map(Some).collect());
            map.line = Some(Contour { level: 1.0, other });
            map.draw().svg().matches("stroke=\"#282C34\" stroke-width=\"20\"").count()
        });
        assert!(lines[0] == 0 && lines[1] > 0, "{lines:?}");
    }

    #[test]
    fn odd_maps_are_drawn() {
        let maps = [
            map(&[1.0], &[1.0], vec![Some(0.3)]),
            map(&[0.0], &[1.0], vec![None]),
            map(&[1.0, 1.0 + 1e-12], &[-3.0, 1e9], vec![Some(0.0), None, Some(1e300), Some(-1e-300)]),
            map(&[1.0, 2.0], &[1.0], vec![Some(0.25), Some(0.75)]),
            map(&(0..300).map(f64::from).collect::<Vec<_>>(), &[1.0], vec![Some(0.5); 300]),
        ];
        let logarithmic = maps.clone().map(|map| Map { colours: Axis::logarithmic("quantity"), ..map });
        for map in maps.into_iter().chain(logarithmic) {
            let text = map.draw().svg();
            assert!(text.trim_end().ends_with("</svg>") && !text.contains("NaN") && !text.contains("inf"), "{text}");
        }
    }

    #[test]
    fn logarithmic_colours_have_round_labels_and_short_numbers() {
        let values = [3.3, 95.38, 1961.2, 624_390.9].map(Some).to_vec();
        let mut map = map(&[1.0, 2.0, 3.0, 4.0], &[1.0], values);
        map.colours = Axis::logarithmic("quantity");
        let text = map.draw().svg();
        for label in ["3.30", "95.4", "1960", "6.2e5", "10⁵"] {
            assert!(text.contains(label), "{label}\n{text}");
        }
    }

    #[test]
    fn labels_do_not_touch() {
        let side = side(&[1.0, 2.0, 3.0, 4.0, 5.0]);
        let labels = |distance: i32| {
            let ticks = ticks(&side, |value| fine(distance) * value as i32, |_| 10);
            ticks.into_iter().map(|(_, label)| label).collect::<Vec<_>>().concat()
        };
        assert_eq!([labels(10), labels(6), labels(1)], ["12345", "135", "1"]);
    }
}

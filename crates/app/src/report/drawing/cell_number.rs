//! Numbers in the cells of a map, which make room for its contour line.

use super::scale::Axis;
use super::{CanvasPoint, fine, typeset};
use bristle_study::text::number::{significant, spanning};

/// Font size of the numbers in cells, and the margin around them.
pub(super) const NUMBER: i32 = 10;
pub(super) const NUMBER_MARGIN: (i32, i32) = (4, 5);

/// Returns the number in a cell. On a logarithmic scale, a number with a power of ten has one digit
/// before it, so that it fits.
pub(super) fn number(value: f64, colours: &Axis) -> String {
    let number = if colours.logarithmic {
        spanning(value)
    } else {
        significant(value)
    };
    typeset(&if colours.logarithmic && number.contains('e') {
        format!("{value:.0e}")
    } else {
        number
    })
}

/// The number in a cell on the canvas.
pub(super) struct CellNumber {
    pub text: String,
    /// The part of the colours that lies below its value.
    pub part: f64,
    pub middle: CanvasPoint,
    /// Half its width and height, and half those of its cell.
    pub half: CanvasPoint,
    pub cell: CanvasPoint,
}

impl CellNumber {
    /// Moves the number away from the points of a line, within its cell, where there is room.
    pub fn avoid(&mut self, line: &[CanvasPoint]) {
        let (wide, high) = (
            self.cell.0 - self.half.0 - fine(2),
            self.cell.1 - self.half.1 - fine(2),
        );
        let (x, y) = self.middle;
        let near: Vec<CanvasPoint> = line
            .iter()
            .copied()
            .filter(|point| {
                (point.0 - x).abs() <= self.cell.0 && (point.1 - y).abs() <= self.cell.1
            })
            .collect();
        let free = |&(across, down): &CanvasPoint| {
            let gap = |&(at_x, at_y): &CanvasPoint| {
                ((at_x - across).abs() - self.half.0).max((at_y - down).abs() - self.half.1)
            };
            near.iter()
                .map(gap)
                .min()
                .unwrap_or(i32::MAX)
                .min(fine(NUMBER_MARGIN.0))
        };
        let moves = [
            (0, 0),
            (0, -1),
            (0, 1),
            (-1, 0),
            (1, 0),
            (-1, -1),
            (1, 1),
            (-1, 1),
            (1, -1),
        ];
        let places = moves.map(|(across, down)| (x + across * wide, y + down * high));
        // The first of several equal ones.
        self.middle = places
            .into_iter()
            .rev()
            .max_by_key(free)
            .unwrap_or(self.middle);
    }
}

#[cfg(test)]
mod tests {
    use super::super::contour::sampled;
    use super::*;

    #[test]
    fn numbers_move_off_the_line() {
        let number = || CellNumber {
            text: "1".to_owned(),
            part: 0.5,
            middle: (0, 0),
            half: (fine(5), fine(4)),
            cell: (fine(20), fine(14)),
        };
        let moved = |line: &[CanvasPoint]| {
            let mut number = number();
            number.avoid(&sampled(line).collect::<Vec<_>>());
            number.middle
        };
        assert_eq!(moved(&[]), (0, 0));
        assert_eq!(
            moved(&[(-fine(20), fine(9)), (fine(20), fine(9))]),
            (0, 0),
            "a line beside it"
        );
        assert_eq!(moved(&[(-fine(20), 0), (fine(20), 0)]), (0, -fine(8)));
        assert_eq!(
            moved(&[(-fine(20), fine(14)), (fine(20), -fine(14))]),
            (-fine(13), -fine(8))
        );
    }
}

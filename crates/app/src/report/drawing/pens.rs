//! Styles of curves. Colour, dashes and markers differ at once, so a figure can be read in grey.

use std::f64::consts::TAU;

use super::{BLUE, Color, GREY, INK, Marker, Pen, VERMILION};

/// The palette of Okabe and Ito without its yellow, which is hard to see on white.
pub const COLORS: [Color; 7] = [
    BLUE,
    VERMILION,
    Color(0, 158, 115),
    Color(204, 121, 167),
    Color(230, 159, 0),
    Color(86, 180, 233),
    INK,
];
/// Corners and turns of the markers. The numbers of markers, colours and dashes have no common
/// factor, so no two of the first 210 curves look alike.
const MARKERS: [(u32, f64); 5] = [
    (32, 0.0),
    (4, TAU / 8.0),
    (3, -TAU / 4.0),
    (4, 0.0),
    (3, TAU / 4.0),
];
const DASHES: [(i32, i32); 6] = [(1, 0), (7, 3), (2, 3), (14, 4), (7, 8), (4, 6)];

/// Returns the pen of the coloured curve number `index`.
pub fn pen(index: usize) -> Pen {
    let (corners, turn) = MARKERS[index % MARKERS.len()];
    let (color, dash) = (COLORS[index % COLORS.len()], DASHES[index % DASHES.len()]);
    Pen {
        color,
        tenths: 16,
        dash,
        marker: Marker {
            corners,
            turn,
            radius: 4,
        },
    }
}

/// Returns the pen of reference number `index`.
pub fn reference_pen(index: usize) -> Pen {
    Pen {
        color: GREY,
        tenths: 10,
        dash: DASHES[index % DASHES.len()],
        ..pen(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
}

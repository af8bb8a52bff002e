//! Colours of the figures: of text, lines and curves, and the colour scale of the maps.

/// A colour by its red, green and blue components.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Color(pub u8, pub u8, pub u8);

/// Background, and parts cut out of a colour.
pub const WHITE: Color = Color(255, 255, 255);
/// Text, and lines with the weight of text.
pub const INK: Color = Color(40, 44, 52);
/// Secondary text and lines.
pub const GREY: Color = Color(100, 104, 110);
/// Frames and other auxiliary lines.
pub const FAINT: Color = Color(150, 154, 160);
/// Lines of a grid.
pub const GRID: Color = Color(228, 230, 233);
/// Blue from the palette of Okabe and Ito, which readers with any colour vision can distinguish.
pub const BLUE: Color = Color(0, 114, 178);
/// Vermilion from the same palette.
pub const VERMILION: Color = Color(213, 94, 0);

/// Viridis at equal distances, from its lower to its upper end.
const VIRIDIS: [Color; 8] = [
    Color(68, 1, 84),
    Color(70, 50, 127),
    Color(54, 92, 141),
    Color(39, 127, 143),
    Color(31, 162, 136),
    Color(74, 194, 110),
    Color(160, 219, 57),
    Color(254, 232, 37),
];

/// Returns the colour of viridis at `part` of its range, 0 to 1. Its brightness rises evenly, so a
/// map can be read in grey.
pub fn viridis(part: f64) -> Color {
    let at = part.clamp(0.0, 1.0) * (VIRIDIS.len() - 1) as f64;
    let (below, above) = (VIRIDIS[at.floor() as usize], VIRIDIS[at.ceil() as usize]);
    let lower = at.ceil() - at;
    let mix = |below: u8, above: u8| {
        ((1.0 - lower) * f64::from(above) + lower * f64::from(below)).round() as u8
    };
    Color(
        mix(below.0, above.0),
        mix(below.1, above.1),
        mix(below.2, above.2),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn viridis_goes_through_its_colours() {
        assert_eq!(
            [0.0, 1.0, -3.0, 7.0].map(viridis),
            [VIRIDIS[0], VIRIDIS[7], VIRIDIS[0], VIRIDIS[7]]
        );
        assert_eq!(viridis(0.5), Color(35, 145, 140));
        // At a colour of the table, and just beside it.
        assert_eq!(viridis(3.0 / 7.0), VIRIDIS[3]);
        assert_eq!(viridis(3.0 / 7.0 + 1e-6), VIRIDIS[3]);
    }
}

//! The font of bitmaps, with its glyphs as paths, and of PDF files.
//!
//! The font is embedded, so bitmaps and PDF files are equal on every machine. Its metrics equal
//! those of Helvetica and Arial, which the SVG files request.

use std::sync::LazyLock;

use tiny_skia::PathBuilder;
use ttf_parser::{Face, GlyphId, OutlineBuilder};

use super::symbols::{TextRun, runs};

/// Liberation Sans 2.1.5, under the SIL Open Font License (`assets/fonts/OFL.txt`).
pub(super) const FILE: &[u8] = include_bytes!("../../../assets/fonts/LiberationSans-Regular.ttf");
static FONT: LazyLock<Face<'static>> =
    LazyLock::new(|| Face::parse(FILE, 0).expect("the font of the program can be read"));

/// Returns the parsed font.
pub(super) fn face() -> &'static Face<'static> {
    &FONT
}

/// Characters that figures use and the font lacks, with similar characters of the font.
const SUBSTITUTES: [(char, char); 2] = [('⁻', 'ˉ'), ('⁰', '°')];

/// Returns the glyph of a character; an empty box if the font lacks it.
pub(super) fn glyph(character: char) -> GlyphId {
    let substitute = SUBSTITUTES
        .iter()
        .find(|(lacking, _)| *lacking == character);
    FONT.glyph_index(substitute.map_or(character, |(_, similar)| *similar))
        .unwrap_or_default()
}

/// Returns the kerning between two glyphs, in font units.
fn kerning(left: GlyphId, right: GlyphId) -> i16 {
    let subtables = FONT
        .tables()
        .kern
        .into_iter()
        .flat_map(|kern| kern.subtables);
    let mut pairs = subtables.filter(|table| table.horizontal && !table.variable);
    pairs
        .find_map(|table| table.glyphs_kerning(left, right))
        .unwrap_or(0)
}

/// Returns the glyphs of a run with their distances from its start, and the length of the run, in
/// font units.
pub(super) fn set(run: &TextRun<'_>) -> (Vec<(GlyphId, i32)>, i32) {
    let mut glyphs: Vec<(GlyphId, i32)> = Vec::with_capacity(run.text.len());
    let mut length = 0;
    for glyph in run.text.chars().map(glyph) {
        if let Some(&(last, _)) = glyphs.last() {
            length += i32::from(kerning(last, glyph));
        }
        glyphs.push((glyph, length));
        length += i32::from(FONT.glyph_hor_advance(glyph).unwrap_or(0));
    }
    (glyphs, length)
}

/// Returns coordinates per font unit, for a run of a text with the font size `size`.
fn scale(run: &TextRun<'_>, size: i32) -> f32 {
    run.size(size) as f32 / f32::from(FONT.units_per_em())
}

/// Returns the length of a text with the font size `size`, in the unit of `size`.
pub(super) fn length(text: &str, size: i32) -> f32 {
    runs(text)
        .iter()
        .map(|run| set(run).1 as f32 * scale(run, size))
        .sum()
}

/// Adds the outlines of a text with the font size `size` to `path`. Its baseline starts at `(x,
/// y)`, with `y` downwards.
pub(super) fn outline(path: &mut PathBuilder, text: &str, size: i32, (mut x, y): (f32, f32)) {
    for run in runs(text) {
        let (scale, baseline) = (scale(&run, size), y + run.drop(size) as f32);
        let (glyphs, length) = set(&run);
        for (glyph, from) in glyphs {
            let mut outline = GlyphOutline {
                path,
                scale,
                origin: (x + from as f32 * scale, baseline),
            };
            // A space has no outline.
            FONT.outline_glyph(glyph, &mut outline);
        }
        x += length as f32 * scale;
    }
}

/// Scales and moves the outline of a glyph.
struct GlyphOutline<'a> {
    path: &'a mut PathBuilder,
    scale: f32,
    origin: (f32, f32),
}

impl GlyphOutline<'_> {
    fn place(&self, x: f32, y: f32) -> (f32, f32) {
        (
            self.origin.0 + x * self.scale,
            self.origin.1 - y * self.scale,
        )
    }
}

impl OutlineBuilder for GlyphOutline<'_> {
    fn move_to(&mut self, x: f32, y: f32) {
        let (x, y) = self.place(x, y);
        self.path.move_to(x, y);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        let (x, y) = self.place(x, y);
        self.path.line_to(x, y);
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        let ((x1, y1), (x, y)) = (self.place(x1, y1), self.place(x, y));
        self.path.quad_to(x1, y1, x, y);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        let ((x1, y1), (x2, y2), (x, y)) =
            (self.place(x1, y1), self.place(x2, y2), self.place(x, y));
        self.path.cubic_to(x1, y1, x2, y2, x, y);
    }

    fn close(&mut self) {
        self.path.close();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_character_of_the_figures_has_a_glyph() {
        for character in
            "abcxyzABCXYZ0123456789()=+,._/·×±−–½²³¹⁴⁵⁶⁷⁸⁹⁻⁰εωφµρχζΩθ√≈≤≥…ΔΣβ∫∞%".chars()
        {
            assert_ne!(glyph(character), GlyphId::default(), "{character}");
        }
    }

    #[test]
    fn lengths_are_those_of_the_font() {
        // Advances of 1251, 569 and 1139 of 2048 units.
        assert_eq!(length("F", 2048), 1251.0);
        assert_eq!(length("F 0", 2048), 1251.0 + 569.0 + 1139.0);
        assert_eq!(length("00", 2048), 2.0 * 1139.0);
        // "11" is kerned by −152 units, and a subscript has 70 % of the size.
        assert_eq!(length("11", 2048), 2.0 * 1139.0 - 152.0);
        assert_eq!(length("F_00", 2000), length("F", 2000) + length("00", 1400));
    }
}

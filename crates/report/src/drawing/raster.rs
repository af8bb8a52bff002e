//! Pictures as bitmaps: the text of an SVG file in, a PNG file out.
//!
//! The one font is part of the program, so that a machine without fonts draws the same bytes as any other. It is metrically
//! equal to the Helvetica and Arial that the SVG asks for.

use std::sync::{Arc, LazyLock};

use resvg::tiny_skia::{Color, Pixmap, Transform};
use resvg::usvg::fontdb::{Database, Source};
use resvg::usvg::{Options, Tree};

/// Liberation Sans 2.1.5, under the SIL Open Font License (`assets/fonts/OFL.txt`).
static FONT: &[u8] = include_bytes!("../../assets/fonts/LiberationSans-Regular.ttf");

/// Pixels of the bitmap for one of the picture: about 200 dpi.
const SCALE: f32 = 2.0;

/// Characters of drawings that the font lacks, and what looks like them.
const SUBSTITUTES: [(char, char); 2] = [('⁻', 'ˉ'), ('⁰', '°')];

static FONTS: LazyLock<Arc<Database>> = LazyLock::new(|| {
    let mut fonts = Database::new();
    fonts.load_font_source(Source::Binary(Arc::new(FONT)));
    // All that a picture asks for.
    fonts.set_sans_serif_family("Liberation Sans");
    Arc::new(fonts)
});

/// A picture as a PNG file, twice as many pixels as the SVG has.
pub fn png(svg: &str) -> super::Result<Vec<u8>> {
    let mut text = svg.to_owned();
    for (lacking, similar) in SUBSTITUTES {
        text = text.replace(lacking, similar.encode_utf8(&mut [0; 4]));
    }
    let options =
        Options { fontdb: Arc::clone(&FONTS), font_family: "Liberation Sans".to_owned(), ..Options::default() };
    let tree = Tree::from_str(&text, &options)?;
    let size = tree.size().to_int_size().scale_by(SCALE).ok_or("the picture has no size")?;
    let mut pixels = Pixmap::new(size.width(), size.height()).ok_or("the picture is too large")?;
    pixels.fill(Color::WHITE);
    resvg::render(&tree, Transform::from_scale(SCALE, SCALE), &mut pixels.as_mut());
    Ok(pixels.encode_png()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture of one word.
    fn picture(word: &str) -> Vec<u8> {
        let svg = super::super::svg((60, 20), |area| {
            area.draw_text(word, &super::super::text(12, super::super::INK), (0, 0))?;
            Ok(())
        });
        png(&svg.expect("a picture")).expect("a bitmap")
    }

    #[test]
    fn bitmaps_have_twice_the_pixels_and_the_same_bytes() {
        let bytes = picture("F_n");
        assert_eq!(bytes[..8], *b"\x89PNG\r\n\x1a\n");
        assert_eq!([&bytes[16..20], &bytes[20..24]], [&120_u32.to_be_bytes()[..], &40_u32.to_be_bytes()[..]]);
        assert_eq!(bytes, picture("F_n"));
    }

    #[test]
    fn every_character_of_the_drawings_has_a_glyph() {
        // What the font lacks is drawn as a box.
        let boxed = picture("\u{10FFFD}");
        for character in "abcxyzABCXYZ0123456789()=+,._/·×±−–½²³¹⁴⁵⁶⁷⁸⁹⁻⁰εωφµρχζΩθ√≈≤≥…".chars()
        {
            let drawn = picture(&character.to_string());
            assert!(drawn != boxed && drawn != picture(""), "{character}");
        }
    }
}

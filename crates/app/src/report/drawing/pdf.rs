//! A canvas as a PDF file: shapes as in the SVG file, and text in the font of the bitmaps. The file
//! holds only the glyphs that it uses.

use std::collections::{BTreeMap, BTreeSet};

use miniz_oxide::deflate::compress_to_vec_zlib;
use pdf_writer::types::{CidFontType, FontFlags, LineCapStyle, SystemInfo, UnicodeCmap};
use pdf_writer::{Content, Filter, Finish, Name, Pdf, Rect, Ref, Str};
use subsetter::{GlyphRemapper, subset};

use super::canvas::{Canvas, CanvasPoint, CanvasShape, FINE, TextStyle};
use super::color::Color;
use super::font;
use super::raster::start;
use super::symbols::runs;

/// Points in an inch, in mm and in pixels of a screen.
const INCH: f64 = 72.0;
const INCH_MM: f64 = 25.4;
const INCH_PIXELS: f64 = 96.0;
/// Name of the font in the file, with the tag of a font subset.
const FONT: &[u8] = b"BRISTL+LiberationSans";
/// Unit of text positions and widths: thousandths of the font size.
const EM: f32 = 1e3;
/// Compression level of streams, 0 to 10.
const LEVEL: u8 = 8;
const SYSTEM: SystemInfo = SystemInfo {
    registry: Str(b"Adobe"),
    ordering: Str(b"Identity"),
    supplement: 0,
};

/// Glyphs of a file: their numbers in it, and the characters that they show.
struct Glyphs {
    numbers: GlyphRemapper,
    characters: BTreeMap<u16, char>,
}

impl Canvas {
    /// Returns the figure as a PDF file of one page, of the size of the SVG file. Its bytes depend
    /// on the figure alone: it states no time. The font is Liberation Sans for every format.
    ///
    /// # Panics
    /// If the embedded font cannot be subset.
    #[must_use]
    pub fn pdf(&self) -> Vec<u8> {
        let (width, height) = self.size();
        let pixel = self
            .format()
            .pixel_mm()
            .map_or(INCH / INCH_PIXELS, |pixel_mm| pixel_mm * INCH / INCH_MM)
            as f32;
        let [wide, high] = [width, height].map(|pixels| pixels as f32 * pixel);
        let mut glyphs = Glyphs {
            numbers: GlyphRemapper::new(),
            characters: BTreeMap::new(),
        };
        let mut opacities = BTreeSet::new();
        let mut content = Content::new();
        let scale = pixel / FINE as f32;
        // Coordinates grow downwards.
        content.transform([scale, 0.0, 0.0, -scale, 0.0, high]);
        content
            .set_line_cap(LineCapStyle::ButtCap)
            .set_miter_limit(4.0);
        for shape in self.shapes() {
            draw(&mut content, shape, &mut glyphs, &mut opacities);
        }
        let [catalog, pages, page, stream] = [1, 2, 3, 4].map(Ref::new);
        let [text, cid, descriptor, file, unicode] = [5, 6, 7, 8, 9].map(Ref::new);
        let state = |index: usize| Ref::new(10 + index as i32);
        let mut pdf = Pdf::new();
        pdf.catalog(catalog).pages(pages);
        pdf.pages(pages).kids([page]).count(1);
        let mut own = pdf.page(page);
        own.media_box(Rect::new(0.0, 0.0, wide, high))
            .parent(pages)
            .contents(stream);
        let mut resources = own.resources();
        resources.fonts().pair(Name(b"F"), text);
        let mut states = resources.ext_g_states();
        for (index, percent) in opacities.iter().enumerate() {
            states.pair(Name(opacity_name(*percent).as_bytes()), state(index));
        }
        states.finish();
        resources.finish();
        own.finish();
        for (index, percent) in opacities.iter().enumerate() {
            pdf.ext_graphics(state(index))
                .non_stroking_alpha(*percent as f32 / 100.0);
        }
        let packed = compress_to_vec_zlib(&content.finish(), LEVEL);
        pdf.stream(stream, &packed).filter(Filter::FlateDecode);
        write_font(&mut pdf, &glyphs, [text, cid, descriptor, file, unicode]);
        pdf.finish()
    }
}

/// Returns the name of the graphics state with an opacity in percent.
fn opacity_name(percent: u32) -> String {
    format!("A{percent}")
}

fn components(Color(red, green, blue): Color) -> [f32; 3] {
    [red, green, blue].map(|part| f32::from(part) / 255.0)
}

/// Writes a shape.
fn draw(
    content: &mut Content,
    shape: &CanvasShape,
    glyphs: &mut Glyphs,
    opacities: &mut BTreeSet<u32>,
) {
    let fill = |content: &mut Content, color: Color| {
        let [red, green, blue] = components(color);
        content.set_fill_rgb(red, green, blue);
    };
    match shape {
        CanvasShape::Rectangle {
            corners: [(left, top), (right, bottom)],
            fill: color,
        } => {
            fill(content, *color);
            let [x, y, wide, high] =
                [*left, *top, right - left, bottom - top].map(|length| length as f32);
            content.rect(x, y, wide, high).fill_nonzero();
        }
        CanvasShape::Polygon {
            points,
            fill: color,
            opacity,
        } => {
            let percent = (100.0 * opacity).round() as u32;
            fill(content, *color);
            if percent < 100 {
                opacities.insert(percent);
                content
                    .save_state()
                    .set_parameters(Name(opacity_name(percent).as_bytes()));
            }
            go_through(content, points);
            content.close_path().fill_nonzero();
            if percent < 100 {
                content.restore_state();
            }
        }
        CanvasShape::Line { points, stroke } => {
            let [red, green, blue] = components(stroke.color);
            content
                .set_stroke_rgb(red, green, blue)
                .set_line_width(stroke.width as f32);
            go_through(content, points);
            content.stroke();
        }
        CanvasShape::Text { text, style, at } => {
            fill(content, style.color);
            write_text(content, text, style, *at, glyphs);
        }
    }
}

fn go_through(content: &mut Content, points: &[CanvasPoint]) {
    for (index, &(x, y)) in points.iter().enumerate() {
        let (x, y) = (x as f32, y as f32);
        if index == 0 {
            content.move_to(x, y)
        } else {
            content.line_to(x, y)
        };
    }
}

fn write_text(
    content: &mut Content,
    text: &str,
    style: &TextStyle,
    at: CanvasPoint,
    glyphs: &mut Glyphs,
) {
    let (x, baseline) = start(text, style, at);
    let em = f32::from(font::face().units_per_em());
    let mut along = x - at.0 as f32;
    content.begin_text();
    for run in runs(text) {
        let size = run.size(style.size) as f32;
        let below = baseline + run.drop(style.size) as f32 - at.1 as f32;
        // Letters stand upright on an axis that points down.
        let matrix = match style.upwards {
            false => [
                1.0,
                0.0,
                0.0,
                -1.0,
                at.0 as f32 + along,
                at.1 as f32 + below,
            ],
            true => [
                0.0,
                -1.0,
                -1.0,
                0.0,
                at.0 as f32 + below,
                at.1 as f32 - along,
            ],
        };
        content.set_font(Name(b"F"), size).set_text_matrix(matrix);
        let (set, length) = font::set(&run);
        let mut shown = content.show_positioned();
        let mut items = shown.items();
        let mut end = 0;
        for (character, (glyph, from)) in run.text.chars().zip(set) {
            if from != end {
                items.adjust((end - from) as f32 * EM / em);
            }
            let number = glyphs.numbers.remap(glyph.0);
            glyphs.characters.entry(number).or_insert(character);
            items.show(Str(&number.to_be_bytes()));
            end = from + i32::from(font::face().glyph_hor_advance(glyph).unwrap_or(0));
        }
        items.finish();
        shown.finish();
        along += length as f32 * size / em;
    }
    content.end_text();
}

/// Writes the glyphs of the font that the file uses, with their widths and characters.
fn write_font(pdf: &mut Pdf, glyphs: &Glyphs, [text, cid, descriptor, file, unicode]: [Ref; 5]) {
    let face = font::face();
    let in_em = |units: i16| f32::from(units) * EM / f32::from(face.units_per_em());
    let mut own = pdf.type0_font(text);
    own.base_font(Name(FONT))
        .encoding_predefined(Name(b"Identity-H"))
        .descendant_font(cid)
        .to_unicode(unicode);
    own.finish();
    let mut own = pdf.cid_font(cid);
    own.subtype(CidFontType::Type2)
        .base_font(Name(FONT))
        .system_info(SYSTEM)
        .font_descriptor(descriptor);
    own.cid_to_gid_map_predefined(Name(b"Identity"));
    let advance = |glyph: u16| {
        face.glyph_hor_advance(ttf_parser::GlyphId(glyph))
            .map_or(0, u16::cast_signed)
    };
    own.widths().consecutive(
        0,
        glyphs
            .numbers
            .remapped_gids()
            .map(|glyph| in_em(advance(glyph))),
    );
    own.finish();
    let ttf_parser::Rect {
        x_min,
        y_min,
        x_max,
        y_max,
    } = face.global_bounding_box();
    let mut own = pdf.font_descriptor(descriptor);
    own.name(Name(FONT))
        .flags(FontFlags::NON_SYMBOLIC)
        .italic_angle(0.0)
        .stem_v(80.0)
        .font_file2(file);
    own.bbox(Rect::new(
        in_em(x_min),
        in_em(y_min),
        in_em(x_max),
        in_em(y_max),
    ));
    own.ascent(in_em(face.ascender()))
        .descent(in_em(face.descender()));
    own.cap_height(in_em(face.capital_height().unwrap_or(face.ascender())));
    own.finish();
    let used =
        subset(font::FILE, 0, &glyphs.numbers).expect("the font of the program can be divided");
    pdf.stream(file, &compress_to_vec_zlib(&used, LEVEL))
        .filter(Filter::FlateDecode)
        .pair(Name(b"Length1"), used.len() as i32);
    let mut map = UnicodeCmap::new(Name(b"Characters"), SYSTEM);
    glyphs
        .characters
        .iter()
        .for_each(|(number, character)| map.pair(*number, *character));
    pdf.stream(unicode, &compress_to_vec_zlib(&map.finish(), LEVEL))
        .filter(Filter::FlateDecode);
}

#[cfg(test)]
mod tests {
    use super::super::canvas::{fine, stroke, text};
    use super::super::color::{BLUE, INK};
    use super::super::format::Format;
    use super::*;

    fn figure(format: &Format) -> Vec<u8> {
        let mut canvas = Canvas::on(format, (100, 50));
        canvas.area([(0, 0), (fine(10), 0), (0, fine(10))], BLUE, 0.15);
        canvas.line([(0, 0), (fine(10), fine(10))], stroke(INK, 10));
        canvas.text(
            "F_n,w in N, −5·10⁻⁶",
            text(12, INK).centred().upwards(),
            (fine(50), fine(25)),
        );
        canvas.pdf()
    }

    fn has(file: &[u8], part: &str) -> bool {
        file.windows(part.len())
            .any(|window| window == part.as_bytes())
    }

    #[test]
    fn a_file_has_the_size_of_the_figure_the_glyphs_that_it_uses_and_no_time() {
        let file = figure(&Format::default());
        assert!(file.starts_with(b"%PDF-") && has(&file, "/MediaBox [0 0 75 37.5]"));
        assert!(
            has(&file, "BRISTL+LiberationSans")
                && has(&file, "/FontFile2")
                && has(&file, "/ca 0.15")
        );
        assert!(!has(&file, "Date") && !has(&file, "/ID"));
        assert!(file.len() < 20_000, "{} bytes", file.len());
        assert_eq!(file, figure(&Format::default()));
    }

    #[test]
    fn on_paper_a_file_has_its_width() {
        let file = figure(&Format::new(Some(84.0), Some(8.0), None).expect("a format"));
        let box_of = |file: &[u8]| {
            let text = String::from_utf8_lossy(file);
            let (_, rest) = text.split_once("/MediaBox [0 0 ").expect("a box");
            rest.split(' ')
                .next()
                .and_then(|width| width.parse::<f64>().ok())
                .expect("a width")
        };
        // 100 pixels of a layout in which 358 are 84 mm wide.
        assert!(
            (box_of(&file) - 100.0 / 358.0 * 84.0 * INCH / INCH_MM).abs() < 0.5,
            "{}",
            box_of(&file)
        );
    }
}

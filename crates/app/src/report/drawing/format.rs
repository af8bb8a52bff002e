//! The size of a figure on paper and the font of its text.
//!
//! Without a stated width or font size, figures have the pixels that suit a screen. With one, a
//! figure is laid out in the pixels that the paper has room for, rather than shrunk. Its text then
//! has the stated size, and all else has less room.

use thiserror::Error;

/// Millimetres in an inch, and points in an inch. A point is that of TeX: LaTeX prints the widths
/// of columns in it.
const INCH_MM: f64 = 25.4;
const INCH_POINTS: f64 = 72.27;
/// Pixels of a screen in an inch, as in CSS.
const INCH_PIXELS: f64 = 96.0;
/// Font size in pixels that stands for the stated one: the size of names and legends.
const NAMES: i32 = 12;
/// Width in pixels of a figure with a stated font size but no stated width.
const USUAL_WIDTH: i32 = 680;
/// Minimum width in pixels at which a map still shows its cells.
const MIN_WIDTH: f64 = 280.0;
/// Bounds of the stated sizes, in mm and in points.
const WIDTHS_MM: [f64; 2] = [30.0, 300.0];
const FONT_SIZES: [f64; 2] = [4.0, 24.0];
/// Resolution of bitmaps on paper in pixels per inch, as journals require for line drawings.
const RESOLUTION: f64 = 600.0;
/// Fonts with the metrics of the bitmaps' font, and keywords for kinds of fonts, which are not
/// quoted.
const ALIKE: [&str; 3] = ["Liberation Sans", "Arial", "Helvetica"];
const GENERIC: [&str; 3] = ["serif", "sans-serif", "monospace"];
/// Fonts of a figure without a stated font, and substitutes for a font that a viewer lacks.
const FAMILIES: &str = "Helvetica, Arial, sans-serif";

/// Widths of columns of journals by name, in mm.
pub const COLUMNS: [(&str, f64); 6] = [
    ("ieee", 88.9),
    ("ieee-double", 181.9),
    ("elsevier", 90.0),
    ("elsevier-double", 190.0),
    ("springer", 84.0),
    ("springer-double", 174.0),
];

/// Units of lengths, in mm.
const UNITS: [(&str, f64); 5] = [
    ("mm", 1.0),
    ("cm", 10.0),
    ("in", INCH_MM),
    ("pt", INCH_MM / INCH_POINTS),
    ("bp", INCH_MM / 72.0),
];

/// Reasons why figures cannot have a format.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum FormatError {
    /// Text is not a length.
    #[error(
        "must be a length with its unit, such as 84mm, 8.4cm, 3.3in, or 239pt as LaTeX prints \\columnwidth"
    )]
    NoLength,
    /// Text is neither a length nor the name of a column.
    #[error(
        "must be a length with its unit, such as 84mm or 239pt, or the column of a journal: {}",
        COLUMNS.map(|(name, _)| name).join(", ")
    )]
    NoWidth,
    /// A width is out of bounds.
    #[error("must be {} mm to {} mm", WIDTHS_MM[0], WIDTHS_MM[1])]
    Width,
    /// A font size is out of bounds.
    #[error("must be {} pt to {} pt", FONT_SIZES[0], FONT_SIZES[1])]
    FontSize,
    /// Text is not the name of a font.
    #[error("must be the name of a font, of letters, digits, spaces and hyphens")]
    Font,
    /// The text is too large for the figure.
    #[error(
        "figures {width_mm:.1} mm wide have no room for text of {points:.1} pt\n   = help: state {}",
        room(*.most, *.least_mm)
    )]
    NoRoom {
        /// The width in mm.
        width_mm: f64,
        /// The font size in points.
        points: f64,
        /// The largest font size for this width, in points.
        most: f64,
        /// The smallest width for this font size, in mm.
        least_mm: f64,
    },
    /// Bitmaps and PDF files have one font.
    #[error(
        "PNG and PDF figures have the font Liberation Sans only, which looks as Helvetica and Arial do, and not `{0}`\n   = help: add \
         --figures svg; a viewer or LaTeX draws the SVG figures in any font that it has"
    )]
    Bitmap(String),
}

/// Names the possible remedies: smaller text in points, or a larger width in mm.
fn room(most: f64, least_mm: f64) -> String {
    let font = (most >= FONT_SIZES[0]).then(|| format!("at most --font-size {most:.1}pt"));
    let width =
        (least_mm <= WIDTHS_MM[1]).then(|| format!("at least --figure-width {least_mm:.0}mm"));
    match (font, width) {
        (Some(font), Some(width)) => format!("{font}, or {width}"),
        (Some(one), None) | (None, Some(one)) => one,
        (None, None) => "a smaller --font-size and a larger --figure-width".to_owned(),
    }
}

/// Size and font of a figure.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Format {
    paper: Option<Paper>,
    font: Option<String>,
    /// `true` if figures have no heading.
    untitled: bool,
}

/// The size of a figure on paper.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Paper {
    /// Width of the figure in mm.
    width_mm: f64,
    /// Width in pixels of the layout, in which names have the font size [`NAMES`].
    width: i32,
}

/// Returns the length in mm that a text states, such as `84mm`.
fn length_mm(text: &str) -> Option<f64> {
    let (number, factor) = UNITS
        .iter()
        .find_map(|(unit, factor)| Some((text.trim().strip_suffix(unit)?.trim_end(), factor)))?;
    number
        .parse()
        .ok()
        .filter(|number: &f64| number.is_finite())
        .map(|number| number * factor)
}

/// Returns the width of figures in mm, from a length such as `84mm` or the name of one of the
/// [`COLUMNS`].
///
/// # Errors
/// If the text is neither, or the width is out of bounds.
pub fn parse_width(text: &str) -> Result<f64, FormatError> {
    let column = COLUMNS
        .iter()
        .find(|(name, _)| *name == text)
        .map(|(_, width)| *width);
    let width = column
        .or_else(|| length_mm(text))
        .ok_or(FormatError::NoWidth)?;
    if (WIDTHS_MM[0]..=WIDTHS_MM[1]).contains(&width) {
        Ok(width)
    } else {
        Err(FormatError::Width)
    }
}

/// Returns a font size in points, from a length such as `8pt`.
///
/// # Errors
/// If the text is not a length, or the size is out of bounds.
pub fn parse_font_size(text: &str) -> Result<f64, FormatError> {
    let points = length_mm(text).ok_or(FormatError::NoLength)? * INCH_POINTS / INCH_MM;
    // Rounding of the unit must not exclude a bound.
    let [least, most] = FONT_SIZES;
    if points > least - 1e-9 && points < most + 1e-9 {
        Ok(points)
    } else {
        Err(FormatError::FontSize)
    }
}

/// Returns the name of a font.
///
/// # Errors
/// If it has characters that are not allowed in names of fonts.
pub fn parse_font(text: &str) -> Result<String, FormatError> {
    let is_plain = |character: char| character.is_alphanumeric() || [' ', '-'].contains(&character);
    let is_name =
        text.chars().all(is_plain) && text.starts_with(char::is_alphanumeric) && text.len() <= 100;
    if is_name {
        Ok(text.to_owned())
    } else {
        Err(FormatError::Font)
    }
}

impl Format {
    /// Creates the format of figures of a width in mm, with text of a size in points, in a font. A
    /// value that is not stated is as on a screen: text of 9 bp.
    ///
    /// # Errors
    /// If the text is too large for the width.
    pub fn new(
        width_mm: Option<f64>,
        points: Option<f64>,
        font: Option<String>,
    ) -> Result<Self, FormatError> {
        if width_mm.is_none() && points.is_none() {
            return Ok(Self {
                font,
                ..Self::default()
            });
        }
        let pixel_mm = INCH_MM / INCH_PIXELS;
        let width_mm = width_mm.unwrap_or(f64::from(USUAL_WIDTH) * pixel_mm);
        let size_mm = points.map_or(f64::from(NAMES) * pixel_mm, |points| {
            points * INCH_MM / INCH_POINTS
        });
        let width = width_mm * f64::from(NAMES) / size_mm;
        if width < MIN_WIDTH {
            let points = size_mm * INCH_POINTS / INCH_MM;
            let largest = |points: f64| (10.0 * points).floor() / 10.0;
            let (most, least_mm) = (
                largest(points * width / MIN_WIDTH),
                (width_mm * MIN_WIDTH / width).ceil(),
            );
            return Err(FormatError::NoRoom {
                width_mm,
                points,
                most,
                least_mm,
            });
        }
        Ok(Self {
            paper: Some(Paper {
                width_mm,
                width: width.round() as i32,
            }),
            font,
            untitled: false,
        })
    }

    /// Returns the format without title and subtitle, for figures with a caption.
    #[must_use]
    pub fn without_title(self) -> Self {
        Self {
            untitled: true,
            ..self
        }
    }

    /// Returns `true` if figures have title and subtitle.
    pub(super) fn has_title(&self) -> bool {
        !self.untitled
    }

    /// # Errors
    /// If bitmaps and PDF files cannot have the font.
    pub fn check_bitmaps(&self) -> Result<(), FormatError> {
        match &self.font {
            Some(font) if !ALIKE.contains(&font.as_str()) => Err(FormatError::Bitmap(font.clone())),
            _ => Ok(()),
        }
    }

    /// Returns `true` if the figure is for paper.
    pub(crate) fn is_on_paper(&self) -> bool {
        self.paper.is_some()
    }

    /// Returns the width in pixels of a figure that is `usual` pixels wide on a screen.
    pub(crate) fn width(&self, usual: i32) -> i32 {
        self.paper.map_or(usual, |paper| paper.width)
    }

    /// Returns a height in pixels, scaled with the width from `of` on a screen, but at least
    /// `least`.
    pub(crate) fn height(&self, height: i32, of: i32, least: i32) -> i32 {
        self.paper
            .map_or(height, |paper| (height * paper.width / of).max(least))
    }

    /// Returns the font size in pixels of a text whose size is `usual` on a screen. On paper, all
    /// text has one size.
    pub(crate) fn font_size(&self, usual: i32) -> i32 {
        if self.is_on_paper() { NAMES } else { usual }
    }

    /// Returns the length in mm of a pixel of the layout, on paper.
    pub(super) fn pixel_mm(&self) -> Option<f64> {
        self.paper
            .map(|paper| paper.width_mm / f64::from(paper.width))
    }

    /// Returns the pixels of a bitmap on paper per pixel of the layout, and per metre.
    pub(super) fn resolution(&self) -> Option<(f64, u32)> {
        self.pixel_mm().map(|pixel| {
            (
                pixel * RESOLUTION / INCH_MM,
                (RESOLUTION * 1e3 / INCH_MM).round() as u32,
            )
        })
    }

    /// Returns the fonts that an SVG file requests; a viewer takes the first that it has.
    pub(super) fn families(&self) -> String {
        match self.font.as_deref() {
            None => FAMILIES.to_owned(),
            Some(font) if GENERIC.contains(&font) => font.to_owned(),
            Some(font) => format!("'{font}', {FAMILIES}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_have_units_and_bounds() {
        let widths = [
            ("84mm", 84.0),
            ("8.4 cm", 84.0),
            ("3.5in", 88.9),
            ("springer", 84.0),
            ("ieee", 88.9),
        ];
        for (text, expected) in widths {
            let width = parse_width(text).expect(text);
            assert!((width - expected).abs() < 1e-9, "{text}: {width}");
        }
        // The column of IEEEtran, as LaTeX prints it.
        assert!((parse_width("252.0pt").expect("a width") - 88.57).abs() < 0.01);
        for (text, error) in [
            ("84", FormatError::NoWidth),
            ("wide", FormatError::NoWidth),
            ("NaNmm", FormatError::NoWidth),
            ("29mm", FormatError::Width),
            ("-84mm", FormatError::Width),
            ("4in4in", FormatError::NoWidth),
        ] {
            assert_eq!(parse_width(text), Err(error), "{text}");
        }
        for (text, expected) in [
            ("8pt", 8.0),
            ("4pt", 4.0),
            ("24pt", 24.0),
            ("72bp", f64::NAN),
            ("3mm", 8.5358),
        ] {
            match parse_font_size(text) {
                Ok(size) => assert!((size - expected).abs() < 1e-4, "{text}: {size}"),
                Err(error) => assert!(
                    expected.is_nan() && error == FormatError::FontSize,
                    "{text}: {error}"
                ),
            }
        }
        assert_eq!(parse_font_size("8"), Err(FormatError::NoLength));
        for font in ["Latin Modern Roman", "STIX", "3270 Nerd Font"] {
            assert_eq!(parse_font(font).as_deref(), Ok(font));
        }
        for font in ["", " ", "a'b", "a\"b", "x;y", "<"] {
            assert_eq!(parse_font(font), Err(FormatError::Font), "{font}");
        }
    }

    /// Advice must not name a font of 3.6 pt, which is refused.
    #[test]
    fn advice_is_the_least_change_that_figures_can_have() {
        let fits = |width: f64, points: f64| Format::new(Some(width), Some(points), None);
        assert!(fits(84.0, 8.0).is_ok() && fits(84.0, 10.0).is_ok());
        let widths = [WIDTHS_MM[0], 60.0, 84.0, 200.0, WIDTHS_MM[1]];
        let sizes = [FONT_SIZES[0], 9.0, 12.0, FONT_SIZES[1]];
        for (width, points) in widths
            .into_iter()
            .flat_map(|width| sizes.map(|points| (width, points)))
        {
            let Err(error) = fits(width, points) else {
                continue;
            };
            let help = error.to_string();
            let value = |option: &str| {
                let (_, rest) = help.split_once(option)?;
                rest.split([',', '\n']).next()
            };
            let [font, figure] = ["--font-size ", "--figure-width "].map(value);
            assert!(font.is_some() || figure.is_some(), "{help}");
            if let Some(font) = font {
                let points = parse_font_size(font).expect(font);
                assert!(
                    fits(width, points).is_ok() && fits(width, points + 0.1).is_err(),
                    "{help}"
                );
            }
            if let Some(figure) = figure {
                let width = parse_width(figure).expect(figure);
                assert!(
                    fits(width, points).is_ok() && fits(width - 1.0, points).is_err(),
                    "{help}"
                );
            }
        }
    }

    #[test]
    fn bitmaps_have_one_font() {
        let with = |font: &str| Format::new(None, None, Some(font.to_owned())).expect("a format");
        assert!(with("Arial").check_bitmaps().is_ok() && Format::default().check_bitmaps().is_ok());
        assert_eq!(
            with("STIX").check_bitmaps(),
            Err(FormatError::Bitmap("STIX".to_owned()))
        );
        let families = ["STIX", "serif"].map(|font| with(font).families());
        assert_eq!(families, ["'STIX', Helvetica, Arial, sans-serif", "serif"]);
    }
}

//! The size of a figure on paper and the font of its text.
//!
//! Without a stated width or font size, figures have the pixels that suit a screen. With one, a
//! figure is laid out anew in as many pixels as the paper has room for, rather than shrunk: its
//! text has the stated size, and there is less of everything else.

use thiserror::Error;

/// Millimetres in an inch, and points in an inch. A point is that of TeX, in which LaTeX prints the
/// widths of columns.
const INCH_MM: f64 = 25.4;
const POINTS: f64 = 72.27;
/// Pixels of a screen in an inch, as CSS has them.
const PIXELS: f64 = 96.0;
/// Font size in pixels that stands for the stated one: that of names and legends.
const NAMES: i32 = 12;
/// Width in pixels of a figure of which only the font size is stated.
const USUAL_WIDTH: i32 = 680;
/// Least width in pixels in which a map still shows its cells.
const LEAST_WIDTH: f64 = 280.0;
/// Bounds of the stated sizes, in mm and in points.
const WIDTHS_MM: [f64; 2] = [30.0, 300.0];
const FONT_SIZES: [f64; 2] = [4.0, 24.0];
/// Resolution of bitmaps on paper in pixels per inch, which journals ask for drawings of lines.
const RESOLUTION: f64 = 600.0;
/// Fonts of the same metrics as that of the bitmaps, and words for kinds of fonts, which are not
/// quoted.
const ALIKE: [&str; 3] = ["Liberation Sans", "Arial", "Helvetica"];
const GENERIC: [&str; 3] = ["serif", "sans-serif", "monospace"];
/// The fonts of figures of which none is stated, and those that stand in for one that a viewer
/// lacks.
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
    ("pt", INCH_MM / POINTS),
    ("bp", INCH_MM / 72.0),
];

/// Why figures cannot have a format.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum FormatError {
    /// Text is not a length.
    #[error(
        "must be a length with its unit, such as 84mm, 8.4cm, 3.3in, or 239pt as LaTeX prints \\columnwidth"
    )]
    NoLength,
    /// Text is not a length and not the name of a column either.
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
        /// The least width for this font size, in mm.
        least_mm: f64,
    },
    /// Bitmaps and PDF files have one font.
    #[error(
        "PNG and PDF figures have the font Liberation Sans only, which looks as Helvetica and Arial do, and not `{0}`\n   = help: add \
         --figures svg; a viewer or LaTeX draws the SVG figures in any font that it has"
    )]
    Bitmap(String),
}

/// What makes room for text, of what figures can have: smaller text, or a larger width in mm.
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

/// The size of a figure and its font.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Format {
    paper: Option<Paper>,
    font: Option<String>,
    /// Whether figures have no heading.
    untitled: bool,
}

/// The size of a figure on paper.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Paper {
    /// Width of the figure in mm.
    width_mm: f64,
    /// Its width in pixels of the layout, in which names have the font size [`NAMES`].
    width: i32,
}

/// A length as text, such as `84mm`, in mm.
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

/// The width of figures in mm, from a length such as `84mm` or the name of one of the [`COLUMNS`].
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

/// A font size in points, from a length such as `8pt`.
///
/// # Errors
/// If the text is no length, or the size is out of bounds.
pub fn parse_font_size(text: &str) -> Result<f64, FormatError> {
    let points = length_mm(text).ok_or(FormatError::NoLength)? * POINTS / INCH_MM;
    // Rounding of the unit must not exclude a bound.
    let [least, most] = FONT_SIZES;
    if points > least - 1e-9 && points < most + 1e-9 {
        Ok(points)
    } else {
        Err(FormatError::FontSize)
    }
}

/// The name of a font.
///
/// # Errors
/// If it has characters that names of fonts do not have.
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
    /// Figures of a width in mm with text of a size in points, in a font. What is not stated is as
    /// on a screen: text of 9 bp.
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
        let pixel_mm = INCH_MM / PIXELS;
        let width_mm = width_mm.unwrap_or(f64::from(USUAL_WIDTH) * pixel_mm);
        let size_mm = points.map_or(f64::from(NAMES) * pixel_mm, |points| {
            points * INCH_MM / POINTS
        });
        let width = width_mm * f64::from(NAMES) / size_mm;
        if width < LEAST_WIDTH {
            let points = size_mm * POINTS / INCH_MM;
            let largest = |points: f64| (10.0 * points).floor() / 10.0;
            let (most, least_mm) = (
                largest(points * width / LEAST_WIDTH),
                (width_mm * LEAST_WIDTH / width).ceil(),
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

    /// The same without title and subtitle, for figures whose caption says what they say.
    #[must_use]
    pub fn without_title(self) -> Self {
        Self {
            untitled: true,
            ..self
        }
    }

    /// Whether figures have title and subtitle.
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

    /// Whether the figure is for paper.
    pub(crate) fn is_on_paper(&self) -> bool {
        self.paper.is_some()
    }

    /// Width of a figure in pixels that has `usual` ones on a screen.
    pub(crate) fn width(&self, usual: i32) -> i32 {
        self.paper.map_or(usual, |paper| paper.width)
    }

    /// A height in pixels that goes with the width `of` a figure on a screen, but not below
    /// `least`.
    pub(crate) fn height(&self, height: i32, of: i32, least: i32) -> i32 {
        self.paper
            .map_or(height, |paper| (height * paper.width / of).max(least))
    }

    /// Font size in pixels of a text that has `usual` ones on a screen. On paper, all text has one
    /// size.
    pub(crate) fn font_size(&self, usual: i32) -> i32 {
        if self.is_on_paper() { NAMES } else { usual }
    }

    /// Length in mm of a pixel of the layout, on paper.
    pub(super) fn pixel_mm(&self) -> Option<f64> {
        self.paper
            .map(|paper| paper.width_mm / f64::from(paper.width))
    }

    /// Pixels of a bitmap on paper for each pixel of the layout, and for each metre.
    pub(super) fn resolution(&self) -> Option<(f64, u32)> {
        self.pixel_mm().map(|pixel| {
            (
                pixel * RESOLUTION / INCH_MM,
                (RESOLUTION * 1e3 / INCH_MM).round() as u32,
            )
        })
    }

    /// The fonts that an SVG file asks for, the first that there is.
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

    /// It advised a font of 3.6 pt, which is refused.
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

//! Figures as files, `DIR/figures/NAME.svg`, `NAME.png` and `NAME.pdf`, drawn from new or saved
//! results.

use std::io;
use std::num::NonZeroUsize;
use std::path::Path;
use std::{fs, iter, thread};

use bristle_app::insight::measured::{
    ForceComparison, compare, comparison_table, write_comparison,
};
use bristle_app::report::drawing::format::{Format, parse_font, parse_font_size, parse_width};
use bristle_app::report::figures::{
    Picture, Pictures, brush_figures, is_of_brush, is_of_contact, is_of_study, main_figures,
    study_figures,
};
use bristle_app::store::staged::{FileError, StagedFile, occupy, prepare_directory, read_table};
use bristle_app::store::study_files::{COMPARISON, MEASURED};
use bristle_study::input::measured::{Measurement, TableFormat, read_measured};
use parking_lot::Mutex;

use bristle_app::store::results::SavedStudy;
use bristle_study::grid::{CaseResult, Study, thread_count};
use bristle_study::text::shown_path;
use clap::{Args, ValueEnum};

use crate::error::CliError;
use crate::saved::{saved_brush, saved_case, saved_study};
use crate::terminal::{say, show, width};

/// Subdirectory of the results for the pictures.
pub const FIGURES: &str = "figures";
/// Endings of the files of a picture.
const SVG: &str = "svg";
const PNG: &str = "png";
const PDF: &str = "pdf";
const ENDINGS: [&str; 3] = [SVG, PNG, PDF];

/// The figures that a command draws.
#[derive(Args, Clone)]
pub struct FigureArgs {
    /// Which figures are drawn, and as which files; several with commas between them, as all,pdf.
    /// The five that matter most are drawn without all, and SVG files without a kind
    #[arg(long, value_name = "WHICH", value_delimiter = ',')]
    figures: Vec<FigureChoice>,
    /// Draw no figures, as --figures none
    #[arg(long, conflicts_with = "figures")]
    no_figures: bool,
    /// Figures without title and subtitle, which the caption in a paper has
    #[arg(long)]
    no_title: bool,
    /// Width of figures on paper, as 84mm, 3.3in, 239pt or the column of a journal: ieee,
    /// ieee-double, elsevier, elsevier-double, springer, springer-double. PNG files then have 600
    /// dpi
    #[arg(long, value_name = "WIDTH", value_parser = parse_width)]
    figure_width: Option<f64>,
    /// Size of all text in figures at that width, as 8pt [default: 9bp at 180mm, with larger
    /// titles]
    #[arg(long, value_name = "SIZE", value_parser = parse_font_size)]
    font_size: Option<f64>,
    /// Font of SVG figures, by name, as "Latin Modern Roman"; PNG and PDF figures have Liberation
    /// Sans (like Helvetica)
    #[arg(long, value_name = "NAME", value_parser = parse_font)]
    font: Option<String>,
}

/// Which figures, or the kind of their files.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum FigureChoice {
    /// No figures
    None,
    /// All figures that there are
    All,
    /// SVG files
    Svg,
    /// PNG files
    Png,
    /// PDF files
    Pdf,
}

/// The figures that a command draws, after a check that they can be drawn.
pub struct Figures {
    /// Endings of the written files.
    endings: Vec<&'static str>,
    /// `true` if all figures are drawn, not only the main ones.
    all: bool,
    format: Format,
}

impl FigureArgs {
    /// Returns the figures that the arguments request. Nothing has been simulated or written yet.
    ///
    /// # Errors
    /// If figures of this format cannot be drawn.
    pub fn figures(&self) -> Result<Figures, CliError> {
        let has = |choice| self.figures.contains(&choice);
        let kinds = [
            (FigureChoice::Svg, SVG),
            (FigureChoice::Png, PNG),
            (FigureChoice::Pdf, PDF),
        ];
        let stated: Vec<&str> = kinds
            .into_iter()
            .filter_map(|(kind, ending)| has(kind).then_some(ending))
            .collect();
        let endings = match stated {
            _ if self.no_figures || has(FigureChoice::None) => Vec::new(),
            stated if stated.is_empty() => vec![SVG],
            stated => stated,
        };
        let format = Format::new(self.figure_width, self.font_size, self.font.clone())?;
        if endings.iter().any(|ending| *ending != SVG) {
            format.check_bitmaps()?;
        }
        let format = if self.no_title {
            format.without_title()
        } else {
            format
        };
        Ok(Figures {
            endings,
            all: has(FigureChoice::All),
            format,
        })
    }
}

impl Figures {
    /// Returns `true` if figures are drawn.
    pub fn are_drawn(&self) -> bool {
        !self.endings.is_empty()
    }

    /// Returns the pictures to draw, and a note on the others.
    fn chosen(&self, pictures: Vec<Picture>) -> (Vec<Picture>, String) {
        let total = pictures.len();
        let chosen = if self.all {
            pictures
        } else {
            main_figures(pictures)
        };
        let others = total - chosen.len();
        let note = if others > 0 {
            format!(" ({others} more with --figures all)")
        } else {
            String::new()
        };
        (chosen, note)
    }
}

/// Reads measured forces from a table written in a `format`.
pub fn measured_forces(path: &Path, format: &TableFormat) -> Result<Vec<Measurement>, CliError> {
    Ok(read_measured(
        &read_table(path)?,
        &path.to_string_lossy(),
        format,
    )?)
}

/// Returns the measured forces of the `study` that is saved in a directory.
pub fn measured_of(directory: &Path, study: &SavedStudy) -> Result<Vec<Measurement>, CliError> {
    if !study.measured {
        return Ok(Vec::new());
    }
    measured_forces(
        &directory.join(MEASURED),
        &TableFormat::of_tools(&study.study),
    )
}

/// Draws a study below `directory`, with measured forces and their `comparisons`, if any. Removes
/// pictures of an earlier study that this one lacks. Returns a message about the pictures.
pub fn draw_study(
    directory: &Path,
    study: &Study,
    results: &[CaseResult],
    measured: &[Measurement],
    comparisons: &[ForceComparison],
    threads: Option<NonZeroUsize>,
    figures: &Figures,
) -> Result<String, FileError> {
    let Pictures { pictures, note } = study_figures(study, results, measured, &figures.format);
    let mut message = draw_all(directory, pictures, threads, figures, is_of_study)?;
    if !note.is_empty() && figures.are_drawn() {
        message.push_str(&format!("\n  ({note})"));
    }
    if !comparisons.is_empty() {
        StagedFile::write(directory.join(COMPARISON), |out| {
            write_comparison(out, comparisons)
        })?
        .commit()?;
    }
    Ok(message)
}

/// Draws the pictures that `figures` requests below `directory`, and tells the user.
pub fn draw(
    directory: &Path,
    make: impl FnOnce(&Format) -> Vec<Picture>,
    threads: Option<NonZeroUsize>,
    figures: &Figures,
    is_ours: fn(&str) -> bool,
) -> Result<(), FileError> {
    let pictures = make(&figures.format);
    draw_all(directory, pictures, threads, figures, is_ours).map(say)
}

/// Writes the pictures that `figures` requests below `directory`, all of them or none. Removes
/// others for which `is_ours` is true. `threads` defaults to the number of cores and does not
/// change the files. Returns a message about them.
fn draw_all(
    directory: &Path,
    pictures: Vec<Picture>,
    threads: Option<NonZeroUsize>,
    figures: &Figures,
    is_ours: fn(&str) -> bool,
) -> Result<String, FileError> {
    let (pictures, note) = figures.chosen(pictures);
    let message = stage_pictures(directory, &pictures, threads, figures)?;
    remove_others(directory, &pictures, figures, is_ours);
    Ok(message + if figures.are_drawn() { &note } else { "" })
}

/// Returns `true` for the name of a picture of a contact or a brush.
pub fn is_of_simulation(name: &str) -> bool {
    is_of_contact(name) || is_of_brush(name)
}

/// Redraws the results saved in `saved` below `directory`: those of a study, of one contact or
/// brush, or of both.
pub fn draw_saved(saved: &Path, directory: &Path, figures: &Figures) -> Result<(), CliError> {
    // Everything is read before anything is written.
    let (study, case, brush) = (saved_study(saved)?, saved_case(saved)?, saved_brush(saved)?);
    if study.is_none() && case.is_none() && brush.is_none() {
        return Err(CliError::NoResults(saved.to_owned()));
    }
    let measured = study
        .as_ref()
        .map(|(study, _)| measured_of(saved, study))
        .transpose()?
        .unwrap_or_default();
    prepare_directory(directory)?;
    let is_ours = is_picture(|name| is_of_study(name) || is_of_simulation(name));
    let _occupied = occupy(
        directory,
        &[("", &|name| name == COMPARISON), (FIGURES, &is_ours)],
    )?;
    if let Some((SavedStudy { study, .. }, results)) = study {
        let comparisons = compare(&study, &results, &measured);
        let drawn = draw_study(
            directory,
            &study,
            &results,
            &measured,
            &comparisons,
            None,
            figures,
        )?;
        say_drawn(&drawn, &comparisons)?;
    }
    if let Some(contact) = case {
        let make = |format: &Format| contact.pictures(format);
        draw(directory, make, None, figures, is_of_simulation)?;
    }
    if let Some(brush) = brush {
        let make = |format: &Format| brush_figures(&brush, format);
        draw(directory, make, None, figures, is_of_simulation)?;
    }
    Ok(())
}

/// Writes pictures, all of them or none.
fn stage_pictures(
    directory: &Path,
    pictures: &[Picture],
    threads: Option<NonZeroUsize>,
    figures: &Figures,
) -> Result<String, FileError> {
    if pictures.is_empty() || !figures.are_drawn() {
        return Ok("no figures".to_owned());
    }
    let directory = directory.join(FIGURES);
    prepare_directory(&directory)?;
    let stage = |Picture { name, canvas }: &Picture| {
        let file = |&ending: &&str| {
            let content = match ending {
                SVG => canvas.svg().into_bytes(),
                PNG => canvas.png(),
                _ => canvas.pdf(),
            };
            StagedFile::write(directory.join(format!("{name}.{ending}")), |out| {
                out.write_all(&content)
            })
        };
        figures
            .endings
            .iter()
            .map(file)
            .collect::<Result<Vec<_>, FileError>>()
    };
    let waiting = Mutex::new(pictures.iter());
    let next = || waiting.lock().next();
    let work = || {
        iter::from_fn(next)
            .map(stage)
            .collect::<Result<Vec<_>, FileError>>()
    };
    let threads = thread_count(threads).min(pictures.len());
    let staged: Result<Vec<_>, FileError> = thread::scope(|scope| {
        let others: Vec<_> = (1..threads).map(|_| scope.spawn(work)).collect();
        let others = others
            .into_iter()
            .map(|other| other.join().expect("drawing does not panic"));
        iter::once_with(work).chain(others).collect()
    });
    for file in staged?.into_iter().flatten().flatten() {
        file.commit()?;
    }
    let count = if pictures.len() == 1 {
        "figure"
    } else {
        "figures"
    };
    let kinds = figures.endings.join(", ").to_uppercase();
    Ok(format!(
        "wrote {} {count} as {kinds} to {}",
        pictures.len(),
        shown_path(&directory)
    ))
}

/// Returns a test for file names of pictures for which `is_ours` is true.
pub fn is_picture(is_ours: fn(&str) -> bool) -> impl Fn(&str) -> bool {
    move |name| picture(name).is_some_and(is_ours)
}

/// Returns the name of the picture in a file.
fn picture(name: &str) -> Option<&str> {
    ENDINGS
        .iter()
        .find_map(|ending| name.strip_suffix(ending)?.strip_suffix('.'))
}

/// Removes earlier pictures for which `is_ours` is true: they would be mistaken for new ones.
/// Pictures of file kinds that are not drawn are removed, too. A failure to remove one is not an
/// error.
fn remove_others(
    directory: &Path,
    pictures: &[Picture],
    figures: &Figures,
    is_ours: fn(&str) -> bool,
) {
    let remove = |entry: io::Result<fs::DirEntry>| {
        let path = entry.ok()?.path();
        let name = picture(path.file_name()?.to_str()?)?;
        let is_drawn = figures
            .endings
            .iter()
            .any(|ending| path.extension().is_some_and(|own| own == *ending));
        let is_old =
            is_ours(name) && !(is_drawn && pictures.iter().any(|picture| picture.name == name));
        is_old.then(|| fs::remove_file(&path).ok()).flatten()
    };
    if let Ok(entries) = fs::read_dir(directory.join(FIGURES)) {
        entries.map(remove).for_each(drop);
    }
}

/// Tells the user which figures were drawn, and shows how measured and simulated forces compare.
pub fn say_drawn(message: &str, comparisons: &[ForceComparison]) -> io::Result<()> {
    say(message);
    if comparisons.is_empty() {
        Ok(())
    } else {
        show(comparison_table(comparisons, width()))
    }
}

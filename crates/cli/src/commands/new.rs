//! `bristle new`.

use std::io::{self, BufRead, IsTerminal};
use std::path::{Path, PathBuf};

use bristle::model::settings::ToolKind;
use bristle_input::first_file::{
    ANGLE, Answers, FirstFile, LENGTH, MODULUS, QUESTIONS, Question, SIZE, Size, TILT, WIDTH,
    first_file, question_of, reach_m,
};
use bristle_input::materials::{MATERIALS, Material};
use bristle_input::plausibility::warnings;
use bristle_store::staged::{FileError, StagedFile};
use bristle_text::layout;
use clap::Args;

use crate::error::CliError;
use crate::terminal::{commit, say};

/// Write a first input file from a few answers: kind of brush, filaments, and the limits of the
/// machine
///
/// On a terminal the program asks for what the options do not state; an empty line takes the value
/// in brackets. Elsewhere the options must state everything that has no such value. Numbers may
/// have a decimal comma, and another unit behind them, as in 1,18 or "0.6 cm". The file has a
/// comment at each line, and a study up to the limits of the machine. Values that are unusual draw
/// a warning. An existing file is not replaced.
#[derive(Args)]
pub struct NewArgs {
    /// The file to write
    #[arg(value_name = "FILE.toml")]
    file: PathBuf,
    /// Kind of tool: round with radial filaments, cup with axial ones, or cone [default: round]
    #[arg(long, value_name = "KIND", value_parser = parse_kind)]
    kind: Option<ToolKind>,
    /// Angle of the filaments to the axis in degrees, which a cone needs: 90 for radial ones
    /// [default: that of the kind]
    #[arg(long, value_name = "DEG", value_parser = number("--filament-angle-deg"))]
    filament_angle_deg: Option<f64>,
    /// Tilt of the axis in degrees: 0 along the workpiece, 90 into it [default: that of the kind]
    #[arg(long, value_name = "DEG", allow_negative_numbers = true, value_parser = number("--tilt-deg"))]
    tilt_deg: Option<f64>,
    /// Diameter of the brush over its filaments, in mm
    #[arg(long, value_name = "MM", group = "size", value_parser = number("--tool-diameter-mm"))]
    tool_diameter_mm: Option<f64>,
    /// Diameter of the brush body, where the filaments in the middle of the trim are clamped, in mm
    #[arg(long, value_name = "MM", group = "size", value_parser = number("--tool-diameter-mm"))]
    body_diameter_mm: Option<f64>,
    /// Radius of the brush body, in mm
    #[arg(long, value_name = "MM", group = "size", value_parser = number("--tool-diameter-mm"))]
    body_radius_mm: Option<f64>,
    /// Width of the trim, in mm: of a round brush along its axis, of a cup along its radius
    #[arg(long, value_name = "MM", value_parser = number("--width-mm"))]
    width_mm: Option<f64>,
    /// Number of filaments, or the share of the body's surface that they cover
    #[arg(long, value_name = "N", value_parser = number("--filaments"))]
    filaments: Option<f64>,
    /// Free length of the filaments, in mm
    #[arg(long, value_name = "MM", value_parser = number("--length-mm"))]
    length_mm: Option<f64>,
    /// Diameter of the filaments, in mm
    #[arg(long, value_name = "MM", value_parser = number("--diameter-mm"))]
    diameter_mm: Option<f64>,
    /// Material of the filaments, such as PA6.12, for their density and modulus [default: not
    /// stated]
    #[arg(long, value_name = "NAME", value_parser = parse_material)]
    material: Option<&'static Material>,
    /// Young's modulus of the filaments, in GPa [default: that of the material, or 3]
    #[arg(long, value_name = "GPA", value_parser = number("--youngs-modulus-gpa"))]
    youngs_modulus_gpa: Option<f64>,
    /// Coefficient of friction on the workpiece [default: 0]
    #[arg(long, value_name = "MU", value_parser = number("--friction"))]
    friction: Option<f64>,
    /// Highest rotational speed of the machine, in rpm
    #[arg(long, value_name = "RPM", value_parser = number("--max-rpm"))]
    max_rpm: Option<f64>,
    /// Largest penetration depth of interest, in mm
    #[arg(long, value_name = "MM", value_parser = number("--max-depth-mm"))]
    max_depth_mm: Option<f64>,
}

/// A parser of the number that an option states, in the unit of its setting.
fn number(option: &'static str) -> impl Fn(&str) -> Result<f64, String> + Clone {
    move |text| question_of(option).ok_or("no such question")?.number(text)
}

impl NewArgs {
    /// The answers that the options give, in the order of [`QUESTIONS`]. The size of the brush is
    /// stated apart.
    fn stated(&self) -> Answers {
        [
            self.filament_angle_deg,
            self.tilt_deg,
            self.length_mm,
            self.diameter_mm,
            self.youngs_modulus_gpa,
            self.width_mm,
            None,
            self.filaments,
            self.friction,
            self.max_rpm,
            self.max_depth_mm,
        ]
    }

    /// The size of the brush, if an option states it.
    fn size(&self) -> Option<Size> {
        let body = self
            .body_diameter_mm
            .map(Size::BodyDiameter)
            .or(self.body_radius_mm.map(Size::BodyRadius));
        self.tool_diameter_mm.map(Size::ToolDiameter).or(body)
    }
}

/// Runs the command.
pub fn run(arguments: &NewArgs) -> Result<(), CliError> {
    let path = &arguments.file;
    if path.symlink_metadata().is_ok() {
        return Err(CliError::Exists(path.clone()));
    }
    let lines = io::stdin()
        .is_terminal()
        .then(|| io::stdin().lock().lines());
    let Answered {
        kind,
        answers,
        material,
    } = answered(arguments, lines)?;
    let Some(name) = path.file_name() else {
        return Err(FileError::new("write", path, io::Error::other("it has no name")).into());
    };
    let FirstFile {
        text,
        unusual,
        note,
    } = first_file(kind, answers, material, &name.to_string_lossy())?;
    warnings(&unusual).iter().for_each(say);
    if !note.is_empty() {
        say(layout::note(&note));
    }
    let directory = path.parent().unwrap_or(Path::new(""));
    Ok(commit([StagedFile::write(directory.join(name), |out| {
        out.write_all(text.as_bytes())
    })?])?)
}

/// What is known of the brush.
#[derive(Debug)]
struct Answered {
    kind: ToolKind,
    answers: Answers,
    material: Option<&'static Material>,
}

/// The answers of the options, and those of a user at a terminal, if there is one. The modulus of a
/// material is not asked for, nor angles that follow from the kind of tool.
fn answered(
    arguments: &NewArgs,
    mut lines: Option<impl Iterator<Item = io::Result<String>>>,
) -> Result<Answered, CliError> {
    let (mut answers, mut material) = (arguments.stated(), arguments.material);
    let kind = match (arguments.kind, &mut lines) {
        (Some(kind), _) => kind,
        (None, Some(lines)) => ask_word(
            "Kind of tool, one of round, cup (also end and disc brushes), cone [round]:",
            lines,
            find_kind,
        )?
        .unwrap_or_default(),
        (None, None) => ToolKind::default(),
    };
    let mut missing = Vec::new();
    for (position, question) in QUESTIONS.iter().enumerate() {
        let sizes_m = answers[LENGTH].zip(answers[WIDTH]);
        let reach_m =
            sizes_m.map(|(length_m, width_m)| reach_m(kind, answers[ANGLE], [length_m, width_m]));
        if position == TILT || (position == ANGLE && kind != ToolKind::Cone) {
            continue;
        } else if let (SIZE, Some(size)) = (position, arguments.size()) {
            let body_radius_m = reach_m.map(|reach_m| size.body_radius_m(reach_m));
            answers[SIZE] = body_radius_m.transpose().map_err(CliError::Answer)?;
        } else if let (None, Some(lines)) = (answers[position], &mut lines) {
            if position == MODULUS && material.is_none() {
                let words = format!(
                    "Material of the filaments, one of {}, if it is one of these [none]:",
                    names()
                );
                material = ask_word(&words, lines, Material::find)?;
            }
            if position != MODULUS || material.is_none() {
                answers[position] = ask(question, reach_m.unwrap_or_default(), lines)?;
            }
        } else if answers[position].is_none() && question.default.is_none() {
            missing.push(question.option);
        }
    }
    if missing.is_empty() {
        Ok(Answered {
            kind,
            answers,
            material,
        })
    } else {
        Err(CliError::Unanswered(missing.join(", ")))
    }
}

/// Asks until the answer is the name of something that `find` knows, or an empty line for none.
fn ask_word<T>(
    words: &str,
    lines: &mut impl Iterator<Item = io::Result<String>>,
    find: fn(&str) -> Option<T>,
) -> Result<Option<T>, CliError> {
    loop {
        say(words);
        let line = lines.next().transpose()?.unwrap_or_default();
        match (line.trim(), find(&line)) {
            ("", _) => return Ok(None),
            (_, Some(found)) => return Ok(Some(found)),
            (_, None) => say("please type one of these names, or nothing"),
        }
    }
}

/// The kind of tool with a name.
fn find_kind(text: &str) -> Option<ToolKind> {
    match text.trim().to_lowercase().as_str() {
        "round" => Some(ToolKind::Round),
        "cup" => Some(ToolKind::Cup),
        "cone" => Some(ToolKind::Cone),
        _ => None,
    }
}

/// Parses the kind of a tool.
fn parse_kind(text: &str) -> Result<ToolKind, String> {
    find_kind(text).ok_or_else(|| "must be one of round, cup, cone".to_owned())
}

/// The names of all materials.
fn names() -> String {
    MATERIALS
        .iter()
        .map(|material| material.name)
        .collect::<Vec<_>>()
        .join(", ")
}

/// Parses the name of a material.
fn parse_material(text: &str) -> Result<&'static Material, String> {
    Material::find(text).ok_or_else(|| format!("must be one of {}", names()))
}

/// Asks until the answer is one that the setting may have, or an empty line for the default. An
/// unusual answer must be given twice. For the size of the brush, filaments reach beyond the body
/// by `reach_m`.
fn ask(
    question: &Question,
    reach_m: f64,
    lines: &mut impl Iterator<Item = io::Result<String>>,
) -> Result<Option<f64>, CliError> {
    let mut told = None;
    loop {
        let default = question
            .default
            .map_or_else(String::new, |default| format!(" [{default}]"));
        say(format_args!("{}{default}:", question.words));
        let Some(line) = lines.next().transpose()? else {
            return Err(CliError::Unanswered(question.option.to_owned()));
        };
        if line.trim().is_empty() && question.default.is_some() {
            return Ok(None);
        }
        match question.answer(&line, reach_m) {
            Ok(answer) => match question.unusual(answer).filter(|_| told != Some(answer)) {
                Some(unusual) => {
                    told = Some(answer);
                    warnings(&[unusual]).iter().for_each(say);
                    say("If it is right, please type it again.");
                }
                None => return Ok(Some(answer)),
            },
            Err(problem) => say(problem),
        }
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    /// The command alone.
    #[derive(Parser)]
    struct Call {
        #[command(flatten)]
        arguments: NewArgs,
    }

    fn answers(options: &str, typed: &[&str]) -> Result<Answered, CliError> {
        let call = Call::try_parse_from(
            ["new", "brush.toml"]
                .into_iter()
                .chain(options.split_whitespace()),
        );
        let lines = typed.iter().map(|line| Ok((*line).to_owned()));
        answered(
            &call.unwrap_or_else(|error| panic!("{error}")).arguments,
            Some(lines),
        )
    }

    #[test]
    fn answers_are_asked_again_until_they_are_right_or_meant() {
        // A kind, a unit, a slip, an unusual diameter that is meant, a material, and the diameter
        // over the filaments.
        let typed = [
            "", "4 cm", "1,18 m", "1,18", "wood", "", "", "20", "long", "360", "60 %", "", "1500",
            "4",
        ];
        let Answered {
            kind,
            answers: all,
            material,
        } = answers("", &typed).expect("answers");
        let of_machine = [Some(1500.0), Some(4e-3)];
        assert_eq!(
            all[..8],
            [
                None,
                None,
                Some(0.04),
                Some(1.18e-3),
                None,
                Some(0.02),
                Some(0.14),
                Some(0.6)
            ]
        );
        assert_eq!(
            (&all[9..], material.is_none(), kind),
            (&of_machine[..], true, ToolKind::Round)
        );
        let Answered { answers: all, .. } = answers(
            "--kind round --length-mm 40 --diameter-mm 1,18 --material PA6 --body-diameter-mm 3000 --width-mm 20",
            &["2000000", "2000000", "0,3", "1500", "4"],
        )
        .expect("answers");
        assert_eq!(
            (all[SIZE], all[7], all[8]),
            (Some(1.5), Some(2e6), Some(0.3))
        );
        let error = answers("--kind round --length-mm 40", &["1.18"])
            .expect_err("an end")
            .to_string();
        assert!(
            error.contains("--youngs-modulus-gpa") || error.contains("--diameter-mm"),
            "{error}"
        );
    }

    #[test]
    fn only_a_cone_is_asked_for_its_angle() {
        let typed = [
            "wheel", "cone", "30", "25", "0.5", "", "3", "10", "70", "500", "", "3000", "1",
        ];
        let Answered {
            kind, answers: all, ..
        } = answers("", &typed).expect("answers");
        assert_eq!((kind, all[TILT]), (ToolKind::Cone, None));
        let (angle, radius) = (30_f64.to_radians(), all[SIZE].expect("a size"));
        assert_eq!(all[ANGLE], Some(angle));
        assert!(
            (radius - (0.035 - 0.005 * angle.cos() - 0.025 * angle.sin())).abs() < 1e-9,
            "{radius}"
        );
        let of_cup = "--kind cup --tilt-deg 80 --body-radius-mm 30";
        let Answered { answers: all, .. } = answers(
            of_cup,
            &["25", "0.5", "", "3", "10", "500", "", "3000", "1"],
        )
        .expect("answers");
        assert_eq!(
            (all[ANGLE], all[TILT], all[SIZE]),
            (None, Some(80_f64.to_radians()), Some(0.030))
        );
    }
}

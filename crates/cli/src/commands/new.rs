//! `bristle new`.

use std::io::{self, BufRead, IsTerminal};
use std::path::{Path, PathBuf};

use bristle::model::settings::ToolKind;
use bristle_app::store::staged::{FileError, StagedFile};
use bristle_study::input::first_file::{
    ANGLE, Answers, FRICTION_COEFFICIENT, FirstFile, LENGTH, MAX_DEPTH, MODULUS, QUESTIONS,
    Question, SIZE, Size, TILT, WIDTH, first_file, is_tube, reach_m,
};
use bristle_study::input::friction::{Pairing, USUAL};
use bristle_study::input::materials::{MATERIALS, Material};
use bristle_study::input::plausibility::warnings;
use bristle_study::text::layout;
use clap::{Arg, ArgMatches, Args, Command, FromArgMatches};

use crate::error::CliError;
use crate::terminal::{say, say_written};

/// Write a first input file from a few answers: kind of brush, filaments, and the limits of the
/// machine
///
/// On a terminal the program asks for what the options do not state; an empty line takes the value
/// in brackets. Elsewhere the options must state everything that has no such value. Numbers may
/// have a decimal comma, and another unit behind them, as in 1,18 or "0.6 cm". The file has a
/// comment at each line, and a study up to the limits of the machine. Friction and modulus that
/// nobody has measured are stated with their standard deviations, so that forces have an interval.
/// Values that are unusual draw a warning. An existing file is not replaced.
#[derive(Args)]
pub struct NewArgs {
    /// The file to write
    #[arg(value_name = "FILE.toml")]
    file: PathBuf,
    /// Kind of tool: round with radial filaments, cup with axial ones, or cone [default: round]
    #[arg(long, value_name = "KIND", value_parser = parse_kind)]
    kind: Option<ToolKind>,
    #[command(flatten)]
    answers: AnswerArgs,
    /// Diameter of the brush over its filaments, in mm
    #[arg(long, value_name = "MM", group = "size", value_parser = size)]
    tool_diameter_mm: Option<f64>,
    /// Diameter of the brush body, where the filaments in the middle of the trim are clamped, in mm
    #[arg(long, value_name = "MM", group = "size", value_parser = size)]
    body_diameter_mm: Option<f64>,
    /// Radius of the brush body, in mm
    #[arg(long, value_name = "MM", group = "size", value_parser = size)]
    body_radius_mm: Option<f64>,
    /// Diameter of the bore in which the brush works, in mm: the depth of a brush that is wider
    /// follows from it [default: a plane workpiece]
    #[arg(long, value_name = "MM", value_parser = size)]
    bore_diameter_mm: Option<f64>,
    /// Material of the filaments, such as PA6.12, for their density and modulus [default: not
    /// stated]
    #[arg(long, value_name = "NAME", value_parser = parse_material)]
    material: Option<&'static Material>,
    /// Material of the workpiece, for friction on it: steel, ceramic, wood, aluminium, plastic or
    /// other [default: steel]
    #[arg(long, value_name = "NAME", value_parser = parse_workpiece)]
    workpiece: Option<&'static str>,
    /// Brush with water, coolant or oil, which lowers friction
    #[arg(long)]
    wet: bool,
}

/// Parses the size of the brush, in mm.
fn size(text: &str) -> Result<f64, String> {
    QUESTIONS[SIZE].number(text)
}

/// The answers that options give, in the order of [`QUESTIONS`]. The size of the brush is stated
/// apart.
struct AnswerArgs(Answers);

/// The name of the option that answers a question, unless it is that for the size of the brush.
fn option_of(question: &Question) -> Option<&'static str> {
    let option = question.option.trim_start_matches("--");
    (!option.contains(' ')).then_some(option)
}

impl Args for AnswerArgs {
    fn augment_args(command: Command) -> Command {
        let options = QUESTIONS.iter().filter_map(|question| {
            let option = option_of(question)?;
            let default = question
                .default
                .map(|default| format!(" [default: {default}]"));
            let number = move |text: &str| question.number(text);
            let help = question.words.to_owned() + &default.unwrap_or_default();
            let option = Arg::new(option)
                .long(option)
                .value_name("NUMBER")
                .help(help);
            Some(option.allow_negative_numbers(true).value_parser(number))
        });
        command.args(options)
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for AnswerArgs {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let answer = |question: &Question| matches.get_one(option_of(question)?).copied();
        Ok(Self(QUESTIONS.each_ref().map(answer)))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

impl NewArgs {
    /// The size of the brush, if an option states it.
    fn size(&self) -> Option<Size> {
        let body = self
            .body_diameter_mm
            .map(Size::BodyDiameter)
            .or(self.body_radius_mm.map(Size::BodyRadius));
        self.tool_diameter_mm.map(Size::ToolDiameter).or(body)
    }

    /// The radius of the bore in m, if there is one.
    fn bore_radius_m(&self) -> Option<f64> {
        self.bore_diameter_mm.map(|diameter_m| diameter_m / 2.0)
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
        pairing,
    } = answered(arguments, lines)?;
    let Some(name) = path.file_name() else {
        return Err(FileError::new("write", path, io::Error::other("it has no name")).into());
    };
    let FirstFile {
        text,
        unusual,
        note,
    } = first_file(
        kind,
        answers,
        material,
        pairing,
        arguments.bore_radius_m(),
        &name.to_string_lossy(),
    )?;
    warnings(&unusual).iter().for_each(say);
    if !note.is_empty() {
        say(layout::note(&note));
    }
    let directory = path.parent().unwrap_or(Path::new(""));
    let file = StagedFile::write(directory.join(name), |out| out.write_all(text.as_bytes()))?;
    // Somebody may have written it while the questions were asked.
    let written = file.commit_new().map_err(|error| match error.kind() {
        io::ErrorKind::AlreadyExists => CliError::Exists(path.clone()),
        _ => error.into(),
    })?;
    say_written(&written);
    Ok(())
}

/// Data of the brush.
#[derive(Debug)]
struct Answered {
    kind: ToolKind,
    answers: Answers,
    material: Option<&'static Material>,
    pairing: &'static Pairing,
}

/// The answers of the options, and those of a user at a terminal, if there is one. The modulus of a
/// material is not asked for, nor angles that follow from the kind of tool.
fn answered(
    arguments: &NewArgs,
    mut lines: Option<impl Iterator<Item = io::Result<String>>>,
) -> Result<Answered, CliError> {
    let (mut answers, mut material) = (arguments.answers.0, arguments.material);
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
    let (mut workpiece, mut is_wet) = (arguments.workpiece, arguments.wet);
    let mut missing = Vec::new();
    for (position, question) in QUESTIONS.iter().enumerate() {
        let sizes_m = answers[LENGTH].zip(answers[WIDTH]);
        let reach_m =
            sizes_m.map(|(length_m, width_m)| reach_m(kind, answers[ANGLE], [length_m, width_m]));
        let follows = position == MAX_DEPTH && is_tube(kind, &answers, arguments.bore_radius_m());
        if follows && answers[position].is_some() {
            let left_out = "leave --max-depth-mm out: in a bore narrower than the brush the depth follows from the diameters";
            return Err(CliError::Answer(left_out.to_owned()));
        }
        if position == TILT || (position == ANGLE && kind != ToolKind::Cone) || follows {
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
            if position == FRICTION_COEFFICIENT && workpiece.is_none() {
                let words = format!(
                    "Material of the workpiece, one of {} [{}]:",
                    Pairing::workpieces().join(", "),
                    USUAL.workpiece
                );
                workpiece = ask_word(&words, lines, find_workpiece)?;
            }
            if position == FRICTION_COEFFICIENT && !is_wet {
                let words = "With water, coolant or oil, one of yes, no [no]:";
                is_wet = ask_word(words, lines, find_yes)?.unwrap_or_default();
            }
            if position != MODULUS || material.is_none() {
                answers[position] = ask(question, reach_m.unwrap_or_default(), lines)?;
            }
        } else if answers[position].is_none() && question.default.is_none() {
            missing.push(question.option);
        }
    }
    if missing.is_empty() {
        let workpiece = workpiece.unwrap_or(USUAL.workpiece);
        Ok(Answered {
            kind,
            answers,
            material,
            pairing: Pairing::find(workpiece, is_wet).expect("each workpiece has a pairing"),
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

/// Returns the workpiece with a name.
fn find_workpiece(text: &str) -> Option<&'static str> {
    let name = text.trim().to_lowercase();
    Pairing::workpieces()
        .into_iter()
        .find(|workpiece| *workpiece == name)
}

/// Parses the material of the workpiece.
fn parse_workpiece(text: &str) -> Result<&'static str, String> {
    find_workpiece(text)
        .ok_or_else(|| format!("must be one of {}", Pairing::workpieces().join(", ")))
}

/// Reads an answer to a question that yes or no answers.
fn find_yes(text: &str) -> Option<bool> {
    match text.trim().to_lowercase().as_str() {
        "yes" | "y" => Some(true),
        "no" | "n" => Some(false),
        _ => None,
    }
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
            "", "4 cm", "1,18 m", "1,18", "wood", "", "", "20", "long", "360", "60 %", "wool",
            "wood", "yes", "", "1500", "4",
        ];
        let Answered {
            kind,
            answers: all,
            material,
            pairing,
        } = answers("", &typed).expect("answers");
        let of_machine = [Some(1500.0), Some(4e-3)];
        assert_eq!((pairing.workpiece, pairing.condition), ("wood", "wet"));
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
            "--kind round --length-mm 40 --diameter-mm 1,18 --material PA6 --body-diameter-mm 3000 --width-mm 20 --workpiece ceramic",
            &["2000000", "2000000", "", "0,3", "1500", "4"],
        )
        .expect("answers");
        assert_eq!(all[SIZE..9], [Some(1.5), Some(2e6), Some(0.3)]);
        let error = answers("--kind round --length-mm 40", &["1.18"]).expect_err("an end");
        assert!(error.to_string().contains("--"), "{error}");
    }

    #[test]
    fn only_a_cone_is_asked_for_its_angle() {
        let typed = [
            "wheel", "cone", "30", "25", "0.5", "", "3", "10", "70", "500", "", "", "", "3000", "1",
        ];
        let Answered {
            kind, answers: all, ..
        } = answers("", &typed).expect("answers");
        assert_eq!((kind, all[TILT]), (ToolKind::Cone, None));
        assert_eq!(all[ANGLE], Some(30_f64.to_radians()));
    }
}

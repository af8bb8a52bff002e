//! `bristle new`.

use std::io::{self, BufRead, IsTerminal};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use bristle_input::first_file::{QUESTIONS, Question, first_file};
use bristle_input::materials::{MATERIALS, Material};
use bristle_store::staged::{FileError, StagedFile};
use clap::Args;

use crate::error::CliError;
use crate::terminal::{say, say_written};

/// The option that states the modulus.
const MODULUS: &str = "--youngs-modulus-gpa";

/// Write a first input file from a few answers: brush, filaments, and the limits of the machine
///
/// On a terminal the program asks for what the options do not state; an empty line takes the value in brackets. Elsewhere the
/// options must state everything that has no such value. The file has a comment at each line, and a study up to the limits of the
/// machine. An existing file is not replaced.
#[derive(Args)]
pub struct NewArgs {
    /// The file to write
    #[arg(value_name = "FILE.toml")]
    file: PathBuf,
    /// Radius of the brush body, where the filaments are clamped, in mm
    #[arg(long, value_name = "MM")]
    body_radius_mm: Option<f64>,
    /// Width of the brush along its axis, in mm
    #[arg(long, value_name = "MM")]
    width_mm: Option<f64>,
    /// Number of filaments, or the share of the body's surface that they cover
    #[arg(long, value_name = "N")]
    filaments: Option<f64>,
    /// Free length of the filaments, in mm
    #[arg(long, value_name = "MM")]
    length_mm: Option<f64>,
    /// Diameter of the filaments, in mm
    #[arg(long, value_name = "MM")]
    diameter_mm: Option<f64>,
    /// Material of the filaments, such as PA6.12, for their density and modulus [default: not stated]
    #[arg(long, value_name = "NAME", value_parser = parse_material)]
    material: Option<&'static Material>,
    /// Young's modulus of the filaments, in GPa [default: that of the material, or 3]
    #[arg(long, value_name = "GPA")]
    youngs_modulus_gpa: Option<f64>,
    /// Coefficient of friction on the workpiece [default: 0]
    #[arg(long, value_name = "MU")]
    friction: Option<f64>,
    /// Highest rotational speed of the machine, in rpm
    #[arg(long, value_name = "RPM")]
    max_rpm: Option<f64>,
    /// Largest penetration depth of interest, in mm
    #[arg(long, value_name = "MM")]
    max_depth_mm: Option<f64>,
}

impl NewArgs {
    /// The answers that the options give, in the order of [`QUESTIONS`].
    fn stated(&self) -> Answers {
        [
            self.body_radius_mm,
            self.width_mm,
            self.filaments,
            self.length_mm,
            self.diameter_mm,
            self.youngs_modulus_gpa,
            self.friction,
            self.max_rpm,
            self.max_depth_mm,
        ]
    }
}

/// Runs the command.
pub fn run(arguments: &NewArgs) -> Result<ExitCode, CliError> {
    let path = &arguments.file;
    if path.symlink_metadata().is_ok() {
        return Err(CliError::Exists(path.clone()));
    }
    let (stated, material) = (arguments.stated(), arguments.material);
    let (answers, material) =
        if io::stdin().is_terminal() { asked(stated, material)? } else { (with_defaults(stated)?, material) };
    let Some(name) = path.file_name() else {
        return Err(FileError::new("write", path, io::Error::other("it has no name")).into());
    };
    let text = first_file(answers, material, &name.to_string_lossy())?;
    let directory = path.parent().unwrap_or(Path::new(""));
    let written = StagedFile::write(directory.join(name), |out| out.write_all(text.as_bytes()))?.commit()?;
    say_written(&written);
    Ok(ExitCode::SUCCESS)
}

/// The answers to all questions; `None` stands for the default.
type Answers = [Option<f64>; QUESTIONS.len()];

/// The answers without a terminal.
fn with_defaults(stated: Answers) -> Result<Answers, CliError> {
    let missing = QUESTIONS.iter().zip(stated).filter(|(question, stated)| stated.or(question.default).is_none());
    let missing: Vec<&str> = missing.map(|(question, _)| question.option).collect();
    if !missing.is_empty() {
        return Err(CliError::Unanswered(missing.join(", ")));
    }
    Ok(stated)
}

/// The answers of a user at a terminal. The modulus of a material is not asked for.
fn asked(
    stated: Answers,
    material: Option<&'static Material>,
) -> Result<(Answers, Option<&'static Material>), CliError> {
    let mut lines = io::stdin().lock().lines();
    let (mut answers, mut material) = (stated, material);
    for (answer, question) in answers.iter_mut().zip(&QUESTIONS).filter(|(answer, _)| answer.is_none()) {
        if question.option == MODULUS {
            material = material.map_or_else(|| ask_material(&mut lines), |material| Ok(Some(material)))?;
        }
        if question.option != MODULUS || material.is_none() {
            *answer = ask(question, &mut lines)?;
        }
    }
    Ok((answers, material))
}

/// Asks until the answer is a material, or an empty line for none.
fn ask_material(lines: &mut impl Iterator<Item = io::Result<String>>) -> Result<Option<&'static Material>, CliError> {
    loop {
        say(format_args!("Material of the filaments, one of {}, if it is one of these [none]:", names()));
        let line = lines.next().transpose()?.unwrap_or_default();
        match (line.trim(), Material::find(&line)) {
            ("", _) => return Ok(None),
            (_, Some(material)) => return Ok(Some(material)),
            (_, None) => say("please type one of these names, or nothing"),
        }
    }
}

/// The names of all materials.
fn names() -> String {
    MATERIALS.iter().map(|material| material.name).collect::<Vec<_>>().join(", ")
}

/// Parses the name of a material.
fn parse_material(text: &str) -> Result<&'static Material, String> {
    Material::find(text).ok_or_else(|| format!("must be one of {}", names()))
}

/// Asks until the answer is a number, or an empty line for the default.
fn ask(question: &Question, lines: &mut impl Iterator<Item = io::Result<String>>) -> Result<Option<f64>, CliError> {
    loop {
        let default = question.default.map_or_else(String::new, |default| format!(" [{default}]"));
        say(format_args!("{}{default}:", question.words));
        let Some(line) = lines.next().transpose()? else {
            return Err(CliError::Unanswered(question.option.to_owned()));
        };
        match (line.trim(), question.default) {
            ("", Some(_)) => return Ok(None),
            (answer, _) => match answer.parse() {
                Ok(answer) => return Ok(Some(answer)),
                Err(_) => say("please type a number, with a decimal point and without a unit"),
            },
        }
    }
}

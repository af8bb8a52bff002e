//! Questions about a brush and its machine, and answers as people type them.

use bristle::model::parameters::Parameter;
use bristle::model::settings::{Settings, ToolKind, ToolSettings};
use bristle::tool::Trim;

use crate::grid::{DEPTH, SPEED, without_rounding_noise};
use crate::input::cells::ambiguous;
use crate::input::friction::FRICTION;
use crate::input::input_error::LONGEST_KEY;
use crate::input::plausibility::{Unusual, unusual_value};
use crate::text::shown;
use crate::text::units::{NamedUnit, in_unit_of, units_of};

/// A question about a brush or a machine.
#[derive(Debug)]
pub struct Question {
    /// Name of the option that answers it.
    pub option: &'static str,
    /// Question, with the unit of the answer.
    pub words: &'static str,
    /// Value of an empty answer, if there is a usual one.
    pub default: Option<&'static str>,
    pub(super) path: &'static str,
    /// Unit of an answer without one.
    unit: &'static str,
}

/// Paths of the radius of the body, of the number of filaments, and of the share of the surface
/// that they cover.
pub(super) const BODY_RADIUS: &str = "tool.body_radius_m";
pub(super) const COUNT: &str = "tool.filament_count";
pub(super) const SHARE: &str = "tool.fill_factor";

/// Position of the question for the angle of the filaments, which only a cone has to state.
pub const ANGLE: usize = 0;
/// Position of the tilt, which is not asked.
pub const TILT: usize = 1;
/// Position of the length of the filaments.
pub const LENGTH: usize = 2;
/// Position of the modulus, which a material answers.
pub const MODULUS: usize = 4;
/// Position of the width of the trim.
pub const WIDTH: usize = 5;
/// Position of the size of the brush, whose answer needs the reach of the filaments.
pub const SIZE: usize = 6;
/// Position of that for the largest depth, which a bore narrower than the brush answers.
pub const MAX_DEPTH: usize = 10;
/// Position of that for friction, which the workpiece answers.
pub const FRICTION_COEFFICIENT: usize = 8;

/// The answers to all questions, each in the unit of its setting; `None` stands for the default.
pub type Answers = [Option<f64>; QUESTIONS.len()];

/// All questions, in the order in which they are asked.
pub const QUESTIONS: [Question; 11] = [
    question(
        "--filament-angle-deg",
        "Angle of the filaments to the axis, in degrees: 90 for radial ones, 0 for those of a cup",
        "tool.filament_angle_rad",
        "°",
    ),
    question(
        "--tilt-deg",
        "Tilt of the axis, in degrees: 90 points it into the workpiece",
        "tool.tilt_rad",
        "°",
    ),
    question(
        "--length-mm",
        "Free length of the filaments, in mm",
        "filament.length_m",
        "mm",
    ),
    question(
        "--diameter-mm",
        "Diameter of the filaments, in mm",
        "filament.diameter_m",
        "mm",
    ),
    Question {
        default: Some("3"),
        ..question(
            "--youngs-modulus-gpa",
            "Young's modulus of the filaments, in GPa",
            "filament.youngs_modulus_pa",
            "GPa",
        )
    },
    question(
        "--width-mm",
        "Width of the trim, in mm: of a round brush along its axis, of a cup along its radius",
        "tool.width_m",
        "mm",
    ),
    question(
        "--tool-diameter-mm (or --body-diameter-mm, or --body-radius-mm)",
        "Diameter of the brush over its filaments, in mm; or that of its body, where the filaments in the middle\n\
         of the trim are clamped, as in body 280; or the radius of the body, as in radius 140",
        BODY_RADIUS,
        "mm",
    ),
    question(
        "--filaments",
        "Number of filaments, or the share of the body's surface that they cover, such as 0.6 or 60 %",
        COUNT,
        "",
    ),
    Question {
        default: Some("the middle of its range on the workpiece"),
        ..question(
            "--friction",
            "Coefficient of friction on the workpiece, if it was measured; 0 gives an upper bound of the force",
            FRICTION,
            "",
        )
    },
    question(
        "--max-rpm",
        "Highest rotational speed of the machine, in rpm",
        SPEED,
        "rpm",
    ),
    question(
        "--max-depth-mm",
        "Largest penetration depth of interest, in mm",
        DEPTH,
        "mm",
    ),
];

const fn question(
    option: &'static str,
    words: &'static str,
    path: &'static str,
    unit: &'static str,
) -> Question {
    Question {
        option,
        words,
        default: None,
        path,
        unit,
    }
}

/// Returns `true` if a bore of the radius `bore_m` (m) is narrower than the round brush of the
/// answers. Its depth then has a default.
#[must_use]
pub fn is_tube(kind: ToolKind, answers: &Answers, bore_m: Option<f64>) -> bool {
    let reach_m = answers[SIZE].zip(answers[LENGTH]);
    kind == ToolKind::Round
        && bore_m
            .zip(reach_m)
            .is_some_and(|(bore_m, (body_m, length_m))| bore_m < body_m + length_m)
}

/// Statement of the size of a brush, in m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Size {
    /// Radius of the body.
    BodyRadius(f64),
    /// Diameter of the body.
    BodyDiameter(f64),
    /// Diameter over the filaments.
    ToolDiameter(f64),
}

/// Returns the reach in m of filaments of this length beyond the radius of the body, on a trim of
/// this width. Their `angle` (rad) to the axis is that of the kind of tool if it is not given.
#[must_use]
pub fn reach_m(kind: ToolKind, angle: Option<f64>, [length_m, width_m]: [f64; 2]) -> f64 {
    let tool = ToolSettings {
        kind,
        filament_angle_rad: angle,
        ..ToolSettings::new(0.0, width_m, 0.0)
    };
    let mut settings = Settings::paper(1.0, 1e-3);
    (settings.tool, settings.filament.length_m) = (tool, length_m);
    let trim = Trim::of(&settings);
    trim.ends()
        .map(|s| trim.tip(s)[0])
        .into_iter()
        .fold(f64::NEG_INFINITY, f64::max)
}

impl Size {
    /// Returns the radius of the body in m, beyond which filaments reach by `reach_m`.
    ///
    /// # Errors
    /// If the radius is not an allowed one. The error states the limits.
    pub fn body_radius_m(self, reach_m: f64) -> Result<f64, String> {
        let (radius_m, slip) = match self {
            Self::BodyRadius(radius_m) => (radius_m, ""),
            Self::BodyDiameter(diameter_m) => (diameter_m / 2.0, ""),
            Self::ToolDiameter(diameter_m) => (
                without_rounding_noise(diameter_m / 2.0 - reach_m),
                ": half the diameter over the filaments, less what they reach beyond the body",
            ),
        };
        parameter(BODY_RADIUS)
            .check(radius_m)
            .map(|()| radius_m)
            .map_err(|violation| format!("{violation}{slip}"))
    }
}

impl Question {
    /// Returns the answer that a text states, in the unit of the setting. The number may have a
    /// decimal comma, and a unit behind it. For the size of the brush, filaments reach beyond the
    /// body by `reach_m` ([`reach_m`]).
    ///
    /// # Errors
    /// If the text is no number that the setting may have. The error says what to type.
    pub fn answer(&self, text: &str, reach_m: f64) -> Result<f64, String> {
        if self.path == BODY_RADIUS {
            return self.size(text)?.body_radius_m(reach_m);
        }
        let value = self.number(text)?;
        self.parameter(value)
            .check(value)
            .map_err(|violation| violation.to_string())?;
        Ok(value)
    }

    /// Returns the default answer.
    ///
    /// # Panics
    /// If there is no default.
    pub(super) fn default_answer(&self) -> f64 {
        let default = self.default.expect("there is an answer or a default");
        self.number(default).expect("a default is a number")
    }

    /// Returns the setting of an answer.
    fn parameter(&self, value: f64) -> &'static Parameter {
        parameter(if self.path == COUNT && value < 1.0 {
            SHARE
        } else {
            self.path
        })
    }

    /// Describes an unusual answer, and the likely slip.
    #[must_use]
    pub fn unusual(&self, value: f64) -> Option<Unusual> {
        unusual_value(self.parameter(value), value)
    }

    /// Reads the size of a brush as people state it: the diameter over the filaments or, after a
    /// word, another size.
    fn size(&self, text: &str) -> Result<Size, String> {
        let text = text.trim();
        let lower = text.to_lowercase();
        let after = |word: &str| {
            lower
                .strip_prefix(word)
                .and_then(|rest| text.get(text.len() - rest.len()..))
        };
        match (after("body"), after("radius"), after("diameter")) {
            (Some(rest), ..) => self.number(rest).map(Size::BodyDiameter),
            (_, Some(rest), _) => self.number(rest).map(Size::BodyRadius),
            (.., rest) => self.number(rest.unwrap_or(text)).map(Size::ToolDiameter),
        }
    }

    /// Reads the number that a text states, in the unit of the setting.
    ///
    /// # Errors
    /// If the text is no number, or has a unit of something else.
    pub fn number(&self, text: &str) -> Result<f64, String> {
        let text = text.trim();
        let is_of_number = |letter: char| letter.is_ascii_digit() || "+-.,eE".contains(letter);
        let (number, unit) = text.split_at(
            text.find(|letter| !is_of_number(letter))
                .unwrap_or(text.len()),
        );
        if let Some(error) = ambiguous(number) {
            return Err(error);
        }
        let example = if self.unit.is_empty() {
            "0.6 or 0,6".to_owned()
        } else {
            format!("4.5 or 4,5 {}", self.unit)
        };
        let wrong = || {
            format!(
                "{} is not a number: please type one, such as {example}",
                shown(text, LONGEST_KEY)
            )
        };
        let decimal = if number.contains('.') {
            number.to_owned()
        } else {
            number.replacen(',', ".", 1)
        };
        let number: f64 = decimal.parse().map_err(|_| wrong())?;
        let value = match unit.trim() {
            "" if self.unit.is_empty() => Some(number),
            "" => in_unit_of(self.path, number, self.unit),
            // Filaments cannot cover 100 % of a surface; it would be taken for one filament.
            unit => in_unit_of(self.path, number, unit)
                .filter(|value| self.path != COUNT || *value < 1.0),
        };
        let units: Vec<&str> = units_of(self.path).map(NamedUnit::name).collect();
        let allowed = if units.is_empty() {
            "no unit, or below 100 %".to_owned()
        } else {
            units.join(", ")
        };
        value.ok_or_else(|| {
            format!(
                "{} has another unit: please use {allowed}",
                shown(text, LONGEST_KEY)
            )
        })
    }
}

pub(super) fn parameter(path: &str) -> &'static Parameter {
    Parameter::find(path).expect("a question is about a setting")
}

//! A first input file from a few answers: brush, filaments, and the limits of the machine.

use crate::text::columns;
use crate::text::shown;
use bristle::model::parameters::Parameter;
use bristle::model::settings::{Settings, ToolKind, ToolSettings};
use bristle::tool::Trim;

use crate::grid::{DEPTH, SPEED, without_rounding_noise};
use crate::input::cells::ambiguous;
use crate::input::document::Document;
use crate::input::friction::{FRICTION, Pairing, TOPIC, USUAL};
use crate::input::input_error::{InputError, LONGEST_KEY};
use crate::input::materials::{
    CONTACT_STIFFNESS, Material, WIRE_MODULUS_PA, default_contact_stiffness,
};
use crate::input::packing::{PACKED, tip_spacing};
use crate::input::plausibility::{Unusual, unusual_in_study, unusual_value};
use crate::input::units::other_paths;
use crate::text::layout::{left, wrap};
use crate::text::number::short;
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
    path: &'static str,
    /// Unit of an answer without one.
    unit: &'static str,
}

/// Paths of the radius of the body, of the number of filaments, and of the share of the surface
/// that they cover.
const BODY_RADIUS: &str = "tool.body_radius_m";
const COUNT: &str = "tool.filament_count";
const SHARE: &str = "tool.fill_factor";

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

/// Relative standard deviation of Young's modulus between nominally equal abrasive filaments.
const MODULUS_SPREAD: f64 = 0.22;
/// The source of [`MODULUS_SPREAD`].
const SOURCE_OF_SPREAD: &str =
    "22 % between nominally equal abrasive filaments of three makers (SK-Lab 12 and 13)";
/// Paths of the standard deviations that a first file states.
const FRICTION_STD: &str = "uncertainty.friction_coefficient_std";
const MODULUS_STD: &str = "uncertainty.youngs_modulus_std_pa";

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
    fn default_answer(&self) -> f64 {
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

fn parameter(path: &str) -> &'static Parameter {
    Parameter::find(path).expect("a question is about a setting")
}

/// An input file.
#[derive(Clone, Debug, PartialEq)]
pub struct FirstFile {
    /// Text of the file.
    pub text: String,
    /// Unusual values in it.
    pub unusual: Vec<Unusual>,
    /// Note about filaments that touch each other and cannot be simulated together; empty if there
    /// are none.
    pub note: String,
}

/// Makes an input file with a study up to the machine's limits, from the answers to [`QUESTIONS`]
/// about a tool of some kind. The material of the filaments is given if known. A question without
/// an answer has its default, which the file does not state. The workpiece is a plane, or a bore of
/// the radius `bore_m` (m). `name` is that of the file.
///
/// Friction without an answer is that of the `pairing`, at the middle of its range. What is not
/// answered has a standard deviation, so that forces have an interval.
///
/// # Errors
/// If the answers make no brush that can be simulated.
///
/// # Panics
/// If there is no answer to a question without a default.
pub fn first_file(
    kind: ToolKind,
    answers: Answers,
    material: Option<&'static Material>,
    pairing: &Pairing,
    bore_m: Option<f64>,
    name: &str,
) -> Result<FirstFile, InputError> {
    let is_tube = is_tube(kind, &answers, bore_m);
    let [angle, tilt, others @ ..] = answers;
    let mut questions = QUESTIONS[TILT + 1..].iter();
    let [
        length,
        diameter,
        modulus,
        width,
        radius,
        filaments,
        friction,
        speed,
        depth,
    ] = others.map(|answer| {
        let question = questions.next().expect("each answer has its question");
        let has_none = is_tube && question.path == DEPTH;
        answer.unwrap_or_else(|| match question.path {
            _ if has_none => 0.0,
            FRICTION => rounded(pairing.middle()),
            _ => question.default_answer(),
        })
    });
    let [_, _, has_modulus, _, _, _, has_friction, _, _] = others.map(|answer| answer.is_some());
    let count = if filaments < 1.0 { SHARE } else { COUNT };
    let shares = |limit: f64, parts: u32| {
        let values = (1..=parts).map(|part| rounded(limit * f64::from(part) / f64::from(parts)));
        values
            .map(|value| format!("{value:?}"))
            .collect::<Vec<_>>()
            .join(", ")
    };
    // An unanswered question is a comment: stated, its default would pass for known.
    let section = |name: &str, settings: &[(&str, f64, bool)]| {
        let (known, unknown): (Vec<_>, Vec<_>) =
            settings.iter().partition(|(.., is_known)| *is_known);
        let stated: String = known
            .into_iter()
            .map(|&(path, value, _)| line("", path, value))
            .collect();
        let material = material
            .filter(|_| name == "filament")
            .map_or_else(String::new, line_of_material);
        let left_out: String = unknown
            .into_iter()
            .map(|&(path, value, _)| line(COMMENT, path, value))
            .collect();
        let what = if left_out.is_empty() {
            ""
        } else {
            "# Defaults, which decide the force; state them if you know them:\n"
        };
        format!("\n[{name}]\n{stated}{material}{what}{left_out}")
    };
    let of_material = material.filter(|_| !has_modulus);
    let modulus_pa = of_material.map_or(modulus, |material| material.youngs_modulus_pa);
    let stiffness = rounded(default_contact_stiffness(modulus_pa, diameter));
    let mut filament = vec![
        ("filament.length_m", length, true),
        ("filament.diameter_m", diameter, true),
    ];
    if has_modulus || material.is_none() {
        filament.push(("filament.youngs_modulus_pa", modulus, has_modulus));
    }
    if material.is_none() {
        filament.push(("filament.density_kg_m3", 1110.0, false));
    }
    filament.push(("filament.damping_ratio", 0.05, false));
    let shown_name = shown(name, LONGEST_KEY);
    let head = |one: String, what: &'static str| {
        let calls = [
            (one, what),
            (
                format!("bristle study {shown_name} --out results"),
                "all combinations of [study]",
            ),
            (
                "bristle advise results --target-force N".to_owned(),
                "what to set for a force of N newtons",
            ),
        ];
        let longest = calls
            .iter()
            .map(|(call, _)| columns(call))
            .max()
            .unwrap_or(0);
        let calls = calls
            .map(|(call, what)| format!("#   {}  {what}\n", left(&call, longest)))
            .concat();
        format!(
            "# An input file of Bristle. `bristle explain KEY` says what a key means.\n#\n{calls}"
        )
    };
    let sections = [
        format!(
            "\n[tool]\n{}{}",
            line_of_kind(kind),
            [("tool.filament_angle_rad", angle), ("tool.tilt_rad", tilt)].map(line_in_degrees).concat()
        ),
        [(BODY_RADIUS, radius), ("tool.width_m", width), (count, filaments)]
            .map(|(path, value)| line("", path, value))
            .concat(),
        section("filament", &filament),
        section_of_contact(friction, (!has_friction).then_some(pairing), stiffness),
        bore_m.map_or_else(String::new, section_of_bore),
        section("process", &[(SPEED, rounded(speed / 2.0), true)]),
        match is_tube {
            true => "# The depth follows from the radii: brush and bore have one axis.\n".to_owned(),
            false => {
                line("", DEPTH, rounded(depth / 2.0))
                    + "# tool_force_n = 50                 # in place of the depth, which is then found\n"
            }
        },
        format!(
            "\n[study]                            # up to the limits of the machine\nrotational_speed_rpm = [{}]\n",
            shares(speed, 6)
        ),
        match is_tube {
            true => String::new(),
            false => format!("penetration_depth_m = [{}]\n", shares(depth, 4)),
        },
        "\n# [goal]                           # what the study is to answer; `bristle explain goal`\n\
         # target_force_n = 50\n"
            .to_owned(),
    ]
    .concat();
    let uncertainty = section_of_uncertainty(
        (!has_friction).then_some(pairing),
        (!has_modulus && modulus_pa < WIRE_MODULUS_PA).then_some(modulus_pa),
    );
    let alone = head(
        format!("bristle simulate {shown_name} --out contact"),
        "one contact, as in [process]",
    ) + &sections;
    let settings = Document::parse(&alone, name)?.settings()?;
    let is_packed = tip_spacing(&settings) < PACKED;
    let note = if is_packed && (is_tube || !Trim::of(&settings).is_radial()) {
        apart(&settings, is_tube)
    } else {
        String::new()
    };
    let text = match (is_packed, note.is_empty()) {
        (true, true) => {
            let brush = format!("bristle simulate {shown_name} --out sector");
            head(brush, "filaments that touch, as in [process]")
                + &sections
                + &section_of_brush(&settings)
        }
        (true, false) => {
            let mut why = String::new();
            wrap(WIDTH_OF_NOTES, &mut why, COMMENT, &note);
            alone + "\n" + &why.trim_end().replace("\n  ", "\n# ") + "\n"
        }
        (false, _) => alone,
    } + &uncertainty;
    let unusual = unusual_in_study(&Document::parse(&text, name)?.study()?);
    Ok(FirstFile {
        text,
        unusual,
        note,
    })
}

/// Returns the section of the contact with the workpiece, whose friction is that of a `pairing` if
/// nobody has measured it.
fn section_of_contact(friction: f64, pairing: Option<&Pairing>, stiffness: f64) -> String {
    let source = pairing.map_or_else(String::new, |pairing| {
        format!(
            "# The middle of {}, a guess for {} {}; `bristle explain {TOPIC}`:\n",
            pairing.range_text(),
            pairing.condition,
            if pairing.workpiece == "other" {
                "workpieces"
            } else {
                pairing.workpiece
            },
        )
    });
    format!(
        "\n[contact]\n{source}{}# A default; state it if you know it:\n{}",
        line("", FRICTION, friction),
        line(COMMENT, CONTACT_STIFFNESS, stiffness)
    )
}

/// Returns the section of standard deviations: of friction on a `pairing`, and of a modulus in Pa
/// that nobody has measured. What was measured has a comment in its place.
fn section_of_uncertainty(pairing: Option<&Pairing>, modulus_pa: Option<f64>) -> String {
    if pairing.is_none() && modulus_pa.is_none() {
        return String::new();
    }
    let friction = pairing.map_or_else(
        || line(COMMENT, FRICTION_STD, rounded(USUAL.std())),
        |pairing| {
            let range = pairing.range_text();
            let source = format!("# A quarter of the range, so that 95 % lie in {range}:\n");
            source + &line("", FRICTION_STD, rounded(pairing.std()))
        },
    );
    let modulus = modulus_pa.map_or_else(String::new, |modulus_pa| {
        let std = rounded(MODULUS_SPREAD * modulus_pa);
        format!("# {SOURCE_OF_SPREAD}:\n{}", line("", MODULUS_STD, std))
    });
    format!(
        "\n[uncertainty]                      # from brush to brush: F_n,w has a 95 % interval\n{friction}{modulus}"
    )
}

/// Returns the line of a kind; empty for the default kind.
fn line_of_kind(kind: ToolKind) -> String {
    let (word, what) = match kind {
        ToolKind::Round => return String::new(),
        ToolKind::Cup => (
            "cup",
            "axial filaments, the axis at right angles to the workpiece",
        ),
        ToolKind::Cone => ("cone", "filaments meet the workpiece at right angles"),
    };
    let setting = format!("kind = \"{word}\"");
    format!("{setting:34} # {what}\n")
}

/// Returns the line of an angle in degrees; empty without a value.
fn line_in_degrees((path, value): (&str, Option<f64>)) -> String {
    let Some(value) = value else {
        return String::new();
    };
    let (key, unit) = other_paths(path)
        .find(|(key, _)| key.ends_with("_deg"))
        .expect("an angle can be stated in degrees");
    let Parameter { symbol, name, .. } = parameter(path);
    let setting = format!(
        "{} = {:?}",
        &key[path.find('.').map_or(0, |dot| dot + 1)..],
        unit.of_own(value)
    );
    format!("{setting:34} # {symbol}: {name}, in degrees\n")
}

/// Returns the section of a bore of this radius in m.
fn section_of_bore(radius_m: f64) -> String {
    let kind = format!("{:34} # around the tool", "kind = \"bore\"");
    format!(
        "\n[workpiece]\n{kind}\n{}",
        line("", "workpiece.radius_m", radius_m)
    )
}

/// Why filaments that touch each other are simulated alone.
fn apart(settings: &Settings, is_tube: bool) -> String {
    let which = if is_tube {
        "Those in a bore narrower than the brush"
    } else {
        "Those of axial and conical trims"
    };
    format!(
        "The tips are {} diameters apart: filaments touch each other. {which} are simulated alone all the same, \
         so that there is no section [brush] here.",
        short(tip_spacing(settings))
    )
}

/// Returns the section of filaments that touch each other. Commented lines are guesses of the
/// unevenness that every brush has.
fn section_of_brush(settings: &Settings) -> String {
    let rows_differ = settings.tool.tilt_rad() != 0.0;
    let ends = if rows_differ {
        "ends = \"free\"                      # rows of a tilted tool differ\n"
    } else {
        ""
    };
    format!(
        "\n[brush]                            # filaments touch: their tips are {} diameters apart\n{ends}\
         # No brush is as even as these rows. Guesses of how uneven it is, which decide the force;\n\
         # docs/trust.md says how to see yours. With them a brush is simulated in space,\n\
         # which takes some fifty times as long:\n{}{}",
        short(tip_spacing(settings)),
        line(COMMENT, "brush.lateral_tilt_std_rad", ASSUMED_TILT_RAD),
        line(
            COMMENT,
            "brush.root_std_m",
            rounded(ASSUMED_SHIFT * settings.filament.diameter_m)
        ),
    )
}

/// Standard deviation of the tilts of a brush that nobody has measured, in rad: a guess. It moves
/// tips by 0.2 mm in 40.
pub const ASSUMED_TILT_RAD: f64 = 5e-3;
/// Standard deviation of the shifts of the roots, over the diameter: a guess.
const ASSUMED_SHIFT: f64 = 0.05;

/// Longest line of prose, in columns.
const WIDTH_OF_NOTES: usize = 90;
const COMMENT: &str = "# ";

/// Returns the line of a setting with its name and unit as a comment, after a `beginning`.
fn line(beginning: &str, path: &str, value: f64) -> String {
    let parameter = Parameter::find(path).expect("the file has settings only");
    let setting = format!(
        "{beginning}{} = {}",
        parameter.key(),
        parameter.format(value)
    );
    let about = [parameter.symbol, parameter.name]
        .iter()
        .filter(|part| !part.is_empty())
        .copied()
        .collect::<Vec<_>>();
    format!(
        "{setting:34} # {}{}\n",
        about.join(": "),
        parameter.in_unit()
    )
}

/// Returns the line that names a material, with its values as a comment.
fn line_of_material(material: &Material) -> String {
    let Material {
        name,
        youngs_modulus_pa,
        density_kg_m3,
        condition,
        caution,
        ..
    } = material;
    // The condition matters only for materials that water or heat changes.
    let condition = match *condition {
        _ if caution.is_empty() => "",
        "wet" => ", wet; hot it is softer",
        _ => ", dry; wet or hot it is softer",
    };
    let setting = format!("material = \"{name}\"");
    let [modulus, density] = [youngs_modulus_pa / 1e9, *density_kg_m3].map(short);
    format!("{setting:34} # E = {modulus} GPa, ρ = {density} kg/m³{condition}\n")
}

/// Rounds to four significant digits.
fn rounded(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the answers to all questions but those about the pose, as a person types them.
    fn typed(texts: [&str; 9]) -> Answers {
        let mut answers = [None; 11];
        for ((answer, question), text) in answers.iter_mut().zip(&QUESTIONS).skip(LENGTH).zip(texts)
        {
            *answer = Some(question.answer(text, 0.04).expect(text));
        }
        answers
    }

    fn file(answers: Answers, material: Option<&'static Material>) -> FirstFile {
        first_file(
            ToolKind::Round,
            answers,
            material,
            USUAL,
            None,
            "brush.toml",
        )
        .expect("a brush")
    }

    #[test]
    fn answers_become_a_brush() {
        let mut answers = typed([
            "40", "1,18 mm", "3", "20", "36 cm", "10500", "0.3", "25 Hz", "4",
        ]);
        let FirstFile {
            text,
            unusual,
            note,
        } = file(answers, None);
        assert_eq!(note, "");
        assert_eq!(unusual, []);
        let document = Document::parse(&text, "brush.toml").expect("a document");
        let settings = document.settings().expect("settings");
        assert_eq!(
            (settings.tool.body_radius_m, settings.filament.diameter_m),
            (0.14, 1.18e-3)
        );
        assert_eq!(
            (
                settings.tool.filament_count,
                settings.filament.youngs_modulus_pa
            ),
            (10_500.0, 3e9)
        );
        assert!((settings.rotational_speed_rpm() - 750.0).abs() < 1e-9);
        assert_eq!(document.study().expect("a study").case_count(), 24);
        let unstated = document.unstated();
        let unstated: Vec<&str> = unstated.iter().map(|parameter| parameter.key()).collect();
        assert_eq!(
            unstated,
            ["density_kg_m3", "damping_ratio", "stiffness_n_m"],
            "what was not asked is not stated"
        );

        answers[MODULUS] = None;
        answers[7] = Some(0.6);
        let packed = file(answers, None).text;
        assert!(
            packed.contains("\nfill_factor = 0.6 ") && packed.contains("\n# youngs_modulus_pa = "),
            "{packed}"
        );
        let named = file(answers, Material::find("PA6.12")).text;
        assert!(
            named.contains("\nmaterial = \"PA6.12\" ")
                && named.contains("# E = 3.31 GPa, ρ = 1060 kg/m³, dry;"),
            "{named}"
        );
        assert!(
            !named.contains("youngs_modulus_pa") && !named.contains("density_kg_m3"),
            "{named}"
        );
        let document = Document::parse(&named, "brush.toml").expect("a document");
        assert_eq!(
            document
                .settings()
                .expect("settings")
                .filament
                .youngs_modulus_pa,
            3.31e9
        );
        answers[7] = Some(20_000.0);
        let unusual = file(answers, None).unusual;
        assert!(
            unusual
                .iter()
                .any(|unusual| unusual.statement.contains("fit on the body")),
            "{unusual:?}"
        );
        answers[10] = Some(50e-3);
        let wrong = first_file(ToolKind::Round, answers, None, USUAL, None, "brush.toml");
        assert!(
            wrong
                .expect_err("too deep")
                .to_string()
                .contains("`process.penetration_depth_m`")
        );
    }

    #[test]
    fn friction_and_modulus_that_nobody_measured_have_a_standard_deviation() {
        let mut answers = typed(["40", "1,18", "3", "20", "360", "1000", "0.3", "1500", "4"]);
        assert!(!file(answers, None).text.contains("\n[uncertainty]"));
        answers[FRICTION_COEFFICIENT] = None;
        answers[MODULUS] = None;
        let settings = |material, pairing: &Pairing| {
            let text = first_file(
                ToolKind::Round,
                answers,
                material,
                pairing,
                None,
                "brush.toml",
            )
            .expect("a brush")
            .text;
            Document::parse(&text, "brush.toml")
                .and_then(|file| file.settings())
                .expect("settings")
        };
        let nylon = Material::find("PA6.12");
        let dry = settings(nylon, USUAL);
        let [friction, modulus] = [
            dry.uncertainty.friction_coefficient_std,
            dry.uncertainty.youngs_modulus_std_pa,
        ];
        assert_eq!((dry.contact.friction_coefficient, friction), (0.4, 0.1));
        assert_eq!(modulus, 0.7282e9, "22 % of 3.31 GPa");
        let wet = settings(nylon, Pairing::find("other", true).expect("a pairing"));
        assert_eq!(wet.contact.friction_coefficient, 0.325);
        // Moduli of metal wires are known better.
        let wire = settings(Material::find("steel"), USUAL);
        assert_eq!(wire.uncertainty.youngs_modulus_std_pa, 0.0);
        assert!(wire.uncertainty.scatters());
    }

    #[test]
    fn cups_and_cones_are_stated_in_degrees_and_diameters() {
        let texts = ["25", "0,5", "3", "10", "200", "1500", "0.3", "3000", "1"];
        let answers = |kind, angle: Option<f64>| {
            let mut answers = typed(texts);
            let reach = reach_m(kind, angle, [0.025, 0.010]);
            answers[SIZE] = Some(QUESTIONS[SIZE].answer("70", reach).expect("a size"));
            answers[ANGLE] = angle;
            answers
        };
        let read = |text: &str| {
            Document::parse(text, "brush.toml")
                .and_then(|file| file.settings())
                .expect("settings")
        };
        let cup = first_file(
            ToolKind::Cup,
            answers(ToolKind::Cup, None),
            None,
            USUAL,
            None,
            "brush.toml",
        )
        .expect("a cup");
        let settings = read(&cup.text);
        assert_eq!(
            (settings.tool.kind, settings.tool.body_radius_m),
            (ToolKind::Cup, 0.030),
            "35 mm less half of the width"
        );
        let FirstFile { text, note, .. } = cup;
        assert!(
            note.contains("so that there is no section [brush]") && !text.contains("\n[brush]"),
            "{text}"
        );
        assert!(
            text.contains("\n# The tips are 2.242 diameters apart")
                && text.contains("bristle simulate"),
            "{text}"
        );
        assert!(
            text.lines().all(|line| line.chars().count() <= 100),
            "{text}"
        );

        let angle = Some(30_f64.to_radians());
        let mut of_cone = answers(ToolKind::Cone, angle);
        let cone = first_file(ToolKind::Cone, of_cone, None, USUAL, None, "brush.toml")
            .expect("a cone")
            .text;
        assert!(
            cone.contains("\nfilament_angle_deg = 30.0 ") && cone.contains("\nkind = \"cone\" "),
            "{cone}"
        );
        let settings = read(&cone);
        assert!((settings.tool.tilt_rad() - 60_f64.to_radians()).abs() < 1e-12);
        let largest = Trim::of(&settings)
            .ends()
            .map(|s| Trim::of(&settings).tip(s)[0])
            .into_iter()
            .fold(0.0, f64::max);
        assert!((largest - 0.035).abs() < 1e-9, "{largest}");
        of_cone[ANGLE] = None;
        let missing = first_file(ToolKind::Cone, of_cone, None, USUAL, None, "brush.toml")
            .expect_err("no angle")
            .to_string();
        assert!(
            missing.contains("`tool.filament_angle_rad` is left out"),
            "{missing}"
        );

        // Rows of a tilted round brush differ.
        let mut tilted = typed(["40", "1,18", "3", "20", "360", "10500", "0.3", "1500", "4"]);
        tilted[TILT] = Some(0.1);
        let text = file(tilted, None).text;
        assert!(
            text.contains("\n[brush] ") && text.contains("\nends = \"free\" "),
            "{text}"
        );
    }

    #[test]
    fn answers_are_read_as_people_type_them() {
        let question = |option: &str| {
            let mut questions = QUESTIONS.iter();
            questions
                .find(|question| question.option.starts_with(option))
                .expect(option)
        };
        for (option, text, expected) in [
            ("--diameter-mm", " 1,18 ", 1.18e-3),
            ("--diameter-mm", "600µm", 0.6e-3),
            ("--length-mm", "4 cm", 0.04),
            ("--youngs-modulus-gpa", "3310 N/mm²", 3.31e9),
            ("--filaments", "60 %", 0.6),
            ("--tool-diameter", "360", 0.14),
            ("--tool-diameter", "Diameter 280,5 mm", 0.10025),
            ("--tool-diameter", "body 280", 0.14),
            ("--tool-diameter", "Radius 14 cm", 0.14),
            ("--max-rpm", "20 Hz", 1200.0),
            ("--filament-angle", "90", std::f64::consts::FRAC_PI_2),
            ("--tilt-deg", "-90 °", -std::f64::consts::FRAC_PI_2),
        ] {
            assert_eq!(question(option).answer(text, 0.04), Ok(expected), "{text}");
        }
        for (option, text, part) in [
            (
                "--length-mm",
                "long",
                "is not a number: please type one, such as 4.5 or 4,5 mm",
            ),
            ("--length-mm", "1.2,3", "is not a number"),
            (
                "--length-mm",
                "4 in",
                "has another unit: please use m, mm, cm, µm",
            ),
            (
                "--length-mm",
                "-4",
                "`filament.length_m` is -0.004, but must be",
            ),
            (
                "--filaments",
                "10,500",
                "may separate decimals or thousands: write 10500 or 10.5",
            ),
            (
                "--filaments",
                "100 %",
                "has another unit: please use no unit, or below 100 %",
            ),
            (
                "--tool-diameter",
                "60",
                "`tool.body_radius_m` is -0.01, but must be",
            ),
            (
                "--tool-diameter",
                "60",
                "half the diameter over the filaments, less what they reach beyond the body",
            ),
            ("--tool-diameter", "", "is not a number"),
        ] {
            let problem = question(option).answer(text, 0.04).expect_err(text);
            assert!(problem.contains(part), "{text}: {problem}");
        }
        let slip = question("--diameter-mm").unusual(0.6).expect("unusual");
        assert!(
            slip.statement
                .contains("`filament.diameter_m` is 0.6 m; usually it is from 2e-5 to 0.005 m"),
            "{slip:?}"
        );
        assert_eq!(question("--filaments").unusual(0.6), None);
    }
}

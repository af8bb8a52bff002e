//! A first input file from a few answers: brush, filaments, and the limits of the machine.

mod questions;
#[cfg(test)]
mod tests;

use crate::text::columns;
use crate::text::shown;
use bristle::model::parameters::Parameter;
use bristle::model::settings::{Settings, ToolKind};
use bristle::tool::Trim;

use crate::grid::{DEPTH, SPEED};
use crate::input::document::Document;
use crate::input::friction::{FRICTION, Pairing, TOPIC, USUAL};
use crate::input::input_error::{InputError, LONGEST_KEY};
use crate::input::materials::{
    CONTACT_STIFFNESS, Material, WIRE_MODULUS_PA, default_contact_stiffness,
};
use crate::input::packing::{PACKED, tip_spacing};
use crate::input::plausibility::{Unusual, unusual_in_study};
use crate::input::units::other_paths;
use crate::text::layout::{left, wrap};
use crate::text::number::{rounded, short};

pub use questions::{
    ANGLE, Answers, FRICTION_COEFFICIENT, LENGTH, MAX_DEPTH, MODULUS, QUESTIONS, Question, SIZE,
    Size, TILT, WIDTH, is_tube, reach_m,
};

use questions::{BODY_RADIUS, COUNT, SHARE, parameter};

/// Relative standard deviation of Young's modulus between nominally equal abrasive filaments.
const MODULUS_SPREAD: f64 = 0.22;
/// The source of [`MODULUS_SPREAD`].
const SOURCE_OF_SPREAD: &str =
    "22 % between nominally equal abrasive filaments of three makers (SK-Lab 12 and 13)";
/// Significant digits of values that a first file computes.
const DIGITS: usize = 4;
/// Paths of the standard deviations that a first file states.
const FRICTION_STD: &str = "uncertainty.friction_coefficient_std";
const MODULUS_STD: &str = "uncertainty.youngs_modulus_std_pa";

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
            FRICTION => rounded(pairing.middle(), DIGITS),
            _ => question.default_answer(),
        })
    });
    let [_, _, has_modulus, _, _, _, has_friction, _, _] = others.map(|answer| answer.is_some());
    let count = if filaments < 1.0 { SHARE } else { COUNT };
    let shares = |limit: f64, parts: u32| {
        let values =
            (1..=parts).map(|part| rounded(limit * f64::from(part) / f64::from(parts), DIGITS));
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
    let stiffness = rounded(default_contact_stiffness(modulus_pa, diameter), DIGITS);
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
        section("process", &[(SPEED, rounded(speed / 2.0, DIGITS), true)]),
        match is_tube {
            true => "# The depth follows from the radii: brush and bore have one axis.\n".to_owned(),
            false => {
                line("", DEPTH, rounded(depth / 2.0, DIGITS))
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
        || line(COMMENT, FRICTION_STD, rounded(USUAL.std(), DIGITS)),
        |pairing| {
            let range = pairing.range_text();
            let source = format!("# A quarter of the range, so that 95 % lie in {range}:\n");
            source + &line("", FRICTION_STD, rounded(pairing.std(), DIGITS))
        },
    );
    let modulus = modulus_pa.map_or_else(String::new, |modulus_pa| {
        let std = rounded(MODULUS_SPREAD * modulus_pa, DIGITS);
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
            rounded(ASSUMED_SHIFT * settings.filament.diameter_m, DIGITS)
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

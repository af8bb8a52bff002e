//! A first input file from a few answers: brush, filaments, and the limits of the machine.

use bristle::model::parameters::Parameter;
use bristle::model::settings::Settings;
use bristle_text::{columns, shown};

use crate::document::Document;
use crate::input_error::{InputError, LONGEST_KEY};
use crate::materials::Material;
use crate::packing::{PACKED, tip_spacing};
use bristle_grid::without_rounding_noise;
use bristle_text::layout::left;
use bristle_text::number::short;

/// A question about a brush or a machine.
#[derive(Debug)]
pub struct Question {
    /// The name of the option that answers it.
    pub option: &'static str,
    /// The question, with the unit of the answer.
    pub words: &'static str,
    /// The answer without one, if there is a usual one.
    pub default: Option<f64>,
    /// From the answer to SI.
    to_si: fn(f64) -> f64,
}

/// All questions, in the order in which they are asked.
pub const QUESTIONS: [Question; 9] = [
    Question {
        option: "--body-radius-mm",
        words: "Radius of the brush body, where the filaments are clamped, in mm",
        default: None,
        to_si: from_milli,
    },
    Question {
        option: "--width-mm",
        words: "Width of the brush along its axis, in mm",
        default: None,
        to_si: from_milli,
    },
    Question {
        option: "--filaments",
        words: "Number of filaments, or the share of the body's surface that they cover, such as 0.6",
        default: None,
        to_si: as_it_is,
    },
    Question { option: "--length-mm", words: "Free length of the filaments, in mm", default: None, to_si: from_milli },
    Question { option: "--diameter-mm", words: "Diameter of the filaments, in mm", default: None, to_si: from_milli },
    Question {
        option: "--youngs-modulus-gpa",
        words: "Young's modulus of the filaments, in GPa",
        default: Some(3.0),
        to_si: from_giga,
    },
    Question {
        option: "--friction",
        words: "Coefficient of friction on the workpiece; 0 gives an upper bound of the force",
        default: Some(0.0),
        to_si: as_it_is,
    },
    Question {
        option: "--max-rpm",
        words: "Highest rotational speed of the machine, in rpm",
        default: None,
        to_si: as_it_is,
    },
    Question {
        option: "--max-depth-mm",
        words: "Largest penetration depth of interest, in mm",
        default: None,
        to_si: from_milli,
    },
];

fn from_milli(value: f64) -> f64 {
    without_rounding_noise(value / 1e3)
}

fn from_giga(value: f64) -> f64 {
    without_rounding_noise(value * 1e9)
}

fn as_it_is(value: f64) -> f64 {
    value
}

/// The text of an input file from the answers to [`QUESTIONS`], each in the unit of its question, and the material of the filaments if it
/// is known, with a study up to the machine's limits. A question without an answer has its default, and the file does not state it. `name`
/// is that of the file.
///
/// # Errors
/// If the answers make no brush that can be simulated.
///
/// # Panics
/// If there is no answer to a question without a default.
pub fn first_file(
    answers: [Option<f64>; 9],
    material: Option<&'static Material>,
    name: &str,
) -> Result<String, InputError> {
    let mut questions = QUESTIONS.iter();
    let [radius, width, filaments, length, diameter, modulus, friction, speed, depth] = answers.map(|answer| {
        let question = questions.next().expect("each answer has its question");
        (question.to_si)(answer.or(question.default).expect("there is an answer or a default"))
    });
    let [.., has_modulus, has_friction, _, _] = answers.map(|answer| answer.is_some());
    let count = if filaments < 1.0 { "tool.fill_factor" } else { "tool.filament_count" };
    let shares = |limit: f64, parts: u32| {
        let values = (1..=parts).map(|part| rounded(limit * f64::from(part) / f64::from(parts)));
        values.map(|value| format!("{value:?}")).collect::<Vec<_>>().join(", ")
    };
    // What nobody has answered is a comment: stated, it would pass for known.
    let section = |name: &str, settings: &[(&str, f64, bool)]| {
        let (known, unknown): (Vec<_>, Vec<_>) = settings.iter().partition(|(.., is_known)| *is_known);
        let stated: String = known.into_iter().map(|&(path, value, _)| line("", path, value)).collect();
        let material = material.filter(|_| name == "filament").map_or_else(String::new, line_of_material);
        let left_out: String = unknown.into_iter().map(|&(path, value, _)| line(COMMENT, path, value)).collect();
        let what =
            if left_out.is_empty() { "" } else { "# Defaults, which decide the force; state them if you know them:\n" };
        format!("\n[{name}]\n{stated}{material}{what}{left_out}")
    };
    let mut filament = vec![("filament.length_m", length, true), ("filament.diameter_m", diameter, true)];
    if has_modulus || material.is_none() {
        filament.push(("filament.youngs_modulus_pa", modulus, has_modulus));
    }
    if material.is_none() {
        filament.push(("filament.density_kg_m3", 1110.0, false));
    }
    filament.push(("filament.damping_ratio", 0.05, false));
    let shown_name = shown(name, LONGEST_KEY);
    let calls = [
        (format!("bristle simulate {shown_name} --out contact"), "one contact, as in [process]"),
        (format!("bristle study {shown_name} --out results"), "all combinations of [study]"),
        ("bristle advise results".to_owned(), "where the force is high"),
    ];
    let longest = calls.iter().map(|(call, _)| columns(call)).max().unwrap_or(0);
    let text = [
        format!(
            "# An input file of Bristle. `bristle explain KEY` says what a key means.\n#\n{}",
            calls.map(|(call, what)| format!("#   {}  {what}\n", left(&call, longest))).concat()
        ),
        section(
            "tool",
            &[("tool.body_radius_m", radius, true), ("tool.width_m", width, true), (count, filaments, true)],
        ),
        section("filament", &filament),
        section(
            "contact",
            &[("contact.friction_coefficient", friction, has_friction), ("contact.stiffness_n_m", 1e5, false)],
        ),
        section(
            "process",
            &[
                ("process.rotational_speed_rpm", rounded(speed / 2.0), true),
                ("process.penetration_depth_m", rounded(depth / 2.0), true),
            ],
        ),
        format!(
            "\n[study]                            # up to the limits of the machine\nrotational_speed_rpm = [{}]\n\
             penetration_depth_m = [{}]\n",
            shares(speed, 6),
            shares(depth, 4)
        ),
    ]
    .concat();
    let settings = Document::parse(&text, name)?.settings()?;
    let text = if tip_spacing(&settings) < PACKED { text + &section_of_brush(&settings) } else { text };
    Document::parse(&text, name)?.study()?;
    Ok(text)
}

/// The section of filaments that touch each other. Its commented lines are guesses of what no brush is without.
fn section_of_brush(settings: &Settings) -> String {
    format!(
        "\n[brush]                            # filaments touch: their tips are {} diameters apart\n\
         # No brush is as even as these rows. Guesses, which decide the force; docs/what-to-measure.md says how to see yours.\n\
         # With them a brush is simulated in space, which takes some twenty times as long:\n{}{}",
        short(tip_spacing(settings)),
        line(COMMENT, "brush.lateral_tilt_std_rad", ASSUMED_TILT_RAD),
        line(COMMENT, "brush.root_std_m", rounded(ASSUMED_SHIFT * settings.filament.diameter_m)),
    )
}

/// The standard deviation of the tilts of a brush that nobody has measured, in rad: a guess. It moves tips by 0.2 mm in 40.
pub const ASSUMED_TILT_RAD: f64 = 5e-3;
/// That of the shifts of the roots, over the diameter: a guess.
const ASSUMED_SHIFT: f64 = 0.05;

/// What makes a line a comment.
const COMMENT: &str = "# ";

/// A setting with its name and unit as a comment, after a `beginning`.
fn line(beginning: &str, path: &str, value: f64) -> String {
    let parameter = Parameter::find(path).expect("the file has settings only");
    let setting = format!("{beginning}{} = {}", parameter.key(), parameter.format(value));
    let about = [parameter.symbol, parameter.name].iter().filter(|part| !part.is_empty()).copied().collect::<Vec<_>>();
    format!("{setting:34} # {}{}\n", about.join(": "), parameter.in_unit())
}

/// The line that names a material, with what it states as a comment.
fn line_of_material(material: &Material) -> String {
    let Material { name, youngs_modulus_pa, density_kg_m3, caution, .. } = material;
    // Only of what water or heat changes the condition matters.
    let dry = if caution.is_empty() { "" } else { ", dry; wet or hot it is softer" };
    let setting = format!("material = \"{name}\"");
    let [modulus, density] = [youngs_modulus_pa / 1e9, *density_kg_m3].map(short);
    format!("{setting:34} # E = {modulus} GPa, ρ = {density} kg/m³{dry}\n")
}

/// Four significant digits.
fn rounded(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_become_a_brush() {
        let answers = [140.0, 20.0, 10_500.0, 40.0, 1.18, 3.0, 0.3, 1500.0, 4.0].map(Some);
        let text = first_file(answers, None, "brush.toml");
        let text = text.expect("the paper's brush");
        let document = Document::parse(&text, "brush.toml").expect("a document");
        let settings = document.settings().expect("settings");
        assert_eq!((settings.tool.body_radius_m, settings.filament.diameter_m), (0.14, 1.18e-3));
        assert_eq!((settings.tool.filament_count, settings.filament.youngs_modulus_pa), (10_500.0, 3e9));
        assert!((settings.rotational_speed_rpm() - 750.0).abs() < 1e-9);
        assert_eq!(document.study().expect("a study").case_count(), 24);
        let unstated = document.unstated();
        let unstated: Vec<&str> = unstated.iter().map(|parameter| parameter.key()).collect();
        assert_eq!(unstated, ["density_kg_m3", "damping_ratio", "stiffness_n_m"], "what was not asked is not stated");
        assert_eq!(crate::plausibility::unusual(&settings), []);

        let mut answers = [140.0, 20.0, 0.6, 40.0, 1.18, 3.0, 0.3, 1500.0, 4.0].map(Some);
        answers[5] = None;
        let packed = first_file(answers, None, "brush.toml").expect("a brush");
        assert!(packed.contains("\nfill_factor = 0.6 ") && packed.contains("\n# youngs_modulus_pa = "), "{packed}");
        let named = first_file(answers, Material::find("PA6.12"), "brush.toml").expect("a brush");
        assert!(
            named.contains("\nmaterial = \"PA6.12\" ") && named.contains("# E = 3.31 GPa, ρ = 1060 kg/m³, dry;"),
            "{named}"
        );
        assert!(!named.contains("youngs_modulus_pa") && !named.contains("density_kg_m3"), "{named}");
        let document = Document::parse(&named, "brush.toml").expect("a document");
        assert_eq!(document.settings().expect("settings").filament.youngs_modulus_pa, 3.31e9);
        answers[8] = Some(50.0);
        let wrong = first_file(answers, None, "brush.toml");
        assert!(wrong.expect_err("too deep").to_string().contains("`process.penetration_depth_m`"));
    }
}

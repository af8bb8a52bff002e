//! A first input file from a few answers: brush, filaments, and the limits of the machine.

use bristle::model::parameters::Parameter;

use crate::document::Document;
use crate::input_error::InputError;
use crate::study::without_rounding_noise;

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

/// The text of an input file from the answers to [`QUESTIONS`], each in the unit of its question, with a study up to the machine's
/// limits. `name` is that of the file.
///
/// # Errors
/// If the answers make no brush that can be simulated.
pub fn first_file(answers: [f64; 9], name: &str) -> Result<String, InputError> {
    let mut number = 0;
    let [radius, width, filaments, length, diameter, modulus, friction, speed, depth] = answers.map(|answer| {
        number += 1;
        (QUESTIONS[number - 1].to_si)(answer)
    });
    let count = if filaments < 1.0 { "tool.fill_factor" } else { "tool.filament_count" };
    let shares = |limit: f64, parts: u32| {
        let values = (1..=parts).map(|part| rounded(limit * f64::from(part) / f64::from(parts)));
        values.map(|value| format!("{value:?}")).collect::<Vec<_>>().join(", ")
    };
    let section = |name: &str, settings: &[(&str, f64)]| {
        let lines: String = settings.iter().map(|&(path, value)| line(path, value)).collect();
        format!("\n[{name}]\n{lines}")
    };
    let text = [
        format!(
            "# An input file of Bristle. `bristle explain KEY` says what a key means.\n#\n\
             #   bristle simulate {name} --out contact     one contact, at the speed and depth in [process]\n\
             #   bristle study {name} --out results        all combinations of [study]\n\
             #   bristle advise results                    where the force is high\n"
        ),
        section("tool", &[("tool.body_radius_m", radius), ("tool.width_m", width), (count, filaments)]),
        section(
            "filament",
            &[
                ("filament.length_m", length),
                ("filament.diameter_m", diameter),
                ("filament.youngs_modulus_pa", modulus),
                ("filament.density_kg_m3", 1110.0),
                ("filament.damping_ratio", 0.05),
            ],
        ),
        section("contact", &[("contact.friction_coefficient", friction), ("contact.stiffness_n_m", 1e5)]),
        section(
            "process",
            &[
                ("process.rotational_speed_rpm", rounded(speed / 2.0)),
                ("process.penetration_depth_m", rounded(depth / 2.0)),
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
    let document = Document::parse(&text, name)?;
    document.settings()?;
    document.study()?;
    Ok(text)
}

/// A setting with its name and unit as a comment.
fn line(path: &str, value: f64) -> String {
    let parameter = Parameter::find(path).expect("the file has settings only");
    let setting = format!("{} = {}", parameter.key(), parameter.format(value));
    let about = [parameter.symbol, parameter.name].iter().filter(|part| !part.is_empty()).copied().collect::<Vec<_>>();
    let unit = if parameter.unit.is_empty() { String::new() } else { format!(", in {}", parameter.unit) };
    format!("{setting:34} # {}{unit}\n", about.join(": "))
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
        let text = first_file([140.0, 20.0, 10_500.0, 40.0, 1.18, 3.0, 0.3, 1500.0, 4.0], "brush.toml");
        let text = text.expect("the paper's brush");
        let document = Document::parse(&text, "brush.toml").expect("a document");
        let settings = document.settings().expect("settings");
        assert_eq!((settings.tool.body_radius_m, settings.filament.diameter_m), (0.14, 1.18e-3));
        assert_eq!((settings.tool.filament_count, settings.filament.youngs_modulus_pa), (10_500.0, 3e9));
        assert!((settings.rotational_speed_rpm() - 750.0).abs() < 1e-9);
        assert_eq!(document.study().expect("a study").case_count(), 24);
        assert!(document.unstated().is_empty(), "all that decides the force is stated");
        assert_eq!(crate::plausibility::unusual(&settings), []);

        let packed = first_file([140.0, 20.0, 0.6, 40.0, 1.18, 3.0, 0.3, 1500.0, 4.0], "brush.toml");
        assert!(packed.expect("a brush").contains("fill_factor = 0.6 "));
        let wrong = first_file([140.0, 20.0, 0.6, 40.0, 1.18, 3.0, 0.3, 1500.0, 50.0], "brush.toml");
        assert!(wrong.expect_err("too deep").to_string().contains("`process.penetration_depth_m`"));
    }
}

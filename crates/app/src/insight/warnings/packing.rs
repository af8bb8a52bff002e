//! Trims whose filaments touch each other, simulated as if each were alone.

use std::f64::consts::TAU;

use super::count::cases;
use bristle::model::filament::first_natural_frequency;
use bristle::model::settings::Settings;
use bristle::simulation::Pass;
use bristle::tool::Trim;
use bristle_study::grid::{CaseResult, Study};
use bristle_study::input::packing::{PACKED, tip_spacing};
use bristle_study::text::layout::Warning;
use bristle_study::text::number::short;

/// Tips closer than so many diameters are pressed onto the workpiece by the filaments behind, if
/// their contact lasts longer than a share of the first period (docs/notes.md). Others keep
/// each other off it.
const CROWDED: f64 = 1.4;
const PRESSED: f64 = 0.75;

/// Whether filaments touch each other to an effect, although each is simulated alone.
pub(crate) fn is_packed(settings: &Settings) -> bool {
    settings.brush.is_none() && tip_spacing(settings) < PACKED
}

/// What contact between filaments is expected to do to the force.
fn effect(settings: &Settings) -> &'static str {
    let pass = Pass::new(settings);
    let [entry, exit] = pass.nominal_times();
    let periods = (exit - entry) * first_natural_frequency(&settings.filament) / TAU;
    if periods > PRESSED && tip_spacing(settings) < CROWDED {
        "higher"
    } else {
        "lower"
    }
}

/// How to simulate filaments together, whose file does not say so, or does.
const SECTION: &str =
    "simulate the filaments together, by this section; all its keys have defaults:";
const COMMAND: [&str; 2] = [
    "simulate the filaments together, by this command:",
    "bristle simulate FILE.toml --out DIR",
];

/// What is said where they cannot be: on trims that are not radial.
const APART: &str = "Filaments that touch each other are simulated on radial trims only, so that nothing is known of what they do to the force here.";

/// The section by which filaments are simulated together. Rows of a tilted tool differ.
fn section(settings: &Settings) -> String {
    let is_posed = settings.tool.tilt_rad() != 0.0 || settings.tool.skew_rad != 0.0;
    format!(
        "[brush]{}",
        if is_posed {
            "\n           ends = \"free\""
        } else {
            ""
        }
    )
}

/// The warning about one contact, which is that of a filament alone whatever its file states.
pub(super) fn of_contact(settings: &Settings) -> Option<Warning> {
    let spacing = tip_spacing(settings);
    (spacing < PACKED).then(|| {
        let statement = format!(
            "the tips are {} diameters apart, so that filaments touch each other, but each is simulated alone.",
            short(spacing)
        );
        if !Trim::of(settings).is_radial() {
            return Warning::new(format!("{statement} {APART}"));
        }
        let statement = format!("{statement} Together their force is likely {} here.", effect(settings));
        match settings.brush {
            Some(_) => Warning::new(statement).with_help(COMMAND[0], COMMAND[1]),
            None => Warning::new(statement).with_help(SECTION, section(settings)),
        }
    })
}

/// The warning about the cases of a study.
pub(super) fn of_study(study: &Study, results: &[CaseResult]) -> Option<Warning> {
    let settings = results
        .iter()
        .enumerate()
        .map(|(case, result)| study.settings_found(case, result));
    let packed: Vec<Settings> = settings.filter(is_packed).collect();
    let closest = packed.iter().map(tip_spacing).reduce(f64::min)?;
    let statement = format!(
        "in {} of {} filaments touch each other, as their tips are {} diameters apart, but each is simulated alone.",
        packed.len(),
        cases(results.len()),
        short(closest)
    );
    let radial: Vec<&Settings> = packed
        .iter()
        .filter(|settings| Trim::of(settings).is_radial())
        .collect();
    let Some(first) = radial.first() else {
        return Some(Warning::new(format!("{statement} {APART}")));
    };
    let lower = radial
        .iter()
        .filter(|settings| effect(settings) == "lower")
        .count();
    let others = match packed.len() - radial.len() {
        0 => String::new(),
        others => format!(" The trims of {others} are not radial, and cannot be simulated so."),
    };
    let statement = format!(
        "{statement} Together their force is likely lower in {lower} and higher in {} of them.{others}",
        radial.len() - lower
    );
    Some(Warning::new(statement).with_help(SECTION, section(first)))
}

#[cfg(test)]
mod tests {
    use bristle::model::settings::ToolKind;
    use bristle_study::grid::Tool;

    use super::*;

    #[test]
    fn what_to_do_depends_on_the_trim() {
        let mut settings = Settings::paper(10.0, 1e-3);
        let told = |settings: &Settings| of_contact(settings).expect("a packed brush").plain();
        assert!(told(&settings).ends_with(" [brush]"));
        settings.tool.tilt_rad = Some(0.05);
        let tilted = told(&settings);
        assert!(
            tilted.ends_with(" [brush]\n           ends = \"free\""),
            "{tilted}"
        );
        (settings.tool.kind, settings.tool.tilt_rad) = (ToolKind::Cup, None);
        let cup = told(&settings);
        assert!(
            cup.contains("radial trims only") && !cup.contains("help") && !cup.contains("likely"),
            "{cup}"
        );

        let tool = |name: &str, settings: &Settings| Tool {
            name: name.to_owned(),
            settings: settings.clone(),
            held: Vec::new(),
        };
        let tools = vec![
            tool("round", &Settings::paper(10.0, 1e-3)),
            tool("cup", &settings),
        ];
        let told = |study: Study| {
            let failed = vec![Err("failed".to_owned()); study.case_count()];
            of_study(&study, &failed).expect("they are packed").plain()
        };
        let both = told(Study::of_tools(tools, Vec::new()).expect("a study"));
        assert!(
            both.contains("lower in 1 and higher in 0 of them. The trims of 1 are not radial"),
            "{both}"
        );
        let alone = told(Study::new(settings, Vec::new()).expect("a study"));
        assert!(!alone.contains("[brush]"), "{alone}");
    }
}

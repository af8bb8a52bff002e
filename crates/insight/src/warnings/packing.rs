//! Trims whose filaments touch each other, simulated as if each were alone.

use std::f64::consts::TAU;

use bristle::model::filament::first_natural_frequency;
use bristle::model::settings::Settings;
use bristle::simulation::Pass;
use bristle_grid::{CaseResult, Study};
use bristle_input::packing::{PACKED, tip_spacing};
use bristle_text::layout::Warning;
use bristle_text::number::short;

/// Tips closer than so many diameters are pressed onto the workpiece by the filaments behind, if their contact lasts longer than a share of
/// the first period (docs/interaction.md). Others keep each other off it.
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
    if periods > PRESSED && tip_spacing(settings) < CROWDED { "higher" } else { "lower" }
}

/// How to simulate filaments together, whose file does not say so, or does.
const SECTION: [&str; 2] = ["simulate the filaments together, by this section; all its keys have defaults:", "[brush]"];
const COMMAND: [&str; 2] = ["simulate the filaments together, by this command:", "bristle brush FILE.toml --out DIR"];

/// The warning about one contact, which is that of a filament alone whatever its file states.
pub(super) fn of_contact(settings: &Settings) -> Option<Warning> {
    let spacing = tip_spacing(settings);
    (spacing < PACKED).then(|| {
        let [how, line] = if settings.brush.is_some() { COMMAND } else { SECTION };
        let statement = format!(
            "the tips are {} diameters apart, so that filaments touch each other, but each is simulated alone. Together their force is likely \
             {} here.",
            short(spacing),
            effect(settings)
        );
        Warning::new(statement).with_help(how, line)
    })
}

/// The warning about the cases of a study.
pub(super) fn of_study(study: &Study, results: &[CaseResult]) -> Option<Warning> {
    let packed: Vec<Settings> = (0..results.len()).map(|case| study.settings(case)).filter(is_packed).collect();
    let closest = packed.iter().map(tip_spacing).reduce(f64::min)?;
    let lower = packed.iter().filter(|settings| effect(settings) == "lower").count();
    let (total, cases) = (results.len(), if results.len() == 1 { "case" } else { "cases" });
    let [how, line] = SECTION;
    let statement = format!(
        "in {} of {total} {cases} filaments touch each other, as their tips are {} diameters apart, but each is simulated alone. Together \
         their force is likely lower in {lower} and higher in {} of them.",
        packed.len(),
        short(closest),
        packed.len() - lower
    );
    Some(Warning::new(statement).with_help(how, line))
}

//! Filaments that come back still vibrating, and turns that do not become steady.
//!
//! A pass begins with a straight filament at rest relative to the tool. A filament of a fast brush
//! is not at rest when it comes back: its impulse then differs from that of its first pass.

use bristle::model::filament::first_natural_frequency;
use bristle::model::metrics::Metrics;
use bristle::model::settings::{MAX_TURNS, Settings, Turns};
use bristle::simulation::Pass;

use super::count::cases;
use super::packing::is_packed;
use super::stability::place_in;
use bristle_study::grid::{CaseResult, Study, TURNS};
use bristle_study::text::layout::Warning;

/// Above this share of its vibration, a filament comes back still vibrating.
const MUCH: f64 = 0.05;
/// The line that simulates turn after turn.
const LINE: &str = "turns = \"steady\"";

/// The share of a filament's vibration after a contact that is left when it comes back: `e^(−ζ Ω_1
/// T)` with the time `T` from nominal exit to the next nominal entry (MODEL, "Turns"). Of two modes
/// that do not oscillate, the slower one counts.
#[must_use]
pub fn residual_vibration(settings: &Settings) -> f64 {
    let ratio = settings.filament.damping_ratio;
    let decay = if ratio > 1.0 {
        1.0 / (ratio + (ratio * ratio - 1.0).sqrt())
    } else {
        ratio
    };
    let pass = Pass::new(settings);
    let [entry, exit] = pass.nominal_times();
    (-decay * first_natural_frequency(&settings.filament) * (pass.turn_time() - (exit - entry)))
        .exp()
}

/// The share of the vibration that a single pass leaves out, if it is [`MUCH`]. In a packed brush
/// neighbours decide how filaments arrive, so that turns hardly matter (docs/notes.md, "Turn
/// after turn").
fn left_out(settings: &Settings) -> Option<f64> {
    if settings.brush.is_some() || is_packed(settings) {
        return None;
    }
    let residual =
        (Pass::new(settings).turns() == Turns::Count(1)).then(|| residual_vibration(settings))?;
    (residual > MUCH).then_some(residual)
}

/// The number of `cases`, counted from 0, in which a single pass leaves out much vibration, the one
/// in which it leaves out most, and the share there.
fn vibrating(
    study: &Study,
    results: &[CaseResult],
    cases: &[usize],
) -> Option<(usize, usize, f64)> {
    let share = |case: usize| left_out(&study.settings_found(case, &results[case]));
    let all: Vec<(usize, f64)> = cases
        .iter()
        .filter_map(|&case| Some((case, share(case)?)))
        .collect();
    // Of equal ones the first.
    let &(worst, residual) = all
        .iter()
        .reduce(|worst, next| if next.1 > worst.1 { next } else { worst })?;
    Some((all.len(), worst, residual))
}

/// The note of advice about cases among those `told`, counted from 0, in which a single pass leaves
/// out much vibration.
pub(crate) fn vibrating_note(
    study: &Study,
    results: &[CaseResult],
    told: &[usize],
) -> Option<String> {
    let (count, worst, residual) = vibrating(study, results, told)?;
    Some(format!(
        "In {count} of {} the filament comes back still vibrating, with up to {} of its vibration (row {}): simulate turn after turn \
         with {TURNS} = \"{}\".",
        cases(told.len()),
        percent(residual),
        worst + 1,
        Turns::STEADY
    ))
}

/// The warnings about the turns of a study.
pub(super) fn of_study(study: &Study, results: &[CaseResult]) -> Vec<Warning> {
    let mut warnings = Vec::new();
    let unsteady = results.iter().filter(|result| {
        result
            .as_ref()
            .is_ok_and(|summary| summary.metrics.unsteady_turns)
    });
    let (unsteady, of_cases) = (unsteady.count(), cases(results.len()));
    if unsteady > 0 {
        let are = if unsteady == 1 { "is" } else { "are" };
        warnings.push(Warning::new(format!(
            "{unsteady} of {of_cases} {are} not steady after {MAX_TURNS} turns (column unsteady_turns of runs.csv). {UNSTEADY}"
        )));
    }
    let solved: Vec<usize> = (0..results.len())
        .filter(|&case| results[case].is_ok())
        .collect();
    if let Some((count, worst, residual)) = vibrating(study, results, &solved) {
        let statement = format!(
            "in {count} of {of_cases} the filament comes back still vibrating, with {} of its vibration at {} (row {} of runs.csv): its \
             impulse then differs from that of its first pass.",
            percent(residual),
            place_in(study, worst),
            worst + 1
        );
        warnings.push(with_help(statement));
    }
    warnings
}

/// The warnings about the turns of one contact.
pub(super) fn of_contact(settings: &Settings, metrics: &Metrics) -> Vec<Warning> {
    let mut warnings = Vec::new();
    if metrics.unsteady_turns {
        warnings.push(Warning::new(format!(
            "this contact is not steady after {MAX_TURNS} turns. {UNSTEADY}"
        )));
    }
    if let Some(residual) = left_out(settings) {
        let statement = format!(
            "the filament comes back still vibrating, with {} of its vibration: its impulse then differs from that of its \
             first pass.",
            percent(residual)
        );
        warnings.push(with_help(statement));
    }
    warnings
}

/// What unsteady turns mean.
const UNSTEADY: &str = "The impulse still changes by more than 0.1 % from turn to turn; the metrics are those of the last one. \
                        Take the mean of the impulses of many turns, or more damping (`filament.damping_ratio`).";

/// A warning with the line that avoids it.
fn with_help(statement: String) -> Warning {
    let how = "simulate turn after turn until the impulse is steady, by this line under [process]:";
    Warning::new(statement).with_help(how, LINE)
}

fn percent(share: f64) -> String {
    format!("{:.0} %", 100.0 * share)
}

#[cfg(test)]
mod tests {
    use super::*;
    use bristle::model::parameters::Parameter;
    use bristle::model::settings::ToolKind;
    use bristle_study::grid::{Sweep, VELOCITY};

    #[test]
    fn the_paper_s_brush_keeps_its_vibration_at_high_speed() {
        // MODEL, "Turns"
        for (velocity, expected) in [(10.0, 0.003), (30.0, 0.14)] {
            let residual = residual_vibration(&Settings::paper(velocity, 1e-3));
            assert!((residual / expected - 1.0).abs() < 0.05, "{residual}");
        }
        let overdamped = |ratio: f64| {
            let mut settings = Settings::paper(30.0, 1e-3);
            settings.filament.damping_ratio = ratio;
            residual_vibration(&settings)
        };
        assert!(
            overdamped(10.0) > overdamped(1.0)
                && overdamped(0.5) > overdamped(1.0)
                && overdamped(0.0) == 1.0
        );
    }

    /// The paper's brush with so few filaments that they do not touch each other.
    fn sparse(velocity: f64) -> Settings {
        let mut settings = Settings::paper(velocity, 1e-3);
        settings.tool.filament_count = 1000.0;
        settings
    }

    #[test]
    fn what_a_single_pass_leaves_out_is_told() {
        let told = |settings: &Settings, unsteady_turns| {
            let metrics = Metrics {
                unsteady_turns,
                ..Metrics::default()
            };
            let told = of_contact(settings, &metrics);
            told.iter().map(Warning::plain).collect::<String>()
        };
        let mut settings = sparse(30.0);
        let text = told(&settings, false);
        assert!(
            text.contains("14 % of its vibration") && text.ends_with(" turns = \"steady\""),
            "{text}"
        );
        assert_eq!(told(&sparse(10.0), false), "");
        // Neighbours decide how filaments arrive.
        assert_eq!(told(&Settings::paper(30.0, 1e-3), false), "");
        settings.process.turns = Some(Turns::Count(2));
        assert_eq!(told(&settings, false), "");
        let text = told(&settings, true);
        assert!(
            text.starts_with("this contact is not steady after 50 turns."),
            "{text}"
        );
    }

    #[test]
    fn filaments_that_touch_all_round_are_followed_until_they_are_steady() {
        let mut cup = sparse(10.0);
        cup.tool.kind = ToolKind::Cup;
        assert_eq!(left_out(&cup), None);
        cup.process.turns = Some(Turns::Count(1));
        assert!(left_out(&cup).is_some(), "a single turn is asked for");
    }

    #[test]
    fn a_study_tells_how_many_cases_and_the_worst() {
        let velocities = Sweep::list(
            Parameter::find(VELOCITY).expect("it exists"),
            vec![10.0, 30.0, 25.0, 20.0],
        );
        let study = Study::new(sparse(10.0), vec![velocities.expect("right")]).expect("right");
        let results = vec![Err("failed".to_owned()); 4];
        assert_eq!(of_study(&study, &results), []);
        let note = vibrating_note(&study, &results, &[0, 1, 2, 3]).expect("they vibrate");
        assert!(
            note.starts_with("In 3 of 4 cases")
                && note.contains("up to 14 % of its vibration (row 2)"),
            "{note}"
        );
        assert_eq!(vibrating_note(&study, &results, &[0]), None);
    }
}

//! Tools that are pressed on with a given force: depths below the roundness of a brush, and forces
//! that jump.

use super::count::{of_rows, rows};
use bristle::model::metrics::Metrics;
use bristle_study::grid::{CaseResult, Study};
use bristle_study::text::layout::Warning;
use bristle_study::text::number::short;

/// The depth in m below which filaments of a real brush do not touch alike (MODEL, "Force instead
/// of depth").
const ROUNDNESS_M: f64 = 1e-4;
/// The relative difference from the force that is asked for, above which none closer to it exists.
const JUMP: f64 = 2e-3;

/// What a depth below the roundness means.
const SHALLOW: &str = "That is far below the roundness of a brush, of which only some filaments touch there: the force of a real one differs.";
/// What a jump means.
const JUMPS: &str = "Contact sets in or ends there, or the turns do not become steady; a slightly different force or speed may have a depth.";

/// Whether a depth that was found is below the roundness of a brush.
fn is_shallow(metrics: &Metrics) -> bool {
    metrics.penetration_depth_m < ROUNDNESS_M
}

/// Whether the force jumps past the one that is asked for (N).
fn jumps(asked_n: f64, metrics: &Metrics) -> bool {
    (metrics.tool_contact_normal_force_n / asked_n - 1.0).abs() > JUMP
}

/// The warnings about a tool that is pressed on with the force `asked_n` (N); none if its depth is
/// given.
#[must_use]
pub fn of_force(asked_n: Option<f64>, metrics: &Metrics) -> Vec<Warning> {
    let Some(asked_n) = asked_n else {
        return Vec::new();
    };
    let shallow = is_shallow(metrics).then(|| {
        let depth = short(1e3 * metrics.penetration_depth_m);
        Warning::new(format!(
            "the tool presses with this force at a depth of {depth} mm. {SHALLOW}"
        ))
    });
    let jump = jumps(asked_n, metrics).then(|| {
        let found = short(metrics.tool_contact_normal_force_n);
        Warning::new(format!(
            "F_n,w jumps past process.tool_force_n = {} N at this depth: it is {found} N. {JUMPS}",
            short(asked_n)
        ))
    });
    shallow.into_iter().chain(jump).collect()
}

/// The warnings about the cases of a study.
pub(super) fn of_study(study: &Study, results: &[CaseResult]) -> Vec<Warning> {
    let rows_where = |is_one: fn(f64, &Metrics) -> bool| {
        rows(study, results, |settings, metrics| {
            settings
                .process
                .tool_force_n
                .is_some_and(|asked_n| is_one(asked_n, metrics))
        })
    };
    let shallow = format!(
        "the tool presses with the force at a depth of less than {} mm. {SHALLOW}",
        short(1e3 * ROUNDNESS_M)
    );
    let jump =
        format!("F_n,w jumps past process.tool_force_n at the depth that was found. {JUMPS}");
    let told = [
        of_rows(
            &rows_where(|_, metrics| is_shallow(metrics)),
            results.len(),
            &shallow,
        ),
        of_rows(&rows_where(jumps), results.len(), &jump),
    ];
    told.into_iter().flatten().collect()
}

#[cfg(test)]
mod tests {
    use bristle::model::parameters::Parameter;
    use bristle::model::settings::Settings;
    use bristle_study::grid::{FORCE, Sweep};

    use super::*;
    use crate::insight::testing::result;

    fn metrics(penetration_depth_m: f64, tool_contact_normal_force_n: f64) -> Metrics {
        Metrics {
            penetration_depth_m,
            tool_contact_normal_force_n,
            ..Metrics::default()
        }
    }

    #[test]
    fn small_depths_and_jumps_are_told() {
        let shallow = "the tool presses with this force at a depth of 0.06912 mm. That is";
        let jump =
            "F_n,w jumps past process.tool_force_n = 10 N at this depth: it is 14.91 N. Contact";
        for (asked_n, metrics, expected) in [
            (Some(166.0), metrics(69.1234e-6, 166.1), Some(shallow)),
            (Some(10.0), metrics(1e-3, 14.91), Some(jump)),
            // Found to a thousandth.
            (Some(10.0), metrics(1e-3, 10.009), None),
            // The depth is given.
            (None, metrics(1e-5, 14.91), None),
        ] {
            let told = of_force(asked_n, &metrics);
            assert_eq!(told.len(), expected.iter().len());
            for (told, expected) in told.iter().zip(expected) {
                assert!(told.plain().starts_with(expected), "{told}");
            }
        }
    }

    #[test]
    fn a_study_tells_the_first_of_its_cases() {
        let force = Parameter::find(FORCE).expect("it exists");
        let force = Sweep::list(force, vec![10.0, 20.0, 30.0]).expect("right");
        let study = Study::new(Settings::paper(10.0, 1e-3), vec![force]).expect("right");
        let results = [
            Err("failed".to_owned()),
            result(metrics(5e-5, 20.0)),
            result(metrics(9e-5, 33.0)),
        ];
        let told: Vec<String> = of_study(&study, &results)
            .iter()
            .map(Warning::plain)
            .collect();
        let shallow = "in 2 of 3 cases, first in row 2 of runs.csv, the tool presses";
        let jump = "in 1 of 3 cases, first in row 3 of runs.csv, F_n,w jumps past";
        assert!(
            told[0].starts_with(shallow) && told[1].starts_with(jump),
            "{told:?}"
        );
        let given = Study::new(Settings::paper(10.0, 1e-3), Vec::new()).expect("right");
        assert_eq!(of_study(&given, &[result(metrics(5e-5, 20.0))]), []);
    }
}

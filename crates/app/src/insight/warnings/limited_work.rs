//! Passes whose work was limited, so that steps miss the tolerance.

use bristle::simulation::Statistics;

use super::count::cases;
use bristle_study::grid::CaseResult;
use bristle_study::text::layout::Warning;

/// What a limit of work means for results, and what avoids it.
const CONSEQUENCE: &str = "The impulse is good to about 1 %, contact times and peak forces to some ten per cent; the lateral \
                           amplification means nothing. Some damping (`filament.damping_ratio`) avoids this.";

/// The warning about the cases of a study whose work was limited, if there are any.
pub(super) fn of_study(results: &[CaseResult]) -> Option<Warning> {
    let limited = |result: &&CaseResult| {
        result
            .as_ref()
            .is_ok_and(|summary| summary.statistics.unresolved_steps > 0)
    };
    let count = results.iter().filter(limited).count();
    let miss = if count == 1 { "misses" } else { "miss" };
    (count > 0).then(|| {
        Warning::new(format!(
            "{count} of {} {miss} the relative tolerance in some steps, as the work of a pass is limited (column unresolved_steps of \
             runs.csv). {CONSEQUENCE}",
            cases(results.len())
        ))
    })
}

/// The warning about one contact whose work was limited.
pub(super) fn of_contact(statistics: &Statistics) -> Option<Warning> {
    let Statistics {
        steps,
        unresolved_steps,
        ..
    } = statistics;
    (*unresolved_steps > 0).then(|| {
        Warning::new(format!(
            "{unresolved_steps} of {steps} steps miss the relative tolerance, as the work of a pass is limited. {CONSEQUENCE}"
        ))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limited_work_is_told() {
        let told = |unresolved_steps| {
            of_contact(&Statistics {
                steps: 123_456,
                unresolved_steps,
                ..Statistics::default()
            })
        };
        assert_eq!(told(0), None);
        let text = told(120_000).expect("steps miss the tolerance").plain();
        let start = "120000 of 123456 steps miss the relative tolerance";
        assert!(text.starts_with(start), "{text}");
        assert_eq!(of_study(&[]), None);
    }
}

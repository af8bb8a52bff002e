//! Passes that are not what their settings mean: edges that are penetrated too deeply, and filaments that miss the workpiece.

use bristle::model::metrics::Metrics;
use bristle::model::settings::Settings;
use bristle::workpiece::{Edge, Part, Workpiece};

use crate::study::{CaseResult, Study};
use crate::text::layout::warning;
use crate::text::number::short;

/// The share of an edge's radius down to which the contact law is meant for it.
const DEEPEST_SHARE: f64 = 0.5;

/// What a deep penetration means for results, and what avoids it.
const DEEP: &str = "The force then depends on the contact stiffness: a larger `contact.stiffness_n_m` penetrates less.";

/// What it means that no filament arrives, and what changes it.
const MISSED: &str = "If they should, change `workpiece.offset_m` or `process.penetration_depth_m`.";

/// The warnings about one contact, each for a terminal 80 columns wide.
#[must_use]
pub fn case_touch_warnings(settings: &Settings, metrics: &Metrics) -> Vec<String> {
    let radius = edge_radius(settings);
    let deep = is_deep(settings, metrics).then(|| {
        warning(&format!(
            "the filament penetrates an edge by {} mm, more than half of its radius of {} mm. {DEEP}",
            short(1e3 * metrics.max_edge_penetration_m),
            short(1e3 * radius)
        ))
    });
    let missed = misses(metrics)
        .then(|| warning(&format!("undeformed filaments of this tool never touch the workpiece. {MISSED}")));
    deep.into_iter().chain(missed).collect()
}

/// The warnings about the cases of a study, each for a terminal 80 columns wide.
#[must_use]
pub fn study_touch_warnings(study: &Study, results: &[CaseResult]) -> Vec<String> {
    let rows = |found: &dyn Fn(&Settings, &Metrics) -> bool| -> Vec<usize> {
        let found = |(case, result): (usize, &CaseResult)| {
            let is_found = result.as_ref().is_ok_and(|summary| found(&study.settings(case), &summary.metrics));
            is_found.then_some(case + 1)
        };
        results.iter().enumerate().filter_map(found).collect()
    };
    let total = results.len();
    let cases = if total == 1 { "case" } else { "cases" };
    let deep = rows(&is_deep);
    let deep = deep.first().map(|first| {
        warning(&format!(
            "in {} of {total} {cases} the filament penetrates an edge by more than half of its radius, first in row {first} \
             of runs.csv (column max_edge_penetration_m). {DEEP}",
            deep.len()
        ))
    });
    let missed = rows(&|_, metrics| misses(metrics));
    let missed = missed.first().map(|first| {
        warning(&format!(
            "in {} of {total} {cases} undeformed filaments never touch the workpiece, first in row {first} of runs.csv \
             (column nominal_contact_time_s). {MISSED}",
            missed.len()
        ))
    });
    deep.into_iter().chain(missed).collect()
}

/// Whether the penetration of an edge is not small against its radius.
fn is_deep(settings: &Settings, metrics: &Metrics) -> bool {
    metrics.max_edge_penetration_m > 0.0 && metrics.max_edge_penetration_m > DEEPEST_SHARE * edge_radius(settings)
}

/// The smallest radius of the workpiece's edges, in m; infinite without edges.
fn edge_radius(settings: &Settings) -> f64 {
    let radius = |edge: &Edge| edge.radius();
    Part::of(settings).map_or(f64::INFINITY, |(part, _)| part.edges().iter().map(radius).fold(f64::INFINITY, f64::min))
}

fn misses(metrics: &Metrics) -> bool {
    metrics.nominal_contact_time_s == 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::document::Document;
    use crate::study::CaseSummary;
    use crate::testing::brush;

    const FILE: &str = concat!(
        brush!(8),
        "
        [workpiece]
        kind = \"edge\"
        edge_radius_m = 0.2e-3
        [process]
        brushing_velocity_m_s = 10.0
        penetration_depth_m = 1.0e-3
        [study]
        brushing_velocity_m_s = [5.0, 10.0, 15.0]
        "
    );

    fn metrics(max_edge_penetration_m: f64, nominal_contact_time_s: f64) -> Metrics {
        Metrics { max_edge_penetration_m, nominal_contact_time_s, ..Metrics::default() }
    }

    #[test]
    fn deep_edges_and_missed_workpieces_are_told_at_80_columns() {
        let document = Document::parse(FILE, "case.toml").expect("a document");
        let settings = document.settings().expect("settings");
        assert_eq!(
            case_touch_warnings(&settings, &metrics(0.1e-3, 1e-3)),
            [""; 0],
            "half of the radius is not too deep"
        );
        let deep = case_touch_warnings(&settings, &metrics(0.123456e-3, 1e-3));
        assert_eq!(
            deep,
            [
                "warning: the filament penetrates an edge by 0.1235 mm, more than half of its\n         radius of 0.2 mm. \
              The force then depends on the contact stiffness: a\n         larger `contact.stiffness_n_m` penetrates less."
            ]
        );
        let missed = case_touch_warnings(&settings, &metrics(0.0, 0.0));
        assert!(missed.len() == 1 && missed[0].starts_with("warning: undeformed filaments of this tool never touch"));

        let study = document.study().expect("a study");
        let result = |metrics| Ok(CaseSummary { metrics, ..CaseSummary::default() });
        let results = [result(metrics(0.0, 1e-3)), Err("failed".to_owned()), result(metrics(1e-3, 0.0))];
        let told = study_touch_warnings(&study, &results);
        assert_eq!(told.len(), 2);
        assert!(told[0].starts_with("warning: in 1 of 3 cases the filament penetrates an edge by more than half of"));
        assert!(told.iter().all(|text| text.replace("\n         ", " ").contains("first in row 3")), "{told:?}");
        assert!(told.iter().chain(&missed).flat_map(|text| text.lines()).all(|line| line.chars().count() <= 80));
        assert_eq!(study_touch_warnings(&study, &results[..2]), [""; 0]);
    }
}

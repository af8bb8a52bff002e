//! Tests of plans, series and limits.

use super::*;
use bristle::model::parameters::Parameter;

use super::plan::{BRUSH_STIFFNESS, BRUSH_TOLERANCE, SEGMENTS, SOLVER_TOLERANCE, values};
use crate::insight::testing::{metrics_of, with_force};

/// Returns a series whose force is a function of the value.
fn series(path: &str, stated: f64, force: impl Fn(f64) -> f64) -> Series {
    let parameter = Parameter::find(path).expect(path);
    let mut settings = Settings::paper(10.0, 1e-3);
    parameter.set(&mut settings, stated);
    let values = values(parameter, &settings);
    let results = values
        .iter()
        .map(|&value| with_force(force(value), 0.0))
        .collect();
    Series {
        parameter,
        stated,
        values,
        results,
    }
}

#[test]
fn values_go_beyond_the_stated_one() {
    let of = |path: &str, stated: f64| series(path, stated, |_| 1.0).values;
    assert_eq!(of(SEGMENTS, 25.0), [5.0, 8.0, 12.0, 17.0, 25.0, 35.0, 50.0]);
    assert_eq!(of(SEGMENTS, 30.0)[4..], [25.0, 30.0, 35.0, 50.0, 70.0]);
    assert_eq!(of(SEGMENTS, 400.0)[12..], [400.0]);
    assert_eq!(
        of(SOLVER_TOLERANCE, 1e-6),
        [1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8]
    );
    assert_eq!(of(SOLVER_TOLERANCE, 1e-2), [1e-2, 1e-3, 1e-4]);
    assert_eq!(of(SOLVER_TOLERANCE, 1e-10).last(), Some(&1e-10));
    let mut settings = Settings::paper(10.0, 1e-3);
    settings.filament.segments = 12;
    settings.brush = Some(settings.brush_or_default());
    let of = |path: &str| values(Parameter::find(path).expect(path), &settings);
    assert_eq!(of(SEGMENTS), [8.0, 12.0, 17.0, 25.0]);
    assert_eq!(of(BRUSH_TOLERANCE), [3e-3, 9e-4, 3e-4]);
    assert_eq!(of(BRUSH_STIFFNESS), [6e6, 1.8e7, 6e7, 1.8e8, 6e8]);
}

#[test]
fn an_order_is_stated_where_the_finest_values_agree_on_it() {
    let regular = series(SEGMENTS, 25.0, |n| 100.0 * (1.0 + 3.0 / (n * n)));
    let near = |found: Option<f64>, expected: f64, tolerance: f64| {
        assert!(
            found.is_some_and(|found| (found - expected).abs() < tolerance),
            "{found:?}"
        );
    };
    let limit = regular.limit(force());
    near(limit.order, 2.0, 1e-6);
    near(Some(limit.value), 100.0, 1e-6);
    near(regular.stated_error(force()), 3.0 / 625.0, 1e-8);
    // 3/17² is just above one per cent, 3/25² half of it.
    assert_eq!(
        [0.01, 0.001, 0.02].map(|goal| regular.enough(goal)),
        [Some(25.0), None, Some(17.0)]
    );
    assert_eq!(
        series(SEGMENTS, 25.0, |n| 100.0 * (1.0 + 1.0 / (n * n))).enough(0.0005),
        Some(50.0)
    );
    // Oscillation or noise has no order: the finest value is the reference, and its own error
    // is unknown.
    for irregular in [
        series(SEGMENTS, 25.0, |n| {
            100.0 + if n % 2.0 == 0.0 { 1.0 } else { 0.0 }
        }),
        series(SEGMENTS, 25.0, |n| 100.0 * (1.0 + 1e-5 / (n * n))),
        series(SOLVER_TOLERANCE, 1e-6, |tolerance| {
            100.0 * (1.0 + tolerance)
        }),
    ] {
        let finest = irregular.finest();
        assert_eq!(
            (
                irregular.limit(force()).order,
                irregular.error(force(), finest)
            ),
            (None, None)
        );
    }
    let by_tolerance = series(SOLVER_TOLERANCE, 1e-6, |tolerance| {
        100.0 * (1.0 + 30.0 * tolerance)
    });
    assert_eq!(
        [0.01, 1e-5].map(|goal| by_tolerance.enough(goal)),
        [Some(1e-4), Some(1e-7)]
    );
}

#[test]
fn nothing_is_extrapolated_while_the_number_of_nodes_in_contact_changes() {
    let mut series = series(SEGMENTS, 25.0, |n| 100.0 * (1.0 + 3.0 / (n * n)));
    let last = series.values.len() - 1;
    metrics_of(&mut series.results[last]).contact_nodes = 2;
    assert_eq!(series.changing_nodes(), Some(vec![0, 0, 0, 2]));
    assert_eq!(series.limit(force()).order, None);
}

#[test]
fn values_that_fail_are_left_out() {
    let mut series = series(SEGMENTS, 25.0, |n| 100.0 * (1.0 + 3.0 / (n * n)));
    let last = series.values.len() - 1;
    (series.results[0], series.results[last]) =
        (Err("failed".to_owned()), Err("failed, too".to_owned()));
    assert_eq!(
        (
            series.finest(),
            series.change(last),
            series.change(last - 1)
        ),
        (last - 1, None, Some(0.0))
    );
    assert!(
        series
            .limit(force())
            .order
            .is_some_and(|order| (order - 2.0).abs() < 1e-6)
    );
    let mut text = Vec::new();
    write_convergence(
        &mut text,
        &Convergence {
            settings: Settings::paper(10.0, 1e-3),
            series: vec![series],
        },
    )
    .expect("a table");
    let text = String::from_utf8(text).expect("text");
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines[1], "filament.segments,5,,,,,,,,,,failed");
    assert!(
        lines[6].starts_with("filament.segments,35,100.2") && lines[6].ends_with(",0,0,ok"),
        "{text}"
    );
    assert_eq!(lines[7], "filament.segments,50,,,,,,,,,,\"failed, too\"");
}

#[test]
fn each_case_differs_in_one_setting() {
    let settings = Settings::paper(10.0, 1e-3);
    let plan = Plan::new(&settings).expect("a plan");
    assert_eq!(plan.study().case_count(), 1 + 6 + 5);
    let fails = plan.conclude(&vec![Err("no".to_owned()); 12]).err();
    assert_eq!(fails, Some(ConvergenceError::Stated("no".to_owned())));
    let none = Plan::new(&settings)
        .expect("a plan")
        .conclude(&vec![with_force(0.0, 0.0); 12])
        .err();
    assert_eq!(none, Some(ConvergenceError::NoContact));
}

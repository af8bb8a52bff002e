use std::ops::Range;

use serde_json::Value;

use super::*;
use crate::insight::findings::judge_study;
use crate::insight::measured::compare;
use crate::testing::brush;
use bristle::model::parameters::PARAMETERS;
use bristle::model::settings::{BrushSettings, ChamferSettings, ProfileSettings, WorkpieceKind};
use bristle::simulation::Statistics;
use bristle_study::grid::{StudyTool, Sweep};
use bristle_study::input::document::Document;
use bristle_study::input::measured::{Measurement, Speed};

const FILE: &str = concat!(
    brush!(4),
    "
    [process]
    brushing_velocity_m_s = 10.0
    penetration_depth_m = 1.0e-3
    [solver]
    relative_tolerance = 1e-3
    "
);

fn study(axes: &[(&'static str, usize, Range<f64>)]) -> Study {
    let base = Document::parse(FILE, "base")
        .and_then(|document| document.settings())
        .expect("the file is right");
    let axis = |(path, count, range): &(&'static str, usize, Range<f64>)| {
        let step = (range.end - range.start) / *count as f64;
        let values = (0..*count).map(|i| range.start + i as f64 * step).collect();
        Sweep::list(Parameter::find(path).expect("the setting exists"), values)
            .expect("the values are right")
    };
    Study::new(base, axes.iter().map(axis).collect()).expect("the study is right")
}

fn grid(velocities: usize, depths: usize) -> Study {
    study(&[
        (bristle_study::grid::VELOCITY, velocities, 10.0..30.0),
        (bristle_study::grid::DEPTH, depths, 1e-3..5e-3),
    ])
}

/// Results with numbers of as many digits as real ones have.
fn made_up(count: usize) -> Vec<CaseResult> {
    let number = |case: usize| 1.0 / (7.0 + case as f64);
    fn record<R: Record + Default>(case: usize, number: f64) -> R {
        let mut record = R::default();
        for column in R::COLUMNS {
            column.set(
                &mut record,
                if column.whole {
                    (case % 7) as f64
                } else {
                    number
                },
            );
        }
        record
    }
    let statistics = Statistics {
        steps: 1234,
        newton_iterations: 12_345,
        factorisations: 1234,
        ..Default::default()
    };
    let summary = |case| CaseSummary {
        metrics: record(case, number(case)),
        turn_contact_normal_impulses_n_s: vec![number(case)],
        statistics,
        scatter: Some(record(case, number(case))),
        ..CaseSummary::default()
    };
    (0..count).map(|case| Ok(summary(case))).collect()
}

/// A page of a study that states nothing besides its cases.
fn page_of(
    study: &Study,
    results: &[CaseResult],
    courses: &[CaseCourse],
    comparisons: &[ForceComparison],
) -> String {
    let statement = Statement {
        title: "study.toml".to_owned(),
        ..Statement::default()
    };
    page_with(&statement, study, results, courses, comparisons)
}

fn page_with(
    statement: &Statement,
    study: &Study,
    results: &[CaseResult],
    courses: &[CaseCourse],
    comparisons: &[ForceComparison],
) -> String {
    let context = ReportContext {
        statement,
        origin: &BuildOrigin::here(),
        assumptions: &Assumptions::default(),
        answer: None,
        measured: &[],
        findings: &judge_study(study, results),
    };
    page(study, results, courses, comparisons, &context)
}

/// The courses of a study.
fn courses(study: &Study, results: &[CaseResult]) -> Vec<CaseCourse> {
    course_recorder(study)
        .finish(results, None)
        .expect("the threads start")
}

fn simulated(study: &Study) -> Vec<CaseResult> {
    bristle_study::grid::run_study(study, None, || {}).expect("the threads start")
}

/// The data that stand in a page, as a browser reads them.
fn data_in(page: &str) -> Value {
    let (_, after) = page
        .split_once("<script type=\"application/json\" id=\"data\">")
        .expect("the block starts");
    let (json, _) = after.split_once("</script>").expect("the block ends");
    serde_json::from_str(json).expect("the block is JSON")
}

#[test]
fn hostile_text_stays_text() {
    let name = "</script><script>alert(1)</script><!-- & {{script}} \"";
    let error = "</SCRIPT> <!-- stopped \u{2028}";
    let study = grid(1, 1);
    let results = [Err(error.to_owned())];
    let statement = Statement {
        title: name.to_owned(),
        ..Statement::default()
    };
    let page = page_with(&statement, &study, &results, &[], &[]);
    assert_eq!(
        page.matches("</script>").count(),
        2,
        "the block of data and the program end, nothing else"
    );
    assert!(!page.to_lowercase().contains("<!-- "));
    assert!(page.contains("<title>&lt;/script&gt;"));
    let data = data_in(&page);
    assert_eq!(data["name"], name);
    assert_eq!(data["errors"][0][1], error);
}

#[test]
fn texts_are_put_in_once() {
    assert_eq!(
        fill("a {{x}} b {{y}}", &[("x", "{{y}}"), ("y", "2")]),
        "a {{y}} b 2"
    );
}

#[test]
fn a_page_holds_all_that_it_uses() {
    let text = page_of(&grid(2, 2), &made_up(4), &[], &[]);
    for outside in ["http://", "https://", "src=", "@import", "url("] {
        // The namespace of SVG is a name, not an address that anyone asks for.
        assert_eq!(
            text.replace("http://www.w3.org/2000/svg", "")
                .matches(outside)
                .count(),
            0,
            "{outside}"
        );
    }
    assert!(text.contains(equations::FINGERPRINT));
}

#[test]
fn a_page_opens_with_the_metric_that_matters_most() {
    let first = |goal: Option<Value>, settings: Settings| {
        let study = Study::new(settings, Vec::new()).expect("a study");
        let statement = Statement {
            goal: goal.and_then(|goal| goal.as_object().cloned()),
            ..Statement::default()
        };
        let data = data_in(&page_with(&statement, &study, &made_up(1), &[], &[]));
        data["quantities"][0]["key"].clone()
    };
    let alone = grid(1, 1).settings(0);
    let mut brush = alone.clone();
    brush.brush = Some(BrushSettings::default());
    let mut pressed = alone.clone();
    pressed.process.tool_force_n = Some(5.0);
    assert_eq!(first(None, alone.clone()), "tool_contact_normal_force_n");
    assert_eq!(first(None, brush), "tool_contact_normal_force_n");
    assert_eq!(first(None, pressed), "penetration_depth_m");
    let removal = json!({ "most": "removal" });
    assert_eq!(first(Some(removal), alone.clone()), "sliding_work_j");
    let force = json!({ "target_force_n": 5.0, "max_power_w": 1.0 });
    assert_eq!(first(Some(force), alone), "tool_contact_normal_force_n");
}

#[test]
fn findings_and_the_method_are_on_the_page() {
    let study = grid(2, 2);
    let mut results = made_up(4);
    for result in results.iter_mut().flatten() {
        result.statistics.unresolved_steps = 0;
        result.metrics.laterally_unstable = false;
    }
    if let Ok(summary) = &mut results[2] {
        summary.statistics.unresolved_steps = 7;
    }
    let page = page_of(&study, &results, &[], &[]);
    let finding = &data_in(&page)["notes"]["findings"][0];
    assert_eq!(
        (&finding["id"], &finding["rows"]),
        (&json!("B001"), &json!([3]))
    );
    assert!(page.contains(&escape_html(&method_of_study(
        &study,
        &BuildOrigin::here().version
    ))));
}

#[test]
fn failed_cases_are_shown_as_such() {
    let study = grid(3, 2);
    let mut results = simulated(&study);
    results[4] = Err("it stopped".to_owned());
    let data = data_in(&page_of(&study, &results, &courses(&study, &results), &[]));
    assert_eq!(data["failed"], 1);
    assert_eq!(data["errors"], json!([[4, "it stopped"]]));
    for quantity in data["quantities"].as_array().expect("a list") {
        let values = quantity["values"].as_array().expect("a list");
        let missing: Vec<usize> = (0..6).filter(|&case| values[case].is_null()).collect();
        assert_eq!(missing, [4], "{}", quantity["key"]);
    }
    let cases: Vec<u64> = data["courses"]
        .as_array()
        .expect("a list")
        .iter()
        .filter_map(|course| course[0].as_u64())
        .collect();
    assert_eq!(cases, [0, 1, 2, 3, 5]);
}

/// Issue: the page of 10 000 cases stays below 10 MB. Courses are those of filaments of the paper's
/// 25 segments.
#[test]
fn large_studies_stay_small_pages() {
    let study = study(&[
        (bristle_study::grid::VELOCITY, 100, 10.0..30.0),
        (bristle_study::grid::DEPTH, 100, 1e-3..5e-3),
        ("filament.segments", 1, 25.0..26.0),
        ("solver.relative_tolerance", 1, 1e-2..2e-2),
    ]);
    let results = made_up(study.case_count());
    let courses = courses(&study, &results);
    assert!((100..=MAX_COURSES).contains(&courses.len()));
    let page = page_of(&study, &results, &courses, &[]);
    assert!(page.len() < 10_000_000, "{} bytes", page.len());
    assert_eq!(
        data_in(&page)["quantities"][0]["values"]
            .as_array()
            .map(Vec::len),
        Some(10_000)
    );
}

#[test]
fn of_a_larger_study_a_page_shows_a_selection() {
    let study = grid(400, 300);
    let shown = Selection::shown(&study);
    assert!((15_000..=MAX_CASES_SHOWN).contains(&shown.cases.len()));
    assert_eq!(
        (
            shown.cases[0],
            *shown.cases.last().expect("there are cases")
        ),
        (0, study.case_count() - 1)
    );
    let with_course = Selection::with_course(&study);
    assert!((100..=MAX_COURSES).contains(&with_course.cases.len()));
    assert!(
        with_course
            .cases
            .iter()
            .all(|case| shown.cases.binary_search(case).is_ok())
    );
    let lengths: Vec<usize> = with_course.positions.iter().map(Vec::len).collect();
    assert!(
        lengths.iter().all(|length| (10..=12).contains(length)),
        "{lengths:?}"
    );
}

#[test]
fn small_studies_are_shown_whole() {
    let study = grid(12, 10);
    assert_eq!(Selection::shown(&study).cases, (0..120).collect::<Vec<_>>());
    assert_eq!(
        Selection::with_course(&study).cases,
        (0..120).collect::<Vec<_>>()
    );
}

#[test]
fn every_setting_is_on_the_page_with_a_name() {
    let alone = grid(1, 1).settings(0);
    has_every_setting(&alone);
    let chamfer = ChamferSettings {
        edge_radius_m: 0.1e-3,
        chamfer_width_m: 1e-3,
        ..ChamferSettings::default()
    };
    let profile = ProfileSettings {
        control_points_m: vec![[-1.0, 0.0], [1.0, 0.0]],
        ..ProfileSettings::default()
    };
    let kinds = [
        WorkpieceKind::edge(1e-3),
        WorkpieceKind::Chamfer(chamfer),
        WorkpieceKind::bore(0.3),
        WorkpieceKind::Profile(profile),
    ];
    for kind in kinds {
        let mut other = alone.clone();
        other.workpiece.kind = kind;
        has_every_setting(&other);
    }
    has_every_setting(&Settings {
        brush: Some(BrushSettings::default()),
        ..alone
    });
}

/// Tools over workpieces of different kinds have settings of their own: none is mistaken for
/// another.
#[test]
fn settings_of_tools_are_merged_by_their_paths() {
    let plane = grid(1, 1).settings(0);
    let mut edge = plane.clone();
    edge.workpiece.kind = WorkpieceKind::edge(1e-3);
    for order in [[&plane, &edge], [&edge, &plane]] {
        let tool = |(position, settings): (usize, &&Settings)| StudyTool {
            name: format!("tool {position}"),
            settings: (*settings).clone(),
            held: Vec::new(),
        };
        let study = Study::of_tools(order.iter().enumerate().map(tool).collect(), Vec::new())
            .expect("a study");
        let merged = study_settings(&study);
        let paths: Vec<&str> = merged
            .iter()
            .filter_map(|entry| entry["path"].as_str())
            .collect();
        for settings in order {
            let own = super::settings(settings, |_| false);
            let own: Vec<&str> = own
                .iter()
                .filter_map(|entry| entry["path"].as_str())
                .collect();
            assert!(own.iter().all(|path| paths.contains(path)) && own.len() < paths.len());
        }
        let by_tool = |path: &str| {
            merged
                .iter()
                .find(|entry| entry["path"] == path)
                .map(|entry| &entry["by_tool"])
        };
        let is_edge = order[0] == &edge;
        let expected = if is_edge {
            json!([1e-3, "none"])
        } else {
            json!(["none", 1e-3])
        };
        assert_eq!(by_tool("workpiece.edge_radius_m"), Some(&expected));
        assert_eq!(by_tool("process.penetration_depth_m"), Some(&Value::Null));
    }
}

fn has_every_setting(stated: &Settings) {
    let base = serde_json::to_value(stated).expect("settings are JSON");
    let keys = |value: &Value| {
        value
            .as_object()
            .map(|object| object.keys().cloned().collect::<Vec<_>>())
    };
    let mut paths: Vec<String> = Vec::new();
    for section in keys(&base).expect("sections") {
        let keys = keys(&base[&section]).expect("settings");
        paths.extend(keys.into_iter().map(|key| format!("{section}.{key}")));
    }
    // Files leave out those that follow from others.
    paths.extend(
        PARAMETERS
            .iter()
            .filter(|parameter| parameter.read(stated).is_some())
            .map(|parameter| parameter.path.to_owned())
            .filter(|path| {
                !paths.contains(path) && (stated.brush.is_some() || !path.starts_with("brush."))
            })
            .filter(|path| !path.starts_with("removal."))
            .collect::<Vec<_>>(),
    );
    paths.sort();
    let shown = settings(stated, |_| false);
    let mut known: Vec<&str> = shown
        .iter()
        .filter_map(|setting| setting["path"].as_str())
        .collect();
    known.sort_unstable();
    assert_eq!(paths, known);
    assert!(shown.iter().all(|setting| {
        setting["name"]
            .as_str()
            .is_some_and(|name| !name.is_empty())
    }));
}

#[test]
fn the_uncertainty_is_that_of_the_number_of_filaments() {
    let study = grid(1, 1);
    let results = simulated(&study);
    let data = data_in(&page_of(&study, &results, &[], &[]));
    let force = results[0]
        .as_ref()
        .expect("the case is solved")
        .metrics
        .tool_contact_normal_force_n;
    let uncertainty = data["force_uncertainty"][0].as_f64().expect("a number");
    // To the six digits that the page has.
    assert!((uncertainty / (force * 600.0 / 10_500.0) - 1.0).abs() < 1e-5);
}

#[test]
fn measured_points_are_on_the_page_with_their_places() {
    let study = grid(3, 2);
    let results = made_up(6);
    let point = |speed, penetration_depth_m, std_n| Measurement {
        speed,
        second_speed_rpm: None,
        penetration_depth_m,
        force_n: 1.0,
        std_n,
        tool: None,
    };
    let measured = [
        point(Speed::Velocity(12.0), 1.5e-3, Some(2.0)),
        point(Speed::Velocity(99.0), 1e-3, None),
    ];
    let comparisons = compare(&study, &results, &measured);
    let data = data_in(&page_of(&study, &results, &[], &comparisons));
    let comparison = &data["measured"]["comparisons"][0];
    assert_eq!(
        (&data["measured"]["speed"]["unit"], &comparison["count"]),
        (&json!("m/s"), &json!(2))
    );
    let [inside, outside] = [0, 1].map(|index| &comparison["points"][index]);
    let axes: Vec<&Value> = data["axes"]
        .as_array()
        .expect("axes")
        .iter()
        .map(|axis| &axis["path"])
        .collect();
    let at = axes.iter().map(|path| {
        if *path == bristle_study::grid::VELOCITY {
            12.0
        } else {
            1.5e-3
        }
    });
    assert_eq!(
        (&inside["at"], &inside["within"]),
        (&json!(at.collect::<Vec<f64>>()), &json!(true))
    );
    assert_eq!(
        (&outside["outside"], &outside["simulated"]),
        (&json!(true), &Value::Null)
    );
    let without = data_in(&page_of(&study, &results, &[], &[]));
    assert!(without["measured"].is_null());
}

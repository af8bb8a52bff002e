//! Tests of figures of studies and contacts.

use bristle::simulation::Sample;
use bristle_study::grid::{CaseResult, Study};
use bristle_study::input::measured::Measurement;

use super::contact::{history_figure, turns_figure};
use super::preferred::MAIN;
use super::slice_view::means_of_flat;
use super::{Picture, Pictures, contact_figures, is_of_study, main_figures, study_figures};
use crate::report::drawing::Canvas;
use crate::report::drawing::format::Format;
use bristle::simulation::simulate_with_history;
use bristle_study::grid::run_study;
use bristle_study::input::document::Document;
use bristle_study::input::measured::Speed;

fn study(sweeps: &str) -> (Study, Vec<CaseResult>) {
    let text = format!(
        "[tool]\nbody_radius_m = 0.140\nwidth_m = 0.020\nfilament_count = 10500\nfilament_count_uncertainty = 600\n[filament]\nsegments = 2\nlength_m = 0.040\n\
         diameter_m = 1.18e-3\n[solver]\nrelative_tolerance = 1e-2\n[process]\nbrushing_velocity_m_s = 10.0\n\
         penetration_depth_m = 1.0e-3\n[study]\n{sweeps}"
    );
    let study = Document::parse(&text, "case.toml")
        .and_then(|document| document.study())
        .expect("a study");
    let results = run_study(&study, None, || {}).expect("threads");
    (study, results)
}

fn names(pictures: &Pictures) -> Vec<&str> {
    pictures
        .pictures
        .iter()
        .map(|picture| picture.name.as_str())
        .collect()
}

#[test]
fn odd_grids_are_drawn_without_what_is_no_number() {
    let sweeps = [
        "brushing_velocity_m_s = [10.0]",
        "brushing_velocity_m_s = [10.0, 10.0]\npenetration_depth_m = [1e-3]",
        "brushing_velocity_m_s = [20.0, 10.0, 11.0]\npenetration_depth_m = [3e-3, 1e-3]",
        "penetration_depth_m = [1e-3, 2e-3]\n\"filament.segments\" = [1, 2, 3]",
        "\"tool.filament_count\" = [0.0, 10.0]\n\"filament.segments\" = [1, 2]\n\"contact.exponent\" = [1.0, 1.5]",
    ];
    let point = |velocity: f64, depth: f64| Measurement {
        speed: Speed::Velocity(velocity),
        second_speed_rpm: None,
        penetration_depth_m: depth,
        force_n: -1.0,
        std_n: Some(0.0),
        tool: None,
    };
    let measured = [point(10.0, 1e-3), point(10.5, 1.5e-3), point(1e9, 1e-9)];
    for sweeps in sweeps {
        let (study, mut results) = study(sweeps);
        // As simulated, with one failed case, and with failed cases only.
        for failed in [0, 1, results.len()] {
            results
                .iter_mut()
                .take(failed)
                .for_each(|result| *result = Err("failed".to_owned()));
            let pictures = study_figures(&study, &results, &measured, &Format::default());
            for Picture { name, canvas } in &pictures.pictures {
                let svg = canvas.svg();
                assert!(is_of_study(name), "{name}");
                assert!(
                    svg.trim_end().ends_with("</svg>")
                        && !svg.contains("NaN")
                        && !svg.contains("inf"),
                    "{name}"
                );
            }
            let mut names = names(&pictures);
            names.sort_unstable();
            names.dedup();
            assert_eq!(names.len(), pictures.pictures.len());
        }
    }
}

#[test]
fn five_figures_matter_most() {
    let main = |names: &[&str]| {
        let picture = |name: &&str| Picture {
            name: (*name).to_owned(),
            canvas: Canvas::on(&Format::default(), (1, 1)),
        };
        main_figures(names.iter().map(picture).collect())
            .into_iter()
            .map(|picture| picture.name)
            .collect::<Vec<_>>()
    };
    let (study, results) =
        study("brushing_velocity_m_s = [10.0, 20.0]\npenetration_depth_m = [1e-3, 2e-3]");
    let all = study_figures(&study, &results, &[], &Format::default());
    let mut expected = [
        "contact_time_ratio_map",
        "impulse_map",
        "tool_force_map",
        "tool_power_map",
        "tool_force_over_velocity",
    ];
    let mut chosen = main(&names(&all));
    expected.sort_unstable();
    chosen.sort_unstable();
    assert_eq!(chosen, expected);
    let more = [&["measured_over_depth"][..], &names(&all)].concat();
    let chosen = main(&more);
    assert!(
        chosen.len() == MAIN && chosen[0] == "measured_over_depth",
        "{chosen:?}"
    );
    assert!(!chosen.contains(&"tool_force_over_velocity".to_owned()));
    let by_tool = "impulse_over_speed_by_tool_penetration_depth_m_0.001";
    assert_eq!(
        main(&["a", "b", "c", "d", "e", "impulse_map", by_tool]),
        ["a", "b", "c", "impulse_map", by_tool]
    );
    assert_eq!(main(&["history", "turns"]), ["history", "turns"]);
}

#[test]
fn one_case_has_no_picture() {
    let (study, results) = study("brushing_velocity_m_s = [10.0]");
    let pictures = study_figures(&study, &results, &[], &Format::default());
    assert!(pictures.pictures.is_empty() && !pictures.note.is_empty());
}

#[test]
fn flat_curves_at_different_levels_show_their_changes() {
    let known = |curves: &[&[f64]]| {
        curves
            .iter()
            .map(|values| values.iter().copied().map(Some).collect())
            .collect()
    };
    let means = |curves: Vec<Vec<Option<f64>>>| means_of_flat(&curves);
    assert_eq!(
        means(known(&[&[10.0, 10.1], &[20.0, 20.1]])),
        Some(vec![10.05, 20.05])
    );
    assert_eq!(
        means(vec![
            vec![Some(10.0), None, Some(10.1)],
            vec![Some(20.0), Some(20.1), None]
        ]),
        Some(vec![10.05, 20.05])
    );
    // One curve, curves that change, that lie together, without values, or below zero, are
    // drawn as they are.
    for curves in [
        &[&[10.0, 10.1][..]][..],
        &[&[10.0, 12.0], &[20.0, 20.1]],
        &[&[10.0, 10.1], &[10.2, 10.3]],
        &[&[], &[]],
        &[&[-1.0, -1.0], &[1.0, 1.0]],
    ] {
        assert_eq!(means(known(curves)), None, "{curves:?}");
    }

    let (study, mut results) =
        study("\"filament.segments\" = [1, 2]\n\"solver.relative_tolerance\" = [1e-5, 1e-3]");
    for (case, result) in results.iter_mut().enumerate() {
        let force = [100.0, 100.1, 200.0, 200.4][case];
        result
            .as_mut()
            .expect("a result")
            .metrics
            .tool_contact_normal_force_n = force;
    }
    let pictures = study_figures(&study, &results, &[], &Format::default()).pictures;
    let picture = pictures
        .iter()
        .find(|picture| picture.name == "tool_force_over_relative_tolerance");
    let svg = picture.expect("a figure").canvas.svg();
    for text in [
        "deviation from the mean in %",
        "segments = 2: mean 200 N",
        "10⁻⁵",
    ] {
        assert!(svg.contains(text), "{text}");
    }
}

#[test]
fn on_paper_all_text_has_its_size() {
    let (study, results) =
        study("brushing_velocity_m_s = [10.0, 15.0, 20.0]\npenetration_depth_m = [1e-3, 2e-3]");
    let settings = study.settings(0);
    let simulation = simulate_with_history(&settings, 100).expect("a pass");
    for (width_mm, points) in [(84.0, 8.0), (90.0, 10.0), (174.0, 7.0), (300.0, 24.0)] {
        let format =
            Format::new(Some(width_mm), Some(points), Some("STIX".to_owned())).expect("a format");
        let mut pictures = study_figures(&study, &results, &[], &format).pictures;
        pictures.extend(contact_figures(
            &settings,
            &simulation.history,
            &[1e-3, 2e-3],
            &[],
            &[],
            &format,
        ));
        assert!(pictures.len() > 10);
        for Picture { name, canvas } in pictures {
            let svg = canvas.svg();
            let after = |text: &str| {
                svg.split_once(text)
                    .map(|(_, rest)| rest)
                    .expect("an attribute")
            };
            let number = |text: &str| {
                text.split(['"', ' ', 'm'])
                    .next()
                    .and_then(|number| number.parse::<f64>().ok())
            };
            assert_eq!(number(after("<svg width=\"")), Some(width_mm), "{name}");
            let of_view_box = number(after("viewBox=\"0 0 ")).expect("a width");
            // A part in a thousand, as the layout has whole pixels.
            for size in svg
                .split("sans-serif\" font-size=\"")
                .skip(1)
                .filter_map(number)
            {
                let in_points = size / of_view_box * width_mm * 72.27 / 25.4;
                assert!(
                    (in_points / points - 1.0).abs() < 2e-3,
                    "{name}: {in_points} pt"
                );
            }
            assert!(svg.contains("font-family=\"'STIX', Helvetica"));
        }
    }
    let format = Format::new(Some(84.0), Some(8.0), None).expect("a format");
    let png = history_figure(&settings, &simulation.history, &format)
        .canvas
        .png();
    let [width, per_metre] =
        [16, 41].map(|at| u32::from_be_bytes(png[at..at + 4].try_into().expect("four bytes")));
    assert!(
        width.abs_diff(1984) <= 1 && per_metre == 23_622,
        "{width} {per_metre}"
    );
}

#[test]
fn what_is_left_out_is_said() {
    let velocities: Vec<String> = (1..=9)
        .map(|velocity| format!("{}.0", 10 * velocity))
        .collect();
    let sweeps = format!(
        "brushing_velocity_m_s = [{}]\npenetration_depth_m = [1e-3, 2e-3]",
        velocities.join(", ")
    );
    let (study, results) = study(&sweeps);
    let pictures = study_figures(&study, &results, &[], &Format::default());
    assert_eq!(pictures.pictures.len(), 15);
    let find = |name: &str| {
        let picture = pictures
            .pictures
            .iter()
            .find(|picture| picture.name == name);
        picture.expect(name).canvas.svg()
    };
    assert!(find("impulse_over_depth").contains("7 of 9 values of v<tspan"));
    assert!(!find("impulse_over_velocity").contains("values of"));
    let map = find("tool_force_map");
    assert!(map.contains("> ± 600: all values ± 5.7 %"));
    assert!(map.contains("µ = 0,") && map.contains("R = 180"));
}

#[test]
fn only_pictures_of_studies_are_taken_for_them() {
    let is_own = [
        "impulse_map_segments_3",
        "measured_over_depth",
        "history",
        "impulse",
        "my_impulse_map",
    ]
    .map(is_of_study);
    assert_eq!(is_own, [true, true, false, false, false]);
}

#[test]
fn histories_of_any_length_are_drawn() {
    let (study, _) = study("brushing_velocity_m_s = [10.0]");
    let settings = study.settings(0);
    let drawn = |history: &[Sample]| {
        history_figure(&settings, history, &Format::default())
            .canvas
            .svg()
    };
    for samples in [2, 3, 300] {
        let svg = drawn(
            &simulate_with_history(&settings, samples)
                .expect("a pass")
                .history,
        );
        assert!(!svg.contains("NaN") && svg.contains("> in N") && svg.contains("> in mm"));
    }
    assert!(drawn(&[]).contains("One contact"));
}

#[test]
fn several_turns_are_drawn() {
    let (study, _) = study("brushing_velocity_m_s = [30.0]\n\"process.turns\" = [3]");
    let settings = study.settings(0);
    let simulation = simulate_with_history(&settings, 300).expect("a pass");
    let svg = history_figure(&settings, &simulation.history, &Format::default())
        .canvas
        .svg();
    assert!(!svg.contains(">entry<") && !svg.contains("NaN"));
    let turns = |impulses: &[f64]| {
        let turns = turns_figure(&settings, impulses, &Format::default())?;
        Some(turns.canvas.svg())
    };
    let three = turns(&simulation.turn_contact_normal_impulses_n_s);
    assert!(three.is_some_and(|svg| svg.contains("turn by turn")));
    assert_eq!(turns(&[1e-3]), None);
    assert!(turns(&[0.0, 0.0]).is_some_and(|svg| !svg.contains("NaN")));
}

//! Tests of advice on cases of small studies.

use super::*;
use crate::insight::testing::{self, metrics_of, with_force};
use bristle_study::grid::uncertainty::ForceScatter;
use bristle_study::text::layout::WIDTH;

fn study(sweeps: &str) -> Study {
    testing::study(&format!(
        "[tool]\nbody_radius_m = 0.140\nwidth_m = 0.020\nfilament_count = 1000\nfilament_count_uncertainty = 100\n\
         [filament]\nlength_m = 0.040\ndiameter_m = 1.18e-3\n[process]\nbrushing_velocity_m_s = 10.0\n\
         penetration_depth_m = 1e-3\n[contact]\nfriction_coefficient = 0.3\n[study]\n{sweeps}"
    ))
}

/// Force in N and contact time ratio of a case; `None` if it failed.
type Case = Option<(f64, f64)>;

fn results(cases: &[Case]) -> Vec<CaseResult> {
    let result =
        |case: &Case| case.map_or(Err("failed".to_owned()), |(n, ratio)| with_force(n, ratio));
    cases.iter().map(result).collect()
}

/// Two depths and four velocities, neither in ascending order. There is a maximum along the
/// tier at 1 mm and 10 m/s.
const SWEEPS: &str =
    "brushing_velocity_m_s = [20.0, 5.0, 15.0, 10.0]\npenetration_depth_m = [2e-3, 1e-3]\n";
const CASES: [Case; 8] = [
    Some((290.0, 0.7)),
    Some((240.0, 0.95)),
    Some((235.0, 0.8)),
    Some((230.0, 0.9)),
    Some((300.0, 0.25)),
    Some((150.0, 0.9)),
    Some((160.0, 0.3)),
    Some((200.0, 0.52)),
];
const NONE: Limits = Limits {
    max_velocity_m_s: None,
    max_rotational_speed_rpm: None,
    max_depth_m: None,
    max_force_n: None,
    max_power_w: None,
    min_ratio: None,
    max_ratio: None,
    target_force_n: None,
    most: None,
};

fn target(force_n: f64) -> Limits {
    Limits {
        target_force_n: Some(force_n),
        ..NONE
    }
}

fn advice(study: &Study, cases: &[Case], limits: Limits) -> Advice {
    assert_eq!(cases.len(), study.case_count());
    advise(study, &results(cases), limits).expect("advice")
}

fn section(sweeps: &str, cases: &[Case], limits: Limits) -> Section {
    advice(&study(sweeps), cases, limits).sections.remove(0)
}

fn error(sweeps: &str, cases: &[Case], limits: Limits) -> String {
    let advice = advise(&study(sweeps), &results(cases), limits);
    advice.expect_err("nothing to advise").to_string()
}

fn rows(section: &Section, topic: Topic) -> Vec<usize> {
    let own = section.advice.iter().filter(|about| about.topic == topic);
    own.map(|about| about.cell.row).collect()
}

#[test]
fn the_right_cases_are_cited() {
    let all = section(SWEEPS, &CASES, NONE);
    for (topic, expected) in [
        (Topic::Highest, &[5][..]),
        (Topic::AtVelocity, &[2, 4, 3, 5]),
        (Topic::AtDepth, &[5, 1]),
        // 48 N for each m/s, 300 N for each mm.
        (Topic::PerVelocity, &[2]),
        (Topic::PerDepth, &[5]),
        (Topic::Tier, &[8]),
        (Topic::WithinLimits, &[]),
    ] {
        assert_eq!(rows(&all, topic), expected, "{topic:?}");
    }
    let notes = [
        "At a_e = 2 mm no local maximum lies along the line between sweeping and striking, from ε_tc = 0.3 to 0.6.",
        "In 2 of 8 cases the filament comes back still vibrating, with up to 6 % of its vibration (row 1). Simulate \
         turn after turn with process.turns = \"steady\".",
    ];
    assert_eq!(all.notes, notes);
    let Cited { place, outcome, .. } = &all.advice[0].cell;
    assert_eq!(
        (place.brushing_velocity_m_s, place.penetration_depth_m),
        (20.0, 1e-3)
    );
    // A tenth, like that of the filaments.
    assert!((outcome.uncertainty_n - 30.0).abs() < 1e-12);

    // Of equal forces the first, at 5 m/s and 1 mm.
    let level = section(SWEEPS, &[Some((100.0, 0.9)); 8], NONE);
    assert_eq!(rows(&level, Topic::Highest), [6]);
    assert_eq!(rows(&level, Topic::AtVelocity), [6, 8, 7, 5]);
    assert_eq!(rows(&level, Topic::AtDepth), [6, 2]);

    // Cases that failed or have no force are no advice.
    let mut cases = CASES;
    (cases[4], cases[1], cases[5]) = (None, Some((0.0, 0.0)), Some((0.0, 0.0)));
    let some = section(SWEEPS, &cases, NONE);
    assert_eq!(rows(&some, Topic::Highest), [1]);
    // Nothing at 5 m/s, nothing to compare at 20 m/s.
    assert_eq!(rows(&some, Topic::AtVelocity), [4, 3]);
    assert_eq!(some.notes[0], "1 of 8 cases failed and is left out.");
    for (case, note) in [
        (Some((0.0, 0.0)), "No case has a contact normal force."),
        (None, "All 8 cases failed."),
    ] {
        let Section { advice, notes, .. } = section(SWEEPS, &[case; 8], NONE);
        assert_eq!((advice, notes), (vec![], vec![note.to_owned()]));
    }
}

#[test]
fn a_headline_is_true_of_any_study() {
    let strikes = "F_n,w = 300 ± 30 N at v_b = 20 m/s, a_e = 1 mm (row 5), where the filaments strike (ε_tc = 0.250)";
    let sweeps = |force: &str| {
        format!(
            "Where the filaments sweep (ε_tc ≥ ½) in a laterally stable pass, the highest is {force}."
        )
    };
    let lowest = "The lowest is 150 ± 15 N at v_b = 5 m/s, a_e = 1 mm (row 6).";
    let mut some = CASES;
    some[4] = None;
    let one = "brushing_velocity_m_s = [10.0]";
    let segments = "\"filament.segments\" = [5, 10]";
    let table: [(&str, &[Case], &[usize], String); 12] = [
        (SWEEPS, &CASES, &[], format!("The highest tool force of 8 cases is {strikes}. {}", sweeps("290 ± 29 N at v_b = 20 m/s, a_e = 2 mm (row 1)"))),
        (SWEEPS, &CASES, &[5, 1], format!("The highest tool force of 8 cases is {strikes}, and the pass is laterally unstable. {}", sweeps("240 ± 24 N at v_b = 5 m/s, a_e = 2 mm (row 2)"))),
        (SWEEPS, &CASES, &[1, 2, 3, 4, 6, 8], format!("The highest tool force of 8 cases is {strikes}. In no laterally stable case do the filaments sweep (ε_tc ≥ ½).")),
        (SWEEPS, &some, &[], format!("The highest tool force of the 7 of 8 cases that did not fail is F_n,w = 290 ± 29 N at v_b = 20 m/s, a_e = 2 mm (row 1), where the filaments sweep (ε_tc = 0.700). {lowest}")),
        (SWEEPS, &[None; 8], &[], "All 8 cases failed. Their errors stand below.".to_owned()),
        (SWEEPS, &[Some((0.0, 0.0)); 8], &[], "There is no contact normal force in 8 cases. The filaments do not touch the workpiece.".to_owned()),
        (one, &[Some((54.321, 0.75))], &[], "At v_b = 10 m/s, a_e = 1 mm, the tool presses with F_n,w = 54.3 ± 5.4 N, and its filaments sweep (ε_tc = 0.750). The pass is laterally stable.".to_owned()),
        (one, &[Some((54.321, 0.25))], &[1], "At v_b = 10 m/s, a_e = 1 mm, the tool presses with F_n,w = 54.3 ± 5.4 N, and its filaments strike (ε_tc = 0.250). The pass is laterally unstable, so that an imperfection of the filament can change the force.".to_owned()),
        (one, &[Some((0.0, 0.0))], &[], "There is no contact normal force in one case. The filaments do not touch the workpiece.".to_owned()),
        (one, &[None], &[], "The case failed. Its error stands below.".to_owned()),
        (segments, &[Some((60.0, 0.75)), Some((50.0, 0.75))], &[], "The highest tool force of 2 cases is F_n,w = 60.0 ± 6.0 N at v_b = 10 m/s, a_e = 1 mm, segments = 5 (row 1), where the filaments sweep (ε_tc = 0.750). The lowest is 50.0 ± 5.0 N at v_b = 10 m/s, a_e = 1 mm, segments = 10 (row 2).".to_owned()),
        (segments, &[Some((60.0, 0.75)); 2], &[], "The highest tool force of 2 cases is F_n,w = 60.0 ± 6.0 N at v_b = 10 m/s, a_e = 1 mm, segments = 5 (row 1), where the filaments sweep (ε_tc = 0.750). All cases have the same force.".to_owned()),
    ];
    for (sweeps, cases, unstable, expected) in table {
        let mut results = results(cases);
        for &row in unstable {
            metrics_of(&mut results[row - 1]).laterally_unstable = true;
        }
        assert_eq!(headline(&study(sweeps), &results), expected);
    }
}

#[test]
fn limits_are_kept_to() {
    let max_velocity_m_s = Some(15.0);
    // 10 m/s at the tips are 530.5 rpm. Those that sweep come first, the highest to 5 %, and no
    // more than five; a limit itself is within.
    let table: [(Limits, &[usize]); 6] = [
        (
            Limits {
                max_velocity_m_s,
                ..NONE
            },
            &[2, 4, 3, 8, 6],
        ),
        (
            Limits {
                min_ratio: Some(0.7),
                ..NONE
            },
            &[1, 2, 4, 3, 6],
        ),
        (
            Limits {
                max_velocity_m_s,
                max_ratio: Some(0.5),
                ..NONE
            },
            &[7],
        ),
        (
            Limits {
                max_depth_m: Some(1e-3),
                ..NONE
            },
            &[8, 6, 5, 7],
        ),
        (
            Limits {
                max_rotational_speed_rpm: Some(531.0),
                ..NONE
            },
            &[2, 4, 8, 6],
        ),
        (
            Limits {
                max_rotational_speed_rpm: Some(530.0),
                ..NONE
            },
            &[2, 6],
        ),
    ];
    for (limits, expected) in table {
        let within = section(SWEEPS, &CASES, limits);
        assert_eq!(rows(&within, Topic::WithinLimits), expected, "{limits}");
    }
    let limits = Limits {
        max_velocity_m_s: Some(4.0),
        min_ratio: Some(0.5),
        max_ratio: Some(0.6),
        ..NONE
    };
    let unmet = section(SWEEPS, &CASES, limits);
    assert_eq!(unmet.advice, []);
    let note = "No case has v_b ≤ 4 m/s and ε_tc ≥ 0.5 and ε_tc ≤ 0.6.";
    assert_eq!(unmet.notes[0], note);
}

/// The rows between which suggestions lie, and their depths in m.
fn interpolated(section: &Section) -> Vec<([usize; 2], f64)> {
    let suggestions = section.interpolated.iter();
    suggestions
        .map(|each| (each.between_rows, each.place.penetration_depth_m))
        .collect()
}

#[test]
fn a_highest_force_ranks_first_what_is_within_it_with_its_uncertainty() {
    let limits = Limits {
        max_force_n: Some(250.0),
        ..NONE
    };
    let section = section(SWEEPS, &CASES, limits);
    assert_eq!(rows(&section, Topic::WithinLimits), [8, 6, 7]);
    let ranked: Vec<&str> = section
        .advice
        .iter()
        .map(|ranked| &*ranked.sentence)
        .collect();
    let best = "The best of 3 entirely within the limit, of 6 cases with F_n,w ≤ 250 N; it sweeps.";
    assert_eq!([ranked[0], ranked[2]], [best, "It strikes."]);
    // The upper end of the uncertainty reaches 250 N a little deeper.
    assert_eq!(
        interpolated(&section),
        [([6, 2], 1.85e-3), ([8, 4], 1.9e-3)]
    );
    let outcome = &section.interpolated[0].interpolated;
    let values = [
        (outcome.tool_contact_normal_force_n, 226.5),
        (outcome.uncertainty_n, 22.65),
        (outcome.contact_time_ratio, 0.9425),
    ];
    assert!(
        values
            .iter()
            .all(|(value, expected)| (value - expected).abs() < 1e-9),
        "{values:?}"
    );
}

#[test]
fn a_target_ranks_the_nearest_first() {
    let near = section(SWEEPS, &CASES, target(220.0));
    assert_eq!(rows(&near, Topic::NearTarget), [4, 3, 2]);
    let sure = "it sweeps. The target is within the uncertainty.";
    assert_eq!(
        near.advice[0].sentence,
        format!("The best of 8 cases. 10 N above 220 N; {sure}")
    );
    assert_eq!(near.advice[2].sentence, format!("20 N above 220 N; {sure}"));
    assert_eq!(interpolated(&near), [([6, 2], 1.78e-3), ([8, 4], 1.67e-3)]);
    // What is interpolated is within the other limits, too.
    let within = |max_depth_m: f64| Limits {
        max_depth_m: Some(max_depth_m),
        ..target(220.0)
    };
    let shallow = section(SWEEPS, &CASES, within(1.7e-3));
    assert_eq!(interpolated(&shallow), [([8, 4], 1.67e-3)]);
    // No depth up to there gives the force, but a velocity does, unless it is too high.
    let faster = section(SWEEPS, &CASES, within(1.6e-3));
    assert_eq!(interpolated(&faster), [([7, 5], 1e-3)]);
    let slow = Limits {
        max_velocity_m_s: Some(16.0),
        ..within(1.6e-3)
    };
    let none = section(SWEEPS, &CASES, slow);
    assert_eq!(interpolated(&none), []);
    assert!(none.notes.iter().any(|note| note == NOTHING_BETWEEN));
    // Nothing is interpolated next to cases that failed or have no force.
    let mut cases = CASES;
    (cases[1], cases[3]) = (None, Some((0.0, 0.0)));
    assert_eq!(
        interpolated(&section(SWEEPS, &cases, target(220.0))),
        [([7, 3], 1.8e-3)]
    );

    let cases = [(100.0, 0.9), (200.0, 0.6)].map(Some);
    let one_depth = section("brushing_velocity_m_s = [5.0, 10.0]", &cases, target(150.0));
    assert_eq!(one_depth.interpolated[0].place.brushing_velocity_m_s, 7.5);
}

/// A wide band, a striking filament, or an unstable one counts for more than a few newtons.
#[test]
fn what_is_recommended_is_robust() {
    let study = study("brushing_velocity_m_s = [5.0, 10.0, 15.0, 20.0]");
    let recommended = |change: &dyn Fn(&mut [CaseResult])| {
        let cases = [(81.0, 0.9), (80.0, 0.7), (80.0, 0.3), (40.0, 0.9)].map(Some);
        let mut results = results(&cases);
        change(&mut results);
        let advice = advise(&study, &results, target(80.0)).expect("advice");
        advice.recommendation.expect("a recommendation")
    };
    let with_bands = |results: &mut [CaseResult]| {
        for (result, band) in results.iter_mut().zip([[51.0, 300.0], [49.0, 139.0]]) {
            let [tool_force_lower_95_n, tool_force_upper_95_n] = band;
            let scatter = ForceScatter {
                tool_force_median_n: 80.0,
                tool_force_lower_95_n,
                tool_force_upper_95_n,
                ..ForceScatter::default()
            };
            result.as_mut().expect("a result").scatter = Some(scatter);
        }
    };
    assert_eq!(recommended(&|_| ()).rows, [2], "inside the grid");
    let narrow = recommended(&with_bands);
    assert_eq!(
        (narrow.rows, narrow.weaknesses),
        (vec![2], vec!["wide band".to_owned()])
    );
    let unstable = |results: &mut [CaseResult]| {
        for result in &mut results[..2] {
            metrics_of(result).laterally_unstable = true;
        }
    };
    assert_eq!(
        recommended(&unstable).rows,
        [3],
        "it strikes, but it is stable"
    );
}

/// A target that no case reaches is named first, as is one that all cases exceed.
#[test]
fn a_target_that_no_setting_reaches_is_named_first() {
    let study = study("rotational_speed_rpm = [400, 800]\npenetration_depth_m = [1e-3, 2e-3]");
    let cases = [10.0, 20.0, 15.0, 30.6].map(|force| Some((force, 0.9)));
    for (target_n, expected) in [
        (
            60.0,
            "No setting up to 800 rpm and 2 mm reaches 60 N; the most is 30.6 N\n  nearest to 60 N: 800 rpm",
        ),
        (
            5.0,
            "All settings from 400 rpm and 1 mm exceed 5 N; the least is 10.0 N\n  nearest to 5 N: 400 rpm",
        ),
        (31.0, "Recommended for 31 N: 800 rpm"),
    ] {
        let text = advice(&study, &cases, target(target_n)).text(WIDTH);
        assert!(text.starts_with(expected), "{text}");
    }
}

#[test]
fn a_force_that_is_passed_along_the_speed_is_found() {
    let sweeps = "rotational_speed_rpm = [2500, 3000]\npenetration_depth_m = [2e-3, 3e-3]";
    let cases = [40.0, 61.0, 59.6, 74.4].map(|force| Some((force, 0.9)));
    let section = section(sweeps, &cases, target(60.0));
    let mut found = section.interpolated.iter();
    let deep = found
        .find(|suggestion| suggestion.between_rows == [3, 4])
        .expect("a suggestion at 3 mm");
    assert_eq!(deep.place.penetration_depth_m, 3e-3);
    // 59.6 N at 2500 rpm, 74.4 N at 3000 rpm.
    let speed = deep.place.rotational_speed_rpm;
    assert!(
        (speed - (2500.0 + 500.0 * 0.4 / 14.8)).abs() < 10.0,
        "{speed}"
    );
    assert!(section.interpolated.len() == 2, "and one at 2 mm");
}

/// A limit is kept with a likelihood, and of a force without an uncertainty nothing is known.
#[test]
fn a_recommendation_says_how_likely_a_limit_is_kept() {
    let study = study("penetration_depth_m = [1e-3, 2e-3]");
    let limits = Limits {
        max_force_n: Some(100.0),
        ..NONE
    };
    let mut uncertain = results(&[Some((50.0, 0.9)), Some((120.0, 0.9))]);
    uncertain[0].as_mut().expect("a result").scatter = Some(ForceScatter {
        tool_force_median_n: 60.0,
        tool_force_lower_95_n: 40.0,
        tool_force_upper_95_n: 100.0,
        ..ForceScatter::default()
    });
    let text = advise(&study, &uncertain, limits)
        .expect("advice")
        .text(WIDTH);
    let kept = " % of such brushes keep F_n,w ≤ 100 N; 60 N is the median";
    let said = text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(said.contains(kept) && said.contains("wide band"), "{text}");

    let exact = testing::study(
        "[tool]\nbody_radius_m = 0.140\nwidth_m = 0.020\nfilament_count = 1000\n[filament]\nlength_m = 0.040\n\
         diameter_m = 1.18e-3\n[process]\nbrushing_velocity_m_s = 10.0\npenetration_depth_m = 1e-3\n\
         [study]\npenetration_depth_m = [1e-3, 2e-3]",
    );
    let text = advice(&exact, &[Some((50.0, 0.9)), Some((60.0, 0.9))], limits).text(WIDTH);
    assert!(!text.contains("band"), "{text}");
}

#[test]
fn tools_are_compared_at_the_same_speed() {
    let study = study(
        "rotational_speed_rpm = [500, 3000]\npenetration_depth_m = [1e-3, 2e-3]\n\
         [study.tools.coarse]\n[study.tools.fine]\nfilament.diameter_m = 0.8e-3",
    );
    // At 500 rpm coarse has the force, fine at 3000 rpm; at 500 rpm fine has less and more.
    let mut results =
        results(&[30.0, 70.0, 60.0, 90.0, 40.0, 60.0, 70.0, 80.0].map(|force| Some((force, 0.9))));
    for (result, power) in results
        .iter_mut()
        .zip([70.0, 800.0, 138.0, 900.0, 100.0, 791.0, 160.0, 990.0])
    {
        metrics_of(result).tool_power_w = power;
    }
    let advice = advise(&study, &results, target(60.0)).expect("advice");
    let compared: Vec<(usize, Topic)> = advice
        .tools
        .iter()
        .map(|tool| (tool.advice.cell.row, tool.advice.topic))
        .collect();
    assert_eq!(compared, [(3, Topic::OfTool), (7, Topic::ToolAlongside)]);
    let sentence = &advice.tools[1].advice.sentence;
    assert!(
        sentence.ends_with("For 60.0 N, interpolated: 1.67 mm and 140 W."),
        "{sentence}"
    );
}

/// The force of the recommendation is that of its own simulation, in which the depth is changed
/// until it is the target.
#[test]
fn a_recommendation_is_simulated_at_the_force_that_is_asked_for() {
    let study = study("penetration_depth_m = [1e-3, 2e-3]");
    let mut advice = advice(&study, &[(3.0, 0.9), (30.0, 0.9)].map(Some), target(10.0));
    advice.verify(None, &Stop::default()).expect("threads");
    let recommendation = advice.recommendation.as_ref().expect("a recommendation");
    let verified = recommendation.verified.as_ref().expect("it was simulated");
    assert!(!verified.with_interaction && verified.error.is_none() && verified.in_space.is_none());
    let force = recommendation.outcome.tool_contact_normal_force_n;
    assert!((force / 10.0 - 1.0).abs() < 0.01, "{force}");
    let settings = study
        .settings(0)
        .at_depth(recommendation.place.penetration_depth_m);
    let again = bristle::simulation::simulate(&settings)
        .expect("a contact")
        .metrics;
    assert!((again.tool_contact_normal_force_n / force - 1.0).abs() < 1e-9);
    let text = advice.text(WIDTH);
    assert!(
        text.starts_with("Recommended for 10 N: ") && text.contains("  simulated (rows 1 and 2: "),
        "{text}"
    );
}

/// Filaments of a packed cup are simulated alone, as `[brush]` is refused there.
#[test]
fn a_packed_cup_is_recommended_without_a_brush() {
    let study = testing::study(
        "[tool]\nkind = \"cup\"\nbody_radius_m = 0.030\nwidth_m = 0.010\nfilament_count = 1500\n\
         [filament]\nlength_m = 0.025\ndiameter_m = 0.5e-3\nsegments = 4\n[solver]\nrelative_tolerance = 1e-3\n\
         [process]\nbrushing_velocity_m_s = 5.0\npenetration_depth_m = 1e-3\n\
         [contact]\nfriction_coefficient = 0.3\n[study]\npenetration_depth_m = [0.5e-3, 1e-3]",
    );
    let mut advice = advice(&study, &[(3.0, 0.9), (30.0, 0.9)].map(Some), target(10.0));
    advice.verify(None, &Stop::default()).expect("threads");
    let recommendation = advice.recommendation.expect("a recommendation");
    let verified = recommendation.verified.expect("it was simulated");
    assert_eq!((verified.with_interaction, verified.error), (false, None));
}

/// The advice along the tier at one depth: velocity, sentence, and rows of the other cases.
fn tier(cases: &[Case]) -> Option<(f64, String, Vec<usize>)> {
    let velocities: Vec<usize> = (1..=cases.len()).collect();
    let sweeps = format!("brushing_velocity_m_s = {velocities:?}");
    let Section { advice, notes, .. } = section(&sweeps, cases, NONE);
    let about = advice.into_iter().find(|about| about.topic == Topic::Tier);
    assert_eq!(
        about.is_none(),
        notes.iter().any(|note| note.starts_with("At a_e = "))
    );
    about.map(
        |Sentence {
             cell,
             sentence,
             other_rows,
             ..
         }| { (cell.place.brushing_velocity_m_s, sentence, other_rows) },
    )
}

#[test]
fn a_maximum_along_the_tier_says_what_is_gained_by_more_velocity() {
    let slow = [(100.0, 0.9), (110.0, 0.8), (105.0, 0.7), (150.0, 0.55)];
    let row = |fast: &[(f64, f64)]| {
        [&slow, fast]
            .concat()
            .into_iter()
            .map(Some)
            .collect::<Vec<_>>()
    };
    let falls = "Above this velocity it falls to 130.0 N at 6 m/s (row 6), then exceeds the maximum at 7 m/s (row 7).";
    assert_eq!(
        tier(&row(&[(140.0, 0.4), (130.0, 0.3), (180.0, 0.3)])),
        Some((4.0, falls.to_owned(), vec![6, 7]))
    );
    let falls = "Above this velocity it falls to 140.0 N at 5 m/s (row 5); no faster case exceeds the maximum.";
    assert_eq!(
        tier(&row(&[(140.0, 0.4), (145.0, 0.3)])),
        Some((4.0, falls.to_owned(), vec![5]))
    );
    // Of two maxima, the one nearer to the line counts, although the other is higher.
    let two = tier(&row(&[(140.0, 0.4), (160.0, 0.35), (155.0, 0.3)])).expect("a maximum");
    assert_eq!(two.0, 4.0);
    // There is none far from the line, at an end, or where the force is level.
    assert_eq!(tier(&row(&[])), None);
    assert_eq!(tier(&row(&[(150.0, 0.4), (120.0, 0.3)])), None);
    // Next to a case that failed, a maximum cannot be told.
    let mut failed = row(&[(140.0, 0.4), (130.0, 0.3)]);
    failed[4] = None;
    assert_eq!(tier(&failed), None);
}

#[test]
fn advice_is_on_what_varies() {
    for (sweeps, topic) in [
        ("brushing_velocity_m_s = [5.0, 10.0]", Topic::PerVelocity),
        ("penetration_depth_m = [1e-3, 2e-3]", Topic::PerDepth),
    ] {
        let advice = section(sweeps, &[(100.0, 0.9), (110.0, 0.9)].map(Some), NONE).advice;
        let topics: Vec<Topic> = advice.iter().map(|about| about.topic).collect();
        assert_eq!(topics, [Topic::Highest, topic]);
    }
    let sweeps = "\"filament.segments\" = [3, 4]\nbrushing_velocity_m_s = [5.0]";
    let error = error(sweeps, &[Some((1.0, 1.0)); 2], NONE);
    let start = "the study has only one brushing velocity and one penetration depth";
    assert!(error.starts_with(start), "{error}");
}

#[test]
fn friction_is_said_to_lower_the_force() {
    let sweeps =
        "brushing_velocity_m_s = [5.0, 10.0]\n\"contact.friction_coefficient\" = [0.3, 0.0]";
    let cases = [60.0, 65.0, 160.0, 165.0].map(|force| Some((force, 0.9)));
    let sections = advice(&study(sweeps), &cases, NONE).sections;
    let note = |section: &Section| section.notes.last().cloned().unwrap_or_default();
    let without =
        "With µ = 0 instead of 0.3, velocity and depth of the highest force give 165.0 N (row 4).";
    assert_eq!(note(&sections[1]), without);
    assert!(note(&sections[0]).starts_with("These forces are without friction"));
}

#[test]
fn each_further_setting_has_its_section_and_its_uncertainty() {
    let study =
        study("\"tool.filament_count\" = [1000, 2000]\nbrushing_velocity_m_s = [5.0, 10.0]");
    let cases = [10.0, 20.0, 40.0, 20.0].map(|force| Some((force, 0.9)));
    let advice = advice(&study, &cases, NONE);
    let top = |section: &Section| {
        let Cited { row, outcome, .. } = &section.advice[0].cell;
        (
            *row,
            outcome.uncertainty_n,
            section.settings["tool.filament_count"].as_f64(),
        )
    };
    let tops: Vec<_> = advice.sections.iter().map(top).collect();
    assert_eq!(tops, [(2, 2.0, Some(1000.0)), (3, 2.0, Some(2000.0))]);
    let text = advice.text(WIDTH);
    assert!(
        text.contains("With N_f = 1000\n") && text.contains("With N_f = 2000\n"),
        "{text}"
    );
}

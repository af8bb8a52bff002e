//! Findings: statements about results that are not resolved or misleading, as values.
//!
//! A [`Rule`] judges one case. Its result for a contact, a brush or the cases of a study is a
//! [`Finding`]. The terminal, files and Python show the same finding. `bristle explain B003`
//! explains an `id`, `--ignore B003` silences it.

use bristle::model::metrics::Metrics;
use bristle::model::parameters::Parameter;
use bristle::model::settings::{Settings, Turns};
use bristle::simulation::Statistics;
use bristle_study::grid::{
    CaseResult, DEPTH, FORCE, Interaction, Study, TURNS, VELOCITY, equation,
};
use bristle_study::text::layout::Warning;
use serde::Serialize;

use crate::insight::rules::{BIAS, Judgement, RULES, Rule, TILT, left_out};

/// One case as rules see it.
#[derive(Clone, Copy)]
pub struct JudgedCase<'a> {
    /// Its settings, at the depth that was found if they state a force.
    pub settings: &'a Settings,
    /// The force in N that the settings state in place of a depth.
    pub asked_n: Option<f64>,
    /// Its result; `None` if it failed.
    pub outcome: Option<JudgedResult<'a>>,
}

/// The result of a case.
#[derive(Clone, Copy)]
pub struct JudgedResult<'a> {
    /// Its metrics.
    pub metrics: &'a Metrics,
    /// Statistics of its pass; `None` for a brush that is not a case of a study.
    pub statistics: Option<&'a Statistics>,
    /// Results of a brush beyond its metrics.
    pub interaction: Option<&'a Interaction>,
}

/// A rule that has found something.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// The number of the rule.
    pub id: &'static str,
    /// Severity: all findings are warnings.
    pub severity: &'static str,
    /// The column or the setting that was judged.
    pub quantity: &'static str,
    /// Its value in the case that is worst.
    pub value: f64,
    /// The limit there.
    pub limit: f64,
    /// Rows of `runs.csv` with this finding; empty for one contact or brush.
    pub rows: Vec<usize>,
    /// The finding in a sentence.
    pub statement: String,
    /// Remedy.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub help: Option<String>,
}

/// Returns the rule with an id; the case of its letter does not matter.
#[must_use]
pub fn rule(id: &str) -> Option<&'static Rule> {
    RULES
        .iter()
        .chain([&BIAS])
        .find(|rule| rule.id.eq_ignore_ascii_case(id))
}

impl Finding {
    /// Returns the finding as a warning.
    #[must_use]
    pub fn warning(&self) -> Warning {
        let warning = Warning::new(self.statement.clone()).with_id(self.id);
        match &self.help {
            Some(help) => warning.with_help(help.clone(), ""),
            None => warning,
        }
    }
}

/// Applies the rules to one contact or brush.
#[must_use]
pub fn judge_case(case: &JudgedCase<'_>) -> Vec<Finding> {
    let of_rule = |rule: &Rule| {
        let judgement = (rule.judge)(case)?;
        Some(found(rule, case, judgement, Vec::new(), String::new()))
    };
    RULES.iter().filter_map(of_rule).collect()
}

/// Applies the rules to the cases of a study. The worst case of each rule stands for all; the first
/// one among equals.
#[must_use]
pub fn judge_study(study: &Study, results: &[CaseResult]) -> Vec<Finding> {
    let settings: Vec<Settings> = results
        .iter()
        .enumerate()
        .map(|(case, result)| study.settings_found(case, result))
        .collect();
    let cases: Vec<JudgedCase<'_>> = settings
        .iter()
        .zip(results)
        .enumerate()
        .map(|(case, (settings, result))| JudgedCase {
            settings,
            asked_n: study.settings(case).process.tool_force_n,
            outcome: result.as_ref().ok().map(|summary| JudgedResult {
                metrics: &summary.metrics,
                statistics: Some(&summary.statistics),
                interaction: summary.brush.as_ref(),
            }),
        })
        .collect();
    let of_rule = |rule: &Rule| {
        let judged: Vec<(usize, Judgement)> = cases
            .iter()
            .enumerate()
            .filter_map(|(case, each)| Some((case, (rule.judge)(each)?)))
            .collect();
        let &(worst, judgement) = judged.iter().reduce(|worst, next| {
            if next.1.excess > worst.1.excess {
                next
            } else {
                worst
            }
        })?;
        let rows: Vec<usize> = judged.iter().map(|(case, _)| case + 1).collect();
        let cases_in_words = if results.len() == 1 {
            String::new()
        } else {
            let most = if rows.len() == 1 { "in" } else { "most in" };
            format!(
                "; {} of {} cases, {most} row {}",
                rows.len(),
                results.len(),
                worst + 1
            )
        };
        let mut finding = found(rule, &cases[worst], judgement, rows, cases_in_words);
        // A study that sweeps the tilt shows what it does.
        if rule.id == "B006" && study.sweep(TILT).is_some() {
            finding.help = None;
        }
        Some(finding)
    };
    RULES.iter().filter_map(of_rule).collect()
}

fn found(
    rule: &Rule,
    case: &JudgedCase<'_>,
    judgement: Judgement,
    rows: Vec<usize>,
    in_words: String,
) -> Finding {
    let Judgement { value, limit, .. } = judgement;
    Finding {
        id: rule.id,
        severity: "warning",
        quantity: rule.quantity,
        value,
        limit,
        statement: (rule.statement)(value, limit) + &in_words,
        help: (rule.help)(case, judgement, !rows.is_empty()),
        rows,
    }
}

/// Returns the finding about settings that were fitted with filaments alone, although they touch.
#[must_use]
pub fn bias_of_fit(settings: &Settings) -> Option<Finding> {
    let case = JudgedCase {
        settings,
        asked_n: None,
        outcome: None,
    };
    let judgement = (BIAS.judge)(&case)?;
    Some(found(&BIAS, &case, judgement, Vec::new(), String::new()))
}

/// Returns `true` if a case is laterally unstable; `false` for a failed one.
#[must_use]
pub fn is_unstable(result: &CaseResult) -> bool {
    result
        .as_ref()
        .is_ok_and(|summary| summary.metrics.laterally_unstable)
}

/// Returns the note of advice on cases in which a single pass leaves out much vibration. `told` has
/// the numbers of the cited cases, counted from 0.
pub(crate) fn vibrating_note(
    study: &Study,
    results: &[CaseResult],
    told: &[usize],
) -> Option<String> {
    let all: Vec<(usize, Judgement)> = told
        .iter()
        .filter_map(|&case| {
            let settings = study.settings_found(case, &results[case]);
            Some((case, left_out(&settings)?))
        })
        .collect();
    let (worst, judgement) = all.iter().reduce(|worst, next| {
        if next.1.value > worst.1.value {
            next
        } else {
            worst
        }
    })?;
    let cases = if told.len() == 1 { "case" } else { "cases" };
    Some(format!(
        "In {} of {} {cases} the filament comes back still vibrating, with up to {:.0} % of its vibration (row {}). Simulate \
         turn after turn with {TURNS} = \"{}\".",
        all.len(),
        told.len(),
        100.0 * judgement.value,
        worst + 1,
        Turns::STEADY
    ))
}

/// Returns velocity and depth of a case in words, or the force in place of the depth.
pub(crate) fn place(settings: &Settings) -> String {
    let shown =
        |path| Parameter::find(path).map(|parameter| equation(parameter, parameter.get(settings)));
    let second = if settings.process.tool_force_n.is_some() {
        FORCE
    } else {
        DEPTH
    };
    [VELOCITY, second]
        .into_iter()
        .filter_map(shown)
        .collect::<Vec<_>>()
        .join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::insight::rules::missing_brush;
    use crate::insight::testing::{brush, result};
    use bristle::model::settings::{BrushSettings, Ends, ToolKind, WorkpieceKind};
    use bristle_study::grid::Sweep;
    use bristle_study::input::document::Document;
    use bristle_study::text::columns;

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

    /// Largest number of words in a sentence of a message or of its explanation.
    const MAX_WORDS: usize = 25;

    /// Returns the paper's brush with so few filaments that they do not touch each other.
    fn sparse(velocity: f64) -> Settings {
        let mut settings = Settings::paper(velocity, 1e-3);
        settings.tool.filament_count = 1000.0;
        settings
    }

    fn told(settings: &Settings, asked_n: Option<f64>, metrics: &Metrics) -> Vec<Finding> {
        judge_case(&JudgedCase {
            settings,
            asked_n,
            outcome: Some(JudgedResult {
                metrics,
                statistics: None,
                interaction: None,
            }),
        })
    }

    fn ids(findings: &[Finding]) -> Vec<&str> {
        findings.iter().map(|finding| finding.id).collect()
    }

    #[test]
    fn rules_are_numbered_and_their_words_are_short() {
        assert!(RULES.is_sorted_by(|before, rule| before.id < rule.id));
        for rule in RULES.iter().chain([&BIAS]) {
            assert_short_sentences(rule.meaning);
        }
        assert!(rule("b003").is_some() && rule("b015").is_some() && rule("B999").is_none());
    }

    fn assert_short_sentences(text: &str) {
        for sentence in text.split_inclusive(". ") {
            let words = sentence.split_whitespace().count();
            assert!(words <= MAX_WORDS, "{words} words: {sentence}");
        }
    }

    /// Each value is just beyond, and just within, its limit.
    #[test]
    fn each_rule_finds_what_is_beyond_its_limit() {
        let edge = Document::parse(FILE, "case.toml")
            .and_then(|document| document.settings())
            .map(|mut settings| {
                settings.tool.filament_count = 1000.0;
                settings
            })
            .expect("settings");
        let mut cup = sparse(10.0);
        cup.tool.kind = ToolKind::Cup;
        let metrics = |change: fn(&mut Metrics)| {
            let mut metrics = Metrics {
                penetration_depth_m: 1e-3,
                ..Metrics::default()
            };
            change(&mut metrics);
            metrics
        };
        for (settings, asked_n, metrics, expected) in [
            (
                &edge,
                None,
                metrics(|own| own.max_edge_penetration_m = 0.11e-3),
                &["B004"][..],
            ),
            (
                &edge,
                None,
                metrics(|own| own.max_edge_penetration_m = 0.1e-3),
                &[],
            ),
            (
                &edge,
                None,
                metrics(|own| own.max_penetration_m = 0.06e-3),
                &["B003"],
            ),
            (
                &edge,
                None,
                metrics(|own| own.max_penetration_m = 0.05e-3),
                &[],
            ),
            (
                &cup,
                None,
                metrics(|own| own.contact_angle_rad = 1.0),
                &["B005"],
            ),
            (&edge, None, metrics(|own| own.contact_angle_rad = 1.0), &[]),
            (
                &edge,
                None,
                metrics(|own| own.unsteady_turns = true),
                &["B007"],
            ),
            (
                &edge,
                None,
                metrics(|own| {
                    (own.laterally_unstable, own.lateral_amplification) = (true, 101.0);
                }),
                &["B006"],
            ),
            (
                &edge,
                Some(166.0),
                metrics(|own| own.tool_contact_normal_force_n = 166.1),
                &[],
            ),
            (
                &edge,
                Some(10.0),
                metrics(|own| own.tool_contact_normal_force_n = 14.9),
                &["B012"],
            ),
            (
                &edge,
                Some(10.0),
                metrics(|own| {
                    own.penetration_depth_m = 0.9e-4;
                    own.tool_contact_normal_force_n = 10.0;
                }),
                &["B011"],
            ),
        ] {
            assert_eq!(ids(&told(settings, asked_n, &metrics)), expected);
        }
        let quiet = Metrics::default();
        assert_eq!(
            ids(&told(&Settings::paper(10.0, 1e-3), None, &quiet)),
            ["B002"]
        );
        assert_eq!(ids(&told(&sparse(30.0), None, &quiet)), ["B008"]);
        assert_eq!(ids(&told(&sparse(10.0), None, &quiet)), [""; 0]);
        let mut two = sparse(30.0);
        two.process.turns = Some(Turns::Count(2));
        assert_eq!(ids(&told(&two, None, &quiet)), [""; 0]);
    }

    /// `[brush]` is advised only where the checks accept it.
    #[test]
    fn a_brush_is_advised_where_it_can_be_simulated() {
        let packed = Settings::paper(10.0, 1e-3);
        let help = |settings: &Settings| {
            let [finding] = &told(settings, None, &Metrics::default())[..] else {
                panic!("one finding");
            };
            assert_eq!(finding.id, "B002");
            let brush = missing_brush(settings);
            assert!(finding.help.is_some() == brush.is_some());
            let bias = bias_of_fit(settings).expect("they touch");
            assert!(bias.help.is_some() == brush.is_some());
            let together = Settings {
                brush,
                ..settings.clone()
            };
            together.check().expect("settings");
            together.brush.map(|brush| brush.ends)
        };
        assert_eq!(help(&packed), Some(Ends::Periodic));
        let mut tilted = packed.clone();
        tilted.tool.tilt_rad = Some(0.05);
        assert_eq!(help(&tilted), Some(Ends::Free));
        let mut cup = packed.clone();
        cup.tool.kind = ToolKind::Cup;
        assert_eq!(help(&cup), None);
    }

    #[test]
    fn work_and_brushes_are_judged_too() {
        let settings = Settings {
            brush: Some(BrushSettings::default()),
            ..Settings::paper(10.0, 1e-3)
        };
        let statistics = Statistics {
            unresolved_steps: 7,
            ..Statistics::default()
        };
        let tolerance = settings.brush_or_default().tolerance;
        let interaction = Interaction {
            impulse_error_estimate: 3.1 * tolerance,
            energy_residual: 11.0 * tolerance,
            ..Interaction::default()
        };
        let found = judge_case(&JudgedCase {
            settings: &settings,
            asked_n: None,
            outcome: Some(JudgedResult {
                metrics: &Metrics::default(),
                statistics: Some(&statistics),
                interaction: Some(&interaction),
            }),
        });
        assert_eq!(ids(&found), ["B001", "B009", "B010"]);
    }

    #[test]
    fn a_soft_contact_is_told_with_a_stiffness_that_is_enough() {
        let metrics = Metrics {
            max_penetration_m: 0.1e-3,
            ..Metrics::default()
        };
        let found = told(&sparse(10.0), None, &metrics);
        let help = found[0].help.as_deref();
        assert_eq!(help, Some("under [contact]: stiffness_n_m = 4.0e5"));
    }

    #[test]
    fn a_study_tells_how_many_cases_and_the_worst() {
        let velocities = Parameter::find(VELOCITY).expect("it exists");
        let velocities = Sweep::list(velocities, vec![10.0, 30.0, 25.0, 20.0]).expect("right");
        let study = Study::new(sparse(10.0), vec![velocities]).expect("right");
        let failed = vec![Err("failed".to_owned()); 4];
        assert_eq!(judge_study(&study, &failed), []);
        let results = [Metrics::default(), Metrics::default(), Metrics::default()].map(result);
        let results = [results.as_slice(), &failed[..1]].concat();
        let found = judge_study(&study, &results);
        assert_eq!((ids(&found), &found[0].rows), (vec!["B008"], &vec![2, 3]));
        assert!(
            found[0]
                .statement
                .ends_with("leaves out; 2 of 4 cases, most in row 2"),
            "{}",
            found[0].statement
        );
        let note = vibrating_note(&study, &results, &[0, 1, 2, 3]).expect("they vibrate");
        assert!(
            note.starts_with("In 3 of 4 cases")
                && note.contains("up to 14 % of its vibration (row 2)"),
            "{note}"
        );
        assert_eq!(vibrating_note(&study, &results, &[0]), None);
    }

    #[test]
    fn only_frictionless_tubes_say_that_filaments_lean() {
        let mut tube = sparse(10.0);
        tube.workpiece.kind = WorkpieceKind::bore(0.175);
        let found = |tube: &Settings| {
            let tube = tube.at_depth(0.18 - 0.175);
            told(&tube, None, &Metrics::default())
        };
        assert_eq!(ids(&found(&tube)), ["B014"]);
        tube.contact.friction_coefficient = 0.3;
        assert_eq!(ids(&found(&tube)), [""; 0]);
    }

    /// Messages have at most three lines of 80 columns, and short sentences.
    #[test]
    fn findings_are_short() {
        let mut settings = Settings::paper(30.0, 1e-3);
        settings.tool.tilt_rad = Some(0.05);
        let of_study = |rule| (rule, "; 1000 of 1000 cases, most in row 1000");
        for (rule, in_words) in RULES.iter().map(of_study).chain([(&BIAS, "")]) {
            let judgement = Judgement {
                value: 0.123_456,
                limit: 0.111_111,
                excess: 1.1,
            };
            let case = JudgedCase {
                settings: &settings,
                asked_n: None,
                outcome: None,
            };
            let finding = found(rule, &case, judgement, vec![1], in_words.to_owned());
            assert_short_sentences(&finding.statement);
            assert_short_sentences(finding.help.as_deref().unwrap_or_default());
            let text = finding.warning().to_string();
            assert!(text.lines().count() <= 3, "{text}");
            assert!(text.lines().all(|line| columns(line) <= 80), "{text}");
        }
    }
}

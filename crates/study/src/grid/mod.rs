//! A study: one simulation for each point of a grid of settings.
//!
//! [`Sweep`] is one axis, over a [`Setting`] or over named [`StudyTool`]s, and [`Study`] the grid of
//! all axes. [`run_study`] simulates the cases, in lanes and threads. [`uncertainty`] samples the
//! tools of a case and has the band of their forces. [`Interaction`] compares a brush with one
//! filament alone. [`check`] has the change of a result that is computed more precisely.
//! [`PassRecorder`] keeps records of single passes; [`force_sensitivities`] change one setting at a
//! time.
//!
//! Journals are tied to the sources of this module, because these decide the content of a case.
//! Code that only reads, prints or advises is in other modules.

mod begun_case;
pub mod brush;
mod case;
pub mod check;
mod interaction;
mod queue;
mod recorder;
pub mod removal;
mod sampled_brush;
mod scheduler;
mod sensitivity;
mod setting;
mod shard;
mod study;
mod sweep;
mod tool;
pub mod uncertainty;

pub use case::{CaseResult, CaseSummary, tentative};
pub use interaction::{Interaction, turn_impulses};
pub use recorder::PassRecorder;
pub use sampled_brush::calibration_band;
pub use scheduler::{
    Resources, by_work, press_brush, run_study, simulate_cases, simulate_cases_with, thread_count,
    without_result, work,
};
pub use sensitivity::{ForceSensitivity, force_sensitivities};
pub use setting::{
    DEPTH, FORCE, FRICTION, OFFSET, SPEED, Setting, TOOL, TURNS, VELOCITY, equation,
};
pub use shard::Shard;
pub use study::{BRUSH, Study, StudyError};
pub use sweep::{
    MAX_CASES, MAX_TOOLS, SHORT_NAMES, Sweep, SweepError, SweepText, without_rounding_noise,
};
pub use tool::{StudyTool, ToolText};

/// SHA-256 of the sources of this module.
pub const SOURCES: &str = env!("BRISTLE_GRID_SOURCES");

#[cfg(test)]
mod tests {
    use std::io;
    use std::num::NonZeroUsize;
    use std::ops::ControlFlow;
    use std::sync::atomic::{AtomicUsize, Ordering};

    use bristle::model::metrics::Metrics;
    use bristle::model::parameters::Parameter;
    use bristle::model::settings::Settings;
    use bristle::simulation::Statistics;
    use bristle::simulation::{Job, Kind, Pass, Sampling, Simulation, Stop};
    use parking_lot::Mutex;

    use super::queue::complete_cases;
    use super::*;

    fn base() -> Settings {
        Settings::paper(10.0, 1e-3)
    }

    fn parameter(path: &str) -> &'static Parameter {
        Parameter::find(path).expect("the setting exists")
    }

    fn list(path: &str, values: &[f64]) -> Sweep {
        Sweep::list(parameter(path), values.to_vec()).expect("the values are right")
    }

    fn study(sweeps: Vec<Sweep>) -> Study {
        Study::new(base(), sweeps).expect("the study is right")
    }

    #[test]
    fn a_range_includes_its_end_and_has_clean_values() {
        let range = |path, start, stop, step| {
            Sweep::range(parameter(path), start, stop, step)
                .expect("the range is right")
                .values()
                .to_vec()
        };
        let depths = [
            0.0005, 0.001, 0.0015, 0.002, 0.0025, 0.003, 0.0035, 0.004, 0.0045, 0.005,
        ];
        assert_eq!(range(DEPTH, 0.5e-3, 5.0e-3, 0.5e-3), depths);
        assert_eq!(range(VELOCITY, 1.0, 0.1, -0.3), [1.0, 0.7, 0.4, 0.1]);
        assert_eq!(range(VELOCITY, 1.0, 2.0, 0.3), [1.0, 1.3, 1.6, 1.9]);
        assert_eq!(range(VELOCITY, 1.0, 1.0, 5.0), [1.0]);
    }

    #[test]
    fn wrong_ranges_are_refused() {
        let range =
            |start, stop, step| Sweep::range(parameter(VELOCITY), start, stop, step).map(|_| ());
        let not_finite = "start, stop and step must be finite numbers";
        let too_many = "more than 1000000 values: take a larger step";
        for (start, stop, step, expected) in [
            (1.0, 2.0, 0.0, "a step of 0.0 does not lead from 1.0 to 2.0"),
            (1.0, 1.0, 0.0, "a step of 0.0 does not lead from 1.0 to 1.0"),
            (
                1.0,
                2.0,
                -1.0,
                "a step of -1.0 does not lead from 1.0 to 2.0",
            ),
            (1.0, f64::NAN, 1.0, not_finite),
            (1.0, 2.0, f64::INFINITY, not_finite),
            (1.0, 2.0, 1e-6, too_many),
            (1.0, 1e300, 1e-300, too_many),
        ] {
            let error = range(start, stop, step).expect_err(expected);
            assert_eq!(error.to_string(), expected);
        }
        let segments = Sweep::range(parameter("filament.segments"), 1.0, 10.0, 1.5);
        assert_eq!(segments.expect_err("half a segment").index, Some(1));
    }

    #[test]
    fn velocity_changes_fastest_and_further_sweeps_slowest() {
        let study = study(vec![
            list(VELOCITY, &[5.0, 10.0]),
            list("contact.exponent", &[1.0, 1.5]),
            list(DEPTH, &[1e-3, 2e-3]),
            list("filament.segments", &[3.0, 4.0]),
        ]);
        let values = |case| study.values(case).collect::<Vec<_>>();
        assert_eq!(study.case_count(), 16);
        assert_eq!(values(0), [1.0, 3.0, 1e-3, 5.0]);
        assert_eq!(values(1), [1.0, 3.0, 1e-3, 10.0]);
        assert_eq!(values(2), [1.0, 3.0, 2e-3, 5.0]);
        assert_eq!(values(4), [1.0, 4.0, 1e-3, 5.0]);
        assert_eq!(values(15), [1.5, 4.0, 2e-3, 10.0]);
        let settings = study.settings(14);
        assert_eq!(settings.filament.segments, 4);
        assert_eq!(settings.process.brushing_velocity_m_s, 5.0);
    }

    #[test]
    fn studies_that_make_no_sense_are_refused() {
        let depth = list(DEPTH, &[1e-3, 0.05]);
        let error = Study::new(base(), vec![depth]).expect_err("deeper than the filament is long");
        assert!(matches!(error, StudyError::Case { case: 1, .. }));
        let twice = vec![list(DEPTH, &[1e-3]), list(DEPTH, &[2e-3])];
        let error = Study::new(base(), twice).expect_err("swept twice");
        assert_eq!(error, StudyError::SweptTwice(DEPTH));
        let thousand =
            |path| Sweep::range(parameter(path), 1.0, 1001.0, 1.0).expect("a long range");
        let many = vec![thousand(VELOCITY), thousand("filament.density_kg_m3")];
        let error = Study::new(base(), many).expect_err("too many cases");
        assert_eq!(error, StudyError::TooManyCases);
        let radius = list("workpiece.radius_m", &[0.05, 0.1]);
        let error = Study::new(base(), vec![radius]).expect_err("a plane has no radius");
        assert!(
            error
                .to_string()
                .contains("`workpiece.radius_m` is 0.05, but must be left out"),
            "{error}"
        );
    }

    #[test]
    fn a_study_without_names_compares_no_tools() {
        let plain = study(vec![list(VELOCITY, &[5.0])]);
        assert!(plain.tools().is_empty() && plain.tool(0).is_none());
    }

    #[test]
    fn tools_have_names_that_differ() {
        let tool = |name: &str| StudyTool {
            name: name.to_owned(),
            settings: base(),
            held: Vec::new(),
        };
        let refused = |names: &[&str]| {
            let tools = names.iter().map(|name| tool(name)).collect();
            Study::of_tools(tools, vec![list(VELOCITY, &[5.0])]).expect_err("no names of tools")
        };
        for name in ["", " a", "a ", "=1", "a\nb", "a\u{202e}", &"a".repeat(41)] {
            assert_eq!(
                refused(&["fine", name]),
                StudyError::ToolName(name.to_owned())
            );
        }
        for (name, other) in [("a b", "A_b"), ("a,b", "a;b"), ("fine", "fine")] {
            assert!(
                matches!(refused(&[other, name]), StudyError::ToolsAlike { .. }),
                "{name}"
            );
        }
    }

    /// Simulates the cases without a result by `simulate`.
    fn complete(
        study: &Study,
        threads: Option<NonZeroUsize>,
        results: &mut [Option<CaseResult>],
        on_case_done: impl Fn(usize, &CaseResult) -> ControlFlow<()> + Sync,
        simulate: impl Fn(
            &dyn Fn(Option<Kind>) -> Option<Job>,
            &dyn Fn(usize, Result<Simulation, &'static str>),
        ) + Sync,
    ) -> io::Result<()> {
        let cases = without_result(study, results);
        let results = Mutex::new(results);
        let done = |case: usize, result| {
            let flow = on_case_done(case, &result);
            results.lock()[case] = Some(result);
            flow
        };
        complete_cases(study, &cases, threads, |_, _| {}, done, simulate)
    }

    #[test]
    fn a_failed_case_does_not_stop_the_others() {
        let velocities: Vec<f64> = (1..=20).map(f64::from).collect();
        let study = study(vec![list(VELOCITY, &velocities)]);
        let done = AtomicUsize::new(0);
        let simulate =
            |take: &dyn Fn(Option<Kind>) -> Option<Job>,
             report: &dyn Fn(usize, Result<Simulation, &'static str>)| {
                while let Some(Job { number, pass }) = take(None) {
                    let velocity = pass.nominal().brushing_velocity;
                    report(
                        number,
                        if velocity == 7.0 {
                            Err("seven")
                        } else {
                            Ok(simulation(velocity))
                        },
                    );
                }
            };
        let on_case_done = |number: usize, result: &CaseResult| {
            assert_eq!(result.is_err(), number == 6);
            done.fetch_add(1, Ordering::Relaxed);
            ControlFlow::Continue(())
        };
        let mut results = vec![None; 20];
        complete(
            &study,
            NonZeroUsize::new(3),
            &mut results,
            on_case_done,
            simulate,
        )
        .expect("the threads start");
        assert_eq!(done.into_inner(), 20);
        for (velocity, result) in velocities.into_iter().zip(results) {
            match result.expect("every case is done") {
                Ok(summary) => assert_eq!(summary.metrics.contact_time_s, velocity),
                Err(message) => assert_eq!((velocity, message.as_str()), (7.0, "seven")),
            }
        }
    }

    #[test]
    fn only_what_is_missing_is_simulated_and_a_break_starts_no_further_case() {
        let velocities: Vec<f64> = (1..=20).map(f64::from).collect();
        let study = study(vec![list(VELOCITY, &velocities)]);
        let simulate =
            |take: &dyn Fn(Option<Kind>) -> Option<Job>,
             report: &dyn Fn(usize, Result<Simulation, &'static str>)| {
                while let Some(Job { number, pass }) = take(None) {
                    assert!(number < 20, "each case has one pass");
                    report(number, Ok(simulation(pass.nominal().brushing_velocity)));
                }
            };
        let mut results = vec![None; 20];
        results[..5].fill(Some(Err("earlier".to_owned())));
        let done = AtomicUsize::new(0);
        let three = |_: usize, _: &CaseResult| {
            if done.fetch_add(1, Ordering::Relaxed) < 2 {
                ControlFlow::Continue(())
            } else {
                ControlFlow::Break(())
            }
        };
        complete(&study, NonZeroUsize::new(1), &mut results, three, simulate)
            .expect("there is one thread");
        assert_eq!(results.iter().flatten().count(), 8);
        assert!(
            results[..5]
                .iter()
                .all(|result| *result == Some(Err("earlier".to_owned())))
        );

        let all = |_: usize, _: &CaseResult| ControlFlow::Continue(());
        complete(&study, NonZeroUsize::new(2), &mut results, all, simulate)
            .expect("the threads start");
        assert!(results.iter().all(Option::is_some));
        complete(
            &study,
            None,
            &mut results,
            |_, _| unreachable!("nothing is left"),
            simulate,
        )
        .expect("nothing is to be done");
    }

    #[test]
    fn cases_that_are_stopped_have_no_result() {
        let study = study(vec![list(VELOCITY, &[5.0, 10.0, 20.0])]);
        let (stop, results) = (Stop::default(), Mutex::new(Vec::new()));
        let done = |_: usize, result: CaseResult| {
            stop.request();
            results.lock().push(result);
            ControlFlow::Continue(())
        };
        let one = NonZeroUsize::new(1);
        simulate_cases(
            &study,
            &[0, 1, 2],
            one,
            &stop,
            Sampling::default(),
            |_, _| {},
            done,
        )
        .expect("there is one thread");
        let results = results.into_inner();
        assert!(results.len() == 1 && results[0].is_ok());
    }

    #[test]
    fn cases_of_one_kind_are_taken_together_and_the_longest_first() {
        let study = study(vec![
            list("filament.segments", &[3.0, 4.0]),
            list("contact.friction_coefficient", &[0.0, 0.2]),
            list(VELOCITY, &[5.0, 20.0, 10.0]),
        ]);
        let mut order = by_work(&study, &Vec::from_iter(0..12));
        let settings: Vec<Settings> = order.iter().map(|&case| study.settings(case)).collect();
        for group in settings.chunks(3) {
            assert!(
                group
                    .iter()
                    .all(|settings| Kind::of(settings) == Kind::of(&group[0]))
            );
            let velocities = group
                .iter()
                .map(|settings| settings.process.brushing_velocity_m_s);
            assert_eq!(velocities.collect::<Vec<_>>(), [5.0, 10.0, 20.0]);
        }
        order.sort_unstable();
        assert_eq!(order, (0..12).collect::<Vec<_>>());
    }

    #[test]
    fn more_segments_take_more_work() {
        let study = study(vec![list("filament.segments", &[3.0, 4.0])]);
        assert!(work(&study, 1) > work(&study, 0));
    }

    #[test]
    fn passes_that_are_made_elsewhere_are_those_of_the_cases() {
        let mut scattering = base();
        (
            scattering.uncertainty.length_std_m,
            scattering.uncertainty.samples,
        ) = (1e-3, 64);
        scattering.filament.segments = 3;
        let study = Study::new(scattering, vec![list(VELOCITY, &[5.0, 10.0, 20.0])])
            .expect("the study is right");
        let study = study.checked();
        let results = Mutex::new(vec![None; 3]);
        let keep = |case: usize, result: CaseResult| {
            results.lock()[case] = Some(result);
            ControlFlow::Continue(())
        };
        let pass_of = |settings: &Settings| match settings.process.brushing_velocity_m_s {
            20.0 => Err("no pass"),
            _ => Ok(Pass::new(settings)),
        };
        simulate_cases_with(&study, &[0, 1, 2], None, &Stop::default(), pass_of, keep)
            .expect("the threads start");
        let mut expected = run_study(&study, None, || ()).expect("the threads start");
        expected[2] = Err("no pass".to_owned());
        let results: Option<Vec<CaseResult>> = results.into_inner().into_iter().collect();
        assert_eq!(results, Some(expected));
    }

    fn simulation(contact_time_s: f64) -> Simulation {
        Simulation {
            metrics: Metrics {
                contact_time_s,
                ..Metrics::default()
            },
            turn_contact_normal_impulses_n_s: vec![0.0],
            end_time_s: 1.0,
            statistics: Statistics::default(),
            history: Vec::new(),
            shapes: Vec::new(),
            profile: Vec::new(),
            positions: Vec::new(),
        }
    }
}

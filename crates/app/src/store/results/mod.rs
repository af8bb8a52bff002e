//! Saved results that describe themselves: `study.json` with `runs.csv`, `case.json` with
//! `history.csv`.
//!
//! This module writes studies, settings and tables as text and reads them back. Reading returns the
//! same numbers to the bit, or an error that states where the text is wrong. The program handles
//! the files.

mod brush;
mod runs;
mod saved;
mod tables;

pub use brush::{
    MOMENT, PAIR, PLACE, REST, read_brush_history, read_contacts, read_filaments, read_interaction,
    write_brush_history, write_brush_metrics, write_contacts, write_filaments,
};
pub use runs::{FIXED_COLUMNS, read_runs, run_columns, run_rows, write_runs};
pub use saved::{
    BuildOrigin, FileHashes, SavedCase, SavedStudy, case_text, read_case, read_study, study_text,
    study_text_from,
};
pub use tables::{
    TableCell, absent_from, cells, keys, read_history, read_profile, read_shapes,
    read_turn_impulses, write_edge_work, write_history, write_metrics, write_positions,
    write_profile, write_removal_rows, write_shapes,
};

#[cfg(test)]
mod tests {
    use std::io;

    use bristle::equations::FINGERPRINT;
    use bristle::model::settings::Settings;

    use super::*;
    use crate::store::digest::digest;
    use crate::testing::brush;
    use bristle::model::metrics::Metrics;
    use bristle::simulation::{
        AtPlace, Sampling, Simulation, simulate_with, simulate_with_history,
    };
    use bristle::tool::Place;
    use bristle_study::grid::{CaseResult, Study, run_study};
    use bristle_study::input::document::Document;
    use bristle_study::input::table::{AGAIN, Source};

    const FILE: &str = concat!(
        brush!(3),
        "
        [solver]
        relative_tolerance = 1e-3
        [process]
        brushing_velocity_m_s = 10.0
        penetration_depth_m = 1.0e-3
        [study]
        \"contact.stiffness_n_m\" = [1e300, 1e5]
        penetration_depth_m = [3e-3, 0.1e-2]
        brushing_velocity_m_s = { start = 10.1, stop = 10.4, step = 0.1 }
        "
    );

    /// Returns the bytes written to memory, as text.
    fn text(write: impl FnOnce(&mut Vec<u8>) -> io::Result<()>) -> String {
        let mut text = Vec::new();
        write(&mut text).expect("a table");
        String::from_utf8(text).expect("text")
    }

    fn settings() -> Settings {
        Document::parse(FILE, "case.toml")
            .and_then(|document| document.settings())
            .expect("settings")
    }

    fn texts(file: &str) -> (Study, Vec<CaseResult>, String, String) {
        let study = Document::parse(file, "case.toml")
            .and_then(|document| document.study())
            .expect("a study");
        let results = run_study(&study, None, || {}).expect("threads");
        let runs = text(|out| write_runs(out, &study, &results));
        let saved = study_text(&study, runs.as_bytes(), false);
        (study, results, saved, runs)
    }

    #[test]
    fn what_was_written_is_read_to_the_bit() {
        let (study, mut results, saved, runs) = texts(FILE);
        let read = read_study(&saved, "study.json").expect("a study");
        assert_eq!(
            study_text(&read.study, runs.as_bytes(), read.measured),
            saved
        );
        assert_eq!(read.origin, BuildOrigin::here());
        assert_eq!(read.origin.equations, FINGERPRINT);
        for case in 0..study.case_count() {
            assert_eq!(read.study.settings(case), study.settings(case));
        }
        assert!(results[..8].iter().all(Result::is_err) && results[8..].iter().all(Result::is_ok));
        // This number is not written to files.
        results
            .iter_mut()
            .flatten()
            .for_each(|summary| summary.statistics.chart_changes = 0);
        assert_eq!(read_runs(&runs, "runs.csv", &read), Ok(results));
    }

    /// Rows do not reveal other settings if the sweeps are equal. A crash between writing the two
    /// files leaves such a pair.
    #[test]
    fn rows_of_other_settings_are_refused() {
        let (_, _, saved, _) = texts(FILE);
        let (_, _, _, runs) = texts(&FILE.replace("length_m = 0.040", "length_m = 0.041"));
        let study = read_study(&saved, "study.json").expect("a study");
        let error = read_runs(&runs, "runs.csv", &study)
            .expect_err("rows of another study")
            .to_string();
        let expected = "runs.csv:1: study.json does not belong to these results\n   = help: ";
        assert_eq!(error, format!("{expected}{AGAIN}"));
    }

    #[test]
    fn a_history_is_read_to_the_bit() {
        let settings = settings();
        let history = simulate_with_history(&settings, 50)
            .expect("a pass")
            .history;
        let text = text(|out| write_history(out, &history));
        assert_eq!(read_history(&text, "history.csv"), Ok(history));
        let files = FileHashes::from([("history.csv".to_owned(), digest(text.as_bytes()))]);
        let case = read_case(&case_text(&settings, &files), "case.json").expect("a case");
        assert_eq!(case.settings, settings);
        assert_eq!(case.check("history.csv", &text, "history.csv"), Ok(()));
        // Every row is as valid as before.
        let other = text.replacen("\n0.0,", "\n-0.0,", 1);
        for (file, text) in [("history.csv", &other), ("metrics.json", &text)] {
            let error = case
                .check(file, text, file)
                .expect_err("not of this case")
                .to_string();
            assert!(
                error.contains("case.json does not belong to these results"),
                "{error}"
            );
        }
        let error = read_history(&text.replacen(",0.0,", ",none,", 1), "history.csv")
            .expect_err("no number");
        assert_eq!((error.line, error.column.is_some()), (2, true), "{error}");
    }

    #[test]
    fn profiles_and_shapes_are_read_to_the_bit() {
        let sampling = Sampling {
            shapes: 7,
            profile: true,
            ..Sampling::default()
        };
        let Simulation {
            profile, shapes, ..
        } = simulate_with(&settings(), sampling).expect("a pass");
        // Also without a cell, and without a shape.
        for profile in [profile, Vec::new()] {
            assert_eq!(
                read_profile(&text(|out| write_profile(out, &profile)), "profile.csv"),
                Ok(profile)
            );
        }
        for shapes in [shapes, Vec::new()] {
            assert_eq!(
                read_shapes(&text(|out| write_shapes(out, &shapes)), "shapes.csv"),
                Ok(shapes)
            );
        }
    }

    #[test]
    fn positions_have_one_row_per_filament_along_the_trim() {
        let mut settings = settings();
        (settings.tool.tilt_rad, settings.tool.positions) = (Some(0.02), Some(3));
        let simulation = simulate_with(&settings, Sampling::default()).expect("a pass");
        let text = text(|out| write_positions(out, &simulation.positions));
        let source = Source {
            name: "positions.csv",
            text: &text,
        };
        let table = source.table(AGAIN).expect("a table");
        let place = table
            .columns(&["position_m", "weight"])
            .expect("the columns of the place");
        let metrics = table
            .columns(&keys::<Metrics>())
            .expect("the columns of the metrics");
        assert_eq!(table.headings().len(), place.len() + metrics.len());
        assert_eq!(table.rows().len(), 3);
        for (
            row,
            AtPlace {
                place: Place { s, weight },
                metrics: expected,
            },
        ) in table.rows().iter().zip(&simulation.positions)
        {
            assert_eq!([0, 1].map(|k| row[place[k]].parse()), [Ok(*s), Ok(*weight)]);
            assert_eq!(table.read::<Metrics>(row, &metrics).as_ref(), Ok(expected));
        }
        let mean: f64 = simulation
            .positions
            .iter()
            .map(|at| at.place.weight * at.metrics.tool_contact_normal_force_n)
            .sum();
        assert!((mean / simulation.metrics.tool_contact_normal_force_n - 1.0).abs() < 1e-12);
    }

    #[test]
    fn damaged_results_are_refused_with_their_place() {
        let (_, _, saved, runs) = texts(FILE);
        let study_error = |old: &str, new: &str| {
            assert!(saved.contains(old), "{old}");
            read_study(&saved.replacen(old, new, 1), "study.json")
                .expect_err(new)
                .to_string()
        };
        assert!(study_error("\"format\": 8", "\"format\": 1").contains("use the version"));
        assert!(
            study_error("\"format\": 8", "\"format\": two").starts_with("study.json:2, column")
        );
        assert!(
            study_error("contact.stiffness_n_m", "contact.stifness_n_m").contains("no setting")
        );
        assert!(study_error("0.04,", "-0.04,").contains("filament.length_m"));
        assert!(study_error("\"axes\"", "\"exes\"").contains("axes"));
        assert!(study_error("\"runs_sha256\"", "\"runs\"").contains("runs_sha256"));
        assert!(study_error("0.04,", "0.05,").contains("has changed"));
        assert!(study_error("10.3", "10.35").contains("has changed"));
        assert!(study_error("\"measured\": false", "\"measured\": true").contains("has changed"));

        let study = read_study(&saved, "study.json").expect("a study");
        let error = |text: &str| {
            read_runs(text, "runs.csv", &study)
                .expect_err("damaged")
                .to_string()
        };
        assert!(error("").contains("empty"));
        assert!(
            error(&runs.replacen(",contact_time_s", ",contact_time", 1))
                .contains("no column `contact_time_s`")
        );
        let last = runs.trim_end().rfind('\n').expect("rows");
        assert!(error(&runs[..=last]).contains("15 rows"));
        assert!(
            error(&runs.replacen("\n10.2,", "\n10.25,", 1))
                .starts_with("runs.csv:3, column brushing_velocity_m_s")
        );
        let broken = error(&runs.replacen(",ok\n", ",0,ok\n", 1));
        assert!(broken.starts_with("runs.csv:10"), "{broken}");
        let cells: Vec<&str> = runs
            .lines()
            .nth(9)
            .expect("a good row")
            .split(',')
            .collect();
        let not_finite = runs.replacen(cells[6], "NaN", 1);
        assert!(
            error(&not_finite).contains("column contact_angle_rad")
                || error(&not_finite).contains("`NaN`")
        );
    }
}

//! Saved results of a study, read in this process. What is read is what was written.

use bristle_grid::{CaseResult, Study};
use bristle_insight::advice::{Limits as AdviceLimits, advise};
use bristle_store::results::{read_runs, read_study, study_text, write_runs};
use bristle_text::layout::WIDTH;
use fastrand::Rng;

use super::{STUDY, change_table, change_text, simulated};
use crate::runner::{Mutant, Target, Verdict};
use crate::tree::JSON;

/// Saved results: `study.json` and `runs.csv`.
pub struct Results {
    study: Study,
    results: Vec<CaseResult>,
    /// The files, and those of a similar study.
    texts: [[String; 2]; 2],
}

/// `study.json` and `runs.csv` of a study.
pub fn saved(study: &Study, results: &[CaseResult]) -> [String; 2] {
    let mut runs = Vec::new();
    write_runs(&mut runs, study, results).expect("memory takes what is written to it");
    [
        study_text(study, &runs, false),
        String::from_utf8(runs).expect("a table is text"),
    ]
}

impl Results {
    pub fn new() -> Self {
        Self::of(STUDY)
    }

    /// The results of the study in a file.
    pub fn of(file: &str) -> Self {
        let (study, mut results) = simulated(file);
        let (other, other_results) = simulated(&file.replace("0.040", "0.041"));
        let texts = [saved(&study, &results), saved(&other, &other_results)];
        // This number is not written to files.
        results
            .iter_mut()
            .flatten()
            .for_each(|summary| summary.statistics.chart_changes = 0);
        Self {
            study,
            results,
            texts,
        }
    }
}

impl Target for Results {
    fn name(&self) -> &'static str {
        "results"
    }

    fn count(&self) -> usize {
        4_000
    }

    fn originals(&self) -> Vec<Mutant> {
        vec![pair("", self.texts[0].clone().map(String::into_bytes))]
    }

    fn mutant(&self, random: &mut Rng) -> Mutant {
        let [[study, runs], [other_study, other_runs]] = &self.texts;
        match random.u8(..20) {
            0 => pair(
                "runs of another",
                [study.clone().into_bytes(), other_runs.clone().into_bytes()],
            ),
            1 => pair(
                "settings of another",
                [other_study.clone().into_bytes(), runs.clone().into_bytes()],
            ),
            2..10 => {
                let (change, bytes) = change_table(runs, random);
                pair(change, [study.clone().into_bytes(), bytes])
            }
            _ => {
                let (change, bytes) = change_text(study, other_study, &JSON, random);
                pair(change, [bytes, runs.clone().into_bytes()])
            }
        }
    }

    fn check(&self, mutant: &Mutant, _: &mut Rng) -> Verdict {
        let saved = read_study(&mutant.text(0), "study.json")?;
        let results = read_runs(&mutant.text(1), "runs.csv", &saved)?;
        assert_eq!(results, self.results);
        let states = |study: &Study| study_text(study, b"", false);
        assert_eq!(
            states(&saved.study),
            states(&self.study),
            "the settings are not those of the results"
        );
        let limits = AdviceLimits {
            target_force_n: Some(100.0),
            ..AdviceLimits::default()
        };
        let text = advise(&saved.study, &results, limits)?.text(WIDTH);
        assert!(!text.contains("NaN") && !text.contains("inf "), "{text}");
        Ok(())
    }
}

fn pair(change: &'static str, [study, runs]: [Vec<u8>; 2]) -> Mutant {
    Mutant {
        change,
        files: vec![
            ("study.json".to_owned(), study),
            ("runs.csv".to_owned(), runs),
        ],
        ..Mutant::default()
    }
}

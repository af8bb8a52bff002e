//! Journals of a study, read in this process. A result read from a damaged journal is the one that
//! was written.

use bristle_grid::{CaseResult, Study};
use bristle_store::journal::Journal;
use fastrand::Rng;

use super::{STUDY, change_bytes, simulated};
use crate::runner::{Mutant, Target, Verdict};

/// Journals.
pub struct Journaled {
    study: Study,
    results: Vec<CaseResult>,
    journal: Journal,
    /// A complete journal, and that of a similar study.
    texts: [String; 2],
}

/// The complete journal of a study.
pub fn written(study: &Study, results: &[CaseResult]) -> String {
    let journal = Journal::new(study);
    let lines = results
        .iter()
        .enumerate()
        .map(|(case, result)| journal.entry(case, result));
    journal.header().to_owned() + &lines.collect::<String>()
}

impl Journaled {
    pub fn new() -> Self {
        Self::of(STUDY)
    }

    /// The journal of the study in a file.
    pub fn of(file: &str) -> Self {
        let (study, results) = simulated(file);
        let (other, other_results) = simulated(&file.replace("0.040", "0.041"));
        let texts = [written(&study, &results), written(&other, &other_results)];
        Self {
            journal: Journal::new(&study),
            study,
            results,
            texts,
        }
    }
}

impl Target for Journaled {
    fn name(&self) -> &'static str {
        "journal"
    }

    fn count(&self) -> usize {
        10_000
    }

    fn originals(&self) -> Vec<Mutant> {
        vec![Mutant::file("", "journal.jsonl", self.texts[0].as_str())]
    }

    fn mutant(&self, random: &mut Rng) -> Mutant {
        let mut bytes = self.texts[0].clone().into_bytes();
        let other = self.texts[random.usize(..2)].as_bytes();
        let change = if random.u8(..10) == 0 {
            exchange_lines(&mut bytes, other, random);
            "foreign lines"
        } else {
            change_bytes(&mut bytes, other, random)
        };
        Mutant::file(change, "journal.jsonl", bytes)
    }

    fn check(&self, mutant: &Mutant, _: &mut Rng) -> Verdict {
        let bytes = mutant.files[0].1.as_slice();
        let contents = self.journal.read(&self.study, bytes)?;
        assert_eq!(contents.intact + contents.torn, bytes.len() as u64);
        for (case, result) in contents.results.iter().enumerate() {
            if let Some(result) = result {
                assert_eq!(result, &self.results[case], "case {case}");
            }
        }
        // What is kept after the torn end is cut off is read as before.
        let again = self
            .journal
            .read(&self.study, &bytes[..contents.intact as usize])
            .expect("the intact part is intact");
        assert_eq!(
            (&again.results, again.intact, again.torn),
            (&contents.results, contents.intact, 0)
        );
        Ok(())
    }
}

/// Replaces lines by those of another journal at the same places.
fn exchange_lines(bytes: &mut Vec<u8>, other: &[u8], random: &mut Rng) {
    let ours = bytes.split_inclusive(|&byte| byte == b'\n');
    let theirs = other.split_inclusive(|&byte| byte == b'\n');
    *bytes = ours
        .zip(theirs)
        .map(|(our, their)| if random.u8(..4) == 0 { their } else { our })
        .collect::<Vec<_>>()
        .concat();
}

//! Saved results of one contact, read in this process.

use bristle::model::settings::Settings;
use bristle::simulation::{Sample, simulate_with_history};
use bristle_study::digest::digest;
use bristle_study::document::Document;
use bristle_study::results::{FileHashes, case_text, read_case, read_history, write_history};
use fastrand::Rng;

use super::{STUDY, change_table, change_text};
use crate::runner::{Mutant, Target, Verdict};
use crate::tree::JSON;

const HISTORY: &str = "history.csv";

/// Saved results: `case.json` and `history.csv`.
pub struct Contact {
    texts: [String; 2],
    settings: Settings,
    history: Vec<Sample>,
}

/// `case.json` and `history.csv` of a contact.
pub fn saved(settings: &Settings) -> [String; 2] {
    let simulation = simulate_with_history(settings, 20).expect("a quick pass");
    let history = written(&simulation.history);
    let files = FileHashes::from([(HISTORY.to_owned(), digest(history.as_bytes()))]);
    [case_text(settings, &files), history]
}

fn written(history: &[Sample]) -> String {
    let mut text = Vec::new();
    write_history(&mut text, history).expect("memory takes what is written to it");
    String::from_utf8(text).expect("a table is text")
}

impl Contact {
    pub fn new() -> Self {
        let settings = Document::parse(STUDY, "").and_then(|document| document.settings()).expect("the file is right");
        let texts = saved(&settings);
        let history = read_history(&texts[1], HISTORY).expect("it was written");
        Self { texts, settings, history }
    }
}

impl Target for Contact {
    fn name(&self) -> &'static str {
        "contact"
    }

    fn count(&self) -> usize {
        4_000
    }

    fn originals(&self) -> Vec<Mutant> {
        vec![pair("", self.texts.clone().map(String::into_bytes))]
    }

    fn mutant(&self, random: &mut Rng) -> Mutant {
        let [case, history] = &self.texts;
        if random.bool() {
            let (change, bytes) = change_table(history, random);
            pair(change, [case.clone().into_bytes(), bytes])
        } else {
            let (change, bytes) = change_text(case, history, &JSON, random);
            pair(change, [bytes, history.clone().into_bytes()])
        }
    }

    fn check(&self, mutant: &Mutant, _: &mut Rng) -> Verdict {
        let case = match read_case(&mutant.text(0), "case.json") {
            Ok(case) => case,
            Err(error) => return Verdict::Refused(error.to_string()),
        };
        let text = mutant.text(1);
        let read =
            read_history(&text, HISTORY).and_then(|history| case.check(HISTORY, &text, HISTORY).map(|()| history));
        let history = match read {
            Ok(history) => history,
            Err(error) => return Verdict::Refused(error.to_string()),
        };
        assert_eq!((&case.settings, &history), (&self.settings, &self.history));
        Verdict::Accepted
    }
}

fn pair(change: &'static str, [case, history]: [Vec<u8>; 2]) -> Mutant {
    Mutant {
        change,
        files: vec![("case.json".to_owned(), case), ("history.csv".to_owned(), history)],
        ..Mutant::default()
    }
}

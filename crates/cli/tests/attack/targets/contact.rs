//! Saved results of one contact, read in this process.

use std::io;

use bristle::model::settings::Settings;
use bristle::simulation::{Sampling, Simulation, simulate_with};
use bristle_study::digest::digest;
use bristle_study::document::Document;
use bristle_study::results::{
    DataError, FileHashes, case_text, read_case, read_history, read_profile, read_shapes, write_history, write_profile,
    write_shapes,
};
use fastrand::Rng;

use super::{STUDY, change_table, change_text};
use crate::runner::{Mutant, Target, Verdict};
use crate::tree::JSON;

/// Names of the tables of a contact.
const TABLES: [&str; 3] = ["history.csv", "profile.csv", "shapes.csv"];

/// Saved results: `case.json` and the tables of a contact.
pub struct Contact {
    texts: [String; 4],
    settings: Settings,
    simulation: Simulation,
}

/// The files of a contact that are read again: `case.json`, then the [`TABLES`].
pub fn saved(settings: &Settings) -> [String; 4] {
    let [history, profile, shapes] = written(&simulated(settings));
    let tables = TABLES.iter().zip([&history, &profile, &shapes]);
    let files: FileHashes = tables.map(|(name, text)| ((*name).to_owned(), digest(text.as_bytes()))).collect();
    [case_text(settings, &files), history, profile, shapes]
}

fn simulated(settings: &Settings) -> Simulation {
    let sampling = Sampling { samples: 20, shapes: 5, profile: true, ..Sampling::default() };
    simulate_with(settings, sampling).expect("a quick pass")
}

/// The texts of the tables.
fn written(Simulation { history, profile, shapes, .. }: &Simulation) -> [String; 3] {
    let text = |write: &dyn Fn(&mut Vec<u8>) -> io::Result<()>| {
        let mut text = Vec::new();
        write(&mut text).expect("memory takes what is written to it");
        String::from_utf8(text).expect("a table is text")
    };
    [
        text(&|out| write_history(out, history)),
        text(&|out| write_profile(out, profile)),
        text(&|out| write_shapes(out, shapes)),
    ]
}

impl Contact {
    pub fn new() -> Self {
        let settings = Document::parse(STUDY, "").and_then(|document| document.settings()).expect("the file is right");
        Self { texts: saved(&settings), simulation: simulated(&settings), settings }
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
        vec![files("", self.texts.clone().map(String::into_bytes))]
    }

    fn mutant(&self, random: &mut Rng) -> Mutant {
        let mut bytes = self.texts.clone().map(String::into_bytes);
        let table = random.usize(1..self.texts.len());
        let (target, (change, changed)) = if random.bool() {
            (table, change_table(&self.texts[table], random))
        } else {
            (0, change_text(&self.texts[0], &self.texts[table], &JSON, random))
        };
        bytes[target] = changed;
        files(change, bytes)
    }

    fn check(&self, mutant: &Mutant, _: &mut Rng) -> Verdict {
        let case = match read_case(&mutant.text(0), "case.json") {
            Ok(case) => case,
            Err(error) => return Verdict::Refused(error.to_string()),
        };
        let texts = [1, 2, 3].map(|file| mutant.text(file));
        let refused = |error: DataError| Verdict::Refused(error.to_string());
        let check = |table: usize| case.check(TABLES[table], &texts[table], TABLES[table]);
        let history = match read_history(&texts[0], TABLES[0]).and_then(|read| check(0).map(|()| read)) {
            Ok(history) => history,
            Err(error) => return refused(error),
        };
        let profile = match read_profile(&texts[1], TABLES[1]).and_then(|read| check(1).map(|()| read)) {
            Ok(profile) => profile,
            Err(error) => return refused(error),
        };
        let shapes = match read_shapes(&texts[2], TABLES[2]).and_then(|read| check(2).map(|()| read)) {
            Ok(shapes) => shapes,
            Err(error) => return refused(error),
        };
        let expected = &self.simulation;
        assert_eq!(
            (&case.settings, &history, &profile, &shapes),
            (&self.settings, &expected.history, &expected.profile, &expected.shapes)
        );
        Verdict::Accepted
    }
}

fn files(change: &'static str, texts: [Vec<u8>; 4]) -> Mutant {
    let names = ["case.json"].into_iter().chain(TABLES).map(str::to_owned);
    Mutant { change, files: names.zip(texts).collect(), ..Mutant::default() }
}

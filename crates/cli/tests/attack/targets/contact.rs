//! Saved results of one contact, read in this process.

use std::io;

use bristle::model::settings::Settings;
use bristle::simulation::{Sampling, Simulation, simulate_with};
use bristle_input::document::Document;
use bristle_store::digest::digest;

use bristle_store::results::{
    FileHashes, case_text, read_case, read_history, read_profile, read_shapes, read_turn_impulses,
    write_history, write_metrics, write_profile, write_shapes,
};
use fastrand::Rng;

use super::{STUDY, change_table, change_text};
use crate::runner::{Mutant, Target, Verdict};
use crate::tree::JSON;

/// Results of a contact: the metrics, then its tables.
const RESULTS: [&str; 4] = ["metrics.json", "history.csv", "profile.csv", "shapes.csv"];

/// Saved results: `case.json` and the [`RESULTS`].
pub struct Contact {
    texts: [String; 5],
    settings: Settings,
    simulation: Simulation,
}

/// The files of a contact that are read again: `case.json`, then the [`RESULTS`].
pub fn saved(settings: &Settings) -> [String; 5] {
    let [metrics, history, profile, shapes] = written(settings, &simulated(settings));
    let results = RESULTS.iter().zip([&metrics, &history, &profile, &shapes]);
    let files: FileHashes = results
        .map(|(name, text)| ((*name).to_owned(), digest(text.as_bytes())))
        .collect();
    [
        case_text(settings, &files),
        metrics,
        history,
        profile,
        shapes,
    ]
}

fn simulated(settings: &Settings) -> Simulation {
    let sampling = Sampling {
        samples: 20,
        shapes: 5,
        profile: true,
        ..Sampling::default()
    };
    simulate_with(settings, sampling).expect("a quick pass")
}

/// The texts of the [`RESULTS`].
fn written(settings: &Settings, simulation: &Simulation) -> [String; 4] {
    let Simulation {
        history,
        profile,
        shapes,
        ..
    } = simulation;
    let text = |write: &dyn Fn(&mut Vec<u8>) -> io::Result<()>| {
        let mut text = Vec::new();
        write(&mut text).expect("memory takes what is written to it");
        String::from_utf8(text).expect("results are text")
    };
    [
        text(&|out| write_metrics(out, settings, simulation)),
        text(&|out| write_history(out, history)),
        text(&|out| write_profile(out, profile)),
        text(&|out| write_shapes(out, shapes)),
    ]
}

impl Contact {
    pub fn new() -> Self {
        let settings = Document::parse(STUDY, "")
            .and_then(|document| document.settings())
            .expect("the file is right");
        Self {
            texts: saved(&settings),
            simulation: simulated(&settings),
            settings,
        }
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
        let table = random.usize(2..self.texts.len());
        let (target, (change, changed)) = if random.bool() {
            (table, change_table(&self.texts[table], random))
        } else {
            let document = random.usize(..2);
            (
                document,
                change_text(&self.texts[document], &self.texts[table], &JSON, random),
            )
        };
        bytes[target] = changed;
        files(change, bytes)
    }

    fn check(&self, mutant: &Mutant, _: &mut Rng) -> Verdict {
        let case = read_case(&mutant.text(0), "case.json")?;
        let texts = [1, 2, 3, 4].map(|file| mutant.text(file));
        let check = |file: usize| case.check(RESULTS[file], &texts[file], RESULTS[file]);
        let turns =
            read_turn_impulses(&texts[0], RESULTS[0]).and_then(|read| check(0).map(|()| read))?;
        let history =
            read_history(&texts[1], RESULTS[1]).and_then(|read| check(1).map(|()| read))?;
        let profile =
            read_profile(&texts[2], RESULTS[2]).and_then(|read| check(2).map(|()| read))?;
        let shapes = read_shapes(&texts[3], RESULTS[3]).and_then(|read| check(3).map(|()| read))?;
        let expected = &self.simulation;
        assert_eq!(
            (&case.settings, &turns, &history, &profile, &shapes),
            (
                &self.settings,
                &expected.turn_contact_normal_impulses_n_s,
                &expected.history,
                &expected.profile,
                &expected.shapes
            )
        );
        Ok(())
    }
}

fn files(change: &'static str, texts: [Vec<u8>; 5]) -> Mutant {
    let names = ["case.json"].into_iter().chain(RESULTS).map(str::to_owned);
    Mutant {
        change,
        files: names.zip(texts).collect(),
        ..Mutant::default()
    }
}

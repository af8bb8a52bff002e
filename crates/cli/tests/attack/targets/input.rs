//! Input files, read in this process.

use std::sync::atomic::{AtomicUsize, Ordering};

use bristle::model::metrics::Metrics;
use bristle::model::parameters::PARAMETERS;
use bristle::model::record::Record;
use bristle::model::settings::Settings;
use bristle::simulation::{Sampling, simulate_with};
use bristle_grid::Study;
use bristle_input::document::Document;
use bristle_store::results::{FileHashes, case_text, read_case, read_study, study_text};
use fastrand::Rng;

use super::{STUDY, of_texts};
use crate::runner::{Mutant, Target, Verdict, presentable};
use crate::tree::{TOML, Tree};

/// Every setting, stated.
const ALL: &str = include_str!("../../../../../examples/zirconia.toml");
/// Filaments that scatter.
const SCATTER: &str = include_str!("../../../../../examples/uncertainty.toml");
/// Filaments that touch each other.
const BRUSH: &str = include_str!("../../../../../examples/brush.toml");
/// Measured forces.
const MEASURED: &str = "
[measured]
file = \"forces.csv\"
";

/// Most segments of a pass that is simulated.
const MOST_SEGMENTS: usize = 8;

/// Largest factor between a setting that is simulated and the usual one.
const FAR: f64 = 1e3;
/// A contact stiffness with which a pass fails at once, in N/m.
const STIFF: f64 = 1e250;

/// Input files.
pub struct Input {
    seeds: [String; 5],
    /// Settings whose neighbours are quickly simulated.
    quick: Settings,
    /// Numbers of simulations that ended, and that failed.
    simulated: AtomicUsize,
    failed: AtomicUsize,
}

impl Input {
    pub fn new() -> Self {
        let quick = Document::parse(STUDY, "")
            .and_then(|document| document.settings())
            .expect("the file is right");
        Self {
            seeds: [
                STUDY.to_owned(),
                ALL.to_owned(),
                SCATTER.to_owned(),
                BRUSH.to_owned(),
                STUDY.to_owned() + MEASURED,
            ],
            quick,
            simulated: 0.into(),
            failed: 0.into(),
        }
    }

    /// Whether settings are so close to those of the examples that a pass takes milliseconds.
    pub fn is_quick(&self, settings: &Settings) -> bool {
        self.is_within(4.0, settings)
    }

    /// Whether a pass has few segments, and all other settings are within a factor of those of the
    /// quick one.
    fn is_within(&self, factor: f64, settings: &Settings) -> bool {
        let close =
            |one: f64, other: f64| one == other || (1.0 / factor..=factor).contains(&(one / other));
        let others = |path: &str| path.starts_with("uncertainty.") || path == "filament.segments";
        PARAMETERS
            .iter()
            .filter(|parameter| !others(parameter.path))
            .all(
                |parameter| match (parameter.read(settings), parameter.read(&self.quick)) {
                    (Some(here), Some(quick)) => {
                        close(here, quick)
                            || parameter.path == "contact.stiffness_n_m" && here > STIFF
                    }
                    (here, quick) => here == quick,
                },
            )
            && settings.filament.segments <= MOST_SEGMENTS
    }

    /// Reads settings in each way that a command does.
    fn read(&self, text: &str, random: &mut Rng) -> Verdict {
        let document = Document::parse(text, "case.toml")?;
        let settings = document.settings();
        if let Ok(settings) = &settings {
            reads_back(settings);
            self.simulate(settings, random);
        }
        if let Err(error) = document.settings_without_process() {
            assert!(settings.is_err(), "{error}");
        }
        let study = document.study();
        if let Ok(study) = &study {
            study_reads_back(study, document.measured().is_some());
            self.simulate(&study.settings(random.usize(..study.case_count())), random);
        }
        match (settings, study) {
            (Err(one), Err(other)) => Err(if random.bool() { one } else { other }.into()),
            _ => Ok(()),
        }
    }

    /// Simulates some of the settings: quick ones, and fewer of those that are far off.
    fn simulate(&self, settings: &Settings, random: &mut Rng) {
        let one_in = if self.is_quick(settings) { 4 } else { 8 };
        if random.u8(..one_in) > 0 || !self.is_within(FAR, settings) {
            return;
        }
        let sampling = Sampling {
            samples: 5,
            shapes: 0,
            loads: true,
            profile: true,
            alongside: false,
        };
        match simulate_with(settings, sampling) {
            Ok(simulation) => {
                self.simulated.fetch_add(1, Ordering::Relaxed);
                assert!(
                    Metrics::is_finite(&simulation.metrics),
                    "{:?}",
                    simulation.metrics
                );
                assert!(
                    simulation.history.iter().all(Record::is_finite),
                    "{:?}",
                    simulation.history
                );
            }
            Err(error) => {
                self.failed.fetch_add(1, Ordering::Relaxed);
                presentable(&error.to_string()).unwrap_or_else(|problem| panic!("{problem}"));
            }
        }
    }
}

/// Settings that were accepted are the same in an input file and in a result file.
fn reads_back(settings: &Settings) {
    assert_eq!(settings.check(), Ok(()));
    let json = serde_json::to_value(settings).expect("settings have a form in JSON");
    let written = Tree::of(&json).toml();
    let again = Document::parse(&written, "again.toml").and_then(|document| document.settings());
    assert_eq!(again.as_ref(), Ok(settings), "{written}");
    let case =
        read_case(&case_text(settings, &FileHashes::new()), "case.json").map(|case| case.settings);
    assert_eq!(case.as_ref(), Ok(settings));
}

/// A study that was accepted is the same in a result file, and its cases are allowed.
fn study_reads_back(study: &Study, measured: bool) {
    let written = study_text(study, b"", measured);
    let read = read_study(&written, "study.json").expect("it was written");
    assert_eq!(study_text(&read.study, b"", read.measured), written);
    for case in [0, study.case_count() / 2, study.case_count() - 1] {
        assert_eq!(study.settings(case).check(), Ok(()), "case {case}");
        assert_eq!(study.settings(case), read.study.settings(case));
    }
}

impl Target for Input {
    fn name(&self) -> &'static str {
        "input"
    }

    fn count(&self) -> usize {
        3_000
    }

    fn originals(&self) -> Vec<Mutant> {
        self.seeds
            .iter()
            .map(|seed| Mutant::file("", "case.toml", seed.as_str()))
            .collect()
    }

    fn refusals(&self) -> Vec<(Mutant, &'static str)> {
        let without = |section: &str| {
            let Tree::Object(mut sections) = Tree::of_toml(STUDY) else {
                return String::new();
            };
            sections.retain(|(name, _)| name != section && name != "study");
            Tree::Object(sections).toml()
        };
        let refusal =
            |text: String, expected| (Mutant::file("a refusal", "case.toml", text), expected);
        let radius = ALL.replace("radius_m = 0.0  ", "radius_m = 1e6  ");
        vec![
            refusal(without("tool"), "[tool]"),
            refusal(without("filament"), "[filament]"),
            refusal(without("process"), "[process]"),
            refusal(radius, "contact.radius_m"),
        ]
    }

    fn mutant(&self, random: &mut Rng) -> Mutant {
        of_texts(
            "case.toml",
            &self.seeds.each_ref().map(String::as_str),
            &TOML,
            random,
        )
    }

    fn check(&self, mutant: &Mutant, random: &mut Rng) -> Verdict {
        self.read(&mutant.text(0), random)
    }

    fn further(&self) -> Vec<(&'static str, usize)> {
        let count = |counter: &AtomicUsize| counter.load(Ordering::Relaxed);
        vec![
            ("simulated", count(&self.simulated)),
            ("refused by the simulation", count(&self.failed)),
        ]
    }
}

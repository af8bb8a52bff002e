//! Expression graphs, read in this process with the checks of the fuzz target, and compared with the derivation.

use bristle_codegen::back::json::from_json;
use bristle_inspect::comparison::{States, compare_graph};
use fastrand::Rng;

use super::of_texts;
use crate::runner::{Mutant, Target, Verdict};
use crate::tree::JSON;

#[path = "../../../../../fuzz/fuzz_targets/reading.rs"]
mod reading;

const SEEDS: [&str; 4] = [
    include_str!("../../../../../fuzz/seeds/every_operator.json"),
    include_str!("../../../../../fuzz/seeds/pendulum.json"),
    include_str!("../../../../../fuzz/seeds/units.json"),
    CHAIN,
];
/// The whole equations of one segment.
pub const CHAIN: &str = include_str!("../../../../../derivations/graphs/chain_1.json");

/// Graphs.
pub struct Graph;

impl Graph {
    pub fn new() -> Self {
        Self
    }
}

impl Target for Graph {
    fn name(&self) -> &'static str {
        "graph"
    }

    fn count(&self) -> usize {
        2_000
    }

    fn originals(&self) -> Vec<Mutant> {
        SEEDS.iter().map(|seed| Mutant::file("", "graph.json", *seed)).collect()
    }

    fn mutant(&self, random: &mut Rng) -> Mutant {
        of_texts("graph.json", &SEEDS, &JSON, random)
    }

    fn check(&self, mutant: &Mutant, random: &mut Rng) -> Verdict {
        let text = mutant.text(0);
        reading::check(&text);
        let read = Verdict::from(from_json(&text));
        if read != Verdict::Accepted || random.u8(..4) > 0 {
            return read;
        }
        match compare_graph(&text, 3, States::All, random.u64(..)) {
            Ok(comparison) => {
                let table = comparison.to_string();
                assert!(table.len() < 100_000, "a table of {} bytes", table.len());
                assert!(!table.chars().any(|character| character != '\n' && character.is_control()), "{table:?}");
                Verdict::Accepted
            }
            Err(error) => Verdict::Refused(error.to_string()),
        }
    }
}

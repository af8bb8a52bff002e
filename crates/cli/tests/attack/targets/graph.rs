//! Expression graphs, read in this process with the checks of the fuzz target, and compared with
//! the derivation.

use bristle_codegen::back::json::from_json;
use bristle_inspect::comparison::{States, compare_graph};
use fastrand::Rng;
use jsonschema::Validator;
use serde_json::Value;

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

const SCHEMA: &str = include_str!("../../../../../docs/graph-format.schema.json");

/// Graphs.
pub struct Graph {
    schema: Validator,
}

impl Graph {
    pub fn new() -> Self {
        let schema: Value = serde_json::from_str(SCHEMA).expect("the schema is JSON");
        Self {
            schema: jsonschema::draft202012::new(&schema).expect("the schema is one"),
        }
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
        SEEDS
            .iter()
            .map(|seed| Mutant::file("", "graph.json", *seed))
            .collect()
    }

    fn mutant(&self, random: &mut Rng) -> Mutant {
        of_texts("graph.json", &SEEDS, &JSON, random)
    }

    fn check(&self, mutant: &Mutant, random: &mut Rng) -> Verdict {
        let text = mutant.text(0);
        reading::check(&text);
        from_json(&text)?;
        let file = serde_json::from_str(&text).expect("what is read is JSON");
        assert!(
            self.schema.is_valid(&file),
            "the reader accepts what the schema refuses"
        );
        if random.u8(..4) == 0 {
            let table = compare_graph(&text, 3, States::All, random.u64(..))?.to_string();
            assert!(table.len() < 100_000, "a table of {} bytes", table.len());
            assert!(
                !table
                    .chars()
                    .any(|character| character != '\n' && character.is_control()),
                "{table:?}"
            );
        }
        Ok(())
    }
}

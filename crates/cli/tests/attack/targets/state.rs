//! States of a filament, read and evaluated in this process.

use bristle::model::settings::Settings;
use bristle_inspect::evaluation::{ChainState, evaluate};
use bristle_inspect::state::parse_state;
use fastrand::Rng;
use serde_json::json;

use super::of_texts;
use crate::runner::{Mutant, Target, Verdict};
use crate::tree::JSON;

/// Deriving the equations of many segments takes long.
const MOST_EVALUATED: usize = 3;

/// A state of two segments, and one of one.
pub const SEEDS: [&str; 2] = [
    r#"{"base_angle": -1.5, "base_rate": 50.0, "base_acceleration": 0.0, "gravity": [0.0, -9.81, 0.0],
 "q": [1.5, -1.5, 1.6, -1.4], "v": [0.1, 50.0, 0.2, 51.0]}"#,
    r#"{"base_angle": 0.0, "base_rate": -3.0, "base_acceleration": 10.0, "gravity": [0, 0, 0], "q": [1.57, 0.1], "v": [0, 0]}"#,
];

/// States.
pub struct State {
    settings: Settings,
}

impl State {
    pub fn new() -> Self {
        Self {
            settings: Settings::paper(10.0, 1e-3),
        }
    }
}

/// A state as a file.
fn text(state: &ChainState) -> String {
    let ChainState {
        base_angle,
        base_rate,
        base_acceleration,
        gravity,
        q,
        v,
    } = state;
    json!({
        "base_angle": base_angle, "base_rate": base_rate, "base_acceleration": base_acceleration,
        "gravity": gravity, "q": q, "v": v,
    })
    .to_string()
}

impl Target for State {
    fn name(&self) -> &'static str {
        "state"
    }

    fn count(&self) -> usize {
        10_000
    }

    fn originals(&self) -> Vec<Mutant> {
        SEEDS
            .iter()
            .map(|seed| Mutant::file("", "state.json", *seed))
            .collect()
    }

    fn mutant(&self, random: &mut Rng) -> Mutant {
        of_texts("state.json", &SEEDS, &JSON, random)
    }

    fn check(&self, mutant: &Mutant, random: &mut Rng) -> Verdict {
        let state = parse_state(&mutant.text(0))?;
        assert_eq!(parse_state(&text(&state)).as_ref(), Ok(&state));
        if state.q.len() > 2 * MOST_EVALUATED || random.u8(..4) > 0 {
            return Ok(());
        }
        let evaluation = evaluate(
            &self.settings.filament,
            self.settings.tool.body_radius_m,
            &state,
        )?;
        let json = serde_json::to_string(&evaluation).expect("numbers have a form in JSON");
        assert!(!json.contains("null"), "not finite: {json}");
        Ok(())
    }
}

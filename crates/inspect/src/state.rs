//! Reads a state of the filament from JSON, for `bristle evaluate`.

use bristle_text::shown;
use serde::Deserialize;
use thiserror::Error;

use crate::evaluation::ChainState;
use bristle::equations::find_pole;
use bristle::model::parameters::MAX_SEGMENTS;

/// The key in errors that concern no single key.
const WHOLE: &str = "state";
/// Longest key and longest message of the parser in an error, in characters.
const LONGEST_KEY: usize = 80;
const LONGEST_MESSAGE: usize = 200;

/// Why a state is invalid.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum StateError {
    /// The text is not JSON, or a key is unknown, missing, or of the wrong type.
    #[error(
        "`{key}` at line {line}, column {column}: {message}\n   = help: a state is\n     {{\"base_angle\": β, \
         \"base_rate\": ω, \"base_acceleration\": β̈,\n      \"gravity\": [x, y, z], \"q\": [φ1, θ1, …], \"v\": [φ̇1, θ̇1, …]}}"
    )]
    Unreadable {
        /// Path of the key.
        key: String,
        /// Line, counted from 1.
        line: usize,
        /// Column, counted from 1.
        column: usize,
        /// The message of the parser.
        message: String,
    },
    /// So many coordinates do not form whole segments, or form too many.
    #[error(
        "`q` has {0} numbers, but must have two (φ and θ) for each of 1 to {MAX_SEGMENTS} segments; in the plane of rotation \
         φ = π/2 = 1.5707963267948966"
    )]
    SegmentCount(usize),
    /// Coordinates and rates differ in number.
    #[error("`v` has {v} numbers, but must have as many as `q`, which has {q}")]
    Lengths {
        /// Length of `q`.
        q: usize,
        /// Length of `v`.
        v: usize,
    },
    /// A segment is parallel to the tool axis.
    #[error(
        "`q[{index}]` = {polar_angle:?}: segment {segment} is at a pole (sin φ = 0), where its azimuth is undefined; \
         turn it away from the tool axis"
    )]
    Pole {
        /// Number of the segment, counted from 1.
        segment: usize,
        /// Position of its polar angle in `q`.
        index: usize,
        /// The polar angle, in rad.
        polar_angle: f64,
    },
}

/// A [`ChainState`] as in the file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StateFile {
    base_angle: f64,
    base_rate: f64,
    base_acceleration: f64,
    gravity: [f64; 3],
    q: Vec<f64>,
    v: Vec<f64>,
}

/// Reads and checks a state.
///
/// Every number of a state is finite: JSON has no NaN and no infinity, and a number too large for
/// `f64` is an error.
pub fn parse_state(text: &str) -> Result<ChainState, StateError> {
    let mut deserializer = serde_json::Deserializer::from_str(text);
    let unreadable = |key: String, error: &serde_json::Error| {
        let message = error.to_string();
        let place = format!(" at line {} column {}", error.line(), error.column());
        StateError::Unreadable {
            key: shown(&key, LONGEST_KEY),
            line: error.line(),
            column: error.column(),
            message: shown(
                message.strip_suffix(&place).unwrap_or(&message),
                LONGEST_MESSAGE,
            ),
        }
    };
    let file: StateFile = serde_path_to_error::deserialize(&mut deserializer).map_err(|error| {
        // Outside of any key the path is only a placeholder.
        let path =
            Some(error.path().to_string()).filter(|path| !matches!(path.as_str(), "." | "?"));
        unreadable(path.unwrap_or_else(|| WHOLE.to_owned()), error.inner())
    })?;
    deserializer
        .end()
        .map_err(|error| unreadable(WHOLE.to_owned(), &error))?;
    let StateFile {
        base_angle,
        base_rate,
        base_acceleration,
        gravity,
        q,
        v,
    } = file;
    if q.is_empty() || q.len() % 2 != 0 || q.len() > 2 * MAX_SEGMENTS {
        return Err(StateError::SegmentCount(q.len()));
    }
    if v.len() != q.len() {
        return Err(StateError::Lengths {
            q: q.len(),
            v: v.len(),
        });
    }
    if let Some(segment) = find_pole(q.as_chunks().0) {
        return Err(StateError::Pole {
            segment: segment + 1,
            index: 2 * segment,
            polar_angle: q[2 * segment],
        });
    }
    Ok(ChainState {
        base_angle,
        base_rate,
        base_acceleration,
        gravity,
        q,
        v,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn state(q: &str, v: &str) -> String {
        format!(
            r#"{{"base_angle": -1.5, "base_rate": 50, "base_acceleration": 0, "gravity": [0, 0, 0], "q": {q}, "v": {v}}}"#
        )
    }

    #[test]
    fn a_valid_state_is_read() {
        let state = parse_state(&state("[1.5, -1.5, 1.6, -1.4]", "[0, 50, 0, 50]"))
            .expect("the state is right");
        assert_eq!(state.base_rate, 50.0);
        assert_eq!(state.q, [1.5, -1.5, 1.6, -1.4]);
    }

    #[test]
    fn errors_name_the_place() {
        let cases = [
            (state("[1.5, \"a\"]", "[0, 0]"), "`q[1]`"),
            (state("[1.5, 1e999]", "[0, 0]"), "`q[1]`"),
            (state("[1.5, NaN]", "[0, 0]"), "`q[1]`"),
            (state("[1.5, 0]", "[0, 0]").replace("\"v\"", "\"w\""), "`w`"),
            (state("[1.5, 0]", "[0, 0]").replace("\"v\"", "\"q\""), "`q`"),
            (
                state("[1.5, 0]", "[0, 0]").replace(", \"v\": [0, 0]", ""),
                "`v`",
            ),
            (
                state("[1.5, 0]", "[0, 0]").replace("-1.5", "null"),
                "`base_angle`",
            ),
            (state("[1.5, 0]", "[0, 0]") + "x", "trailing"),
            (state("[]", "[]"), "`q` has 0"),
            (state("[1.5]", "[0]"), "`q` has 1"),
            (state("[1.5, 0]", "[0]"), "`v` has 1"),
            (
                state("[1.5, 0, 3.141592653589793, 0]", "[0, 0, 0, 0]"),
                "segment 2",
            ),
            (String::new(), "line 1"),
        ];
        for (text, expected) in cases {
            let message = parse_state(&text).expect_err(&text).to_string();
            assert!(message.contains(expected), "{text}: {message}");
        }
    }
}

//! Reads a state of the filament from JSON, for `bristle evaluate`.

use bristle_codegen::text::shown;

use crate::evaluation::RoundToolState;
use bristle::equations::find_pole;
use bristle::model::parameters::MAX_SEGMENTS;

/// The key in errors that concern no single key.
const WHOLE: &str = "state";
/// Maximum length of a key and of a message of the parser in an error, in characters.
const MAX_KEY_CHARS: usize = 80;
const MAX_MESSAGE_CHARS: usize = 200;

/// Reads and checks a state.
///
/// Every number of a state is finite: JSON has no NaN and no infinity, and a number too large for
/// `f64` is an error.
pub fn parse_state(text: &str) -> Result<RoundToolState, String> {
    let mut deserializer = serde_json::Deserializer::from_str(text);
    let unreadable = |key: String, error: &serde_json::Error| {
        let message = error.to_string();
        let place = format!(" at line {} column {}", error.line(), error.column());
        format!(
            "`{}` at line {}, column {}: {}\n   = help: a state is\n     {{\"base_angle\": β, \
             \"base_rate\": ω, \"base_acceleration\": β̈,\n      \"gravity\": [x, y, z], \"q\": [φ1, θ1, …], \"v\": [φ̇1, θ̇1, …]}}",
            shown(&key, MAX_KEY_CHARS),
            error.line(),
            error.column(),
            shown(
                message.strip_suffix(&place).unwrap_or(&message),
                MAX_MESSAGE_CHARS,
            )
        )
    };
    let state: RoundToolState =
        serde_path_to_error::deserialize(&mut deserializer).map_err(|error| {
            // Outside of any key the path is a placeholder.
            let path =
                Some(error.path().to_string()).filter(|path| !matches!(path.as_str(), "." | "?"));
            unreadable(path.unwrap_or_else(|| WHOLE.to_owned()), error.inner())
        })?;
    deserializer
        .end()
        .map_err(|error| unreadable(WHOLE.to_owned(), &error))?;
    let RoundToolState { q, v, .. } = &state;
    if q.is_empty() || q.len() % 2 != 0 || q.len() > 2 * MAX_SEGMENTS {
        return Err(format!(
            "`q` has {} numbers, but must have two (φ and θ) for each of 1 to {MAX_SEGMENTS} segments; \
             in the plane of rotation φ = π/2 = 1.5707963267948966",
            q.len()
        ));
    }
    if v.len() != q.len() {
        return Err(format!(
            "`v` has {} numbers, but must have as many as `q`, which has {}",
            v.len(),
            q.len()
        ));
    }
    if let Some(segment) = find_pole(q.as_chunks().0) {
        let (index, number) = (2 * segment, segment + 1);
        return Err(format!(
            "`q[{index}]` = {:?}: segment {number} is at a pole (sin φ = 0), where its azimuth is \
             undefined; turn it away from the tool axis",
            q[index]
        ));
    }
    Ok(state)
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
            let message = parse_state(&text).expect_err(&text);
            assert!(message.contains(expected), "{text}: {message}");
        }
    }
}

//! The checkpoint of a brush: the state from which a stopped simulation goes on, and what it belongs to.
//!
//! The first line is JSON. It states settings and program, as the header of a [`journal`](crate::journal) does, and the SHA-256 of
//! the state, whose bytes follow it:
//!
//! ```json
//! {"checkpoint":"bristle brush","format":1,"version":"0.2.0","equations":"…","solver":"…","settings":{…},"frames":120,"state":"…","check":"…"}
//! ```

use bristle::equations::FINGERPRINT;
use bristle::model::settings::Settings;
use bristle::simulation::SOLVER_FINGERPRINT;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use thiserror::Error;

use crate::digest::digest;
use crate::origin;

/// The version of the format.
const FORMAT: u32 = 1;
/// What the file says it is.
const KIND: &str = "bristle brush";

/// What can be wrong with a checkpoint.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum CheckpointError {
    /// It has no header.
    #[error("it is not the checkpoint of a brush")]
    Foreign,
    /// It has another version of the format.
    #[error("it comes from another version of Bristle and has format {found}; this version reads format {FORMAT}")]
    Format {
        /// The format's number.
        found: u32,
    },
    /// It belongs to other settings or another program.
    #[error("it belongs to another simulation or program:{}", origin::listed(.differences))]
    Other {
        /// The differences, one sentence each.
        differences: Vec<String>,
    },
    /// Its state has changed since it was written.
    #[error("it is damaged")]
    Damaged,
}

/// The first line.
#[derive(Serialize, Deserialize)]
struct Header<S> {
    checkpoint: String,
    format: u32,
    version: String,
    /// SHA-256 of the kernels' expressions.
    equations: String,
    /// SHA-256 of the code that solves them.
    solver: String,
    settings: S,
    /// Number of frames, which are part of the state.
    frames: usize,
    /// SHA-256 of the state.
    state: String,
}

/// The bytes of a checkpoint with this `state`.
#[must_use]
pub fn write_checkpoint(settings: &Settings, frames: usize, state: &[u8]) -> Vec<u8> {
    let header = Header {
        checkpoint: KIND.to_owned(),
        format: FORMAT,
        version: env!("CARGO_PKG_VERSION").to_owned(),
        equations: FINGERPRINT.to_owned(),
        solver: SOLVER_FINGERPRINT.to_owned(),
        settings,
        frames,
        state: digest(state),
    };
    [origin::sealed("", &header).as_bytes(), state].concat()
}

/// The state in a checkpoint of a brush with these settings and this number of frames, simulated by this build of Bristle.
///
/// # Errors
/// If it is not a checkpoint, belongs to another simulation or another build, or is damaged.
pub fn read_checkpoint<'b>(settings: &Settings, frames: usize, bytes: &'b [u8]) -> Result<&'b [u8], CheckpointError> {
    /// What is read of any format.
    #[derive(Deserialize)]
    struct Beginning {
        checkpoint: String,
        format: u32,
    }
    let end = bytes.iter().position(|&byte| byte == b'\n').ok_or(CheckpointError::Foreign)? + 1;
    let (line, state) = bytes.split_at(end);
    let line = str::from_utf8(line).map_err(|_| CheckpointError::Foreign)?;
    match serde_json::from_str::<Beginning>(line) {
        Ok(Beginning { checkpoint, format }) if checkpoint == KIND => {
            if format != FORMAT {
                return Err(CheckpointError::Format { found: format });
            }
        }
        _ => return Err(CheckpointError::Foreign),
    }
    let header: Header<Value> = origin::unsealed("", line).ok_or(CheckpointError::Damaged)?;
    let mut differences = origin::programs(&header.version, &header.equations, [&header.solver, SOLVER_FINGERPRINT]);
    differences.extend(origin::settings(&header.settings, settings, |_| false));
    if header.frames != frames {
        differences.push(format!("frames: {} there, {frames} here", header.frames));
    }
    if !differences.is_empty() {
        return Err(CheckpointError::Other { differences });
    }
    if digest(state) == header.state { Ok(state) } else { Err(CheckpointError::Damaged) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_state_comes_back_to_its_own_simulation_only() {
        let settings = Settings::paper(10.0, 1e-3);
        let bytes = write_checkpoint(&settings, 7, b"a\nstate");
        assert_eq!(read_checkpoint(&settings, 7, &bytes), Ok(&b"a\nstate"[..]));
        let other = |settings: &Settings, frames: usize| {
            read_checkpoint(settings, frames, &bytes).expect_err("of another simulation").to_string()
        };
        assert!(other(&settings, 8).contains("frames: 7 there, 8 here"));
        let faster = Settings::paper(20.0, 1e-3);
        assert!(other(&faster, 7).contains("process.brushing_velocity_m_s: 10.0 there, 20.0 here"));
    }

    #[test]
    fn anything_else_is_refused() {
        let settings = Settings::paper(10.0, 1e-3);
        let bytes = write_checkpoint(&settings, 7, b"state");
        let read = |bytes: &[u8]| read_checkpoint(&settings, 7, bytes).expect_err("not a checkpoint");
        for foreign in [&b""[..], b"\n", b"text", b"\xff\n", b"{}\n"] {
            assert_eq!(read(foreign), CheckpointError::Foreign);
        }
        let text = String::from_utf8(bytes.clone()).expect("text");
        assert_eq!(read(text.replace("\"format\":1", "\"format\":2").as_bytes()), CheckpointError::Format { found: 2 });
        assert_eq!(read(text.replace("10.0", "11.0").as_bytes()), CheckpointError::Damaged);
        for cut in 0..bytes.len() {
            let error = read(&bytes[..cut]);
            assert!([CheckpointError::Foreign, CheckpointError::Damaged].contains(&error), "{cut}");
        }
    }
}

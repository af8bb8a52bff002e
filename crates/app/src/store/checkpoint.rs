//! The checkpoint of a brush: the state from which a stopped simulation resumes, with its settings
//! and program.
//!
//! The first line is JSON. It states the program, as the header of a
//! [`journal`](crate::store::journal) does, the key of the settings and the SHA-256 of the state.
//! The state follows in the format of [postcard](https://postcard.jamesmunns.com):
//!
//! ```json
//! {"checkpoint":"bristle brush","format":3,"version":"0.3.0","equations":"…","solver":"…","key":"…","state":"…","check":"…"}
//! ```

use bristle::brush::Checkpoint;
use bristle::model::settings::Settings;
use bristle::simulation::SOLVER_FINGERPRINT;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::store::digest::digest;
use crate::store::journal::Key;
use crate::store::origin::{Program, sealed, unsealed};

const FORMAT: u32 = 3;
/// Kind of file that the header states.
const KIND: &str = "bristle brush";

/// Reasons why a checkpoint cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum CheckpointError {
    /// No header.
    #[error("it is not the checkpoint of a brush")]
    Foreign,
    /// Another version of the format.
    #[error(
        "it comes from another version of Bristle and has format {0}; this version reads format {FORMAT}"
    )]
    Format(u32),
    /// Other settings, another number of frames, or another build.
    #[error("it belongs to another simulation or build")]
    Other,
    /// A state that has changed since it was written.
    #[error("it is damaged")]
    Damaged,
}

/// The first line.
#[derive(Serialize, Deserialize)]
struct CheckpointHeader {
    checkpoint: String,
    format: u32,
    #[serde(flatten)]
    program: Program,
    /// Digest of the settings and of the number of frames, which are part of the state.
    key: String,
    /// SHA-256 of the state.
    state: String,
}

/// Returns the bytes of a state, which keep every bit of it.
#[must_use]
pub fn state_bytes(state: &Checkpoint) -> Vec<u8> {
    postcard::to_stdvec(state).expect("memory takes all that is written")
}

/// Returns the state that [`state_bytes`] turned into these `bytes`; `None` if they are damaged.
#[must_use]
pub fn state_of(bytes: &[u8]) -> Option<Checkpoint> {
    let (state, rest) = postcard::take_from_bytes(bytes).ok()?;
    rest.is_empty().then_some(state)
}

/// Returns the bytes of the file with this `state`.
#[must_use]
pub fn write_checkpoint(settings: &Settings, frames: usize, state: &Checkpoint) -> Vec<u8> {
    let state = state_bytes(state);
    let header = CheckpointHeader {
        checkpoint: KIND.to_owned(),
        format: FORMAT,
        program: here(),
        key: key_of(settings, frames),
        state: digest(&state),
    };
    [sealed("", &header).as_bytes(), &state].concat()
}

/// This program.
fn here() -> Program {
    Program::here(SOLVER_FINGERPRINT)
}

fn key_of(settings: &Settings, frames: usize) -> String {
    Key::of(&format!("{frames} frames"), settings).to_string()
}

/// Reads the checkpoint of a brush with these settings and this number of frames, simulated by this
/// build of Bristle.
///
/// # Errors
/// If it is not a checkpoint, belongs to another simulation or another build, or is damaged.
pub fn read_checkpoint(
    settings: &Settings,
    frames: usize,
    bytes: &[u8],
) -> Result<Checkpoint, CheckpointError> {
    /// Keys that every format has.
    #[derive(Deserialize)]
    struct Beginning {
        checkpoint: String,
        format: u32,
    }
    let end = bytes
        .iter()
        .position(|&byte| byte == b'\n')
        .ok_or(CheckpointError::Foreign)?
        + 1;
    let (line, state) = bytes.split_at(end);
    let line = str::from_utf8(line).map_err(|_| CheckpointError::Foreign)?;
    match serde_json::from_str(line) {
        Ok(Beginning {
            checkpoint,
            format: FORMAT,
        }) if checkpoint == KIND => {}
        Ok(Beginning { checkpoint, format }) if checkpoint == KIND => {
            return Err(CheckpointError::Format(format));
        }
        _ => return Err(CheckpointError::Foreign),
    }
    let header: CheckpointHeader = unsealed("", line).ok_or(CheckpointError::Damaged)?;
    let key = key_of(settings, frames);
    if header.key != key || !header.program.differences(&here()).is_empty() {
        return Err(CheckpointError::Other);
    }
    Some(state)
        .filter(|state| digest(state) == header.state)
        .and_then(state_of)
        .ok_or(CheckpointError::Damaged)
}

#[cfg(test)]
mod tests {
    use bristle::brush::{BrushRun, RunOptions};
    use bristle::model::settings::BrushSettings;

    use super::*;

    /// Returns a running brush with frames: three rows in space that touch each other and the
    /// workpiece.
    fn run() -> (Settings, BrushRun) {
        let mut settings = Settings::paper(10.0, 1e-3);
        settings.filament.segments = 3;
        (settings.tool.filament_count, settings.tool.width_m) = (682.0 * 3.0, 3.6e-3);
        let brush = BrushSettings {
            columns: Some(3),
            rows: Some(3),
            steady: false,
            ..BrushSettings::default()
        };
        settings.brush = Some(BrushSettings {
            lateral_tilt_std_rad: 2e-3,
            tolerance: 1e-2,
            ..brush
        });
        let options = RunOptions {
            frames: 7,
            ..RunOptions::default()
        };
        let mut run = BrushRun::new(&settings, options).expect("a brush");
        while run.done() < 0.8 {
            assert!(run.advance().expect("steps"));
        }
        (settings, run)
    }

    #[test]
    fn a_state_comes_back_to_its_own_simulation_only() {
        let (settings, run) = run();
        let state = run.checkpoint();
        let bytes = write_checkpoint(&settings, 7, &state);
        assert_eq!(read_checkpoint(&settings, 7, &bytes), Ok(state));
        let mut faster = settings.clone();
        faster.process.brushing_velocity_m_s = 20.0;
        for (settings, frames) in [(&settings, 8), (&faster, 7)] {
            let read = read_checkpoint(settings, frames, &bytes);
            assert_eq!(read, Err(CheckpointError::Other));
        }
    }

    #[test]
    fn anything_else_is_refused() {
        let (settings, run) = run();
        let bytes = write_checkpoint(&settings, 7, &run.checkpoint());
        let read =
            |bytes: &[u8]| read_checkpoint(&settings, 7, bytes).expect_err("not a checkpoint");
        for foreign in [&b""[..], b"\n", b"text", b"\xff\n", b"{}\n"] {
            assert_eq!(read(foreign), CheckpointError::Foreign);
        }
        let end = bytes
            .iter()
            .position(|&byte| byte == b'\n')
            .expect("a header");
        let (header, state) = bytes.split_at(end);
        let header = str::from_utf8(header).expect("text");
        let changed =
            |from: &str, to: &str| read(&[header.replace(from, to).as_bytes(), state].concat());
        assert_eq!(
            changed("\"format\":3", "\"format\":4"),
            CheckpointError::Format(4)
        );
        assert_eq!(
            changed("\"key\":\"", "\"key\":\"0"),
            CheckpointError::Damaged
        );
        for cut in (0..end + 100).chain([bytes.len() / 2, bytes.len() - 1]) {
            let error = read(&bytes[..cut]);
            assert!(
                [CheckpointError::Foreign, CheckpointError::Damaged].contains(&error),
                "{cut}"
            );
        }
        // A state that is too short or too long is refused even if its digest fits.
        let state = &state[1..];
        assert!(state_of(state).is_some());
        for other in [&state[..state.len() - 1], &[state, b"\0"].concat(), b""] {
            assert_eq!(state_of(other), None);
        }
    }
}

//! The header of a journal: the program that writes it.

use std::sync::LazyLock;

use bristle::simulation::SOLVER_FINGERPRINT;
use serde::{Deserialize, Serialize};

use crate::store::digest::digest;
use crate::store::journal::{FORMAT, JournalError};
use crate::store::origin::{CHECK_DIGITS, Program, sealed, unsealed};

/// SHA-256 of all code that affects results: the core's and that of `bristle_study::grid`.
static SOLVER: LazyLock<String> = LazyLock::new(|| {
    digest(
        [SOLVER_FINGERPRINT, bristle_study::grid::SOURCES]
            .concat()
            .as_bytes(),
    )
});

/// The first line of a journal of this program, with its newline.
pub(super) static HEADER: LazyLock<String> = LazyLock::new(|| {
    let header = JournalHeader {
        journal: "bristle".to_owned(),
        format: FORMAT,
        program: Program::here(&SOLVER),
    };
    sealed("", &header)
});

/// The check of the header, which enters the check of every line.
pub(super) static SEED: LazyLock<&str> = LazyLock::new(|| {
    let end = HEADER.len() - "\"}\n".len();
    &HEADER[end - CHECK_DIGITS..end]
});

/// Beginning of every header of any format. Format 1 named the study.
pub(super) const BEGINNING: &str = r#"{"journal":"bristle"#;
pub(super) const FORMAT_KEY: &str = r#"","format":"#;

/// The first line.
#[derive(Serialize, Deserialize)]
pub(super) struct JournalHeader {
    journal: String,
    format: u32,
    #[serde(flatten)]
    program: Program,
}

/// Returns the reason why a first line is not the header of this program.
pub(super) fn unlike(line: &[u8]) -> JournalError {
    let text = str::from_utf8(line).ok();
    let Some(rest) = text.and_then(|line| line.strip_prefix(BEGINNING)) else {
        return JournalError::Foreign;
    };
    // The format comes first, because another format may have another check.
    let digits = rest.split_once(FORMAT_KEY).map_or("", |(_, rest)| {
        let end = rest.find(|character: char| !character.is_ascii_digit());
        &rest[..end.unwrap_or(rest.len())]
    });
    match digits.parse() {
        Ok(found) if found != u64::from(FORMAT) => return JournalError::Format(found),
        _ => {}
    }
    match text.and_then(|line| unsealed::<JournalHeader>("", line)) {
        Some(header) => JournalError::Other(header.program.differences(&Program::here(&SOLVER))),
        None => JournalError::Damaged(1),
    }
}

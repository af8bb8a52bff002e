//! What Bristle keeps.
//!
//! As text: results as they arrive, from which a stopped study resumes ([`journal`]), the state of
//! a stopped brush ([`checkpoint`]), and saved results ([`results`]). On disk: files that appear
//! whole or not at all ([`staged`]), the journal ([`journal_file`]), and the results of a study
//! ([`study_files`]).

pub mod checkpoint;
pub mod digest;
mod disk;
pub mod force_journal;
pub mod journal;
pub mod journal_file;
pub mod origin;
pub mod results;
pub mod staged;
pub mod study_files;

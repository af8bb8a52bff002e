//! Storage of results and states.
//!
//! As text: results as they arrive, from which a stopped command resumes ([`journal`]), the state
//! of a stopped brush ([`checkpoint`]), and saved results ([`results`]). On disk: files that appear
//! whole or not at all ([`staged`]), the journal ([`journal_file`]), the results of a study
//! ([`study_files`]), filaments for ParaView ([`vtk_files`]), and earlier results that they replace
//! ([`previous`]).

pub mod checkpoint;
pub mod digest;
mod disk;
pub mod journal;
pub mod journal_file;
mod journal_header;
pub mod method;
pub mod origin;
pub mod previous;
pub mod results;
pub mod staged;
pub mod study_files;
pub mod vtk_files;

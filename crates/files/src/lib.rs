//! Files of Bristle, for the program and for Python.
//!
//! [`staged`]: input files, read with limits, and result files that appear whole or not at all; [`journal_file`]: the journal of a
//! study, locked, read, appended to, and synced to disk; [`study_files`]: the results of a study.

pub mod journal_file;
pub mod staged;
pub mod study_files;

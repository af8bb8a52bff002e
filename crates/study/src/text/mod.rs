//! Numbers and tables as text, shared by advice, tables, captions and file names.

pub mod layout;
pub mod number;
pub mod quantity;

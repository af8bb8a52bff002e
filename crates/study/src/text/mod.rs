//! Numbers and tables as text: what advice, tables, captions and file names share.

pub mod layout;
pub mod number;
pub mod quantity;

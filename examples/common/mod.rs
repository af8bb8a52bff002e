//! What the examples that draw share: their pictures become files.

use std::io;

/// Writes a picture to the file `path`.
pub fn write(path: &str, svg: &str) -> io::Result<()> {
    std::fs::write(path, svg)?;
    eprintln!("wrote {path}");
    Ok(())
}

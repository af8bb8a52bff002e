//! What contact between filaments does to the force of the tool: simulates brushes, and writes docs/interaction.md and its figures.
//!
//! ```text
//! cargo run --release -p bristle-benches --example interaction                 # docs/interaction*
//! cargo run --release -p bristle-benches --example interaction -- directory
//! ```
//!
//! `page.md` is the text. The program fills its tables and numbers in, and refuses to write a page whose statements do not hold.

mod cases;
mod claims;
mod figures;
mod numbers;
mod tables;

use std::error::Error;
use std::fs;
use std::path::PathBuf;

use bristle_benches::filled;
use cases::Results;

const PAGE: &str = include_str!("page.md");
/// Number of threads; each simulates a brush of its own.
const THREADS: usize = 2;

fn main() -> Result<(), Box<dyn Error>> {
    let directory: PathBuf = std::env::args().nth(1).unwrap_or_else(|| "docs".into()).into();
    let results = Results::simulate(THREADS)?;
    let page = filled(PAGE, &tables::all(&results)?)?;
    for (name, figure) in figures::all(&results)? {
        fs::write(directory.join(format!("interaction_{name}.svg")), figure.svg())?;
    }
    let wrong: Vec<&str> =
        claims::all(&results)?.into_iter().filter(|claim| !claim.holds).map(|claim| claim.text).collect();
    if !wrong.is_empty() {
        return Err(format!("page.md states what does not hold:\n{}", wrong.join("\n")).into());
    }
    fs::write(directory.join("interaction.md"), page)?;
    Ok(())
}

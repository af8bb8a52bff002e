//! What contact between filaments does to the force of the tool: simulates brushes, and writes
//! docs/interaction.md and its figures.
//!
//! ```text
//! cargo run --release -p bristle-benches --example interaction                 # docs/interaction*
//! cargo run --release -p bristle-benches --example interaction -- directory
//! ```
//!
//! `page.md` is the text. The program fills its tables and numbers in, and refuses to write a page
//! whose statements do not hold.

mod cases;
mod claims;
mod figures;
mod numbers;
mod tables;

use std::error::Error;

use bristle_benches::write_page;
use cases::Results;

const PAGE: &str = include_str!("page.md");
/// Number of threads; each simulates a brush of its own.
const THREADS: usize = 2;

fn main() -> Result<(), Box<dyn Error>> {
    let results = Results::simulate(THREADS)?;
    let figures = figures::all(&results)?
        .into_iter()
        .map(|(name, figure)| (name, figure.svg()));
    write_page(
        "interaction",
        PAGE,
        &tables::all(&results)?,
        figures,
        claims::all(&results)?,
    )
}

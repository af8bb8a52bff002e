//! Benchmarks of Bristle. `Cargo.toml` has their names, and each file says what it measures. Here
//! is what programs share that write pages of docs/.

use std::collections::BTreeMap;
use std::error::Error;
use std::path::PathBuf;
use std::{env, fs};

/// Writes the page NAME.md and its figures NAME_FIGURE.svg to the directory that the program is
/// called with, or else to docs/. The page is `text` with its places `{{name}}` filled in.
///
/// # Errors
/// If a place has no value or a value no place, if a claim does not hold, or if a file cannot be
/// written.
pub fn write_page(
    name: &str,
    text: &str,
    values: &BTreeMap<&'static str, String>,
    figures: impl IntoIterator<Item = (&'static str, String)>,
    claims: impl IntoIterator<Item = (&'static str, bool)>,
) -> Result<(), Box<dyn Error>> {
    let directory = PathBuf::from(env::args().nth(1).unwrap_or_else(|| "docs".into()));
    let page = filled(text, values)?;
    let wrong: Vec<&str> = claims
        .into_iter()
        .filter(|(_, holds)| !holds)
        .map(|(claim, _)| claim)
        .collect();
    if !wrong.is_empty() {
        return Err(format!("page.md states what does not hold:\n{}", wrong.join("\n")).into());
    }
    for (figure, svg) in figures {
        fs::write(directory.join(format!("{name}_{figure}.svg")), svg)?;
    }
    Ok(fs::write(directory.join(format!("{name}.md")), page)?)
}

fn filled(text: &str, values: &BTreeMap<&'static str, String>) -> Result<String, String> {
    let mut unused: Vec<&str> = values.keys().copied().collect();
    let mut filled = String::new();
    let mut rest = text;
    while let Some((before, after)) = rest.split_once("{{") {
        let (name, after) = after
            .split_once("}}")
            .ok_or("page.md: a place does not end")?;
        filled += before;
        filled += values
            .get(name)
            .ok_or_else(|| format!("page.md: no value for {name}"))?;
        unused.retain(|other| *other != name);
        rest = after;
    }
    if unused.is_empty() {
        Ok(filled + rest)
    } else {
        Err(format!("page.md does not use {}", unused.join(", ")))
    }
}

/// A table in Markdown whose columns hold numbers from the second on.
pub fn table(heads: &[&str], rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let line = |cells: &[String]| format!("| {} |", cells.join(" | "));
    let heads: Vec<String> = heads.iter().map(|head| (*head).to_owned()).collect();
    let ruler: Vec<&str> = (0..heads.len())
        .map(|column| if column == 0 { "---" } else { "---:" })
        .collect();
    let rows = rows.into_iter().map(|row| line(&row));
    [line(&heads), format!("|{}|", ruler.join("|"))]
        .into_iter()
        .chain(rows)
        .collect::<Vec<_>>()
        .join("\n")
}

/// A number with so many decimals.
pub fn fixed(decimals: usize, value: f64) -> String {
    format!("{value:.decimals$}").replace('-', "−")
}

//! Draws the impulses of single passes and of steady turns in the paper's 120 cases, and their
//! ratio.
//!
//! ```text
//! cargo run --release -p bristle-report --example turns                 # docs/turns_*.svg
//! cargo run --release -p bristle-report --example turns -- directory
//! ```

use std::error::Error;
use std::path::{Path, PathBuf};

use bristle_grid::{CaseResult, Study, run_study};
use bristle_input::document::Document;
use bristle_report::drawing::map::{CellAxis, Map};
use bristle_report::drawing::scale::Axis;
use bristle_text::number::labels;

type Result<T> = std::result::Result<T, Box<dyn Error>>;

fn main() -> Result<()> {
    let directory: PathBuf = std::env::args()
        .nth(1)
        .unwrap_or_else(|| "docs".into())
        .into();
    let (study, single) = impulses(
        include_str!("../../../examples/zirconia.toml"),
        "examples/zirconia.toml",
    )?;
    let (_, steady) = impulses(
        include_str!("../../../examples/turns.toml"),
        "examples/turns.toml",
    )?;
    let ratios = single
        .iter()
        .zip(&steady)
        .map(|(single, steady)| Some((*steady)? / (*single)?))
        .collect();
    let draw = |name: &str, title: &str, label: &'static str, values: Vec<Option<f64>>| {
        write(
            &directory.join(format!("turns_{name}_map.svg")),
            &study,
            title,
            Axis::linear(label),
            values,
        )
    };
    draw(
        "single",
        "Impulse of a single pass",
        "p_n in mN s",
        in_millis(&single),
    )?;
    draw(
        "steady",
        "Impulse of a steady turn",
        "p_n in mN s",
        in_millis(&steady),
    )?;
    draw(
        "ratio",
        "Impulse of a steady turn over that of a single pass",
        "ratio",
        ratios,
    )
}

/// A study, and the contact normal impulse of each case in N s; none if it failed.
fn impulses(text: &str, name: &str) -> Result<(Study, Vec<Option<f64>>)> {
    let study = Document::parse(text, name)?.study()?;
    let impulse = |result: CaseResult| {
        result
            .ok()
            .map(|summary| summary.metrics.contact_normal_impulse_n_s)
    };
    let impulses = run_study(&study, None, || {})?
        .into_iter()
        .map(impulse)
        .collect();
    Ok((study, impulses))
}

fn in_millis(impulses: &[Option<f64>]) -> Vec<Option<f64>> {
    impulses
        .iter()
        .map(|impulse| impulse.map(|impulse| 1e3 * impulse))
        .collect()
}

fn write(
    path: &Path,
    study: &Study,
    title: &str,
    colours: Axis,
    values: Vec<Option<f64>>,
) -> Result<()> {
    let side = |label: &str, values: Vec<f64>| CellAxis {
        label: label.to_owned(),
        labels: labels(values.iter().copied()),
        values,
    };
    // From the slowest to the fastest.
    let [depths, velocities] = study.sweeps() else {
        return Err("the examples sweep velocity and depth".into());
    };
    let map = Map {
        title: title.to_owned(),
        subtitle: String::new(),
        x: side("v_b in m/s", velocities.values().to_vec()),
        y: side(
            "a_e in mm",
            depths.values().iter().map(|depth| 1e3 * depth).collect(),
        ),
        colours,
        marked: vec![false; values.len()],
        values,
        range: None,
        line: None,
    };
    std::fs::write(path, map.draw().svg())?;
    eprintln!("wrote {}", path.display());
    Ok(())
}

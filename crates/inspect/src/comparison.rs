//! Compares a graph that another engine has derived with the built-in derivation.

use std::fmt::{self, Display, Formatter};

use bristle_codegen::back::json::{self, ExchangeError, from_json};
use bristle_codegen::compare::{self, CompareError, Deviation, compare, whole_segments};
use bristle_codegen::model::kernels::kernels;
use bristle_codegen::model::whole::{Purpose, whole_kernels};
use bristle_codegen::passes::dimension::DimensionError;

use bristle::model::parameters::MAX_SEGMENTS;

pub use bristle_codegen::compare::States;

/// Largest size of a graph in bytes.
pub const MAX_GRAPH_BYTES: usize = json::MAX_BYTES;

/// The result of a comparison.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// The program that made the graph, as stated in the graph.
    pub generator: String,
    /// Number of segments of whole equations; `None` for the solver's kernels.
    pub segments: Option<usize>,
    /// Number of states.
    pub states: usize,
    /// The largest deviation of each output.
    pub deviations: Vec<Deviation>,
}

/// Why a graph cannot be compared.
#[derive(Debug, thiserror::Error)]
pub enum ComparisonError {
    /// The graph cannot be read.
    #[error(transparent)]
    Exchange(#[from] ExchangeError),
    /// The graph computes something else.
    #[error(transparent)]
    Compare(#[from] CompareError),
    /// The graph has more segments than a filament may have.
    #[error("the equations have {0} segments; at most {MAX_SEGMENTS} can be derived")]
    TooManySegments(usize),
    /// The built-in derivation fails.
    #[error(transparent)]
    Dimension(#[from] DimensionError),
}

impl Comparison {
    /// True if every output agrees to [`compare::TOLERANCE`].
    pub fn agrees(&self) -> bool {
        self.deviations.iter().all(agrees)
    }
}

fn agrees(deviation: &Deviation) -> bool {
    deviation.largest <= compare::TOLERANCE
}

/// Reads the graph `text` and compares it with the built-in derivation of the same equations at `states` random states.
///
/// # Errors
/// If the graph cannot be read or computes something else.
pub fn compare_graph(text: &str, states: usize, which: States, seed: u64) -> Result<Comparison, ComparisonError> {
    let file = from_json(text)?;
    let segments = whole_segments(&file.kernels);
    let expected = match segments {
        Some(segments) if segments > MAX_SEGMENTS => return Err(ComparisonError::TooManySegments(segments)),
        Some(segments) => whole_kernels(segments, Purpose::Computing)?,
        None => kernels()?,
    };
    let deviations = compare(&expected, &file.kernels, states, which, seed)?;
    Ok(Comparison { generator: file.generator, segments, states, deviations })
}

impl Display for Comparison {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        let what = match self.segments {
            Some(1) => "whole equations of 1 segment".to_owned(),
            Some(segments) => format!("whole equations of {segments} segments"),
            None => "kernels of the solver".to_owned(),
        };
        let generator: String = self.generator.chars().take(200).collect();
        writeln!(formatter, "{what}, by {generator}")?;
        writeln!(formatter, "compared with the built-in derivation at {} random states\n", self.states)?;
        let name = |deviation: &Deviation| match deviation.kernel == deviation.output {
            true => deviation.kernel.clone(),
            false => format!("{}.{}", deviation.kernel, deviation.output),
        };
        let width = self.deviations.iter().map(|deviation| name(deviation).chars().count()).max().unwrap_or(0).max(6);
        writeln!(formatter, "{:width$}  elements  largest relative deviation", "output")?;
        for deviation in &self.deviations {
            let mark = if agrees(deviation) { "" } else { "  DEVIATES" };
            let Deviation { elements, largest, .. } = deviation;
            writeln!(formatter, "{:width$}  {elements:8}  {largest:.1e}{mark}", name(deviation))?;
        }
        let verdict = if self.agrees() { "all agree" } else { "NOT all agree" };
        writeln!(formatter, "\n{verdict} to {:e} of the size of each output", compare::TOLERANCE)
    }
}

//! Compares a graph that another engine has derived with the built-in derivation.

use std::fmt::{self, Display, Formatter};

use bristle_codegen::back::json::{self, from_json};
use bristle_codegen::compare::{self, Deviation, compare, whole_chain};
use bristle_codegen::ir::kernel::Kernel;

use bristle::model::parameters::MAX_SEGMENTS;

use crate::derive::{Equations, Motion, RelaxedShape};

pub use bristle_codegen::compare::States;

/// Largest size of a graph in bytes.
pub const MAX_GRAPH_BYTES: usize = json::MAX_BYTES;

/// The result of a comparison.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// The program that made the graph, as stated in the graph.
    pub generator: String,
    /// Equations that the graph computes.
    pub equations: Equations,
    /// Number of states.
    pub states: usize,
    /// The largest deviation of each output.
    pub deviations: Vec<Deviation>,
}

impl Comparison {
    /// `true` if every output agrees to [`compare::TOLERANCE`].
    pub fn agrees(&self) -> bool {
        self.deviations.iter().all(agrees)
    }
}

fn agrees(deviation: &Deviation) -> bool {
    deviation.largest <= compare::TOLERANCE
}

/// Reads the graph `text` and compares it with the built-in derivation of the same equations at
/// `states` random states.
///
/// # Errors
/// If the graph cannot be read or computes something else.
pub fn compare_graph(
    text: &str,
    states: usize,
    which: States,
    seed: u64,
) -> Result<Comparison, String> {
    let file = from_json(text)?;
    let equations = equations_of(&file.kernels);
    if let Equations::Whole { segments, .. } = equations
        && segments > MAX_SEGMENTS
    {
        return Err(format!(
            "the equations have {segments} segments; at most {MAX_SEGMENTS} can be derived"
        ));
    }
    let expected = equations.for_computing()?;
    let deviations = compare(&expected, &file.kernels, states, which, seed)?;
    Ok(Comparison {
        generator: file.generator,
        equations,
        states,
        deviations,
    })
}

/// The equations to compare `kernels` with, by their names.
fn equations_of(kernels: &[Kernel]) -> Equations {
    if let Some((segments, motion)) = whole_chain(kernels) {
        return Equations::Whole {
            segments,
            motion,
            shape: RelaxedShape::default(),
        };
    }
    let planar = kernels
        .first()
        .is_some_and(|kernel| kernel.name.starts_with("planar_"));
    if planar {
        Equations::PlanarKernels
    } else {
        Equations::Kernels
    }
}

impl Display for Comparison {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        let what = match self.equations {
            Equations::Whole {
                segments, motion, ..
            } => {
                let planar = if motion == Motion::Planar {
                    "planar "
                } else {
                    ""
                };
                let plural = if segments == 1 { "" } else { "s" };
                format!("whole {planar}equations of {segments} segment{plural}")
            }
            Equations::Kernels => "kernels of the solver".to_owned(),
            Equations::PlanarKernels => "planar kernels of the solver".to_owned(),
        };
        let generator: String = self.generator.chars().take(200).collect();
        writeln!(formatter, "{what}, by {generator}")?;
        writeln!(
            formatter,
            "compared with the built-in derivation at {} random states\n",
            self.states
        )?;
        let name = |deviation: &Deviation| match deviation.kernel == deviation.output {
            true => deviation.kernel.clone(),
            false => format!("{}.{}", deviation.kernel, deviation.output),
        };
        let width = self
            .deviations
            .iter()
            .map(|deviation| name(deviation).chars().count())
            .max()
            .unwrap_or(0)
            .max(6);
        writeln!(
            formatter,
            "{:width$}  elements  largest relative deviation",
            "output"
        )?;
        for deviation in &self.deviations {
            let mark = if agrees(deviation) { "" } else { "  DEVIATES" };
            let Deviation {
                elements, largest, ..
            } = deviation;
            writeln!(
                formatter,
                "{:width$}  {elements:8}  {largest:.1e}{mark}",
                name(deviation)
            )?;
        }
        let verdict = if self.agrees() {
            "all agree"
        } else {
            "NOT all agree"
        };
        writeln!(
            formatter,
            "\n{verdict} to {:e} of the size of each output",
            compare::TOLERANCE
        )
    }
}

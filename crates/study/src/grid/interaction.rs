//! Interaction in a brush: its effect, and the columns from which metrics were taken.

use bristle::brush::{BrushResult, BrushStatistics, Stretch};
use bristle::model::metrics::BETWEEN_SWEEPING_AND_STRIKING;
use bristle::model::record::{Display, Level, Prominence, Scope};
use bristle::simulation::Statistics;
use serde::{Deserialize, Serialize};

/// Returns a display in figures whose file names start with `file_name`, and in tables of a
/// terminal.
const fn headline(file_name: &'static str, unit: &'static str, scope: Scope) -> Display {
    Display {
        prominence: Prominence::Headline,
        file_name,
        unit,
        scope,
        ..Display::DETAIL
    }
}

/// Line between interaction that raises the force and that lowers it.
const NO_EFFECT: Level = Level {
    of: "interaction_factor",
    value: 1.0,
    meaning: "line: 1, above which interaction raises the force",
    in_curves: "",
};

bristle::record! {
    /// A brush compared with one filament alone, and the stretch of columns from which its metrics
    /// were taken.
    #[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
    pub struct Interaction {
        interaction_factor: f64 =
            ["", "", "interaction factor", "p_n in the brush over that of one filament alone, zero if that is zero"]
            => Display { level: Some(NO_EFFECT), ..headline("interaction_factor", "", Scope::Filament) },
        contact_normal_impulse_alone_n_s: f64 =
            ["", "N s", "contact normal impulse of a filament alone", "p_n without interaction"],
        tool_contact_normal_force_alone_n: f64 = [
            "F_n,w alone", "N", "contact normal force of the tool without interaction",
            "p_n of one filament alone times N_f ω/(2π)"
        ] => Display {
            level: Some(BETWEEN_SWEEPING_AND_STRIKING),
            ..headline("tool_force_alone", "N", Scope::Tool)
        },
        columns: usize = ["", "", "columns", "filaments of a row, one behind the other around the tool"],
        rows: usize = ["", "", "rows", "rows of filaments along the axis"],
        first_counted_column: usize = ["", "", "first column that counts", "column 0 meets the workpiece first"],
        last_counted_column: usize =
            ["", "", "last column that counts", "the metrics are means over the filaments from the first to the last"],
        impulse_error_estimate: f64 = [
            "", "", "error estimate of the impulse",
            "error of the mean p_n, over it: the embedded error estimate of the steps (or the difference from filaments alone, if none touches another), and the standard error of the mean over columns"
        ],
        energy_residual: f64 = [
            "", "", "residual of the energy",
            "energy that is lacking in the balance of the brush, over that which was put in and taken"
        ],
        momentum_residual: f64 = [
            "", "", "residual of the momentum",
            "momentum that is lacking in the balance of the brush, over that of the filaments and the impulse of the workpiece on them"
        ],
        krylov_vectors: usize =
            ["", "", "vectors of the linear solutions", "iterations of the generalised minimal residual method"],
    }
}

impl Interaction {
    /// Returns the interaction in a brush.
    #[must_use]
    pub fn of(result: &BrushResult) -> Self {
        let Stretch { first, last, .. } = result.stretch;
        Self {
            interaction_factor: result.interaction_factor,
            contact_normal_impulse_alone_n_s: result.alone.contact_normal_impulse_n_s,
            tool_contact_normal_force_alone_n: result.alone.tool_contact_normal_force_n,
            columns: result.columns,
            rows: result.rows,
            first_counted_column: first,
            last_counted_column: last,
            impulse_error_estimate: result.impulse_error_estimate,
            energy_residual: result.residuals.energy,
            momentum_residual: result.residuals.momentum,
            krylov_vectors: result.statistics.effort.krylov_vectors,
        }
    }
}

/// Returns the mean impulse of each turn of a brush, in N s. A single pass is one turn.
#[must_use]
pub fn turn_impulses(result: &BrushResult) -> Vec<f64> {
    match &result.turn_contact_normal_impulses_n_s[..] {
        [] => vec![result.tool.contact_normal_impulse_n_s],
        impulses => impulses.to_vec(),
    }
}

/// Converts the statistics of a brush to those of one simulation.
#[must_use]
pub(crate) fn statistics(brush: &BrushStatistics) -> Statistics {
    Statistics {
        steps: brush.steps,
        rejected_steps: brush.rejected_steps,
        newton_failures: brush.newton_failures,
        newton_iterations: brush.effort.newton_iterations,
        ..Statistics::default()
    }
}
